!> Joint compliance K*^-1 straight from receptances of the assembly at the joint, without model, first estimate or band,
!> and how measurement noise comes through.
module jointfrf_compliance
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_space, in_memory, lane_kernels, lanes, largest_solved, padded, real_lines, &
    row_starts
  use jointfrf_line_layout, only: all_finite, load, load_real, store, take_block
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: joint_compliance, compliance_covariance, compliance_factors

  !> Where the blocks of gamma and C lie in lanes.
  type :: compliance_in_lanes
    real(dp), pointer, contiguous :: gamma(:, :, :), c_joint(:, :, :)
    integer, allocatable :: gamma_place(:), c(:)          !< in the caller's order
    integer, allocatable :: kk_row(:), c_row(:)           !< the element before each row
    integer :: jk_before                                  !< the element before the system gamma_jk X = gamma_jj
  end type compliance_in_lanes

  type, extends(line_operation) :: compliance
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: gamma(:, :, :)
    type(compliance_in_lanes) :: plan
  contains
    procedure :: line => compliance_one
    procedure :: line_block => compliance_block
  end type compliance

  !> What both linearisations share.
  type, abstract, extends(line_operation) :: linearisation
    logical :: transposed
    integer :: n, m
    complex(dp), pointer, contiguous :: gamma(:, :, :)
    real(dp), pointer, contiguous :: transform(:, :)
  end type linearisation

  !> The matrices of one line of it.
  type :: linear_terms
    complex(dp), pointer, contiguous :: u(:, :), v_transposed(:, :)          !< U and V^T
    complex(dp), pointer, contiguous :: right(:, :), left(:, :)              !< R and L^T
    complex(dp), pointer, contiguous :: gamma(:, :), gamma_jk(:, :)
  end type linear_terms

  type, extends(linearisation) :: factorisation
  contains
    procedure :: line => factor_one
  end type factorisation

  type, extends(linearisation) :: propagation
    logical :: reciprocal
    real(dp), pointer, contiguous :: variance(:, :, :)
  contains
    procedure :: line => propagate_one
  end type propagation

contains

  !> C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj = K*^-1.
  !>
  !> Exact, because with gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]] one has gamma_kk gamma_jk^-1 = K*^-1 (Z_A + K*)
  !> and (Z_A + K*) gamma_jj - K* gamma_kj = I. Noise enters C almost linearly; it enters K* through an inverse.
  !> gamma     receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> c_joint   joint compliance, shape (n, n, n_freq), m/N
  subroutine joint_compliance(transposed, gamma, c_joint, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    complex(dp), contiguous, target, intent(out) :: c_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(compliance) :: operation
    integer :: n

    n = size(c_joint, 1)
    operation%transposed = transposed
    operation%n = n
    operation%gamma => gamma
    operation%result => c_joint
    operation%flops = 19.0_dp*real(n, dp)**3
    if (worth_a_plan(size(gamma, 3), memory) .and. n >= 1 .and. n <= largest_solved) call plan_compliance(operation)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine joint_compliance

  subroutine plan_compliance(operation)
    type(compliance), intent(inout) :: operation
    integer :: gamma(2*operation%n, 2*operation%n), solved(operation%n, 2*operation%n), n
    type(element_space) :: room

    n = operation%n
    solved = room%system(n, n, operation%plan%jk_before)
    gamma(:n, n + 1:) = solved(:, :n)               ! jk, to be inverted
    gamma(:n, :n) = solved(:, n + 1:)               ! jj, the right-hand sides
    gamma(n + 1:, n + 1:) = room%matrix(n, n)       ! kk
    gamma(n + 1:, :n) = room%matrix(n, n)           ! kj, where C will be
    operation%n_element = room%taken
    operation%n_hint = padded(n)
    operation%plan%gamma => real_lines(operation%gamma)
    call operation%reads(operation%plan%gamma)
    associate (plan => operation%plan)
      plan%c_joint => real_lines(operation%result)
      plan%gamma_place = in_memory(operation%transposed, gamma)
      plan%c = in_memory(operation%transposed, gamma(n + 1:, :n))
      plan%kk_row = row_starts(gamma(n + 1:, n + 1:))
      plan%c_row = row_starts(gamma(n + 1:, :n))
    end associate
  end subroutine plan_compliance

  subroutine compliance_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(compliance), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)
    integer :: row(self%n), n

    n = self%n
    associate (plan => self%plan, x => space%x)
      call kernels%load(4*n*n, plan%gamma_place, first, n_lines, plan%gamma, x)
      call kernels%solve(n, n, n, plan%jk_before, x, space%hint, row, rcond_lanes, space%ahead)  ! gamma_jk^-1 gamma_jj
      call kernels%copy(n*n, -1.0_dp, plan%c, plan%c, x)
      call kernels%product(n, n, n, 1.0_dp, plan%kk_row, row, plan%c_row, x)
      call kernels%store(n*n, plan%c, first, n_lines, x, self%plan%c_joint)
      call kernels%total(n*n, plan%c, x, total)
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine compliance_block

  subroutine compliance_one(self, i, space, line_info, rcond)
    class(compliance), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: gamma(:, :), gamma_jk(:, :), gamma_kk(:, :), right(:, :), c(:, :)
    integer :: n

    n = self%n
    call space%take(2*n, 2*n, gamma)
    call space%take(n, n, gamma_jk)
    call space%take(n, n, gamma_kk)
    call space%take(n, n, right)
    call space%take(n, n, c)
    call room_to_solve(n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all_finite(self%gamma(:, :, i))) return
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call take_block(.false., 1.0_dp, gamma, 0, n, gamma_jk)
    call take_block(.false., 1.0_dp, gamma, n, n, gamma_kk)
    call take_block(.false., 1.0_dp, gamma, 0, 0, right)
    call solve_line(gamma_jk, right, space, line_info, rcond)       ! gamma_jk^-1 gamma_jj
    if (line_info /= line_good) return
    call take_block(.false., -1.0_dp, gamma, n, 0, c)
    call product_line('N', 'N', 1.0_dp, gamma_kk, right, c)
    if (.not. all_finite(c)) line_info = line_overflow
    call store(self%transposed, c, self%result(:, :, i))
  end subroutine compliance_one

  !> How a small change of the measured FRFs moves C: dC = U dh V, to first order.
  !>
  !> With gamma = T h T^T, L = gamma_kk gamma_jk^-1 and R = gamma_jk^-1 gamma_jj:
  !>   dC = [L, -I] dgamma [I; -R],   so   U = [L, -I] T,   V = T^T [I; -R]
  !> gamma        receptance about which is linearised, shape (2 n, 2 n, n_freq), m/N
  !> transform    T, shape (2 n, m), (m, 2 n) where transposed: from measured points to DOFs j, then k; the unit matrix
  !>              where gamma itself was measured
  !> factors      U above V^T, shape (2 n, m, n_freq), (m, 2 n, n_freq) where transposed
  subroutine compliance_factors(transposed, gamma, transform, factors, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    real(dp), contiguous, target, intent(in) :: transform(:, :)
    complex(dp), contiguous, target, intent(out) :: factors(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(factorisation) :: operation
    integer :: n, m

    call set_linearisation(operation, transposed, gamma, transform)
    operation%result => factors
    n = operation%n
    m = operation%m
    operation%flops = 43.0_dp*real(n, dp)**3 + 8.0_dp*real(n, dp)**2*m
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine compliance_factors

  subroutine set_linearisation(operation, transposed, gamma, transform)
    class(linearisation), intent(inout) :: operation
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    real(dp), contiguous, target, intent(in) :: transform(:, :)

    operation%transposed = transposed
    operation%n = size(gamma, 1)/2
    operation%gamma => gamma
    operation%transform => transform
    operation%m = size(transform, merge(1, 2, transposed))
  end subroutine set_linearisation

  subroutine factor_one(self, i, space, line_info, rcond)
    class(factorisation), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: factors(:, :)
    type(linear_terms) :: terms

    call space%take(2*self%n, self%m, factors)
    call take_terms(self, space, terms)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    call linearise(self, i, terms, space, line_info, rcond)
    if (line_info /= line_good) return
    call stack(terms%u, terms%v_transposed, factors)
    if (.not. all_finite(factors)) line_info = line_overflow
    call store(self%transposed, factors, self%result(:, :, i))
  end subroutine factor_one

  pure subroutine stack(above, below, whole)
    complex(dp), contiguous, intent(in) :: above(:, :), below(:, :)
    complex(dp), contiguous, intent(out) :: whole(:, :)

    whole(:size(above, 1), :) = above
    whole(size(above, 1) + 1:, :) = below
  end subroutine stack

  !> The matrices of one line, and room for `linearise`.
  subroutine take_terms(self, space, terms)
    class(linearisation), intent(in) :: self
    type(line_space), target, intent(inout) :: space
    type(linear_terms), intent(out) :: terms
    integer :: n

    n = self%n
    call space%take(n, self%m, terms%u)
    call space%take(n, self%m, terms%v_transposed)
    call space%take(n, n, terms%right)
    call space%take(n, n, terms%left)
    call space%take(2*n, 2*n, terms%gamma)
    call space%take(n, n, terms%gamma_jk)
    call room_to_solve(n, space)
  end subroutine take_terms

  !> U and V^T of one line.
  subroutine linearise(self, i, terms, space, line_info, rcond)
    class(linearisation), intent(in) :: self
    integer, intent(in) :: i
    type(linear_terms), intent(in) :: terms
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    integer :: n

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(self%gamma(:, :, i))) return
    n = self%n
    call load(self%transposed, self%gamma(:, :, i), terms%gamma)
    call take_block(.false., 1.0_dp, terms%gamma, 0, n, terms%gamma_jk)
    call take_block(.false., 1.0_dp, terms%gamma, 0, 0, terms%right)
    call solve_line(terms%gamma_jk, terms%right, space, line_info, rcond)       ! R
    if (line_info /= line_good) return
    call take_block(.true., 1.0_dp, terms%gamma, 0, n, terms%gamma_jk)
    call take_block(.true., 1.0_dp, terms%gamma, n, n, terms%left)
    call solve_line(terms%gamma_jk, terms%left, space, line_info, rcond)        ! L^T
    if (line_info /= line_good) return
    call weigh(self, terms%left, terms%right, terms%u, terms%v_transposed)
  end subroutine linearise

  !> U = [L, -I] T and V = T^T [I; -R].
  subroutine weigh(self, left, right, u, v_transposed)
    class(linearisation), intent(in) :: self
    complex(dp), contiguous, intent(in) :: left(:, :), right(:, :)
    complex(dp), contiguous, intent(out) :: u(:, :), v_transposed(:, :)
    integer :: n, p, a, b

    n = self%n
    do p = 1, self%m
      do a = 1, n
        u(a, p) = 0.0_dp
        v_transposed(a, p) = 0.0_dp
        do b = 1, n
          u(a, p) = u(a, p) + left(b, a)*weight(b, p)
          v_transposed(a, p) = v_transposed(a, p) - right(b, a)*weight(n + b, p)
        end do
        u(a, p) = u(a, p) - weight(n + a, p)
        v_transposed(a, p) = v_transposed(a, p) + weight(a, p)
      end do
    end do

  contains

    !> T at a DOF of j or k and a measured point.
    pure function weight(dof, point)
      integer, intent(in) :: dof, point
      real(dp) :: weight

      if (self%transposed) then
        weight = self%transform(point, dof)
      else
        weight = self%transform(dof, point)
      end if
    end function weight
  end subroutine weigh

  !> Covariance of the entries of C from the noise of the measured FRFs, to first order.
  !>
  !> With U and V of `compliance_factors`, noise e_pq of entry pq of h moves C_ab by U_ap V_qb e_pq, or by
  !> (U_ap V_qb + U_aq V_pb) e_pq/2 where h was made reciprocal, (h + h^T)/2. The noise is taken as circular and
  !> independent between entries. The sums over p and q are taken one after the other: n^4 m instead of n^4 m^2
  !> products.
  !> gamma        receptance about which is linearised, shape (2 n, 2 n, n_freq), m/N
  !> transform    T, shape (2 n, m), (m, 2 n) where transposed: from measured points to DOFs j, then k; the unit matrix
  !>              where gamma itself was measured
  !> variance     E|e_pq|^2 of the measured FRFs, shape (m, m, n_freq), (m/N)^2
  !> reciprocal   whether h was made reciprocal
  !> covariance   E[dC_ab conj(dC_cd)], shape (n^2, n^2, n_freq); ab runs as C lies in the caller's memory
  subroutine compliance_covariance(transposed, gamma, transform, variance, reciprocal, covariance, line_info, rcond, &
                                   info, memory)
    logical, intent(in) :: transposed, reciprocal
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    real(dp), contiguous, target, intent(in) :: variance(:, :, :)
    real(dp), contiguous, target, intent(in) :: transform(:, :)
    complex(dp), contiguous, target, intent(out) :: covariance(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(propagation) :: operation
    integer :: n, m

    call set_linearisation(operation, transposed, gamma, transform)
    operation%reciprocal = reciprocal
    operation%variance => variance
    operation%result => covariance
    n = operation%n
    m = operation%m
    operation%flops = 16.0_dp*real(n, dp)**2*m*(real(n, dp)**2 + m)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine compliance_covariance

  subroutine propagate_one(self, i, space, line_info, rcond)
    class(propagation), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: spread(:, :), uu(:, :), vv(:, :), uv(:, :)
    type(linear_terms) :: terms
    complex(dp), pointer, contiguous :: straight(:, :), crossed(:, :), covariance(:, :)
    integer :: n, m, a, b, c, d, ab, cd

    n = self%n
    m = self%m
    call space%take(m, m, spread)
    call space%take(n*n, m, uu)
    call space%take(n*n, m, vv)
    call space%take(n*n, m, uv)
    call space%take(n*n, n*n, straight)
    call space%take(n*n, n*n, crossed)
    call space%take(n*n, n*n, covariance)
    call take_terms(self, space, terms)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all(self%variance(:, :, i) >= 0.0_dp .and. self%variance(:, :, i) <= huge(1.0_dp))) return
    call linearise(self, i, terms, space, line_info, rcond)
    if (line_info /= line_good) return
    call load_real(self%transposed, self%variance(:, :, i), spread)
    if (self%reciprocal) call make_symmetric(spread)

    ! sum over p, q of U_ap conj(U_cp) s_pq V_qb conj(V_qd), at row ac, column bd
    call outer_rows(terms%u, terms%u, uu)
    call outer_rows(terms%v_transposed, terms%v_transposed, vv)
    uv = 0
    call product_line('N', 'N', 1.0_dp, uu, spread, uv)
    straight = 0
    call product_line('N', 'T', 1.0_dp, uv, vv, straight)
    crossed = 0
    if (self%reciprocal) then
      ! sum over p, q of U_ap conj(V_pd) s_pq V_qb conj(U_cq), at row ad, column cb
      call outer_rows(terms%u, terms%v_transposed, uv)
      uu = 0
      call product_line('N', 'N', 1.0_dp, uv, spread, uu)
      call product_line('N', 'C', 1.0_dp, uu, uv, crossed)
    end if
    do d = 1, n
      do c = 1, n
        cd = merge(d + (c - 1)*n, c + (d - 1)*n, self%transposed)
        do b = 1, n
          do a = 1, n
            ab = merge(b + (a - 1)*n, a + (b - 1)*n, self%transposed)
            covariance(ab, cd) = straight(a + (c - 1)*n, b + (d - 1)*n)
            if (self%reciprocal) then
              covariance(ab, cd) = 0.5_dp*(covariance(ab, cd) + crossed(a + (d - 1)*n, c + (b - 1)*n))
            end if
          end do
        end do
      end do
    end do
    if (.not. all_finite(covariance)) line_info = line_overflow
    call store(self%transposed, covariance, self%result(:, :, i))
  end subroutine propagate_one

  !> a = (a + a^T)/2
  pure subroutine make_symmetric(a)
    complex(dp), contiguous, intent(inout) :: a(:, :)
    integer :: i, j

    do j = 1, size(a, 2)
      do i = 1, j
        a(i, j) = 0.5_dp*(a(i, j) + a(j, i))
        a(j, i) = a(i, j)
      end do
    end do
  end subroutine make_symmetric

  !> Products x_ap conj(y_cp), at row ac.
  pure subroutine outer_rows(x, y, outer)
    complex(dp), contiguous, intent(in) :: x(:, :), y(:, :)
    complex(dp), contiguous, intent(out) :: outer(:, :)
    integer :: p, c, n

    n = size(x, 1)
    do p = 1, size(x, 2)
      do c = 1, n
        outer((c - 1)*n + 1:c*n, p) = x(:, p)*conjg(y(c, p))
      end do
    end do
  end subroutine outer_rows

end module jointfrf_compliance
