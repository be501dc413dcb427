!> The linear algebra of one line with LAPACK (zgesv, zgetrf and zgetri): the reference engine, any n.
module jointfrf_lines_lapack
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lapack, only: zgecon, zgemm, zgesv, zgetrf, zgetri
  use jointfrf_line_layout, only: all_finite
  use jointfrf_status, only: line_good, line_overflow
  use jointfrf_sweep, only: area, line_space
  implicit none
  private
  public :: solve_line, invert_line, product_line, one_norm, inverse_work

  complex(dp), parameter :: one = (1.0_dp, 0.0_dp), zero = (0.0_dp, 0.0_dp)
  integer(c_size_t), parameter :: one_char = 1_c_size_t
  !> zgetri works by blocks of this many columns when it is given the room.
  integer, parameter :: inverse_block = 32
  !> Up to this order the condition number comes from the inverse itself, which costs a third of an estimate by zgecon.
  integer, parameter :: exact_condition = 32

contains

  !> Complex workspace that `solve_line` and `invert_line` take for matrices up to n by n.
  pure function inverse_work(n) result(size_needed)
    integer, intent(in) :: n
    integer(long) :: size_needed

    size_needed = max(area(2, n), area(min(n, inverse_block), n))
    if (n <= exact_condition) size_needed = size_needed + area(n, n)
  end function inverse_work

  !> A X = B with zgesv. A leaves as its LU factors, B as X. Needs space%pivot(n), space%r(2 n).
  subroutine solve_line(a, b, space, info, rcond)
    complex(dp), contiguous, intent(inout) :: a(:, :), b(:, :)
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: info
    real(dp), intent(out) :: rcond
    real(dp) :: norm
    integer(blas_ip) :: n, code

    n = size(a, 1, kind=blas_ip)
    rcond = 1.0_dp
    info = line_good
    if (n == 0 .or. size(b, 2) == 0) return        ! OpenBLAS does not factor A without right-hand sides
    norm = one_norm(a)
    call zgesv(n, size(b, 2, kind=blas_ip), a, n, space%pivot, b, n, code)
    info = int(code, ip)
    if (info /= line_good) return
    call condition(norm, a, space, rcond)
    if (.not. all_finite(b)) info = line_overflow
  end subroutine solve_line

  !> Reciprocal condition number from LU factors: of the inverse while that is cheap, else LAPACK's estimate.
  subroutine condition(norm, factors, space, rcond)
    real(dp), intent(in) :: norm
    complex(dp), contiguous, intent(in) :: factors(:, :)
    type(line_space), target, intent(inout) :: space
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: inverse(:, :), work(:, :)
    integer(blas_ip) :: n, ignored
    integer(long) :: before

    n = size(factors, 1, kind=blas_ip)
    before = space%used
    if (n <= exact_condition) then
      inverse => space%matrix(int(n), int(n))
      work => space%matrix(min(int(n), inverse_block), int(n))
      inverse = factors
      call zgetri(n, inverse, n, space%pivot, work, size(work, kind=blas_ip), ignored)
      rcond = 0.0_dp
      if (all_finite(inverse)) rcond = min(1.0_dp, (1.0_dp/norm)/one_norm(inverse))
    else
      work => space%matrix(2, int(n))
      call zgecon('1', n, factors, n, norm, rcond, work, space%r, ignored, one_char)
    end if
    space%used = before
  end subroutine condition

  !> A becomes its inverse, with zgetrf and zgetri. Needs space%pivot(n).
  subroutine invert_line(a, space, info, rcond)
    complex(dp), contiguous, intent(inout) :: a(:, :)
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: work(:, :)
    real(dp) :: norm
    integer(blas_ip) :: n, code
    integer(long) :: before

    n = size(a, 1, kind=blas_ip)
    rcond = 1.0_dp
    info = line_good
    if (n == 0) return
    norm = one_norm(a)
    call zgetrf(n, n, a, n, space%pivot, code)
    info = int(code, ip)
    if (info /= line_good) return
    before = space%used
    work => space%matrix(int(inverse_work(int(n))), 1)
    call zgetri(n, a, n, space%pivot, work, size(work, kind=blas_ip), code)
    space%used = before
    info = int(code, ip)
    if (info /= line_good) return
    if (.not. all_finite(a)) then
      info = line_overflow
    else
      rcond = min(1.0_dp, (1.0_dp/norm)/one_norm(a))
    end if
  end subroutine invert_line

  !> C = C + factor op(A) op(B), op by 'N', 'T' or 'C', with zgemm.
  subroutine product_line(trans_a, trans_b, factor, a, b, c)
    character, intent(in) :: trans_a, trans_b
    real(dp), intent(in) :: factor
    complex(dp), contiguous, intent(in) :: a(:, :), b(:, :)
    complex(dp), contiguous, intent(inout) :: c(:, :)
    integer(blas_ip) :: m, n, k

    m = size(c, 1, kind=blas_ip)
    n = size(c, 2, kind=blas_ip)
    k = size(a, merge(2, 1, trans_a == 'N'), kind=blas_ip)
    if (min(m, n, k) == 0) return
    call zgemm(trans_a, trans_b, m, n, k, factor*one, a, size(a, 1, kind=blas_ip), b, size(b, 1, kind=blas_ip), &
               one, c, m, one_char, one_char)
  end subroutine product_line

  !> Largest column sum of |re| + |im|: within a factor 2 of the 1-norm, and no square root, which would cost as much as
  !> the inversion of a small matrix.
  pure function one_norm(a) result(norm)
    complex(dp), contiguous, intent(in) :: a(:, :)
    real(dp) :: norm
    integer :: j

    norm = 0.0_dp
    do j = 1, size(a, 2)
      norm = max(norm, sum(abs(real(a(:, j), dp)) + abs(aimag(a(:, j)))))
    end do
  end function one_norm
end module jointfrf_lines_lapack
