!> Inverse structural modification: the joint stiffness from receptances of the assembly (2.37)-(2.48).
module jointfrf_ismm
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_layout, only: all_finite, load, store, subtract, take_block
  use jointfrf_lines_lapack, only: inverse_work, product_line, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: ismm, inverse_substructuring

  type, extends(line_operation) :: identification
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :)
  contains
    procedure :: line => identify_one
  end type identification

  type, extends(line_operation) :: short_identification
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: gamma(:, :, :)
  contains
    procedure :: line => invert_one
  end type short_identification

contains

  !> K* = K0 - D_jk with D = alpha^-1 (alpha - gamma) gamma^-1. Eqs. (2.47), (2.48): D holds -Delta off its diagonal.
  !>
  !> Only the block jk is formed: rows j of alpha^-1 and columns k of gamma^-1. It holds for any alpha; where alpha was
  !> assembled through K0, it reduces to -(gamma^-1)_jk, see `inverse_substructuring`.
  !> alpha       receptance of the assembly with K0 at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> gamma       measured receptance of the assembly, same DOFs and shape
  !> k_initial   K0, shape (n, n, n_freq), N/m
  !> k_joint     K*, shape (n, n, n_freq), N/m
  subroutine ismm(transposed, alpha, gamma, k_initial, k_joint, line_info, rcond, info)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(identification) :: operation
    integer :: n, m

    n = size(k_initial, 1)
    m = 2*n
    operation%transposed = transposed
    operation%n = n
    operation%alpha => alpha
    operation%gamma => gamma
    operation%k_initial => k_initial
    operation%result => k_joint
    operation%n_complex = 3*m**2 + 3*m*n + n**2 + inverse_work(m)
    operation%n_real = 2*m
    operation%n_pivot = m
    operation%flops = 8.0_dp*real(m, dp)**3*(5.0_dp/3.0_dp)
    call run_sweep(operation, size(alpha, 3, kind=ip), line_info, rcond, info)
  end subroutine ismm

  subroutine identify_one(self, i, space, line_info, rcond)
    class(identification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: alpha(:, :), gamma(:, :), difference(:, :), rows_j(:, :), columns_k(:, :)
    complex(dp), pointer, contiguous :: product(:, :), k_joint(:, :)
    real(dp) :: rcond_gamma
    integer :: n, m

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. (all_finite(self%alpha(:, :, i)) .and. all_finite(self%gamma(:, :, i)) &
               .and. all_finite(self%k_initial(:, :, i)))) return
    n = self%n
    m = 2*n
    alpha => space%matrix(m, m)
    gamma => space%matrix(m, m)
    difference => space%matrix(m, m)
    rows_j => space%matrix(m, n)
    columns_k => space%matrix(m, n)
    product => space%matrix(m, n)
    k_joint => space%matrix(n, n)
    call load(self%transposed, self%alpha(:, :, i), alpha)
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call load(self%transposed, self%k_initial(:, :, i), k_joint)
    call subtract(alpha, gamma, difference)
    call load(.not. self%transposed, self%alpha(:, :, i), alpha)        ! alpha^T
    call unit_columns(0, rows_j)
    call solve_line(alpha, rows_j, space, line_info, rcond)             ! rows j of alpha^-1, as columns
    if (line_info /= line_good) return
    call unit_columns(n, columns_k)
    call solve_line(gamma, columns_k, space, line_info, rcond_gamma)    ! columns k of gamma^-1
    rcond = min(rcond, rcond_gamma)
    if (line_info /= line_good) return
    product = 0
    call product_line('N', 'N', 1.0_dp, difference, columns_k, product)
    call product_line('T', 'N', -1.0_dp, rows_j, product, k_joint)      ! (2.47), (2.48): K* = K0 - D_jk
    if (.not. all_finite(k_joint)) line_info = line_overflow
    call store(self%transposed, k_joint, self%result(:, :, i))
  end subroutine identify_one

  !> K* = -(gamma^-1)_jk: what ISMM reduces to where alpha was assembled through K0.
  !>
  !> gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]], so the joint stands alone off the diagonal; no model is needed.
  !> gamma     measured receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> k_joint   K*, shape (n, n, n_freq), N/m
  subroutine inverse_substructuring(transposed, gamma, k_joint, line_info, rcond, info)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(short_identification) :: operation
    integer :: n, m

    n = size(k_joint, 1)
    m = 2*n
    operation%transposed = transposed
    operation%n = n
    operation%gamma => gamma
    operation%result => k_joint
    operation%n_complex = m**2 + m*n + n**2 + inverse_work(m)
    operation%n_real = 2*m
    operation%n_pivot = m
    operation%flops = 8.0_dp*real(m, dp)**3*(5.0_dp/6.0_dp)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info)
  end subroutine inverse_substructuring

  subroutine invert_one(self, i, space, line_info, rcond)
    class(short_identification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: gamma(:, :), columns_k(:, :), k_joint(:, :)
    integer :: n

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(self%gamma(:, :, i))) return
    n = self%n
    gamma => space%matrix(2*n, 2*n)
    columns_k => space%matrix(2*n, n)
    k_joint => space%matrix(n, n)
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call unit_columns(n, columns_k)
    call solve_line(gamma, columns_k, space, line_info, rcond)
    call take_block(.false., -1.0_dp, columns_k, 0, 0, k_joint)
    call store(self%transposed, k_joint, self%result(:, :, i))
  end subroutine invert_one

  !> The unit vectors first + 1, first + 2, ... as columns.
  pure subroutine unit_columns(first, columns)
    integer, intent(in) :: first
    complex(dp), contiguous, intent(out) :: columns(:, :)
    integer :: m

    columns = 0
    do m = 1, size(columns, 2)
      columns(first + m, m) = 1
    end do
  end subroutine unit_columns
end module jointfrf_ismm
