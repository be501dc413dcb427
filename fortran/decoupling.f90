!> FRF decoupling: the joint stiffness from receptances of the assembly away from the joint and of both substructures
!> (2.49)-(2.56).
module jointfrf_decoupling
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_in_lanes, padded, real_lines, &
    worse_of
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_lines_lapack, only: invert_line, product_line, room_to_invert, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: decouple, is_equation

  !> Where the terms of the equation lie in lanes: the system [M, Q], P, and -H_jj - H_kk, which is to be inverted.
  type :: decoupling_in_lanes
    real(dp), pointer, contiguous :: a(:, :, :), b(:, :, :), c(:, :, :), k_joint(:, :, :)
    integer, allocatable :: a_place(:), b_place(:), c_place(:)         !< in the caller's order
    integer, allocatable :: measured(:), m(:)                          !< H^C, M
    integer, allocatable :: model(:)                                   !< H_rr or H_ss where M is a difference
    integer, allocatable :: q(:), q_from(:), p(:), p_from(:), z(:), z_from_j(:), z_from_k(:)
    integer, allocatable :: p_row(:), z_row(:), z_system(:)
    integer, allocatable :: given(:)                                   !< all that is loaded
    integer :: m_before, z_before                                      !< the element before each system
  end type decoupling_in_lanes

  type, extends(line_operation) :: decoupling
    character(len=2) :: equation
    logical :: transposed
    integer :: n_a, n_b, n
    complex(dp), pointer, contiguous :: h_a(:, :, :), h_b(:, :, :), h_c(:, :, :)
    integer(ip), pointer, contiguous :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    type(decoupling_in_lanes) :: plan
  contains
    procedure :: line => decouple_one
    procedure :: line_block => decouple_block
  end type decoupling

contains

  !> Whether the two letters name one of the four equations: 'rr' (2.53), 'rs' (2.54), 'sr' (2.55), 'ss' (2.56).
  pure function is_equation(equation) result(known)
    character(len=2), intent(in) :: equation
    logical :: known

    known = equation == 'rr' .or. equation == 'rs' .or. equation == 'sr' .or. equation == 'ss'
  end function is_equation

  !> K* by one of the four equations. All four have one form, K* = (P M^-1 Q - H_jj - H_kk)^-1, with
  !>   rr (2.53)  M = H_rr - H_rr^C,  P = H_jr,  Q = H_rj      rs (2.54)  M = H_rs^C,         P = H_ks,  Q = H_rj
  !>   sr (2.55)  M = H_sr^C,         P = H_jr,  Q = H_sk      ss (2.56)  M = H_ss - H_ss^C,  P = H_ks,  Q = H_sk
  !> h_a       receptance of A, shape (n_a, n_a, n_freq), m/N
  !> h_b       receptance of B, shape (n_b, n_b, n_freq), m/N
  !> h_c       measured receptance of the assembly: responses at the points of the first letter, forces at those of the
  !>           second, shape (n, n, n_freq), m/N
  !> dofs_j    joint DOFs among those of A, shape (n), counted from 1
  !> dofs_k    joint DOFs among those of B, shape (n), in the same order
  !> dofs_r    internal DOFs of A, shape (n); read where the equation names r
  !> dofs_s    internal DOFs of B, shape (n); read where the equation names s
  !> k_joint   K*, shape (n, n, n_freq), N/m
  subroutine decouple(equation, transposed, h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, k_joint, &
                      line_info, rcond, info, memory)
    character(len=2), intent(in) :: equation
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: h_a(:, :, :), h_b(:, :, :), h_c(:, :, :)
    integer(ip), contiguous, target, intent(in) :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(decoupling) :: operation
    integer :: n

    n = size(dofs_j)
    operation%equation = equation
    operation%transposed = transposed
    operation%n_a = size(h_a, 1)
    operation%n_b = size(h_b, 1)
    operation%n = n
    operation%h_a => h_a
    operation%h_b => h_b
    operation%h_c => h_c
    operation%dofs_j => dofs_j
    operation%dofs_k => dofs_k
    operation%dofs_r => dofs_r
    operation%dofs_s => dofs_s
    operation%result => k_joint
    operation%flops = 27.0_dp*real(n, dp)**3
    if (worth_a_plan(size(h_a, 3), memory) .and. n >= 1 .and. max(operation%n_a, operation%n_b) <= largest_in_lanes) &
      call plan_decoupling(operation)
    call run_sweep(operation, size(h_a, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine decouple

  subroutine plan_decoupling(operation)
    type(decoupling), intent(inout) :: operation
    type(element_matrix) :: a, b, measured, to_joint, z, m, q, inverse
    type(element_space) :: room
    integer :: n, used

    n = operation%n
    a = room%matrix(operation%n_a, operation%n_a)
    b = room%matrix(operation%n_b, operation%n_b)
    measured = room%matrix(n, n)
    to_joint = room%matrix(n, n)
    z = room%matrix(n, n)
    call room%system(n, n, operation%plan%m_before, m, q)
    call room%system(n, 0, operation%plan%z_before, inverse)
    operation%n_hint = 2*padded(n)
    associate (plan => operation%plan, j => operation%dofs_j, k => operation%dofs_k, r => operation%dofs_r, &
               s => operation%dofs_s, equation => operation%equation)
      plan%a => real_lines(operation%h_a)
      plan%b => real_lines(operation%h_b)
      plan%c => real_lines(operation%h_c)
      plan%k_joint => real_lines(operation%result)
      call operation%reads(plan%a)
      call operation%reads(plan%b)
      call operation%reads(plan%c)
      call room%in_memory(operation%transposed, a, plan%a_place)
      call room%in_memory(operation%transposed, b, plan%b_place)
      call room%in_memory(operation%transposed, measured, plan%c_place)
      call room%new_list(operation%n_a**2 + operation%n_b**2 + n*n, plan%given)
      used = 0
      call room%add(a, plan%given, used)
      call room%add(b, plan%given, used)
      call room%add(measured, plan%given, used)
      call room%pick(measured, plan%measured)
      call room%pick(m, plan%m)
      call room%pick(q, plan%q)
      call room%pick(to_joint, plan%p)
      call room%pick(z, plan%z)
      call room%pick(inverse, plan%z_system)
      call room%pick(a, plan%z_from_j, j, j)
      call room%pick(b, plan%z_from_k, k, k)
      if (equation(1:1) == 'r') then
        call room%pick(a, plan%q_from, r, j)
      else
        call room%pick(b, plan%q_from, s, k)
      end if
      if (equation(2:2) == 'r') then
        call room%pick(a, plan%p_from, j, r)
      else
        call room%pick(b, plan%p_from, k, s)
      end if
      if (equation == 'rr') then
        call room%pick(a, plan%model, r, r)
      else if (equation == 'ss') then
        call room%pick(b, plan%model, s, s)
      else
        call room%new_list(0, plan%model)
      end if
      call room%row_starts(to_joint, plan%p_row)
      call room%row_starts(z, plan%z_row)
    end associate
    call operation%lies_in(room, n + 2*n*n)
  end subroutine plan_decoupling

  subroutine decouple_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(decoupling), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_m(lanes), rcond_z(lanes), total(lanes)
    integer :: n, i, j

    n = self%n
    associate (plan => self%plan, x => space%x, row => space%list(:n), inverse => space%list(n + 1:n + n*n), &
               place => space%list(n + n*n + 1:))
      call kernels%load(size(plan%a_place), plan%a_place, first, n_lines, plan%a, x)
      call kernels%load(size(plan%b_place), plan%b_place, first, n_lines, plan%b, x)
      call kernels%load(n*n, plan%c_place, first, n_lines, plan%c, x)
      call kernels%total(size(plan%given), plan%given, x, total)                ! not all of it enters the result
      if (size(plan%model) > 0) then
        call kernels%combine(n*n, 1.0_dp, plan%model, -1.0_dp, plan%measured, plan%m, x)
      else
        call kernels%copy(n*n, 1.0_dp, plan%measured, plan%m, x)
      end if
      call kernels%copy(n*n, 1.0_dp, plan%q_from, plan%q, x)
      call kernels%copy(n*n, 1.0_dp, plan%p_from, plan%p, x)
      call kernels%combine(n*n, -1.0_dp, plan%z_from_j, -1.0_dp, plan%z_from_k, plan%z, x)
      call kernels%solve(n, n, n, plan%m_before, x, space%hint(:padded(n)), row, rcond_m, space%ahead)
      call kernels%product(n, n, n, 1.0_dp, plan%p_row, row, plan%z_row, x)
      call kernels%copy(n*n, 1.0_dp, plan%z, plan%z_system, x)
      call kernels%invert(n, plan%z_before, x, space%hint(padded(n) + 1:), inverse, rcond_z)  ! (2.53)-(2.56)
      do j = 1, n
        do i = 1, n
          place((j - 1)*n + i) = inverse(merge((j - 1)*n + i, (i - 1)*n + j, self%transposed))
        end do
      end do
      call kernels%store(n*n, place, first, n_lines, x, self%plan%k_joint)
      rcond = worse_of(rcond_m(:n_lines), rcond_z(:n_lines))
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine decouple_block

  subroutine decouple_one(self, i, space, line_info, rcond)
    class(decoupling), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: h_a(:, :), h_b(:, :), measured(:, :), to_joint(:, :), from_joint(:, :), z(:, :)
    real(dp) :: rcond_z
    integer :: n

    n = self%n
    call space%take(self%n_a, self%n_a, h_a)
    call space%take(self%n_b, self%n_b, h_b)
    call space%take(n, n, measured)
    call space%take(n, n, to_joint)
    call space%take(n, n, from_joint)
    call space%take(n, n, z)
    call room_to_solve(n, space)
    call room_to_invert(n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%h_a(:, :, i)) .and. all_finite(self%h_b(:, :, i)) &
               .and. all_finite(self%h_c(:, :, i)))) return
    call load(self%transposed, self%h_a(:, :, i), h_a)
    call load(self%transposed, self%h_b(:, :, i), h_b)
    call load(self%transposed, self%h_c(:, :, i), measured)

    call take_terms(self%equation, h_a, h_b, self%dofs_j, self%dofs_k, self%dofs_r, self%dofs_s, &
                    measured, to_joint, from_joint, z)
    call solve_line(measured, from_joint, space, line_info, rcond)
    if (line_info /= line_good) return
    call product_line('N', 'N', 1.0_dp, to_joint, from_joint, z)
    call invert_line(z, space, line_info, rcond_z)             ! (2.53)-(2.56)
    rcond = min(rcond, rcond_z)
    call store(self%transposed, z, self%result(:, :, i))
  end subroutine decouple_one

  !> M, P and Q of the equation, and -H_jj - H_kk. The first letter names the responding point: it gives Q. The second
  !> names the excited point: it gives P.
  pure subroutine take_terms(equation, h_a, h_b, dofs_j, dofs_k, dofs_r, dofs_s, measured, to_joint, from_joint, z)
    character(len=2), intent(in) :: equation
    complex(dp), contiguous, intent(in) :: h_a(:, :), h_b(:, :)
    integer(ip), contiguous, intent(in) :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    complex(dp), contiguous, intent(inout) :: measured(:, :)
    complex(dp), contiguous, intent(out) :: to_joint(:, :), from_joint(:, :), z(:, :)

    if (equation(1:1) == 'r') then
      from_joint = h_a(dofs_r, dofs_j)
    else
      from_joint = h_b(dofs_s, dofs_k)
    end if
    if (equation(2:2) == 'r') then
      to_joint = h_a(dofs_j, dofs_r)
    else
      to_joint = h_b(dofs_k, dofs_s)
    end if
    if (equation == 'rr') measured = h_a(dofs_r, dofs_r) - measured
    if (equation == 'ss') measured = h_b(dofs_s, dofs_s) - measured
    z = -h_a(dofs_j, dofs_j) - h_b(dofs_k, dofs_k)
  end subroutine take_terms

end module jointfrf_decoupling
