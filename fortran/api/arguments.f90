!> What the flat API checks before anything is done, and how it sees the caller's memory.
module jointfrf_arguments
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_double_complex
  use jointfrf_decoupling, only: is_equation
  use jointfrf_kinds, only: ip, long
  use jointfrf_status, only: text_length
  implicit none
  private
  public :: unknown_order, is_transposed, bad_size, out_of_range, repeated, not_finite, bad_offsets
  public :: lower, unknown_equation, names, as_lines, as_matrix, spread_text

contains

  !> Whether TRANS is none of N, T.
  pure function unknown_order(trans) result(unknown)
    character(kind=c_char), intent(in) :: trans
    logical :: unknown

    unknown = scan(trans, 'NnTt') == 0
  end function unknown_order

  !> Whether TRANS says h(in, out, freq).
  pure function is_transposed(trans) result(transposed)
    character(kind=c_char), intent(in) :: trans
    logical :: transposed

    transposed = trans == 'T' .or. trans == 't'
  end function is_transposed

  !> Whether a size is negative, or no default integer although the caller's integers are longer.
  pure function bad_size(n) result(bad)
    integer(ip), intent(in) :: n
    logical :: bad

    bad = n < 0 .or. n > huge(0)
  end function bad_size

  !> Whether a DOF lies outside 1..n.
  pure function out_of_range(dofs, n) result(bad)
    integer(ip), intent(in) :: dofs(:), n
    logical :: bad

    bad = any(dofs < 1 .or. dofs > n)
  end function out_of_range

  !> Whether a DOF is named twice.
  pure function repeated(dofs) result(bad)
    integer(ip), intent(in) :: dofs(:)
    logical :: bad
    integer :: i

    bad = .false.
    do i = 2, size(dofs)
      bad = bad .or. any(dofs(:i - 1) == dofs(i))
    end do
  end function repeated

  !> Whether a number is NaN or Inf.
  pure function not_finite(value) result(bad)
    real(c_double), intent(in) :: value
    logical :: bad

    bad = .not. abs(value) <= huge(value)
  end function not_finite

  !> Whether an offset is not finite or two are equal.
  pure function bad_offsets(offset) result(bad)
    real(c_double), intent(in) :: offset(:)
    logical :: bad
    integer :: i

    bad = .false.
    do i = 1, size(offset)
      bad = bad .or. not_finite(offset(i)) .or. any(.not. abs(offset(:i - 1) - offset(i)) > 0.0_c_double)
    end do
  end function bad_offsets

  !> The two letters of an equation in lower case.
  pure function lower(equation) result(letters)
    character(kind=c_char), intent(in) :: equation(2)
    character(len=2) :: letters
    integer :: i

    do i = 1, 2
      letters(i:i) = equation(i)
      if (equation(i) == 'R') letters(i:i) = 'r'
      if (equation(i) == 'S') letters(i:i) = 's'
    end do
  end function lower

  !> Whether the letters name none of the four equations.
  pure function unknown_equation(equation) result(unknown)
    character(kind=c_char), intent(in) :: equation(2)
    logical :: unknown

    unknown = .not. is_equation(lower(equation))
  end function unknown_equation

  !> Whether an equation uses point 'r' or 's'.
  pure function names(equation, point) result(named)
    character(kind=c_char), intent(in) :: equation(2)
    character, intent(in) :: point
    logical :: named

    named = scan(lower(equation), point) > 0
  end function names

  !> The caller's memory as lines of (n, m), or (m, n) where transposed.
  subroutine as_lines(trans, n, m, n_freq, memory, lines)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, m, n_freq
    complex(c_double_complex), target, intent(in) :: memory(*)
    complex(c_double_complex), pointer, contiguous, intent(out) :: lines(:, :, :)
    integer(long) :: total

    total = int(n, long)*m*n_freq
    if (is_transposed(trans)) then
      lines(1:m, 1:n, 1:n_freq) => memory(1:total)
    else
      lines(1:n, 1:m, 1:n_freq) => memory(1:total)
    end if
  end subroutine as_lines

  !> The caller's memory as a real matrix (n, m), or (m, n) where transposed.
  subroutine as_matrix(trans, n, m, memory, matrix)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, m
    real(c_double), target, intent(in) :: memory(*)
    real(c_double), pointer, contiguous, intent(out) :: matrix(:, :)
    integer(long) :: total

    total = int(n, long)*m
    if (is_transposed(trans)) then
      matrix(1:m, 1:n) => memory(1:total)
    else
      matrix(1:n, 1:m) => memory(1:total)
    end if
  end subroutine as_matrix

  !> A text as single characters, padded with blanks.
  pure subroutine spread_text(line, text)
    character(len=text_length), intent(in) :: line
    character(kind=c_char), intent(out) :: text(:)
    integer :: i

    do i = 1, size(text)
      text(i) = ' '
      if (i <= text_length) text(i) = line(i:i)
    end do
  end subroutine spread_text
end module jointfrf_arguments
