!> Inverse and solution of a sweep of matrices.
module jointfrf_linear_algebra
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_in_lanes, largest_product, &
    largest_solved, padded, real_lines, rows_in_memory
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_lines_lapack, only: invert_line, room_to_invert, room_to_solve, solve_line
  use jointfrf_status, only: line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, long_block, run_sweep, worth_a_plan
  implicit none
  private
  public :: invert, solve

  type, extends(line_operation) :: inversion
    integer :: n
    complex(dp), pointer, contiguous :: a(:, :, :)
    real(dp), pointer, contiguous :: a_pairs(:, :, :), result_pairs(:, :, :)
    integer, allocatable :: place(:)
  contains
    procedure :: line => invert_one
    procedure :: line_block => invert_block
  end type inversion

  type, extends(line_operation) :: solution
    logical :: transposed
    integer :: n, n_rhs
    complex(dp), pointer, contiguous :: a(:, :, :), b(:, :, :)
    real(dp), pointer, contiguous :: a_pairs(:, :, :), b_pairs(:, :, :), result_pairs(:, :, :)
    integer, allocatable :: a_place(:), b_place(:)
  contains
    procedure :: line => solve_one
    procedure :: line_block => solve_block
  end type solution

contains

  !> Inverse of every line. The order of storage does not matter: transposing and inverting commute.
  !> a           matrices, shape (n, n, n_freq)
  !> a_inverse   their inverses, same shape
  subroutine invert(a, a_inverse, line_info, rcond, info, memory)
    complex(dp), contiguous, target, intent(in) :: a(:, :, :)
    complex(dp), contiguous, target, intent(out) :: a_inverse(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(inversion) :: operation

    operation%n = size(a, 1)
    operation%a => a
    operation%result => a_inverse
    operation%flops = 8.0_dp*real(operation%n, dp)**3
    if (worth_a_plan(size(a, 3), memory) .and. operation%n >= 1 .and. operation%n <= largest_in_lanes) &
      call plan_inversion(operation)
    call run_sweep(operation, size(a, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine invert

  subroutine plan_inversion(operation)
    type(inversion), intent(inout) :: operation
    type(element_space) :: room
    type(element_matrix) :: matrix
    integer :: before

    call room%system(operation%n, 0, before, matrix)
    call room%in_memory(.true., matrix, operation%place)
    call operation%lies_in(room, operation%n**2)
    operation%n_hint = padded(operation%n)
    if (operation%n <= 2) operation%block_lines = long_block
    operation%a_pairs => real_lines(operation%a)
    operation%result_pairs => real_lines(operation%result)
    call operation%reads(operation%a_pairs)
  end subroutine plan_inversion

  !> The rows in lanes are the columns in memory, so that the largest row sum is the 1-norm.
  subroutine invert_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(inversion), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes)

    if (self%n <= 2) then
      call kernels%invert_lines(self%n, first, n_lines, self%a_pairs, self%result_pairs, rcond)
      call kernels%judge(n_lines, 0*rcond, line_info, rcond)
      return
    end if
    call kernels%load(self%n**2, self%place, first, n_lines, self%a_pairs, space%x)
    call kernels%invert(self%n, 0, space%x, space%hint, space%list, rcond_lanes, space%ahead)
    call kernels%store(self%n**2, space%list, first, n_lines, space%x, self%result_pairs)
    rcond = rcond_lanes(:n_lines)
    call kernels%judge(n_lines, rcond_lanes, line_info, rcond)
  end subroutine invert_block

  subroutine invert_one(self, i, space, line_info, rcond)
    class(inversion), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    call room_to_invert(self%n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all_finite(self%a(:, :, i))) return
    self%result(:, :, i) = self%a(:, :, i)
    call invert_line(self%result(:, :, i), space, line_info, rcond)
  end subroutine invert_one

  !> A X = B on every line.
  !> transposed  whether each matrix is stored as (in, out)
  !> a           shape (n, n, n_freq)
  !> b, x        shape (n, n_rhs, n_freq), or (n_rhs, n, n_freq) where transposed
  subroutine solve(transposed, a, b, x, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: a(:, :, :), b(:, :, :)
    complex(dp), contiguous, target, intent(out) :: x(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(solution) :: operation

    operation%transposed = transposed
    operation%n = size(a, 1)
    operation%n_rhs = size(b, merge(1, 2, transposed))
    operation%a => a
    operation%b => b
    operation%result => x
    operation%flops = 8.0_dp*real(operation%n, dp)**2*(operation%n/3.0_dp + operation%n_rhs)
    ! More right-hand sides than these leave the caches, eight lines at a time.
    if (worth_a_plan(size(a, 3), memory) .and. min(operation%n, operation%n_rhs) >= 1 &
        .and. operation%n <= largest_solved .and. operation%n_rhs <= largest_product) &
      call plan_solution(operation)
    call run_sweep(operation, size(a, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine solve

  subroutine plan_solution(operation)
    type(solution), intent(inout) :: operation
    type(element_space) :: room
    type(element_matrix) :: a, b
    integer :: before

    associate (n => operation%n, n_rhs => operation%n_rhs)
      call room%system(n, n_rhs, before, a, b)
      if (divides(operation)) operation%block_lines = long_block
      operation%n_hint = padded(n)
      call room%in_memory(operation%transposed, a, operation%a_place)
      call room%in_memory(operation%transposed, b, operation%b_place)
      call operation%lies_in(room, n + n*n_rhs)
      operation%a_pairs => real_lines(operation%a)
      operation%b_pairs => real_lines(operation%b)
      operation%result_pairs => real_lines(operation%result)
      call operation%reads(operation%a_pairs)
      call operation%reads(operation%b_pairs)
    end associate
  end subroutine plan_solution

  !> Whether a line is one number through another.
  pure function divides(operation) result(yes)
    class(solution), intent(in) :: operation
    logical :: yes

    yes = operation%n == 1 .and. operation%n_rhs == 1
  end function divides

  subroutine solve_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(solution), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)
    integer :: n_x

    if (divides(self)) then
      call kernels%divide_lines(first, n_lines, self%a_pairs, self%b_pairs, self%result_pairs, rcond)
      call kernels%judge(n_lines, 0*rcond, line_info, rcond)
      return
    end if
    n_x = self%n*self%n_rhs
    associate (row => space%list(:self%n), place => space%list(self%n + 1:))
      call kernels%load(self%n**2, self%a_place, first, n_lines, self%a_pairs, space%x)
      call kernels%load(n_x, self%b_place, first, n_lines, self%b_pairs, space%x)
      call kernels%solve(self%n, self%n_rhs, self%n, 0, space%x, space%hint, row, rcond_lanes, space%ahead)
      call rows_in_memory(self%transposed, row, self%n_rhs, place)
      call kernels%store(n_x, place, first, n_lines, space%x, self%result_pairs)
      call kernels%total(n_x, place, space%x, total)
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine solve_block

  subroutine solve_one(self, i, space, line_info, rcond)
    class(solution), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: a(:, :), b(:, :)

    call space%take(self%n, self%n, a)
    call space%take(self%n, self%n_rhs, b)
    call room_to_solve(self%n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%a(:, :, i)) .and. all_finite(self%b(:, :, i)))) return
    call load(self%transposed, self%a(:, :, i), a)
    call load(self%transposed, self%b(:, :, i), b)
    call solve_line(a, b, space, line_info, rcond)
    call store(self%transposed, b, self%result(:, :, i))
  end subroutine solve_one

end module jointfrf_linear_algebra
