!> Receptance from K, M, C, H: one DOF by hand, random matrices without symmetry against quadruple precision, dense and
!> in band storage.
program test_dynamic_stiffness
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, infinity, ip, not_a_number, qp, &
    quad_inverse, random_real, seed, set_threads, transposed, two_pi, thesis_chain
  use jointfrf_dynamic_stiffness, only: receptance_banded, receptance_dense
  use jointfrf_engine, only: engine_automatic, engine_lapack, set_engine
  implicit none
  real(dp), parameter :: tolerance = 1.0e-12_dp
  real(dp), parameter :: none(0, 0) = reshape([real(dp) ::], [0, 0])

  call seed(4)
  call one_dof()
  call chain()
  call dense_against_reference()
  call banded_against_reference(2, 1)
  call banded_against_reference(0, 3)
  call banded_against_reference(3, 0)
  call banded_against_reference(0, 0)
  call banded_against_reference(6, 6)
  call long_chain(.true.)
  call long_chain(.false.)
  call zero_pivot()
  call part_that_is_not_wanted()
  call nothing()
  call bad_lines()
  call scales()
  call threads()
  call finish('dynamic_stiffness')

contains

  !> H = 1/(k (1 + i eta) + i h + i w c - w^2 m), with each damping alone and with all of them.
  subroutine one_dof()
    real(dp), parameter :: k = 900.0_dp, m = 2.0_dp, c = 3.0_dp, s = 40.0_dp, eta = 0.05_dp
    real(dp) :: omega(4), rcond(4)
    complex(dp) :: h(1, 1, 4), expected(1, 1, 4)
    integer(ip) :: line_info(4), info
    integer(ip), parameter :: dof(1) = [1_ip]

    omega = [0.0_dp, 10.0_dp, sqrt(k/m), 70.0_dp]
    call receptance_dense(.false., omega, matrix(k), matrix(m), matrix(c), none, 0.0_dp, dof, dof, h, line_info, &
                          rcond, info)
    expected(1, 1, :) = 1/cmplx(k - omega**2*m, omega*c, dp)
    call check_close(h, expected, tolerance, 'viscous')
    call receptance_dense(.false., omega, matrix(k), matrix(m), none, matrix(s), 0.0_dp, dof, dof, h, line_info, &
                          rcond, info)
    expected(1, 1, :) = 1/cmplx(k - omega**2*m, s, dp)
    call check_close(h, expected, tolerance, 'structural')
    call receptance_dense(.false., omega, matrix(k), matrix(m), none, none, eta, dof, dof, h, line_info, rcond, info)
    expected(1, 1, :) = 1/cmplx(k - omega**2*m, eta*k, dp)
    call check_close(h, expected, tolerance, 'loss factor')
    call receptance_banded(.true., 0, 0, omega, matrix(k), matrix(m), matrix(c), matrix(s), eta, dof, dof, h, &
                           line_info, rcond, info)
    expected(1, 1, :) = 1/cmplx(k - omega**2*m, eta*k + s + omega*c, dp)
    call check_close(h, expected, tolerance, 'all dampings, banded')
    call check(info == 0 .and. all(line_info == 0), 'one DOF: good')
    call set_engine(engine_lapack, info)
    call receptance_banded(.true., 0, 0, omega, matrix(k), matrix(m), matrix(c), matrix(s), eta, dof, dof, h, &
                           line_info, rcond, info)
    ! |re| + |im| of Z, as everywhere; LAPACK's estimate of the inverse takes the modulus
    call check_close(sum(rcond), sum(1/(abs(expected)*(abs(real(1/expected)) + abs(aimag(1/expected))))), tolerance, &
                     'one DOF: rcond of LAPACK')
    call set_engine(engine_automatic, info)
    call receptance_banded(.true., 0, 0, omega, matrix(k), matrix(m), matrix(c), matrix(s), eta, dof, dof, h, &
                           line_info, rcond, info)
    ! side by side the norm of Z is that of its terms
    call check_close(h, expected, tolerance, 'one DOF: side by side')
    call check(all(rcond <= 1.0_dp .and. rcond > 1.0e-2_dp), 'one DOF: rcond side by side')
  end subroutine one_dof

  pure function matrix(x) result(a)
    real(dp), intent(in) :: x
    real(dp) :: a(1, 1)

    a = x
  end function matrix

  !> The thesis' chain (substructure A), dense and banded.
  subroutine chain()
    real(dp) :: freq_hz(3), rcond(3), band(3, 2, 3)
    real(dp), parameter :: k(2, 2) = reshape([6000, -3500, -3500, 3500], [2, 2])
    real(dp), parameter :: m(2, 2) = reshape([5, 0, 0, 3], [2, 2]), c(2, 2) = reshape([7, -4, -4, 4], [2, 2])
    complex(dp) :: h(2, 2, 3), h_a(2, 2, 3), h_b(2, 2, 3), h_c(4, 4, 3), joint(3)
    integer(ip) :: line_info(3), info
    integer(ip), parameter :: dofs(2) = [1_ip, 2_ip]

    freq_hz = [1.0_dp, 4.0_dp, 8.0_dp]
    joint = 1
    call thesis_chain(freq_hz, joint, h_a, h_b, h_c)
    call receptance_dense(.false., two_pi*freq_hz, k, m, c, none, 0.0_dp, dofs, dofs, h, line_info, rcond, info)
    call check_close(h, h_a, tolerance, 'chain, dense')
    band(:, :, 1) = to_band(k, 1, 1)
    band(:, :, 2) = to_band(m, 1, 1)
    band(:, :, 3) = to_band(c, 1, 1)
    call receptance_banded(.false., 1, 1, two_pi*freq_hz, band(:, :, 1), band(:, :, 2), band(:, :, 3), none, 0.0_dp, &
                           dofs, dofs, h, line_info, rcond, info)
    call check_close(h, h_a, tolerance, 'chain, banded')
  end subroutine chain

  !> Band storage; NaN where it holds no entry of the matrix, which must not be read.
  function to_band(a, kl, ku) result(band)
    real(dp), intent(in) :: a(:, :)
    integer, intent(in) :: kl, ku
    real(dp) :: band(kl + ku + 1, size(a, 2))
    integer :: i, j

    band = not_a_number()
    do j = 1, size(a, 2)
      do i = max(1, j - ku), min(size(a, 1), j + kl)
        band(ku + 1 + i - j, j) = a(i, j)
      end do
    end do
  end function to_band

  !> Rows `outputs` and columns `inputs` of ((1 + i eta) K + i H + i w C - w^2 M)^-1 in quadruple precision.
  function reference(omega, k, m, c, s, eta, outputs, inputs) result(h)
    real(dp), intent(in) :: omega(:), k(:, :), m(:, :), c(:, :), s(:, :), eta
    integer(ip), intent(in) :: outputs(:), inputs(:)
    complex(dp) :: h(size(outputs), size(inputs), size(omega))
    complex(qp), parameter :: i_unit = (0.0_qp, 1.0_qp)
    complex(qp) :: x(size(k, 1), size(k, 1))
    real(qp) :: w
    integer :: i

    do i = 1, size(omega)
      w = omega(i)
      x = quad_inverse((1 + i_unit*real(eta, qp))*real(k, qp) + i_unit*real(s, qp) + i_unit*w*real(c, qp) &
                       - w**2*real(m, qp))
      h(:, :, i) = cmplx(x(outputs, inputs), kind=dp)
    end do
  end function reference

  !> All matrices without symmetry; outputs and inputs differ in number and order, one DOF is asked for twice.
  subroutine dense_against_reference()
    integer, parameter :: n = 6, lines = 5
    integer(ip), parameter :: outputs(4) = [5_ip, 1_ip, 5_ip, 2_ip], inputs(3) = [6_ip, 2_ip, 1_ip]
    real(dp) :: k(n, n), m(n, n), c(n, n), s(n, n), omega(lines), rcond(lines), rcond_t(lines)
    complex(dp) :: h(4, 3, lines), h_t(3, 4, lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    k = random_real(n, n)
    m = random_real(n, n)
    c = random_real(n, n)
    s = random_real(n, n)
    omega = [(0.4_dp*i, i=0, lines - 1)]
    call receptance_dense(.false., omega, k, m, c, s, 0.3_dp, outputs, inputs, h, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'dense: good')
    call check_close(h, reference(omega, k, m, c, s, 0.3_dp, outputs, inputs), 1.0e-11_dp, 'dense')
    call check(all(rcond > 0.0_dp .and. rcond < 1.0_dp), 'dense: rcond')
    call receptance_dense(.true., omega, transpose(k), transpose(m), transpose(c), transpose(s), 0.3_dp, outputs, &
                          inputs, h_t, line_info, rcond_t, info)
    call check_same(transposed(h_t), h, 'dense, transposed')
    call check_same(rcond_t, rcond, 'dense: rcond knows no order of storage')
  end subroutine dense_against_reference

  subroutine banded_against_reference(kl, ku)
    integer, intent(in) :: kl, ku
    integer, parameter :: n = 7, lines = 4
    integer(ip), parameter :: outputs(3) = [7_ip, 1_ip, 4_ip], inputs(2) = [3_ip, 7_ip]
    real(dp) :: k(n, n), m(n, n), c(n, n), s(n, n), omega(lines), rcond(lines), rcond_dense(lines)
    complex(dp) :: h(3, 2, lines), h_t(2, 3, lines), h_dense(3, 2, lines)
    integer(ip) :: line_info(lines), info
    integer :: i, j

    k = random_real(n, n)
    m = random_real(n, n)
    c = random_real(n, n)
    s = random_real(n, n)
    do j = 1, n
      k(j, j) = k(j, j) + 3
      do i = 1, n
        if (i > j + kl .or. i < j - ku) then
          k(i, j) = 0
          m(i, j) = 0
          c(i, j) = 0
          s(i, j) = 0
        end if
      end do
    end do
    omega = [(0.3_dp*i, i=0, lines - 1)]
    call receptance_banded(.false., kl, ku, omega, to_band(k, kl, ku), to_band(m, kl, ku), to_band(c, kl, ku), &
                           to_band(s, kl, ku), 0.2_dp, outputs, inputs, h, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'banded: good')
    call check_close(h, reference(omega, k, m, c, s, 0.2_dp, outputs, inputs), 1.0e-11_dp, 'banded')
    call receptance_banded(.true., kl, ku, omega, to_band(k, kl, ku), to_band(m, kl, ku), to_band(c, kl, ku), &
                           to_band(s, kl, ku), 0.2_dp, outputs, inputs, h_t, line_info, rcond, info)
    call check_same(transposed(h_t), h, 'banded: the order of storage concerns h only')
    call receptance_dense(.false., omega, k, m, c, s, 0.2_dp, outputs, inputs, h_dense, line_info, rcond_dense, info)
    call check(all(rcond > 0.999_dp*rcond_dense .and. rcond < 3.0_dp*rcond_dense), &
               'banded: rcond near that of the dense matrix')
    call receptance_banded(.false., kl, ku, omega, to_band(k, kl, ku), to_band(m, kl, ku), none, none, 0.2_dp, &
                           outputs, inputs, h, line_info, rcond, info)
    call check_close(h, reference(omega, k, m, 0*c, 0*s, 0.2_dp, outputs, inputs), 1.0e-11_dp, &
                     'banded, loss factor alone')
  end subroutine banded_against_reference

  !> Nodes of three DOFs, every matrix general: many lines, so that blocks are full and one is not. DOFs are wanted at
  !> the first node, at two in the middle, and not at the last; the DOFs of a node have different units.
  subroutine long_chain(symmetric)
    logical, intent(in) :: symmetric
    integer, parameter :: n = 36, band = 5, lines = 11
    integer(ip), parameter :: outputs(4) = [20_ip, 1_ip, 21_ip, 14_ip], inputs(3) = [14_ip, 1_ip, 19_ip]
    real(dp) :: k(n, n), m(n, n), c(n, n), s(n, n), unit(n), omega(lines), rcond(lines)
    complex(dp) :: h(4, 3, lines), h_t(3, 4, lines), h_lapack(4, 3, lines)
    integer(ip) :: line_info(lines), info
    integer :: i, j

    k = random_real(n, n)
    m = 0.1_dp*random_real(n, n)
    c = 0.1_dp*random_real(n, n)
    s = 0.1_dp*random_real(n, n)
    if (symmetric) then
      k = k + transpose(k)
      m = m + transpose(m)
      c = c + transpose(c)
      s = s + transpose(s)
    end if
    unit = [(10.0_dp**mod(i, 3), i=1, n)]
    do j = 1, n
      k(j, j) = k(j, j) + 6
      m(j, j) = m(j, j) + 2
      do i = 1, n
        if ((i - 1)/3 - (j - 1)/3 > 1 .or. (j - 1)/3 - (i - 1)/3 > 1) then
          k(i, j) = 0
          m(i, j) = 0
          c(i, j) = 0
          s(i, j) = 0
        end if
        k(i, j) = k(i, j)*unit(i)*unit(j)
        m(i, j) = m(i, j)*unit(i)*unit(j)
        c(i, j) = c(i, j)*unit(i)*unit(j)
        s(i, j) = s(i, j)*unit(i)*unit(j)
      end do
    end do
    omega = [(0.21_dp*i, i=1, lines)]
    call receptance_banded(.false., band, band, omega, to_band(k, band, band), to_band(m, band, band), &
                           to_band(c, band, band), to_band(s, band, band), 0.05_dp, outputs, inputs, h, line_info, &
                           rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'long chain: good')
    call check_close(h, reference(omega, k, m, c, s, 0.05_dp, outputs, inputs), 1.0e-12_dp, 'long chain')
    call receptance_banded(.true., band, band, omega, to_band(k, band, band), to_band(m, band, band), &
                           to_band(c, band, band), to_band(s, band, band), 0.05_dp, outputs, inputs, h_t, line_info, &
                           rcond, info)
    call check_same(transposed(h_t), h, 'long chain, transposed')
    call set_engine(engine_lapack, info)
    call receptance_banded(.false., band, band, omega, to_band(k, band, band), to_band(m, band, band), &
                           to_band(c, band, band), to_band(s, band, band), 0.05_dp, outputs, inputs, h_lapack, &
                           line_info, rcond, info)
    call check_close(h_lapack, h, 1.0e-12_dp, 'long chain: LAPACK')
    call set_engine(engine_automatic, info)
  end subroutine long_chain

  !> The mass in the middle is at rest in the sense of its own pivot: k + k - w^2 m = 0 at w = 2, and no damping. The
  !> assembly is regular there.
  subroutine zero_pivot()
    real(dp), parameter :: k(3, 3) = reshape([3, -1, 0, -1, 4, -3, 0, -3, 9], [3, 3])
    real(dp), parameter :: m(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    integer(ip), parameter :: ends(2) = [1_ip, 3_ip]
    real(dp) :: omega(4), rcond(4)
    complex(dp) :: h(2, 2, 4)
    integer(ip) :: line_info(4), info

    omega = [1.0_dp, 2.0_dp, 2.0_dp + 1.0e-9_dp, 2.5_dp]
    call receptance_banded(.false., 1, 1, omega, to_band(k, 1, 1), to_band(m, 1, 1), none, none, 0.0_dp, ends, ends, &
                           h, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'zero pivot: good')
    call check_close(h, reference(omega, k, m, 0*k, 0*k, 0.0_dp, ends, ends), 1.0e-13_dp, 'zero pivot')
  end subroutine zero_pivot

  !> Two parts; the one where nothing is wanted is in undamped resonance.
  subroutine part_that_is_not_wanted()
    real(dp), parameter :: k(3, 3) = reshape([3, 0, -1, 0, 4, 0, -1, 0, 9], [3, 3])
    real(dp), parameter :: m(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    integer(ip), parameter :: tip(1) = [3_ip]
    real(dp) :: omega(4), bad_omega(4), rcond(4)
    complex(dp) :: good(1, 1, 4), h(1, 1, 4)
    integer(ip) :: line_info(4), info

    omega = [1.0_dp, 1.4_dp, 1.9_dp, 2.5_dp]
    call receptance_banded(.false., 2, 2, omega, to_band(k, 2, 2), to_band(m, 2, 2), none, none, 0.0_dp, tip, tip, &
                           good, line_info, rcond, info)
    call check_close(good, reference(omega, k, m, 0*k, 0*k, 0.0_dp, tip, tip), 1.0e-13_dp, 'other part')
    bad_omega = omega
    bad_omega(3) = 2.0_dp
    call receptance_banded(.false., 2, 2, bad_omega, to_band(k, 2, 2), to_band(m, 2, 2), none, none, 0.0_dp, tip, tip, &
                           h, line_info, rcond, info)
    call check_bad_line(h, good, 3, 2_ip, line_info, rcond, info, 'other part in resonance')
  end subroutine part_that_is_not_wanted

  subroutine nothing()
    real(dp), parameter :: k(2, 2) = reshape([2, 1, 0, 3], [2, 2]), no_band(1, 0) = reshape([real(dp) ::], [1, 0])
    real(dp), parameter :: singular(2, 2) = 0.0_dp
    integer(ip), parameter :: dofs(2) = [1_ip, 2_ip], no_dofs(0) = [integer(ip) ::]
    real(dp) :: omega(2), rcond(2)
    complex(dp) :: no_line(2, 2, 0), empty(0, 0, 2), no_in(2, 0, 2), no_out(0, 2, 2)
    integer(ip) :: line_info(2), info

    omega = [1.0_dp, 2.0_dp]
    call receptance_dense(.false., omega(:0), k, k, none, none, 0.0_dp, dofs, dofs, no_line, line_info(:0), &
                          rcond(:0), info)
    call check(info == 0, 'dense: no lines')
    call receptance_dense(.false., omega, none, none, none, none, 0.0_dp, no_dofs, no_dofs, empty, line_info, rcond, &
                          info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'dense: no DOFs')
    call receptance_dense(.false., omega, singular, singular, none, none, 0.0_dp, dofs, no_dofs, no_in, line_info, &
                          rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'dense: no inputs, nothing is inverted')
    call receptance_dense(.false., omega, k, 0*k, none, none, 0.0_dp, no_dofs, dofs, no_out, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'dense: no outputs')

    call receptance_banded(.false., 0, 1, omega(:0), k, k, none, none, 0.0_dp, dofs, dofs, no_line, line_info(:0), &
                           rcond(:0), info)
    call check(info == 0, 'banded: no lines')
    call receptance_banded(.false., 0, 0, omega, no_band, no_band, none, none, 0.0_dp, no_dofs, no_dofs, empty, &
                           line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'banded: no DOFs')
    call receptance_banded(.false., 0, 1, omega, singular, singular, none, none, 0.0_dp, dofs, no_dofs, no_in, &
                           line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'banded: no inputs, nothing is inverted')
  end subroutine nothing

  !> Two uncoupled DOFs, the first without damping: at w = 10 it is exactly in resonance.
  subroutine bad_lines()
    real(dp), parameter :: k(2, 2) = reshape([100, 0, 0, 50], [2, 2]), m(2, 2) = reshape([1, 0, 0, 1], [2, 2])
    real(dp), parameter :: tiny_k(1, 1) = 1.0e-310_dp, zero(1, 1) = 0.0_dp, one(1, 1) = 1.0_dp
    integer(ip), parameter :: dofs(2) = [1_ip, 2_ip]
    real(dp) :: omega(4), bad_omega(4), rcond(4), band_k(1, 2), band_m(1, 2)
    complex(dp) :: good(2, 2, 4), h(2, 2, 4), good_1(1, 1, 4), h_1(1, 1, 4)
    integer(ip) :: line_info(4), info

    omega = [1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]
    band_k = to_band(k, 0, 0)
    band_m = to_band(m, 0, 0)
    call receptance_dense(.false., omega, k, m, none, none, 0.0_dp, dofs, dofs, good, line_info, rcond, info)

    bad_omega = omega
    bad_omega(3) = 10.0_dp
    call receptance_dense(.false., bad_omega, k, m, none, none, 0.0_dp, dofs, dofs, h, line_info, rcond, info)
    call check_bad_line(h, good, 3, 1_ip, line_info, rcond, info, 'dense: undamped resonance')
    call receptance_banded(.false., 0, 0, bad_omega, band_k, band_m, none, none, 0.0_dp, dofs, dofs, h, line_info, &
                           rcond, info)
    call check_bad_line(h, good, 3, 1_ip, line_info, rcond, info, 'banded: undamped resonance')

    bad_omega(3) = not_a_number()
    call receptance_dense(.false., bad_omega, k, m, none, none, 0.0_dp, dofs, dofs, h, line_info, rcond, info)
    call check_bad_line(h, good, 3, -1_ip, line_info, rcond, info, 'dense: NaN')
    call receptance_banded(.false., 0, 0, bad_omega, band_k, band_m, none, none, 0.0_dp, dofs, dofs, h, line_info, &
                           rcond, info)
    call check_bad_line(h, good, 3, -1_ip, line_info, rcond, info, 'banded: NaN')
    bad_omega(3) = infinity()
    call receptance_dense(.false., bad_omega, k, m, none, none, 0.0_dp, dofs, dofs, h, line_info, rcond, info)
    call check_bad_line(h, good, 3, -1_ip, line_info, rcond, info, 'dense: Inf')

    bad_omega(3) = sqrt(100.0_dp*(1 + 1.0e-10_dp))
    call receptance_dense(.false., bad_omega, k, m, none, none, 0.0_dp, dofs, dofs, h, line_info, rcond, info)
    call check(info == 0 .and. rcond(3) > 1.0e-11_dp .and. rcond(3) < 1.0e-9_dp, 'dense: close to resonance')
    call receptance_banded(.false., 0, 0, bad_omega, band_k, band_m, none, none, 0.0_dp, dofs, dofs, h, line_info, &
                           rcond, info)
    call check(info == 0 .and. rcond(3) > 1.0e-11_dp .and. rcond(3) < 1.0e-9_dp, 'banded: close to resonance')

    ! a stiffness so small that its inverse overflows where there is no damping
    call receptance_dense(.false., omega, tiny_k, zero, one, none, 0.0_dp, dofs(:1), dofs(:1), good_1, line_info, &
                          rcond, info)
    bad_omega = omega
    bad_omega(2) = 0.0_dp
    call receptance_dense(.false., bad_omega, tiny_k, zero, one, none, 0.0_dp, dofs(:1), dofs(:1), h_1, line_info, &
                          rcond, info)
    call check_bad_line(h_1, good_1, 2, -2_ip, line_info, rcond, info, 'dense: overflow')
    call receptance_banded(.false., 0, 0, bad_omega, tiny_k, zero, one, none, 0.0_dp, dofs(:1), dofs(:1), h_1, &
                           line_info, rcond, info)
    call check_bad_line(h_1, good_1, 2, -2_ip, line_info, rcond, info, 'banded: overflow')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    integer(ip), parameter :: dofs(3) = [1_ip, 2_ip, 3_ip]
    real(dp) :: k(3, 3), m(3, 3), omega(2), rcond(2), band_k(5, 3), band_m(5, 3)
    complex(dp) :: one(3, 3, 2), h(3, 3, 2)
    integer(ip) :: line_info(2), info
    integer :: i

    k = random_real(3, 3)
    m = random_real(3, 3)
    omega = [0.5_dp, 1.5_dp]
    call receptance_dense(.false., omega, k, m, none, none, 0.1_dp, dofs, dofs, one, line_info, rcond, info)
    do i = 1, 2
      call receptance_dense(.false., omega, factors(i)*k, factors(i)*m, none, none, 0.1_dp, dofs, dofs, h, line_info, &
                            rcond, info)
      call check_close(factors(i)*h, one, tolerance, 'dense: scaled')
      band_k = to_band(factors(i)*k, 2, 2)
      band_m = to_band(factors(i)*m, 2, 2)
      call receptance_banded(.false., 2, 2, omega, band_k, band_m, none, none, 0.1_dp, dofs, dofs, h, line_info, &
                             rcond, info)
      call check_close(factors(i)*h, one, tolerance, 'banded: scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: n = 6, lines = 300
    integer(ip), parameter :: dofs(3) = [4_ip, 1_ip, 6_ip]
    real(dp) :: k(n, n), m(n, n), omega(lines), rcond(lines, 4)
    complex(dp) :: h(3, 3, lines, 4)
    integer(ip) :: line_info(lines), info
    integer :: i, t

    k = random_real(n, n)
    m = random_real(n, n)
    omega = [(0.01_dp*i, i=1, lines)]
    do t = 1, 2
      call set_threads(t)
      call receptance_dense(.false., omega, k, m, none, none, 0.1_dp, dofs, dofs, h(:, :, :, t), line_info, rcond(:, &
                            t), info)
      call receptance_banded(.false., 5, 5, omega, to_band(k, 5, 5), to_band(m, 5, 5), none, none, 0.1_dp, dofs, dofs, &
                             h(:, :, :, t + 2), line_info, rcond(:, t + 2), info)
    end do
    call check_same(h(:, :, :, 1), h(:, :, :, 2), 'dense: one thread and two')
    call check_same(h(:, :, :, 3), h(:, :, :, 4), 'banded: one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'dense: rcond, one thread and two')
    call check_same(rcond(:, 3), rcond(:, 4), 'banded: rcond, one thread and two')
  end subroutine threads
end program test_dynamic_stiffness
