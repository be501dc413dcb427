!> Inverse and solution of a sweep of matrices.
module jointfrf_linear_algebra
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_lines_lapack, only: inverse_work, invert_line, solve_line
  use jointfrf_status, only: line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: invert, solve

  type, extends(line_operation) :: inversion
    integer :: n
    complex(dp), pointer, contiguous :: a(:, :, :)
  contains
    procedure :: line => invert_one
  end type inversion

  type, extends(line_operation) :: solution
    logical :: transposed
    integer :: n, n_rhs
    complex(dp), pointer, contiguous :: a(:, :, :), b(:, :, :)
  contains
    procedure :: line => solve_one
  end type solution

contains

  !> Inverse of every line. The order of storage does not matter: transposing and inverting commute.
  !> a           matrices, shape (n, n, n_freq)
  !> a_inverse   their inverses, same shape
  subroutine invert(a, a_inverse, line_info, rcond, info)
    complex(dp), contiguous, target, intent(in) :: a(:, :, :)
    complex(dp), contiguous, target, intent(out) :: a_inverse(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(inversion) :: operation

    operation%n = size(a, 1)
    operation%a => a
    operation%result => a_inverse
    operation%n_complex = inverse_work(operation%n)
    operation%n_pivot = operation%n
    operation%flops = 8.0_dp*real(operation%n, dp)**3
    call run_sweep(operation, size(a, 3, kind=ip), line_info, rcond, info)
  end subroutine invert

  subroutine invert_one(self, i, space, line_info, rcond)
    class(inversion), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(self%a(:, :, i))) return
    self%result(:, :, i) = self%a(:, :, i)
    call invert_line(self%result(:, :, i), space, line_info, rcond)
  end subroutine invert_one

  !> A X = B on every line.
  !> transposed  whether each matrix is stored as (in, out)
  !> a           shape (n, n, n_freq)
  !> b, x        shape (n, n_rhs, n_freq), or (n_rhs, n, n_freq) where transposed
  subroutine solve(transposed, a, b, x, line_info, rcond, info)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: a(:, :, :), b(:, :, :)
    complex(dp), contiguous, target, intent(out) :: x(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(solution) :: operation

    operation%transposed = transposed
    operation%n = size(a, 1)
    operation%n_rhs = size(b, merge(1, 2, transposed))
    operation%a => a
    operation%b => b
    operation%result => x
    operation%n_complex = operation%n**2 + operation%n*operation%n_rhs + inverse_work(operation%n)
    operation%n_real = 2*operation%n
    operation%n_pivot = operation%n
    operation%flops = 8.0_dp*real(operation%n, dp)**2*(operation%n/3.0_dp + operation%n_rhs)
    call run_sweep(operation, size(a, 3, kind=ip), line_info, rcond, info)
  end subroutine solve

  subroutine solve_one(self, i, space, line_info, rcond)
    class(solution), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: a(:, :), b(:, :)

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. (all_finite(self%a(:, :, i)) .and. all_finite(self%b(:, :, i)))) return
    a => space%matrix(self%n, self%n)
    b => space%matrix(self%n, self%n_rhs)
    call load(self%transposed, self%a(:, :, i), a)
    call load(self%transposed, self%b(:, :, i), b)
    call solve_line(a, b, space, line_info, rcond)
    call store(self%transposed, b, self%result(:, :, i))
  end subroutine solve_one

end module jointfrf_linear_algebra
