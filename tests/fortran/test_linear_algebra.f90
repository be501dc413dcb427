!> Inverse and solution of whole sweeps: both storage orders, bad lines, scaling, threads.
program test_linear_algebra
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, infinity, inverse, ip, norm_1, &
    not_a_number, random_lines, random_regular, seed, set_threads, transposed
  use jointfrf_linear_algebra, only: invert, solve
  implicit none
  real(dp), parameter :: tolerance = 1.0e-13_dp
  integer, parameter :: sizes(5) = [1, 2, 3, 6, 24]
  integer :: i

  call seed(3)
  do i = 1, size(sizes)
    call against_reference(sizes(i))
  end do
  call empty_sweeps()
  call bad_lines()
  call scales()
  call threads()
  call finish('linear_algebra')

contains

  subroutine against_reference(n)
    integer, intent(in) :: n
    integer, parameter :: lines = 4
    complex(dp) :: a(n, n, lines), b(n, 3, lines), expected(n, 3, lines), x(n, 3, lines), x_t(3, n, lines)
    complex(dp) :: reference(n, n, lines), a_inverse(n, n, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)
    integer :: i

    a = random_regular(n, lines)
    b = random_lines(n, 3, lines)
    reference = inverse(a)
    do i = 1, lines
      expected(:, :, i) = matmul(reference(:, :, i), b(:, :, i))
    end do

    call invert(a, a_inverse, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'invert: good')
    call check_close(a_inverse, reference, tolerance, 'invert')
    do i = 1, lines
      call check_close(rcond(i), 1.0_dp/(norm_1(a(:, :, i))*norm_1(reference(:, :, i))), 1.0e-10_dp, 'invert: rcond')
    end do

    call solve(.false., a, b, x, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'solve: good')
    call check_close(x, expected, tolerance, 'solve')
    call solve(.true., transposed(a), transposed(b), x_t, line_info, rcond_t, info)
    call check(info == 0, 'solve transposed: good')
    call check_same(transposed(x_t), x, 'solve transposed')
    call check_same(rcond_t, rcond, 'solve: rcond knows no order of storage')
  end subroutine against_reference

  subroutine empty_sweeps()
    complex(dp) :: a(2, 2, 0), b(2, 3, 0), none(0, 0, 2), empty(0, 3, 2), a_2(2, 2, 2), no_rhs(2, 0, 2)
    complex(dp) :: no_line(2, 2, 0), no_x(2, 3, 0), nothing(0, 0, 2), empty_x(0, 3, 2), x(2, 0, 2)
    integer(ip) :: line_info(2), info
    real(dp) :: rcond(2)

    call invert(a, no_line, line_info(:0), rcond(:0), info)
    call check(info == 0, 'invert: no lines')
    call solve(.false., a, b, no_x, line_info(:0), rcond(:0), info)
    call check(info == 0, 'solve: no lines')
    call invert(none, nothing, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'invert: order 0')
    call solve(.false., none, empty, empty_x, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'solve: order 0')
    a_2 = random_regular(2, 2)
    call solve(.false., a_2, no_rhs, x, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'solve: no right-hand side')
  end subroutine empty_sweeps

  !> Each kind of bad line in turn, as second of four lines.
  subroutine bad_lines()
    complex(dp) :: a(3, 3, 4), b(3, 2, 4), bad(3, 3, 4)
    character(len=*), parameter :: kinds(5) = [character(len=8) :: 'singular', 'NaN', 'Inf', '-Inf i', 'overflow']
    integer(ip), parameter :: codes(5) = [3_ip, -1_ip, -1_ip, -1_ip, -2_ip]
    complex(dp) :: good_inverse(3, 3, 4), good_x(3, 2, 4), a_inverse(3, 3, 4), x(3, 2, 4)
    integer(ip) :: line_info(4), info
    real(dp) :: rcond(4)
    integer :: k

    a = random_regular(3, 4)
    b = random_lines(3, 2, 4)
    call invert(a, good_inverse, line_info, rcond, info)
    call solve(.false., a, b, good_x, line_info, rcond, info)
    do k = 1, size(kinds)
      bad = a
      select case (k)
      case (1)
        bad(:, :, 2) = reshape([1, 0, 0, 0, 1, 0, 1, 1, 0], [3, 3])
      case (2)
        bad(3, 2, 2) = cmplx(not_a_number(), 1.0_dp, dp)
      case (3)
        bad(1, 1, 2) = infinity()
      case (4)
        bad(1, 3, 2) = cmplx(0.0_dp, -infinity(), dp)
      case (5)
        bad(:, :, 2) = 0
        bad(1, 1, 2) = 1.0e-310_dp
        bad(2, 2, 2) = 1
        bad(3, 3, 2) = 1
      end select
      call invert(bad, a_inverse, line_info, rcond, info)
      call check_bad_line(a_inverse, good_inverse, 2, codes(k), line_info, rcond, info, 'invert: '//kinds(k))
      call solve(.false., bad, b, x, line_info, rcond, info)
      call check_bad_line(x, good_x, 2, codes(k), line_info, rcond, info, 'solve: '//kinds(k))
    end do

    bad = a
    x = b
    x(2, 1, 3) = cmplx(0.0_dp, not_a_number(), dp)
    b = x
    call solve(.false., bad, b, x, line_info, rcond, info)
    call check_bad_line(x, good_x, 3, -1_ip, line_info, rcond, info, 'solve: NaN in the right-hand side')

    bad(:, :, :2) = not_a_number()
    call invert(bad, a_inverse, line_info, rcond, info)
    call check(info == 2 .and. all(line_info == [-1, -1, 0, 0]), 'two bad lines are counted')

    bad = 0
    bad(1, 1, :) = 1
    bad(2, 2, :) = (0.0_dp, 1.0_dp)
    bad(3, 3, :) = 1.0e-14_dp
    call invert(bad, a_inverse, line_info, rcond, info)
    call check(info == 0, 'nearly singular lines are good')
    call check_close(rcond(4), 1.0e-14_dp, 1.0e-10_dp, 'invert: rcond of a nearly singular line')
    call solve(.false., bad, good_x, x, line_info, rcond, info)
    call check_close(rcond(4), 1.0e-14_dp, 1.0e-10_dp, 'solve: rcond of a nearly singular line')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: a(4, 4, 1), b(4, 2, 1), one(4, 4, 1), one_x(4, 2, 1), a_inverse(4, 4, 1), x(4, 2, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1), one_rcond(1)
    integer :: k

    a = random_regular(4, 1)
    b = random_lines(4, 2, 1)
    call invert(a, one, line_info, one_rcond, info)
    call solve(.false., a, b, one_x, line_info, one_rcond, info)
    do k = 1, 2
      call invert(factors(k)*a, a_inverse, line_info, rcond, info)
      call check(info == 0, 'invert: scaled')
      call check_close(factors(k)*a_inverse, one, tolerance, 'invert: scaled')
      call solve(.false., factors(k)*a, b, x, line_info, rcond, info)
      call check_close(factors(k)*x, one_x, tolerance, 'solve: scaled')
      call check_close(rcond(1), one_rcond(1), tolerance, 'rcond knows no scale')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 600
    complex(dp) :: a(4, 4, lines), b(4, 2, lines), a_inverse(4, 4, lines, 2), x(4, 2, lines, 2)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines, 2)
    integer :: t

    a = random_regular(4, lines)
    a(:, :, 300) = 0
    b = random_lines(4, 2, lines)
    do t = 1, 2
      call set_threads(t)
      call invert(a, a_inverse(:, :, :, t), line_info, rcond(:, t), info)
      call check(info == 1 .and. line_info(300) == 1, 'the one singular line')
      call solve(.false., a, b, x(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(a_inverse(:, :, :, 1), a_inverse(:, :, :, 2), 'invert: one thread and two')
    call check_same(x(:, :, :, 1), x(:, :, :, 2), 'solve: one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads
end program test_linear_algebra
