!> Superposition of modes: a two-mass chain whose modes are known, and random shapes against a plain sum.
program test_modal
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, ip, not_a_number, qp, quad_inverse, &
    random_real, seed, set_threads, transposed
  use jointfrf_modal, only: receptance_modal
  implicit none
  real(dp), parameter :: tolerance = 1.0e-13_dp

  call seed(5)
  call two_masses()
  call against_sum()
  call reciprocal()
  call nothing()
  call bad_lines()
  call scales()
  call threads()
  call finish('modal')

contains

  !> Two unit masses, springs k to the ground and between them: modes (1, 1) and (1, -1), w_r^2 = k and 3 k.
  subroutine two_masses()
    real(dp), parameter :: k = 200.0_dp, eta = 0.02_dp, proportion = 1.0e-3_dp
    real(dp) :: omega(3), rcond(3), shapes(2, 2)
    complex(dp) :: h(2, 2, 3), expected(2, 2, 3)
    complex(qp) :: z(2, 2)
    real(qp) :: w
    integer(ip) :: line_info(3), info
    integer :: i

    omega = [3.0_dp, 14.0_dp, 40.0_dp]
    shapes = reshape([1, 1, 1, -1], [2, 2])/sqrt(2.0_dp)
    do i = 1, 3
      w = omega(i)
      z = reshape([2, -1, -1, 2], [2, 2])*k*cmplx(1.0_qp, eta + w*proportion, qp)
      z(1, 1) = z(1, 1) - w**2
      z(2, 2) = z(2, 2) - w**2
      expected(:, :, i) = cmplx(quad_inverse(z), kind=dp)
    end do
    call receptance_modal(.false., omega, [k, 3*k], proportion*[k, 3*k], [eta, eta], shapes, shapes, h, line_info, &
                          rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'two masses: good')
    call check_close(h, expected, tolerance, 'two masses')
    do i = 1, 3
      z = k*cmplx(1.0_qp, eta + omega(i)*proportion, qp) - omega(i)**2
      z(2, 2) = 3*k*cmplx(1.0_qp, eta + omega(i)*proportion, qp) - omega(i)**2
      call check_close(rcond(i), real(min(abs(z(1, 1)), abs(z(2, 2)))/max(abs(z(1, 1)), abs(z(2, 2))), dp), tolerance, &
                       'two masses: rcond')
    end do
  end subroutine two_masses

  !> Each mode with its own damping; shapes at responses and forces differ.
  subroutine against_sum()
    integer, parameter :: modes = 5, lines = 4
    real(dp) :: lambda(modes), c(modes), eta(modes), phi_out(4, modes), phi_in(3, modes), omega(lines), rcond(lines)
    complex(dp) :: h(4, 3, lines), h_t(3, 4, lines), expected(4, 3, lines)
    integer(ip) :: line_info(lines), info
    integer :: i, o, r

    lambda = [1.0_dp, 2.5_dp, 4.0_dp, 9.0_dp, 0.0_dp]
    c = [0.1_dp, 0.0_dp, 0.3_dp, 0.2_dp, 0.05_dp]
    eta = [0.0_dp, 0.04_dp, 0.01_dp, 0.0_dp, 0.3_dp]
    phi_out = random_real(4, modes)
    phi_in = random_real(3, modes)
    omega = [0.3_dp, 1.0_dp, 2.0_dp, 5.0_dp]
    expected = 0
    do i = 1, lines
      do o = 1, 4
        do r = 1, modes
          expected(o, :, i) = expected(o, :, i) + phi_out(o, r)*phi_in(:, r) &
            /(lambda(r)*cmplx(1.0_dp, eta(r), dp) - omega(i)**2 + cmplx(0.0_dp, omega(i)*c(r), dp))
        end do
      end do
    end do
    call receptance_modal(.false., omega, lambda, c, eta, phi_out, phi_in, h, line_info, rcond, info)
    call check(info == 0, 'sum: good')
    call check_close(h, expected, tolerance, 'sum')
    call receptance_modal(.true., omega, lambda, c, eta, transposed(phi_out), transposed(phi_in), h_t, line_info, &
                          rcond, info)
    call check_same(transposed(h_t), h, 'sum, transposed')
  end subroutine against_sum

  !> Responses and forces at the same places, against a sum in quadruple precision; lines for a full block and a part.
  subroutine reciprocal()
    integer, parameter :: modes = 13, lines = 19, n = 5
    real(dp) :: lambda(modes), c(modes), eta(modes), phi(n, modes), omega(lines), rcond(lines)
    complex(dp) :: h(n, n, lines), h_t(n, n, lines), expected(n, n, lines)
    complex(qp) :: total(n, n), denominator
    real(qp) :: w
    integer(ip) :: line_info(lines), info
    integer :: i, j, r

    lambda = [(real(r, dp)**4, r=1, modes)]
    c = [(0.01_dp*r, r=1, modes)]
    eta = [(0.02_dp/r, r=1, modes)]
    phi = random_real(n, modes)
    omega = [(8.0_dp*i, i=1, lines)]
    do i = 1, lines
      w = omega(i)
      total = 0
      do r = 1, modes
        denominator = cmplx(lambda(r) - w**2, lambda(r)*real(eta(r), qp) + w*c(r), qp)
        do j = 1, n
          total(:, j) = total(:, j) + real(phi(:, r), qp)*phi(j, r)/denominator
        end do
      end do
      expected(:, :, i) = cmplx(total, kind=dp)
    end do
    call receptance_modal(.false., omega, lambda, c, eta, phi, phi, h, line_info, rcond, info)
    call check(info == 0, 'reciprocal: good')
    call check_close(h, expected, 1.0e-14_dp, 'reciprocal')
    call receptance_modal(.true., omega, lambda, c, eta, transposed(phi), transposed(phi), h_t, line_info, rcond, info)
    call check_same(transposed(h_t), h, 'reciprocal, transposed')
  end subroutine reciprocal

  subroutine nothing()
    real(dp), parameter :: no_modes(0) = [real(dp) ::], no_shapes(2, 0) = reshape([real(dp) ::], [2, 0])
    real(dp), parameter :: one_mode(1) = [4.0_dp], shapes(2, 1) = 1.0_dp
    complex(dp) :: h(2, 2, 1), no_line(2, 2, 0)
    real(dp) :: rcond(1)
    integer(ip) :: line_info(1), info

    call receptance_modal(.false., [1.0_dp], no_modes, no_modes, no_modes, no_shapes, no_shapes, h, line_info, rcond, &
                          info)
    call check(info == 0 .and. line_info(1) == 0 .and. rcond(1) >= 1.0_dp, 'no modes: good')
    call check(.not. maxval(abs(h)) > 0.0_dp, 'no modes give no motion')
    call receptance_modal(.false., no_modes, one_mode, one_mode, one_mode, shapes, shapes, no_line, line_info(:0), &
                          rcond(:0), info)
    call check(info == 0, 'no lines')
  end subroutine nothing

  subroutine bad_lines()
    real(dp), parameter :: lambda(3) = [1, 9, 4], none(3) = 0.0_dp
    real(dp) :: omega(4), bad_omega(4), rcond(4), shapes(2, 3), large(1, 1)
    complex(dp) :: good(2, 2, 4), h(2, 2, 4), good_1(1, 1, 4), h_1(1, 1, 4)
    integer(ip) :: line_info(4), info

    omega = [0.5_dp, 1.5_dp, 2.5_dp, 4.0_dp]
    shapes = random_real(2, 3)
    call receptance_modal(.false., omega, lambda, none, none, shapes, shapes, good, line_info, rcond, info)
    bad_omega = omega
    bad_omega(2) = 3.0_dp
    call receptance_modal(.false., bad_omega, lambda, none, none, shapes, shapes, h, line_info, rcond, info)
    call check_bad_line(h, good, 2, 2_ip, line_info, rcond, info, 'undamped resonance of mode 2')
    bad_omega(2) = not_a_number()
    call receptance_modal(.false., bad_omega, lambda, none, none, shapes, shapes, h, line_info, rcond, info)
    call check_bad_line(h, good, 2, -1_ip, line_info, rcond, info, 'NaN')
    bad_omega(2) = 3.0_dp + 1.0e-12_dp
    call receptance_modal(.false., bad_omega, lambda, none, none, shapes, shapes, h, line_info, rcond, info)
    call check(info == 0 .and. rcond(2) > 0.0_dp .and. rcond(2) < 1.0e-11_dp, 'close to resonance')

    large = 1.0e150_dp
    call receptance_modal(.false., omega, [2.25_dp], [1.0_dp], [0.0_dp], large, large, good_1, line_info, rcond, info)
    call receptance_modal(.false., omega, [2.25_dp], [1.0e-20_dp], [0.0_dp], large, large, h_1, line_info, rcond, info)
    call check(info == 1 .and. all(line_info == [0, -2, 0, 0]), 'overflow')
    call check(.not. abs(h_1(1, 1, 2)) <= huge(1.0_dp), 'overflow is NaN')
    call check(all(abs(h_1(1, 1, [1, 3, 4])) > 1.0e290_dp), 'lines beside the overflow')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp], lambda(2) = [1, 2], c(2) = 0.1_dp, eta(2) = 0.2_dp
    real(dp) :: shapes(2, 2), rcond(1)
    complex(dp) :: one(2, 2, 1), h(2, 2, 1)
    integer(ip) :: line_info(1), info
    integer :: i

    shapes = random_real(2, 2)
    call receptance_modal(.false., [0.0_dp], lambda, c, eta, shapes, shapes, one, line_info, rcond, info)
    do i = 1, 2
      call receptance_modal(.false., [0.0_dp], factors(i)*lambda, c, eta, shapes, shapes, h, line_info, rcond, info)
      call check_close(factors(i)*h, one, tolerance, 'scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: modes = 20, lines = 400
    real(dp) :: lambda(modes), c(modes), eta(modes), shapes(3, modes), omega(lines), rcond(lines, 2)
    complex(dp) :: h(3, 3, lines, 2)
    integer(ip) :: line_info(lines), info
    integer :: i, t

    lambda = [(real(i, dp)**2, i=1, modes)]
    c = 0.1_dp
    eta = 0.01_dp
    shapes = random_real(3, modes)
    omega = [(0.05_dp*i, i=1, lines)]
    do t = 1, 2
      call set_threads(t)
      call receptance_modal(.false., omega, lambda, c, eta, shapes, shapes, h(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(h(:, :, :, 1), h(:, :, :, 2), 'one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads
end program test_modal
