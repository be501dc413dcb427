!> Between the caller's array and the matrix of one line: storage order (TRANS), and whether the line is finite.
!>
!> Inside the kernel every line is a matrix m(out, in), whatever the caller's order is, so that the physics reads as the
!> equations do. Copying one line costs n**2 against n**3 for its algebra. Copies go through dummy arguments, which the
!> compiler knows not to overlap: between pointers it would allocate a temporary in every line.
module jointfrf_line_layout
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use jointfrf_kinds, only: dp
  implicit none
  private
  public :: load, load_real, store, store_nan, subtract, take_block, all_finite

contains

  !> m = a, or its transpose where the caller stores (in, out).
  pure subroutine load(transposed, a, m)
    logical, intent(in) :: transposed
    complex(dp), contiguous, intent(in) :: a(:, :)
    complex(dp), contiguous, intent(out) :: m(:, :)

    if (transposed) then
      m = transpose(a)
    else
      m = a
    end if
  end subroutine load

  !> The same from real numbers.
  pure subroutine load_real(transposed, a, m)
    logical, intent(in) :: transposed
    real(dp), contiguous, intent(in) :: a(:, :)
    complex(dp), contiguous, intent(out) :: m(:, :)

    if (transposed) then
      m = transpose(a)
    else
      m = a
    end if
  end subroutine load_real

  !> a = m, or its transpose where the caller stores (in, out).
  pure subroutine store(transposed, m, a)
    logical, intent(in) :: transposed
    complex(dp), contiguous, intent(in) :: m(:, :)
    complex(dp), contiguous, intent(out) :: a(:, :)

    call load(transposed, m, a)
  end subroutine store

  !> c = a - b
  pure subroutine subtract(a, b, c)
    complex(dp), contiguous, intent(in) :: a(:, :), b(:, :)
    complex(dp), contiguous, intent(out) :: c(:, :)

    c = a - b
  end subroutine subtract

  !> m = factor times the block of a that begins after `row` rows and `column` columns, or its transpose.
  pure subroutine take_block(transposed, factor, a, row, column, m)
    logical, intent(in) :: transposed
    real(dp), intent(in) :: factor
    complex(dp), contiguous, intent(in) :: a(:, :)
    integer, intent(in) :: row, column
    complex(dp), contiguous, intent(out) :: m(:, :)

    if (transposed) then
      m = factor*transpose(a(row + 1:row + size(m, 2), column + 1:column + size(m, 1)))
    else
      m = factor*a(row + 1:row + size(m, 1), column + 1:column + size(m, 2))
    end if
  end subroutine take_block

  !> Fill the result of a bad line with NaN.
  subroutine store_nan(a)
    complex(dp), contiguous, intent(out) :: a(:, :)
    real(dp) :: nan

    nan = ieee_value(nan, ieee_quiet_nan)
    a = cmplx(nan, nan, dp)
  end subroutine store_nan

  !> Whether no entry is NaN or Inf. The sum of all moduli is finite then, unless it overflows itself: only where it is
  !> not does each entry count.
  pure function all_finite(a) result(finite)
    complex(dp), contiguous, intent(in) :: a(:, :)
    logical :: finite
    real(dp) :: total
    integer :: i, j

    total = 0
    do j = 1, size(a, 2)
      !$omp simd reduction(+:total)
      do i = 1, size(a, 1)
        total = total + (abs(real(a(i, j), dp)) + abs(aimag(a(i, j))))
      end do
    end do
    finite = total <= huge(1.0_dp)
    if (.not. finite) finite = all(abs(real(a, dp)) <= huge(1.0_dp) .and. abs(aimag(a)) <= huge(1.0_dp))
  end function all_finite
end module jointfrf_line_layout
