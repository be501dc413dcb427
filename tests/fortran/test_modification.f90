!> A locally modified structure against the inverse of its dynamic stiffness, and the modification found again.
program test_modification
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, infinity, ip, not_a_number, qp, &
    quad_inverse, random_lines, random_regular, seed, set_threads, transposed
  use jointfrf_linear_algebra, only: invert
  use jointfrf_modification, only: find_modification, modify
  implicit none
  real(dp), parameter :: tolerance = 1.0e-12_dp

  call seed(6)
  call against_reference(6, [4_ip, 1_ip, 6_ip])
  call against_reference(3, [2_ip, 3_ip, 1_ip])
  call against_reference(1, [1_ip])
  call nothing()
  call singular_modification()
  call weak_modification()
  call bad_lines()
  call scales()
  call threads()
  call finish('modification')

contains

  !> (alpha^-1 + D)^-1 in quadruple precision.
  function reference(alpha, d, dofs) result(gamma)
    complex(dp), intent(in) :: alpha(:, :, :), d(:, :, :)
    integer(ip), intent(in) :: dofs(:)
    complex(dp) :: gamma(size(alpha, 1), size(alpha, 1), size(alpha, 3))
    complex(qp) :: z(size(alpha, 1), size(alpha, 1))
    integer :: i

    do i = 1, size(alpha, 3)
      z = quad_inverse(cmplx(alpha(:, :, i), kind=qp))
      z(dofs, dofs) = z(dofs, dofs) + cmplx(d(:, :, i), kind=qp)
      gamma(:, :, i) = cmplx(quad_inverse(z), kind=dp)
    end do
  end function reference

  subroutine against_reference(n, dofs)
    integer, intent(in) :: n
    integer(ip), intent(in) :: dofs(:)
    integer, parameter :: lines = 4
    complex(dp) :: alpha(n, n, lines), d(size(dofs), size(dofs), lines), gamma(n, n, lines), gamma_t(n, n, lines)
    complex(dp) :: found(n, n, lines), found_t(n, n, lines), expected(n, n, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)

    alpha = random_regular(n, lines)
    d = random_lines(size(dofs), size(dofs), lines)
    call modify(.false., alpha, d, dofs, gamma, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'modify: good')
    call check_close(gamma, reference(alpha, d, dofs), tolerance, 'modify')
    call modify(.true., transposed(alpha), transposed(d), dofs, gamma_t, line_info, rcond_t, info)
    call check_same(transposed(gamma_t), gamma, 'modify, transposed')
    call check_same(rcond_t, rcond, 'modify: rcond knows no order of storage')

    expected = 0
    expected(dofs, dofs, :) = d
    call find_modification(.false., alpha, gamma, found, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'find: good')
    call check_close(found, expected, 1.0e-11_dp, 'find returns what modify did')
    call find_modification(.true., transposed(alpha), transposed(gamma), found_t, line_info, rcond, info)
    call check_close(transposed(found_t), found, 1.0e-12_dp, 'find, transposed')
  end subroutine against_reference

  subroutine nothing()
    integer(ip), parameter :: no_dofs(0) = [integer(ip) ::]
    complex(dp) :: alpha(2, 2, 2), no_d(0, 0, 2), gamma(2, 2, 2), empty(0, 0, 2), empty_d(0, 0, 2), no_line(2, 2, 0)
    complex(dp) :: no_line_d(2, 2, 0), no_gamma(2, 2, 0)
    integer(ip) :: line_info(2), info
    real(dp) :: rcond(2)

    alpha = random_regular(2, 2)
    call modify(.false., alpha, no_d, no_dofs, gamma, line_info, rcond, info)
    call check(info == 0 .and. all(rcond >= 1.0_dp), 'modify: no modified DOFs')
    call check_same(gamma, alpha, 'no modified DOFs change nothing')
    call modify(.false., empty, no_d, no_dofs, empty_d, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'modify: no DOFs')
    call modify(.false., no_line, no_line_d, [2_ip, 1_ip], no_gamma, line_info(:0), rcond(:0), info)
    call check(info == 0, 'modify: no lines')
    call find_modification(.false., empty, no_d, empty_d, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'find: no DOFs')
    call find_modification(.false., no_line, no_line_d, no_gamma, line_info(:0), rcond(:0), info)
    call check(info == 0, 'find: no lines')
  end subroutine nothing

  !> A spring between two DOFs has a singular D.
  subroutine singular_modification()
    complex(dp) :: alpha(4, 4, 2), d(2, 2, 2), gamma(4, 4, 2)
    integer(ip), parameter :: dofs(2) = [3_ip, 1_ip]
    integer(ip) :: line_info(2), info
    real(dp) :: rcond(2)

    alpha = random_regular(4, 2)
    d(:, :, 1) = reshape([1, -1, -1, 1], [2, 2])*cmplx(2.0_dp, 0.3_dp, dp)
    d(:, :, 2) = 0
    call modify(.false., alpha, d, dofs, gamma, line_info, rcond, info)
    call check(info == 0, 'singular D is good')
    call check_close(gamma, reference(alpha, d, dofs), tolerance, 'singular D')
    call check_same(gamma(:, :, 2:2), alpha(:, :, 2:2), 'D = 0 changes nothing')
  end subroutine singular_modification

  !> D a millionth of Z: the product form keeps its digits, the difference gamma^-1 - alpha^-1 loses six of them.
  subroutine weak_modification()
    integer, parameter :: n = 4
    integer(ip), parameter :: dofs(n) = [1_ip, 2_ip, 3_ip, 4_ip]
    complex(dp) :: alpha(n, n, 1), d(n, n, 1), gamma(n, n, 1), exact(n, n, 1), found(n, n, 1)
    complex(dp) :: alpha_inverse(n, n, 1), gamma_inverse(n, n, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1), difference_error

    alpha = random_regular(n, 1)
    d = 1.0e-6_dp*random_lines(n, n, 1)
    gamma = reference(alpha, d, dofs)
    exact(:, :, 1) = cmplx(quad_inverse(cmplx(gamma(:, :, 1), kind=qp)) - quad_inverse(cmplx(alpha(:, :, 1), &
      kind=qp)), kind=dp)
    call find_modification(.false., alpha, gamma, found, line_info, rcond, info)
    call check_close(found, exact, 1.0e-13_dp, 'weak modification')
    call invert(alpha, alpha_inverse, line_info, rcond, info)
    call invert(gamma, gamma_inverse, line_info, rcond, info)
    difference_error = maxval(abs(gamma_inverse - alpha_inverse - exact))/maxval(abs(exact))
    call check(difference_error > 1.0e-11_dp, 'the difference form cancels here, else this test shows nothing')
  end subroutine weak_modification

  subroutine bad_lines()
    complex(dp) :: alpha(2, 2, 4), d(1, 1, 4), good(2, 2, 4), gamma(2, 2, 4), a(2, 2, 4), b(2, 2, 4), g(2, 2, 4)
    complex(dp) :: good_d(2, 2, 4), found(2, 2, 4)
    integer(ip), parameter :: dofs(1) = [2_ip]
    integer(ip) :: line_info(4), info
    real(dp) :: rcond(4)

    alpha = random_regular(2, 4)
    d = 1
    call modify(.false., alpha, d, dofs, good, line_info, rcond, info)
    a = alpha
    a(2, 2, 3) = -1
    call modify(.false., a, d, dofs, gamma, line_info, rcond, info)
    call check_bad_line(gamma, good, 3, 1_ip, line_info, rcond, info, 'modify: I + D H singular')
    a(2, 2, 3) = alpha(2, 2, 3)
    a(1, 1, 3) = not_a_number()
    call modify(.false., a, d, dofs, gamma, line_info, rcond, info)
    call check_bad_line(gamma, good, 3, -1_ip, line_info, rcond, info, 'modify: NaN in alpha')
    d(1, 1, 3) = cmplx(0.0_dp, infinity(), dp)
    call modify(.false., alpha, d, dofs, gamma, line_info, rcond, info)
    call check_bad_line(gamma, good, 3, -1_ip, line_info, rcond, info, 'modify: Inf in D')
    d = 1
    a = alpha
    a(:, :, 3) = reshape([0, 1, 1, 0], [2, 2])*1.0e200_dp
    call modify(.false., a, d, dofs, gamma, line_info, rcond, info)
    call check_bad_line(gamma, good, 3, -2_ip, line_info, rcond, info, 'modify: overflow')

    g = random_regular(2, 4)
    call find_modification(.false., alpha, g, good_d, line_info, rcond, info)
    a = alpha
    a(:, :, 2) = reshape([1, 2, 2, 4], [2, 2])
    call find_modification(.false., a, g, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, 2_ip, line_info, rcond, info, 'find: alpha singular')
    b = g
    b(:, :, 2) = 0
    call find_modification(.false., alpha, b, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, 1_ip, line_info, rcond, info, 'find: gamma singular')
    b = g
    b(1, 2, 2) = infinity()
    call find_modification(.false., alpha, b, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, -1_ip, line_info, rcond, info, 'find: Inf in gamma')
    a = alpha
    a(2, 1, 2) = not_a_number()
    call find_modification(.false., a, g, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, -1_ip, line_info, rcond, info, 'find: NaN in alpha')
    a = alpha
    a(:, :, 2) = reshape([1, 0, 0, 1], [2, 2])*1.0e-310_dp
    call find_modification(.false., a, g, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, -2_ip, line_info, rcond, info, 'find: alpha^-1 overflows')
    b = g
    b(:, :, 2) = reshape([1, 0, 0, 1], [2, 2])*1.0e-310_dp
    call find_modification(.false., alpha, b, found, line_info, rcond, info)
    call check_bad_line(found, good_d, 2, -2_ip, line_info, rcond, info, 'find: gamma^-1 overflows')

    a(:, :, 2) = reshape([1, 0, 0, 0], [2, 2])
    a(2, 2, 2) = 1.0e-9_dp
    call find_modification(.false., a, g, found, line_info, rcond, info)
    call check(info == 0, 'find: nearly singular alpha is good')
    call check_close(rcond(2), 1.0e-9_dp, 1.0e-10_dp, 'find: rcond of nearly singular alpha')
    call find_modification(.false., g, a, found, line_info, rcond, info)
    call check_close(rcond(2), 1.0e-9_dp, 1.0e-10_dp, 'find: rcond of nearly singular gamma')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: alpha(4, 4, 1), d(2, 2, 1), one(4, 4, 1), gamma(4, 4, 1), one_d(4, 4, 1), found(4, 4, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)
    integer :: i

    alpha = random_regular(4, 1)
    d = random_lines(2, 2, 1)
    call modify(.false., alpha, d, [3_ip, 2_ip], one, line_info, rcond, info)
    call find_modification(.false., alpha, one, one_d, line_info, rcond, info)
    do i = 1, 2
      call modify(.false., factors(i)*alpha, d/factors(i), [3_ip, 2_ip], gamma, line_info, rcond, info)
      call check_close(gamma/factors(i), one, tolerance, 'modify: scaled')
      call find_modification(.false., factors(i)*alpha, factors(i)*one, found, line_info, rcond, info)
      call check_close(factors(i)*found, one_d, tolerance, 'find: scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 500
    complex(dp) :: alpha(4, 4, lines), d(2, 2, lines), gamma(4, 4, lines, 2), found(4, 4, lines, 2)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines, 2)
    integer :: t

    alpha = random_regular(4, lines)
    d = random_lines(2, 2, lines)
    do t = 1, 2
      call set_threads(t)
      call modify(.false., alpha, d, [3_ip, 2_ip], gamma(:, :, :, t), line_info, rcond(:, t), info)
      call find_modification(.false., alpha, gamma(:, :, :, t), found(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(gamma(:, :, :, 1), gamma(:, :, :, 2), 'modify: one thread and two')
    call check_same(found(:, :, :, 1), found(:, :, :, 2), 'find: one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads

end program test_modification
