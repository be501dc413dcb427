!> How measurement noise comes through to the joint compliance: its first-order factors, and its covariance.
module jointfrf_compliance_noise
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, find_rows, lane_kernels, lanes, largest_solved, padded, &
    real_lines, rows_in_memory, sparse_rows, worse_of
  use jointfrf_line_layout, only: all_finite, load, load_real, store, take_block
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: compliance_covariance, compliance_factors

  !> Above this number of joint DOFs a block of covariances leaves the caches.
  integer, parameter :: largest_propagated = 8

  !> Where one of the two systems of a line lies in lanes, and what its solution is weighed with.
  type :: weighed_system
    integer :: before                        !< the element before the system
    integer :: solved                        !< before its solution, row by row
    integer, allocatable :: solution(:)      !< its elements
    integer :: weighed                       !< before what comes of it, column by column
    type(sparse_rows) :: weights             !< of the rows of the solution, for each measured point
    real(dp), allocatable :: constant(:, :)  !< what is added, shape (n, m)
  end type weighed_system

  !> Where the numbers of a line lie in lanes.
  type :: linearisation_in_lanes
    real(dp), pointer, contiguous :: gamma(:, :, :), result(:, :, :)
    integer, allocatable :: gamma_place(:), result_place(:)              !< in the caller's order
    integer, allocatable :: jk(:), jk_transposed(:)                      !< elements of n by n matrices
    type(weighed_system) :: right, left      !< gamma_jk R = gamma_jj, gamma_jk^T L^T = gamma_kk^T
  end type linearisation_in_lanes

  !> What both linearisations share.
  type, abstract, extends(line_operation) :: linearisation
    logical :: transposed
    integer :: n, m
    complex(dp), pointer, contiguous :: gamma(:, :, :)
    real(dp), pointer, contiguous :: transform(:, :)
    type(linearisation_in_lanes) :: plan
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
    procedure :: line_block => factor_block
  end type factorisation

  type, extends(linearisation) :: propagation
    logical :: reciprocal
    real(dp), pointer, contiguous :: variance(:, :, :)
    integer :: spread_before, work_before, covariance_before       !< elements before
  contains
    procedure :: line => propagate_one
    procedure :: line_block => propagate_block
  end type propagation

contains

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
    if (worth_a_plan(size(gamma, 3), memory) .and. min(n, m) >= 1 .and. n <= largest_solved) &
      call plan_factors(operation)
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

  !> Where both systems of a line lie, and U and V^T column by column.
  subroutine plan_linearisation(operation, room)
    class(linearisation), intent(inout) :: operation
    type(element_space), intent(inout) :: room
    type(element_matrix) :: jk, jj, jk_transposed, kk_transposed, kj
    integer :: n, m

    n = operation%n
    m = operation%m
    associate (plan => operation%plan)
      call room%system(n, n, plan%right%before, jk, jj)                        ! jj are the right-hand sides of R
      call room%system(n, n, plan%left%before, jk_transposed, kk_transposed)   ! kk^T those of L^T
      kj = room%matrix(n, n)                                                   ! must be finite
      call room%pick(jk, plan%jk)
      call room%pick(jk_transposed%transpose(), plan%jk_transposed)
      plan%gamma => real_lines(operation%gamma)
      call room%in_memory(operation%transposed, jj, jk, kj, kk_transposed%transpose(), plan%gamma_place)
      call place_solution(plan%right)
      call place_solution(plan%left)
      plan%left%weighed = room%run(n*m)
      plan%right%weighed = room%run(n*m)
      if (operation%transposed) then
        call weigh(operation%transform(:, :n), operation%transform(:, n + 1:))
      else
        call weigh(operation%transform(:n, :), operation%transform(n + 1:, :))
      end if
    end associate
    operation%n_hint = 2*padded(n)

  contains

    subroutine place_solution(one)
      type(weighed_system), intent(inout) :: one
      type(element_matrix) :: solution

      solution = room%matrix(n, n)
      one%solved = solution%before
      call room%in_memory(.true., solution, one%solution)
    end subroutine place_solution

    !> U = L T_j - T_k and V^T = T_j - R^T T_k, column by column.
    subroutine weigh(t_j, t_k)
      real(dp), intent(in) :: t_j(:, :), t_k(:, :)

      call set(1.0_dp, t_j, -1.0_dp, t_k, operation%plan%left)
      call set(-1.0_dp, t_k, 1.0_dp, t_j, operation%plan%right)
    end subroutine weigh

    subroutine set(factor, weights, constant_factor, constant, one)
      real(dp), intent(in) :: factor, weights(:, :), constant_factor, constant(:, :)
      type(weighed_system), intent(inout) :: one
      integer :: stat, i

      if (room%no_memory) return
      call find_rows(factor, weights, .not. operation%transposed, one%weights, stat)
      if (stat == 0) allocate (one%constant(n, m), stat=stat)
      room%no_memory = stat /= 0
      if (room%no_memory) return
      do i = 1, n
        if (operation%transposed) then
          one%constant(i, :) = constant_factor*constant(:, i)
        else
          one%constant(i, :) = constant_factor*constant(i, :)
        end if
      end do
    end subroutine set
  end subroutine plan_linearisation

  subroutine plan_factors(operation)
    type(factorisation), intent(inout) :: operation
    integer :: n, m, i, p, above, below
    type(element_space) :: room

    n = operation%n
    m = operation%m
    call plan_linearisation(operation, room)
    call room%new_list(2*n*m, operation%plan%result_place)
    if (.not. room%no_memory) then
      do p = 1, m
        do i = 1, n
          above = merge((i - 1)*m + p, (p - 1)*2*n + i, operation%transposed)
          below = merge((n + i - 1)*m + p, (p - 1)*2*n + n + i, operation%transposed)
          operation%plan%result_place(above) = operation%plan%left%weighed + (p - 1)*n + i
          operation%plan%result_place(below) = operation%plan%right%weighed + (p - 1)*n + i
        end do
      end do
    end if
    operation%plan%result => real_lines(operation%result)
    call operation%reads(operation%plan%gamma)
    call operation%lies_in(room, n + n*n)
  end subroutine plan_factors

  !> U and V^T of a block of lines.
  !> total   sums in which NaN, Inf and overflow show
  !> rcond   of the worse of both systems
  subroutine linearise_block(self, kernels, first, n_lines, space, total, rcond)
    class(linearisation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    real(dp), intent(out) :: total(lanes), rcond(lanes)
    real(dp) :: rcond_left(lanes)
    integer :: n

    n = self%n
    associate (plan => self%plan, x => space%x)
      call kernels%load(4*n*n, plan%gamma_place, first, n_lines, plan%gamma, x)
      call kernels%total(4*n*n, plan%gamma_place, x, total)
      call kernels%copy(n*n, 1.0_dp, plan%jk, plan%jk_transposed, x)
      call solve_and_weigh(plan%right, space%hint(:padded(n)), rcond)
      call solve_and_weigh(plan%left, space%hint(padded(n) + 1:), rcond_left)
    end associate
    rcond = worse_of(rcond, rcond_left)

  contains

    subroutine solve_and_weigh(one, hint, rcond_one)
      type(weighed_system), intent(in) :: one
      integer, intent(inout) :: hint(:)
      real(dp), intent(out) :: rcond_one(lanes)
      real(dp) :: of_solution(lanes)

      associate (row => space%list(:n), from => space%list(n + 1:))
        call kernels%solve(n, n, n, one%before, space%x, hint, row, rcond_one, space%ahead)
        call rows_in_memory(.true., row, n, from)
        call kernels%total(n*n, from, space%x, of_solution)
        total = total + of_solution
        call kernels%copy(n*n, 1.0_dp, from, one%solution, space%x)
        call kernels%weigh_rows(n, one%weights, one%constant, one%solved, one%weighed, space%x)
      end associate
    end subroutine solve_and_weigh
  end subroutine linearise_block

  subroutine factor_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(factorisation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: total(lanes), of_factors(lanes), rcond_lanes(lanes)

    call linearise_block(self, kernels, first, n_lines, space, total, rcond_lanes)
    associate (plan => self%plan)
      call kernels%store(size(plan%result_place), plan%result_place, first, n_lines, space%x, self%plan%result)
      call kernels%total(size(plan%result_place), plan%result_place, space%x, of_factors)
    end associate
    rcond = rcond_lanes(:n_lines)
    call kernels%judge(n_lines, total + of_factors, line_info, rcond)
  end subroutine factor_block

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
    real(dp) :: rcond_right
    integer :: n

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(self%gamma(:, :, i))) return
    n = self%n
    call load(self%transposed, self%gamma(:, :, i), terms%gamma)
    call take_block(.false., 1.0_dp, terms%gamma, 0, n, terms%gamma_jk)
    call take_block(.false., 1.0_dp, terms%gamma, 0, 0, terms%right)
    call solve_line(terms%gamma_jk, terms%right, space, line_info, rcond_right)       ! R
    if (line_info /= line_good) return
    call take_block(.true., 1.0_dp, terms%gamma, 0, n, terms%gamma_jk)
    call take_block(.true., 1.0_dp, terms%gamma, n, n, terms%left)
    call solve_line(terms%gamma_jk, terms%left, space, line_info, rcond)              ! L^T
    if (line_info /= line_good) return
    rcond = min(rcond, rcond_right)
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
    if (worth_a_plan(size(gamma, 3), memory) .and. min(n, m) >= 1 .and. n <= largest_propagated) &
      call plan_propagation(operation)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine compliance_covariance

  subroutine plan_propagation(operation)
    type(propagation), intent(inout) :: operation
    type(element_space) :: room
    integer :: n, m, a, b, c, d, ab, cd

    n = operation%n
    m = operation%m
    call plan_linearisation(operation, room)
    operation%spread_before = room%run(m*m)
    operation%work_before = room%run((n + 2)*m)
    operation%covariance_before = room%run(n**4)
    call room%new_list(n**4, operation%plan%result_place)
    if (.not. room%no_memory) then
      do d = 1, n
        do c = 1, n
          cd = merge(d + (c - 1)*n, c + (d - 1)*n, operation%transposed)
          do b = 1, n
            do a = 1, n
              ab = merge(b + (a - 1)*n, a + (b - 1)*n, operation%transposed)
              operation%plan%result_place(merge((ab - 1)*n*n + cd, (cd - 1)*n*n + ab, operation%transposed)) = &
                operation%covariance_before + (((c - 1)*n + a - 1)*n + d - 1)*n + b
            end do
          end do
        end do
      end do
    end if
    operation%plan%result => real_lines(operation%result)
    call operation%reads(operation%plan%gamma)
    call operation%lies_in(room, n + n*n)
  end subroutine plan_propagation

  subroutine propagate_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(propagation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: total(lanes), of_covariance(lanes), rcond_lanes(lanes), not_finite
    integer :: l

    not_finite = ieee_value(1.0_dp, ieee_positive_inf)
    call linearise_block(self, kernels, first, n_lines, space, total, rcond_lanes)
    call load_spread()
    associate (plan => self%plan)
      call kernels%propagate(self%n, self%m, self%reciprocal, plan%left%weighed, plan%right%weighed, &
                             self%spread_before, self%work_before, self%covariance_before, space%x)
      call kernels%store(size(plan%result_place), plan%result_place, first, n_lines, space%x, self%plan%result)
      call kernels%total(size(plan%result_place), plan%result_place, space%x, of_covariance)
    end associate
    rcond = rcond_lanes(:n_lines)
    call kernels%judge(n_lines, total + of_covariance, line_info, rcond)

  contains

    !> Variances of the block, those of both directions averaged where h was made reciprocal.
    subroutine load_spread()
      integer :: line, p, q, e

      associate (m => self%m, variance => self%variance)
        do l = 1, lanes
          line = first + min(l, n_lines) - 1
          do q = 1, m
            do p = 1, m
              e = merge(q + (p - 1)*m, p + (q - 1)*m, self%transposed)
              space%x(l, 1, self%spread_before + e) = variance(p, q, line)
              if (self%reciprocal) space%x(l, 1, self%spread_before + e) = 0.5_dp*(variance(p, q, line) &
                                                                                    + variance(q, p, line))
              ! A line with a bad variance is left to the reference engine.
              total(l) = total(l) + merge(0.0_dp, not_finite, variance(p, q, line) >= 0.0_dp &
                                          .and. variance(p, q, line) <= huge(1.0_dp))
            end do
          end do
        end do
      end associate
    end subroutine load_spread
  end subroutine propagate_block

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
end module jointfrf_compliance_noise
