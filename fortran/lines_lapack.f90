!> The linear algebra of one line with LAPACK (zgesv, zgetrf and zgetri): the reference engine, any n.
module jointfrf_lines_lapack
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lapack, only: zgecon, zgemm, zgesv, zgetrf, zgetri, zgetrs
  use jointfrf_line_layout, only: all_finite
  use jointfrf_status, only: line_good, line_overflow
  use jointfrf_sweep, only: line_space
  implicit none
  private
  public :: solve_line, invert_line, product_block, product_line, one_norm, room_to_solve, room_to_invert

  complex(dp), parameter :: one = (1.0_dp, 0.0_dp), zero = (0.0_dp, 0.0_dp)
  integer(c_size_t), parameter :: one_char = 1_c_size_t
  !> zgetri works by blocks of this many columns when it is given the room.
  integer, parameter :: inverse_block = 32
  !> Up to this order the condition number comes from the inverse itself, which costs a third of an estimate by zgecon.
  integer, parameter :: exact_condition = 32
  !> An estimated reciprocal condition number above this is taken: it may be too large by a factor of 30.
  real(dp), parameter :: well_conditioned = 1.0e-8_dp
  !> A matrix of a larger norm is scaled, by a power of two: |z|^2 and sums of products overflow in LAPACK.
  real(dp), parameter :: large = 2.0_dp**900
  !> One of a smaller norm is scaled, too: reciprocals of its pivots, and squares of them, are beyond all numbers.
  real(dp), parameter :: small = 2.0_dp**(-900)

contains

  !> Take and give back what `solve_line` takes and gives back for matrices of order n, where the space only counts.
  subroutine room_to_solve(n, space)
    integer, intent(in) :: n
    type(line_space), target, intent(inout) :: space
    complex(dp), pointer, contiguous :: copy(:, :), work(:, :)
    real(dp), pointer, contiguous :: real_work(:)
    integer(blas_ip), pointer, contiguous :: pivot(:)
    integer(long) :: before

    if (.not. space%only_counts) return
    before = space%used
    call space%take_pivots(n, pivot)
    call take_for_condition(n, space, copy, work, real_work)
    space%used = before
  end subroutine room_to_solve

  !> The same for `invert_line`.
  subroutine room_to_invert(n, space)
    integer, intent(in) :: n
    type(line_space), target, intent(inout) :: space
    complex(dp), pointer, contiguous :: work(:, :)
    integer(blas_ip), pointer, contiguous :: pivot(:)
    integer(long) :: before

    if (.not. space%only_counts) return
    before = space%used
    call space%take_pivots(n, pivot)
    call space%take(n, min(n, inverse_block), work)
    space%used = before
  end subroutine room_to_invert

  !> A X = B with zgesv. A leaves as its LU factors, B as X.
  subroutine solve_line(a, b, space, info, rcond)
    complex(dp), contiguous, intent(inout) :: a(:, :), b(:, :)
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: info
    real(dp), intent(out) :: rcond
    integer(blas_ip), pointer, contiguous :: pivot(:)
    real(dp) :: norm, factor
    integer(blas_ip) :: n, code

    n = size(a, 1, kind=blas_ip)
    rcond = 1.0_dp
    info = line_good
    if (n == 0 .or. size(b, 2) == 0) return        ! OpenBLAS does not factor A without right-hand sides
    call space%take_pivots(int(n), pivot)
    call bring_near_one(a, norm, factor)
    call zgesv(n, size(b, 2, kind=blas_ip), a, n, pivot, b, n, code)
    info = int(code, ip)
    if (info /= line_good) return
    call condition(norm, a, pivot, space, rcond)
    call multiply_by(factor, b)                    ! X = factor (factor A)^-1 B
    if (.not. all_finite(b)) info = line_overflow
  end subroutine solve_line

  !> Reciprocal condition number from LU factors: of the inverse while that is cheap, else LAPACK's estimate; where an
  !> estimate will do and it is large, by one solution.
  subroutine condition(norm, factors, pivot, space, rcond)
    real(dp), intent(in) :: norm
    complex(dp), contiguous, intent(in) :: factors(:, :)
    integer(blas_ip), contiguous, intent(in) :: pivot(:)
    type(line_space), target, intent(inout) :: space
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: inverse(:, :), work(:, :)
    real(dp), pointer, contiguous :: real_work(:)
    integer(blas_ip) :: n, ignored
    integer(long) :: before

    n = size(factors, 1, kind=blas_ip)
    before = space%used
    call take_for_condition(int(n), space, inverse, work, real_work)
    rcond = 0.0_dp
    if (space%estimates) call condition_by_solution(norm, factors, pivot, work(:, 1), rcond)
    if (rcond <= well_conditioned .and. n <= exact_condition) then
      inverse = factors
      call zgetri(n, inverse, n, pivot, work, size(work, kind=blas_ip), ignored)
      rcond = 0.0_dp
      if (all_finite(inverse)) rcond = min(1.0_dp, (1.0_dp/norm)/one_norm(inverse))
    else if (rcond <= well_conditioned) then
      call zgecon('1', n, factors, n, norm, rcond, work, real_work, ignored, one_char)
    end if
    space%used = before
  end subroutine condition

  !> From the largest unknown of A^T x = b, where the numbers of b have modulus 1 at angles that no symmetry shares: a
  !> column of A^-1 of n numbers of like size adds up to about sqrt(n) of them in x, and to n in the norm.
  subroutine condition_by_solution(norm, factors, pivot, x, rcond)
    real(dp), intent(in) :: norm
    complex(dp), contiguous, intent(in) :: factors(:, :)
    integer(blas_ip), contiguous, intent(in) :: pivot(:)
    complex(dp), contiguous, intent(out) :: x(:)
    real(dp), intent(out) :: rcond
    real(dp), parameter :: angle = 2.39996322972865332_dp      ! the golden angle
    complex(dp), parameter :: turn = cmplx(cos(angle), sin(angle), dp)
    integer(blas_ip) :: n, ignored
    integer :: i

    n = size(x, kind=blas_ip)
    x(1) = turn
    do i = 2, size(x)
      x(i) = turn*x(i - 1)
    end do
    call zgetrs('T', n, 1_blas_ip, factors, n, pivot, x, n, ignored, one_char)
    rcond = 0.0_dp
    if (.not. sum(abs(real(x, dp)) + abs(aimag(x))) <= huge(1.0_dp)) return
    rcond = min(1.0_dp, (1.0_dp/norm)/(sqrt(real(n, dp))*maxval(abs(real(x, dp)) + abs(aimag(x)))))
  end subroutine condition_by_solution

  !> What `condition` works in for a matrix of order n; null where it does not need it.
  subroutine take_for_condition(n, space, inverse, work, real_work)
    integer, intent(in) :: n
    type(line_space), target, intent(inout) :: space
    complex(dp), pointer, contiguous, intent(out) :: inverse(:, :), work(:, :)
    real(dp), pointer, contiguous, intent(out) :: real_work(:)

    nullify (inverse, real_work)
    if (n <= exact_condition) then
      call space%take(n, n, inverse)
      call space%take(n, min(n, inverse_block), work)
    else
      call space%take(n, 2, work)
      call space%take_reals(2*n, real_work)
    end if
  end subroutine take_for_condition

  !> A becomes its inverse, with zgetrf and zgetri.
  subroutine invert_line(a, space, info, rcond)
    complex(dp), contiguous, intent(inout) :: a(:, :)
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: work(:, :)
    integer(blas_ip), pointer, contiguous :: pivot(:)
    real(dp) :: norm, factor
    integer(blas_ip) :: n, code
    integer(long) :: before

    n = size(a, 1, kind=blas_ip)
    rcond = 1.0_dp
    info = line_good
    if (n == 0) return
    call space%take_pivots(int(n), pivot)
    call bring_near_one(a, norm, factor)
    call zgetrf(n, n, a, n, pivot, code)
    info = int(code, ip)
    if (info /= line_good) return
    before = space%used
    call space%take(int(n), min(int(n), inverse_block), work)
    call zgetri(n, a, n, pivot, work, size(work, kind=blas_ip), code)
    space%used = before
    info = int(code, ip)
    if (info /= line_good) return
    if (.not. all_finite(a)) then
      info = line_overflow
    else
      rcond = min(1.0_dp, (1.0_dp/norm)/one_norm(a))
      call multiply_by(factor, a)                  ! A^-1 = factor (factor A)^-1
      if (factor > 1.0_dp) then
        if (.not. all_finite(a)) info = line_overflow
      end if
    end if
  end subroutine invert_line

  !> Scale a matrix whose norm is large down and one whose norm is small up, to a modest one.
  !> norm     of the scaled matrix
  !> factor   by which it was multiplied, a power of two; 1 where the norm is neither large nor small
  pure subroutine bring_near_one(a, norm, factor)
    complex(dp), contiguous, intent(inout) :: a(:, :)
    real(dp), intent(out) :: norm, factor

    factor = 1.0_dp
    norm = one_norm(a)
    if ((norm >= small .and. norm <= large) .or. norm <= 0) return
    ! Never denormal, which a processor may take for zero.
    factor = scale(1.0_dp, -max(-1000, min(exponent(max(maxval(abs(real(a, dp))), maxval(abs(aimag(a))))), 1000)))
    call multiply_by(factor, a)
    norm = one_norm(a)
  end subroutine bring_near_one

  !> A becomes factor A, each part by itself: no product of it overflows but with a factor beyond 1.
  pure subroutine multiply_by(factor, a)
    real(dp), intent(in) :: factor
    complex(dp), contiguous, intent(inout) :: a(:, :)

    if (factor < 1.0_dp .or. factor > 1.0_dp) a = cmplx(factor*real(a, dp), factor*aimag(a), dp)
  end subroutine multiply_by

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

  !> C = kept C + factor A B for blocks of larger matrices, with zgemm. What is kept 0 times need not be set.
  !> m, n, k             A is m by k, B is k by n
  !> ld_a, ld_b, ld_c    leading dimensions
  !> b_transposed        whether B lies there as its transpose; not by default
  subroutine product_block(m, n, k, factor, a, ld_a, b, ld_b, kept, c, ld_c, b_transposed)
    integer, intent(in) :: m, n, k, ld_a, ld_b, ld_c
    real(dp), intent(in) :: factor, kept
    complex(dp), intent(in) :: a(ld_a, *), b(ld_b, *)
    complex(dp), intent(inout) :: c(ld_c, *)
    logical, intent(in), optional :: b_transposed
    character :: trans_b

    if (min(m, n) == 0) return
    trans_b = 'N'
    if (present(b_transposed)) trans_b = merge('T', 'N', b_transposed)
    call zgemm('N', trans_b, int(m, blas_ip), int(n, blas_ip), int(k, blas_ip), factor*one, a, int(ld_a, blas_ip), b, &
               int(ld_b, blas_ip), kept*one, c, int(ld_c, blas_ip), one_char, one_char)
  end subroutine product_block

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
