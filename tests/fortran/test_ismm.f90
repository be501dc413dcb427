!> ISMM and its short form return the joint that an assembly was made with.
program test_ismm
  use testing, only: assembled, check, check_bad_line, check_close, check_same, dp, finish, infinity, inverse, ip, &
    not_a_number, random_lines, random_regular, seed, set_threads, thesis_chain, transposed, two_pi
  use jointfrf_engine, only: engine_lapack, get_engine, set_engine
  use jointfrf_ismm, only: inverse_substructuring, ismm
  implicit none
  real(dp), parameter :: tolerance = 1.0e-10_dp

  call seed(8)
  call chain()
  call random_joint(1)
  call random_joint(2)
  call random_joint(4)
  call other_alpha()
  call weak_change()
  call nothing()
  call bad_lines()
  call scales()
  call threads()
  call finish('ismm')

contains

  subroutine chain()
    integer, parameter :: lines = 20
    real(dp) :: freq_hz(lines), rcond(lines)
    complex(dp) :: h_a(2, 2, lines), h_b(2, 2, lines), alpha(4, 4, lines), gamma(4, 4, lines)
    complex(dp) :: exact(1, 1, lines), first(1, 1, lines), k(1, 1, lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    freq_hz = [(0.5_dp*i, i=1, lines)]
    exact(1, 1, :) = cmplx(2000.0_dp, two_pi*freq_hz*3.0_dp, dp)
    first(1, 1, :) = cmplx(1000.0_dp, two_pi*freq_hz*1.5_dp, dp)
    call thesis_chain(freq_hz, exact(1, 1, :), h_a, h_b, gamma)
    call thesis_chain(freq_hz, first(1, 1, :), h_a, h_b, alpha)
    call ismm(.false., alpha(2:3, 2:3, :), gamma(2:3, 2:3, :), first, k, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'chain: good')
    call check_close(k, exact, tolerance, 'chain')
    call inverse_substructuring(.false., gamma(2:3, 2:3, :), k, line_info, rcond, info)
    call check_close(k, exact, tolerance, 'chain, short form')
  end subroutine chain

  !> Receptances at the joint, DOFs j, then k, of random substructures with a further DOF each.
  function at_joint(h_a, h_b, k) result(h)
    complex(dp), intent(in) :: h_a(:, :, :), h_b(:, :, :), k(:, :, :)
    complex(dp) :: h(2*size(k, 1), 2*size(k, 1), size(k, 3))
    complex(dp) :: h_c(size(h_a, 1) + size(h_b, 1), size(h_a, 1) + size(h_b, 1), size(k, 3))
    integer :: dofs(2*size(k, 1)), m

    dofs = [(m + 1, m=1, size(k, 1)), (size(h_a, 1) + m, m=1, size(k, 1))]
    h_c = assembled(h_a, h_b, k, int(dofs(:size(k, 1)), ip), int(dofs(size(k, 1) + 1:) - size(h_a, 1), ip))
    h = h_c(dofs, dofs, :)
  end function at_joint

  subroutine random_joint(n)
    integer, intent(in) :: n
    integer, parameter :: lines = 4
    complex(dp) :: h_a(n + 1, n + 1, lines), h_b(n + 1, n + 1, lines), exact(n, n, lines), first(n, n, lines)
    complex(dp) :: alpha(2*n, 2*n, lines), gamma(2*n, 2*n, lines), k(n, n, lines), k_t(n, n, lines), short(n, n, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_short(lines)

    h_a = random_regular(n + 1, lines)
    h_b = random_regular(n + 1, lines)
    exact = random_lines(n, n, lines)
    first = random_lines(n, n, lines)
    alpha = at_joint(h_a, h_b, first)
    gamma = at_joint(h_a, h_b, exact)

    call ismm(.false., alpha, gamma, first, k, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'good')
    call check_close(k, exact, tolerance, 'K* returns')
    call inverse_substructuring(.false., gamma, short, line_info, rcond_short, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond_short > 0.0_dp), 'short form: good')
    call check_close(short, exact, tolerance, 'K* returns, short form')
    call check_close(short, k, tolerance, 'both forms agree')
    call ismm(.true., transposed(alpha), transposed(gamma), transposed(first), k_t, line_info, rcond, info)
    call check_close(transposed(k_t), k, 1.0e-12_dp, 'transposed')
    call inverse_substructuring(.true., transposed(gamma), k_t, line_info, rcond, info)
    call check_same(transposed(k_t), short, 'short form, transposed')
    call check_same(rcond, rcond_short, 'short form: rcond knows no order of storage')
  end subroutine random_joint

  !> With an alpha that was not assembled through K0, K* = K0 - (gamma^-1 - alpha^-1)_jk still holds; the short form
  !> differs.
  subroutine other_alpha()
    integer, parameter :: n = 2, lines = 3
    complex(dp) :: alpha(2*n, 2*n, lines), gamma(2*n, 2*n, lines), first(n, n, lines), k(n, n, lines), short(n, n, &
      lines)
    complex(dp) :: d(2*n, 2*n, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines)

    alpha = random_regular(2*n, lines)
    gamma = random_regular(2*n, lines)
    first = random_lines(n, n, lines)
    d = inverse(gamma) - inverse(alpha)
    call ismm(.false., alpha, gamma, first, k, line_info, rcond, info)
    call check_close(k, first - d(:n, n + 1:, :), tolerance, 'any alpha')
    call inverse_substructuring(.false., gamma, short, line_info, rcond, info)
    call check(minval(maxval(maxval(abs(k - short), 1), 1)) > 1.0e-2_dp, 'any alpha: the short form differs')
  end subroutine other_alpha

  !> Delta a hundred-millionth of the dynamic stiffness still comes out to ten digits.
  subroutine weak_change()
    integer, parameter :: n = 2
    complex(dp) :: h_a(n + 1, n + 1, 1), h_b(n + 1, n + 1, 1), alpha(2*n, 2*n, 1), gamma(2*n, 2*n, 1), first(n, n, 1)
    complex(dp) :: zero(n, n, 1), delta(n, n, 1), found(n, n, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)

    h_a = random_regular(n + 1, 1)
    h_b = random_regular(n + 1, 1)
    first = random_lines(n, n, 1)
    delta = random_lines(n, n, 1)
    zero = 0
    alpha = at_joint(h_a, h_b, first)
    gamma = at_joint(h_a, h_b, first + 1.0e-8_dp*delta)
    call ismm(.false., alpha, gamma, zero, found, line_info, rcond, info)
    ! gamma is rounded to double precision, which alone costs 1e-16/1e-8
    call check_close(found, 1.0e-8_dp*delta, 2.0e-7_dp, 'weak change')
    gamma = alpha
    call ismm(.false., alpha, gamma, zero, found, line_info, rcond, info)
    call check(.not. maxval(abs(found)) > 0.0_dp, 'no change gives exactly none')
  end subroutine weak_change

  subroutine nothing()
    complex(dp) :: empty(0, 0, 2), no_line(2, 2, 0), no_k(1, 1, 0), none(0, 0, 2), no_k_out(1, 1, 0)
    integer(ip) :: line_info(2), info
    real(dp) :: rcond(2)

    call ismm(.false., empty, empty, empty, none, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'no DOFs')
    call ismm(.false., no_line, no_line, no_k, no_k_out, line_info(:0), rcond(:0), info)
    call check(info == 0, 'no lines')
    call inverse_substructuring(.false., empty, none, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'short form: no DOFs')
    call inverse_substructuring(.false., no_line, no_k, line_info(:0), rcond(:0), info)
    call check(info == 0, 'short form: no lines')
  end subroutine nothing

  subroutine bad_lines()
    real(dp), parameter :: singular(2, 2) = reshape([1, 2, 2, 4], [2, 2]), unit(2, 2) = reshape([1, 0, 0, 1], [2, 2])
    complex(dp) :: alpha(2, 2, 4), gamma(2, 2, 4), first(1, 1, 4), good(1, 1, 4), good_short(1, 1, 4), k(1, 1, 4)
    complex(dp) :: bad(2, 2, 4), large(1, 1, 4)
    integer(ip) :: line_info(4), info, engine
    real(dp) :: rcond(4)

    alpha = random_regular(2, 4)
    gamma = random_regular(2, 4)
    first = random_lines(1, 1, 4)
    call ismm(.false., alpha, gamma, first, good, line_info, rcond, info)
    call inverse_substructuring(.false., gamma, good_short, line_info, rcond, info)

    bad = alpha
    bad(:, :, 2) = singular
    call ismm(.false., bad, gamma, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 2, 2_ip, line_info, rcond, info, 'alpha singular')
    bad(:, :, 2) = not_a_number()
    call ismm(.false., bad, gamma, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 2, -1_ip, line_info, rcond, info, 'NaN in alpha')
    bad(:, :, 2) = 1.0e-310_dp*unit
    call ismm(.false., bad, gamma, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 2, -2_ip, line_info, rcond, info, 'alpha^-1 overflows')

    bad = gamma
    bad(:, :, 3) = singular
    call ismm(.false., alpha, bad, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 3, 2_ip, line_info, rcond, info, 'gamma singular')
    call inverse_substructuring(.false., bad, k, line_info, rcond, info)
    call check_bad_line(k, good_short, 3, 2_ip, line_info, rcond, info, 'short form: gamma singular')
    bad(:, :, 3) = gamma(:, :, 3)
    bad(2, 1, 3) = infinity()
    call ismm(.false., alpha, bad, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 3, -1_ip, line_info, rcond, info, 'Inf in gamma')
    call inverse_substructuring(.false., bad, k, line_info, rcond, info)
    call check_bad_line(k, good_short, 3, -1_ip, line_info, rcond, info, 'short form: Inf in gamma')
    bad(:, :, 3) = 1.0e-310_dp*unit
    call inverse_substructuring(.false., bad, k, line_info, rcond, info)
    call check_bad_line(k, good_short, 3, -2_ip, line_info, rcond, info, 'short form: overflow')

    bad = alpha
    bad(:, :, 4) = 1.0e-308_dp*reshape([0, 1, 1, 0], [2, 2])
    large = first
    large(1, 1, 4) = 1.7e308_dp
    call ismm(.false., bad, gamma, large, k, line_info, rcond, info)
    call check_bad_line(k, good, 4, -2_ip, line_info, rcond, info, 'K0 - D_jk overflows')

    bad = gamma
    bad(:, :, 1) = unit
    bad(2, 2, 1) = 1.0e-8_dp
    call ismm(.false., alpha, bad, first, k, line_info, rcond, info)
    call check(info == 0, 'nearly singular gamma is good')
    call check(abs(log(rcond(1)/1.0e-8_dp)) < log(3.0_dp), 'rcond of nearly singular gamma')      ! an estimate
    call ismm(.false., bad, gamma, first, k, line_info, rcond, info)
    call check(abs(log(rcond(1)/1.0e-8_dp)) < log(3.0_dp), 'rcond of nearly singular alpha')      ! an estimate
    call inverse_substructuring(.false., bad, k, line_info, rcond, info)
    call check(abs(log(rcond(1)/1.0e-8_dp)) < log(3.0_dp), &
      'short form: rcond of nearly singular gamma')      ! an estimate

    call get_engine(engine, info)
    call set_engine(engine_lapack, info)                       ! the reference engine knows it exactly
    call ismm(.false., alpha, bad, first, k, line_info, rcond, info)
    call check_close(rcond(1), 1.0e-8_dp, 1.0e-10_dp, 'reference: rcond of nearly singular gamma')
    call ismm(.false., bad, gamma, first, k, line_info, rcond, info)
    call check_close(rcond(1), 1.0e-8_dp, 1.0e-10_dp, 'reference: rcond of nearly singular alpha')
    call inverse_substructuring(.false., bad, k, line_info, rcond, info)
    call check_close(rcond(1), 1.0e-8_dp, 1.0e-10_dp, 'reference: short form: rcond of nearly singular gamma')
    call set_engine(engine, info)

    first(1, 1, 1) = cmplx(0.0_dp, not_a_number(), dp)
    call ismm(.false., alpha, gamma, first, k, line_info, rcond, info)
    call check_bad_line(k, good, 1, -1_ip, line_info, rcond, info, 'NaN in K0')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: alpha(4, 4, 1), gamma(4, 4, 1), first(2, 2, 1), one(2, 2, 1), one_short(2, 2, 1), k(2, 2, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)
    integer :: i

    alpha = random_regular(4, 1)
    gamma = random_regular(4, 1)
    first = random_lines(2, 2, 1)
    call ismm(.false., alpha, gamma, first, one, line_info, rcond, info)
    call inverse_substructuring(.false., gamma, one_short, line_info, rcond, info)
    do i = 1, 2
      call ismm(.false., factors(i)*alpha, factors(i)*gamma, first/factors(i), k, line_info, rcond, info)
      call check_close(factors(i)*k, one, 1.0e-12_dp, 'scaled')
      call inverse_substructuring(.false., factors(i)*gamma, k, line_info, rcond, info)
      call check_close(factors(i)*k, one_short, 1.0e-12_dp, 'short form: scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 500
    complex(dp) :: alpha(4, 4, lines), gamma(4, 4, lines), first(2, 2, lines), k(2, 2, lines, 2), short(2, 2, lines, 2)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines, 2)
    integer :: t

    alpha = random_regular(4, lines)
    gamma = random_regular(4, lines)
    first = random_lines(2, 2, lines)
    do t = 1, 2
      call set_threads(t)
      call ismm(.false., alpha, gamma, first, k(:, :, :, t), line_info, rcond(:, t), info)
      call inverse_substructuring(.false., gamma, short(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(k(:, :, :, 1), k(:, :, :, 2), 'one thread and two')
    call check_same(short(:, :, :, 1), short(:, :, :, 2), 'short form: one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads
end program test_ismm
