!> The flat API gives what the modules behind it give, in both storage orders, and for sweeps of nothing.
program test_api
  use, intrinsic :: iso_c_binding, only: c_char
  use testing, only: check, check_close, check_same, dp, finish, inverse, ip, random_lines, random_real, &
    random_regular, seed, transposed
  use jointfrf, only: jf_central_difference, jf_compliance_covariance, jf_compliance_factors, jf_couple, jf_decouple, &
    jf_difference_weights, jf_engine_automatic, jf_engine_lapack, jf_engine_plain, jf_engine_x86_64_v2, &
    jf_engine_x86_64_v3, jf_engine_x86_64_v4, jf_find_modification, jf_get_engine, jf_info_text, &
    jf_inverse_substructuring, jf_invert, jf_ismm, &
    jf_joint_compliance, jf_line_text, jf_modify, jf_receptance, jf_receptance_banded, jf_receptance_modal, &
      jf_set_engine, &
    jf_solve, jf_transform, jf_version
  use jointfrf_compliance, only: joint_compliance
  use jointfrf_compliance_noise, only: compliance_covariance, compliance_factors
  use jointfrf_coupling, only: couple
  use jointfrf_decoupling, only: decouple
  use jointfrf_dynamic_stiffness, only: receptance_banded, receptance_dense
  use jointfrf_finite_difference, only: difference_weights, transform_receptance
  use jointfrf_ismm, only: inverse_substructuring, ismm
  use jointfrf_modal, only: receptance_modal
  use jointfrf_modification, only: find_modification, modify
  implicit none
  integer, parameter :: lines = 3
  real(dp), parameter :: none(0, 0) = reshape([real(dp) ::], [0, 0])
  integer(ip), parameter :: n_freq = int(lines, ip)
  integer(ip) :: line_info(lines), info
  real(dp) :: rcond(lines), omega(lines)

  call seed(13)
  omega = [0.0_dp, 0.7_dp, 1.9_dp]
  call version_and_texts()
  call engines()
  call algebra()
  call models()
  call assemblies()
  call joints()
  call compliances()
  call differences()
  call no_lines()
  call lists_too_long()
  call finish('api')

contains

  !> After each call.
  subroutine good(what)
    character(len=*), intent(in) :: what

    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp), what//': good')
    info = -99
    line_info = -99
    rcond = -99.0_dp
  end subroutine good

  subroutine version_and_texts()
    integer(ip) :: major, minor, patch
    character(kind=c_char) :: text(80), long(100), short(3)
    character(len=20) :: digits

    call jf_version(major, minor, patch)
    write (digits, '(i0,a,i0,a,i0)') major, '.', minor, '.', patch
    call check(digits == JF_VERSION, 'version '//digits)
    call jf_info_text(-3_ip, 80_ip, text)
    call check(joined(text) == 'argument 3 is wrong', 'info text')
    call jf_line_text(-1_ip, 100_ip, long)
    call check(joined(long) == 'the line holds NaN or Inf', 'line text, padded')
    call jf_line_text(0_ip, 3_ip, short)
    call check(joined(short) == 'goo', 'line text, cut')
    call jf_info_text(0_ip, 0_ip, short)
    call check(joined(short) == 'goo', 'no room, nothing written')
  end subroutine version_and_texts

  subroutine engines()
    integer(ip) :: engine, before

    call check(all([jf_engine_automatic, jf_engine_lapack, jf_engine_plain, jf_engine_x86_64_v2, jf_engine_x86_64_v3, &
                    jf_engine_x86_64_v4] == [0, 1, 2, 3, 4, 5]), 'engines as documented')
    call jf_get_engine(before, info)
    call check(info == 0 .and. before > 0, 'engine in use')
    call jf_set_engine(jf_engine_lapack, info)
    call check(info == 0, 'engine chosen')
    call jf_set_engine(9_ip, info)
    call check(info == -1, 'engine that does not exist')
    call jf_get_engine(engine, info)
    call check(info == 0 .and. engine == jf_engine_lapack, 'engine kept')
    call jf_set_engine(before, info)
  end subroutine engines

  function joined(text) result(line)
    character(kind=c_char), intent(in) :: text(:)
    character(len=size(text)) :: line

    line = transfer(text, line)
  end function joined

  subroutine algebra()
    complex(dp) :: a(3, 3, lines), b(3, 2, lines), x(3, 2, lines), x_t(2, 3, lines), a_inverse(3, 3, lines), ax(3, 2, &
      lines)
    integer :: i

    a = random_regular(3, lines)
    b = random_lines(3, 2, lines)
    call jf_invert(3_ip, n_freq, a, a_inverse, line_info, rcond, info)
    call good('invert')
    call check_close(a_inverse, inverse(a), 1.0e-13_dp, 'invert')
    call jf_solve('N', 3_ip, 2_ip, n_freq, a, b, x, line_info, rcond, info)
    call good('solve')
    do i = 1, lines
      ax(:, :, i) = matmul(a(:, :, i), x(:, :, i))
    end do
    call check_close(ax, b, 1.0e-13_dp, 'solve')
    call jf_solve('T', 3_ip, 2_ip, n_freq, transposed(a), transposed(b), x_t, line_info, rcond, info)
    call good('solve T')
    call check_same(transposed(x_t), x, 'solve T')
  end subroutine algebra

  subroutine models()
    integer(ip), parameter :: outputs(3) = [4_ip, 1_ip, 2_ip], inputs(2) = [3_ip, 4_ip]
    real(dp) :: k(4, 4), m(4, 4), c(4, 4), s(4, 4), lambda(4), damping(4), eta(4), phi_out(3, 4), phi_in(2, 4)
    complex(dp) :: h(3, 2, lines), h_t(2, 3, lines), expected(3, 2, lines)

    k = random_real(4, 4)
    m = random_real(4, 4)
    c = random_real(4, 4)
    s = random_real(4, 4)
    call receptance_dense(.false., omega, k, m, c, s, 0.1_dp, outputs, inputs, expected, line_info, rcond, info)
    call jf_receptance('N', 4_ip, n_freq, 3_ip, 2_ip, omega, k, m, 4_ip, c, 4_ip, s, 0.1_dp, outputs, inputs, h, &
                       line_info, rcond, info)
    call good('receptance')
    call check_same(h, expected, 'receptance')
    call jf_receptance('T', 4_ip, n_freq, 3_ip, 2_ip, omega, transpose(k), transpose(m), 4_ip, transpose(c), 4_ip, &
                       transpose(s), 0.1_dp, outputs, inputs, h_t, line_info, rcond, info)
    call good('receptance T')
    call check_same(transposed(h_t), expected, 'receptance T')
    call receptance_dense(.false., omega, k, m, none, none, 0.1_dp, outputs, inputs, expected, line_info, rcond, info)
    call jf_receptance('N', 4_ip, n_freq, 3_ip, 2_ip, omega, k, m, 0_ip, none, 0_ip, none, 0.1_dp, outputs, inputs, h, &
                       line_info, rcond, info)
    call check_same(h, expected, 'receptance without C and H')

    ! kl = 2, ku = 1: four rows of band storage
    call receptance_banded(.false., 2, 1, omega, k, m, c, s, 0.1_dp, outputs, inputs, expected, line_info, rcond, info)
    call jf_receptance_banded('n', 4_ip, 2_ip, 1_ip, n_freq, 3_ip, 2_ip, omega, k, m, 4_ip, c, 4_ip, s, 0.1_dp, &
                              outputs, inputs, h, line_info, rcond, info)
    call good('receptance_banded')
    call check_same(h, expected, 'receptance_banded')
    call jf_receptance_banded('t', 4_ip, 2_ip, 1_ip, n_freq, 3_ip, 2_ip, omega, k, m, 4_ip, c, 4_ip, s, 0.1_dp, &
                              outputs, inputs, h_t, line_info, rcond, info)
    call good('receptance_banded T')
    call check_same(transposed(h_t), expected, 'receptance_banded T')

    lambda = [1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]
    damping = [0.1_dp, 0.2_dp, 0.3_dp, 0.4_dp]
    eta = [0.04_dp, 0.03_dp, 0.02_dp, 0.01_dp]
    phi_out = random_real(3, 4)
    phi_in = random_real(2, 4)
    call receptance_modal(.false., omega, lambda, damping, eta, phi_out, phi_in, expected, line_info, rcond, info)
    call jf_receptance_modal('N', 4_ip, n_freq, 3_ip, 2_ip, omega, lambda, damping, eta, phi_out, phi_in, h, &
                             line_info, rcond, info)
    call good('receptance_modal')
    call check_same(h, expected, 'receptance_modal')
    call jf_receptance_modal('T', 4_ip, n_freq, 3_ip, 2_ip, omega, lambda, damping, eta, transposed(phi_out), &
                             transposed(phi_in), h_t, line_info, rcond, info)
    call good('receptance_modal T')
    call check_same(transposed(h_t), expected, 'receptance_modal T')
  end subroutine models

  subroutine assemblies()
    integer(ip), parameter :: dofs_a(2) = [3_ip, 1_ip], dofs_b(2) = [1_ip, 4_ip]
    complex(dp) :: h_a(3, 3, lines), h_b(4, 4, lines), k(2, 2, lines), h_c(7, 7, lines), expected(7, 7, lines)
    complex(dp) :: gamma(3, 3, lines), modified(3, 3, lines), d(3, 3, lines), found(3, 3, lines)

    h_a = random_regular(3, lines)
    h_b = random_regular(4, lines)
    k = random_lines(2, 2, lines)
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, expected, line_info, rcond, info)
    call jf_couple('N', 3_ip, 4_ip, 2_ip, n_freq, h_a, h_b, k, dofs_a, dofs_b, h_c, line_info, rcond, info)
    call good('couple')
    call check_same(h_c, expected, 'couple')
    call jf_couple('T', 3_ip, 4_ip, 2_ip, n_freq, transposed(h_a), transposed(h_b), transposed(k), dofs_a, dofs_b, &
                   h_c, line_info, rcond, info)
    call good('couple T')
    call check_same(transposed(h_c), expected, 'couple T')

    call modify(.false., h_a, k, dofs_a, modified, line_info, rcond, info)
    call jf_modify('N', 3_ip, 2_ip, n_freq, h_a, k, dofs_a, gamma, line_info, rcond, info)
    call good('modify')
    call check_same(gamma, modified, 'modify')
    call jf_modify('T', 3_ip, 2_ip, n_freq, transposed(h_a), transposed(k), dofs_a, gamma, line_info, rcond, info)
    call good('modify T')
    call check_same(transposed(gamma), modified, 'modify T')

    call find_modification(.false., h_a, modified, d, line_info, rcond, info)
    call jf_find_modification('N', 3_ip, n_freq, h_a, modified, found, line_info, rcond, info)
    call good('find_modification')
    call check_same(found, d, 'find_modification')
    call jf_find_modification('T', 3_ip, n_freq, transposed(h_a), transposed(modified), found, line_info, rcond, info)
    call good('find_modification T')
    call check_close(transposed(found), d, 1.0e-12_dp, 'find_modification T')
  end subroutine assemblies

  subroutine joints()
    character(len=2), parameter :: equations(4) = ['rr', 'rs', 'sr', 'ss']
    integer(ip), parameter :: j(2) = [1_ip, 3_ip], k(2) = [4_ip, 2_ip], r(2) = [3_ip, 2_ip], s(2) = [1_ip, 3_ip]
    complex(dp) :: alpha(4, 4, lines), gamma(4, 4, lines), first(2, 2, lines), found(2, 2, lines), expected(2, 2, lines)
    complex(dp) :: h_a(3, 3, lines)
    character(len=2) :: name
    integer :: e

    alpha = random_regular(4, lines)
    gamma = random_regular(4, lines)
    first = random_regular(2, lines)
    call ismm(.false., alpha, gamma, first, expected, line_info, rcond, info)
    call jf_ismm('N', 2_ip, n_freq, alpha, gamma, first, found, line_info, rcond, info)
    call good('ismm')
    call check_same(found, expected, 'ismm')
    call jf_ismm('T', 2_ip, n_freq, transposed(alpha), transposed(gamma), transposed(first), found, line_info, rcond, &
                 info)
    call good('ismm T')
    call check_close(transposed(found), expected, 1.0e-12_dp, 'ismm T')
    call inverse_substructuring(.false., gamma, expected, line_info, rcond, info)
    call jf_inverse_substructuring('N', 2_ip, n_freq, gamma, found, line_info, rcond, info)
    call good('inverse_substructuring')
    call check_same(found, expected, 'inverse_substructuring')
    call jf_inverse_substructuring('T', 2_ip, n_freq, transposed(gamma), found, line_info, rcond, info)
    call good('inverse_substructuring T')
    call check_same(transposed(found), expected, 'inverse_substructuring T')

    h_a = random_regular(3, lines)
    do e = 1, 4
      call decouple(equations(e), .false., h_a, gamma, first, j, k, r, s, expected, line_info, rcond, info)
      name = equations(e)
      call jf_decouple([name(1:1), name(2:2)], 'N', 3_ip, 4_ip, 2_ip, n_freq, h_a, gamma, first, j, k, r, s, found, &
                       line_info, rcond, info)
      call good('decouple '//name)
      call check_same(found, expected, 'decouple '//name)
      name = achar(iachar(name(1:1)) - 32)//name(2:2)
      call jf_decouple([name(1:1), name(2:2)], 'T', 3_ip, 4_ip, 2_ip, n_freq, transposed(h_a), transposed(gamma), &
                       transposed(first), j, k, r, s, found, line_info, rcond, info)
      call good('decouple '//name//' T')
      call check_same(transposed(found), expected, 'decouple '//name//' T')
    end do
  end subroutine joints

  subroutine compliances()
    complex(dp) :: gamma(4, 4, lines), c(2, 2, lines), expected(2, 2, lines), covariance(4, 4, lines), propagated(4, &
      4, lines)
    complex(dp) :: factors(4, 3, lines), found(4, 3, lines), found_t(3, 4, lines)
    real(dp) :: t(4, 3), variance(3, 3, lines), variance_t(3, 3, lines)
    integer :: i, reciprocal

    gamma = random_regular(4, lines)
    t = random_real(4, 3)
    do i = 1, lines
      variance(:, :, i) = random_real(3, 3)**2
      variance_t(:, :, i) = transpose(variance(:, :, i))
    end do
    call joint_compliance(.false., gamma, expected, line_info, rcond, info)
    call jf_joint_compliance('N', 2_ip, n_freq, gamma, c, line_info, rcond, info)
    call good('joint_compliance')
    call check_same(c, expected, 'joint_compliance')
    call jf_joint_compliance('T', 2_ip, n_freq, transposed(gamma), c, line_info, rcond, info)
    call good('joint_compliance T')
    call check_same(transposed(c), expected, 'joint_compliance T')

    call compliance_factors(.false., gamma, t, factors, line_info, rcond, info)
    call jf_compliance_factors('N', 2_ip, 3_ip, n_freq, gamma, t, found, line_info, rcond, info)
    call good('compliance_factors')
    call check_same(found, factors, 'compliance_factors')
    call jf_compliance_factors('T', 2_ip, 3_ip, n_freq, transposed(gamma), transposed(t), found_t, line_info, rcond, &
                               info)
    call good('compliance_factors T')
    call check_same(transposed(found_t), factors, 'compliance_factors T')

    do reciprocal = 0, 1
      call compliance_covariance(.false., gamma, t, variance, reciprocal == 1, propagated, line_info, rcond, info)
      call jf_compliance_covariance('N', int(reciprocal, ip), 2_ip, 3_ip, n_freq, gamma, t, variance, covariance, &
                                    line_info, rcond, info)
      call good('compliance_covariance')
      call check_same(covariance, propagated, 'compliance_covariance')
      call compliance_covariance(.true., transposed(gamma), transposed(t), variance_t, reciprocal == 1, propagated, &
                                 line_info, rcond, info)
      call jf_compliance_covariance('T', int(reciprocal, ip), 2_ip, 3_ip, n_freq, transposed(gamma), transposed(t), &
                                    variance_t, covariance, line_info, rcond, info)
      call good('compliance_covariance T')
      call check_same(covariance, propagated, 'compliance_covariance T')
    end do
  end subroutine compliances

  subroutine differences()
    real(dp), parameter :: offset(3) = [-0.02_dp, 0.01_dp, 0.05_dp]
    complex(dp) :: h(3, 3, lines), h_new(2, 2, lines), expected(2, 2, lines), wide(3, 5, lines), new(2, 4, lines)
    complex(dp) :: new_t(4, 2, lines), transformed(2, 4, lines)
    real(dp) :: weights(2, 3), flat(2, 3), t_out(2, 3), t_in(4, 5)

    h = random_lines(3, 3, lines)
    call difference_weights(offset, weights)
    call jf_difference_weights(3_ip, offset, flat, info)
    call check(info == 0, 'difference_weights: good')
    call check_same([flat], [weights], 'difference_weights')
    call transform_receptance(.false., h, weights, weights, expected, line_info, rcond, info)
    call jf_central_difference('N', 3_ip, n_freq, offset, h, h_new, line_info, rcond, info)
    call good('central_difference')
    call check_same(h_new, expected, 'central_difference')
    call jf_central_difference('T', 3_ip, n_freq, offset, transposed(h), h_new, line_info, rcond, info)
    call good('central_difference T')
    call check_same(transposed(h_new), expected, 'central_difference T')

    wide = random_lines(3, 5, lines)
    t_out = random_real(2, 3)
    t_in = random_real(4, 5)
    call transform_receptance(.false., wide, t_out, t_in, transformed, line_info, rcond, info)
    call jf_transform('N', 2_ip, 4_ip, 3_ip, 5_ip, n_freq, wide, t_out, t_in, new, line_info, rcond, info)
    call good('transform')
    call check_same(new, transformed, 'transform')
    call jf_transform('T', 2_ip, 4_ip, 3_ip, 5_ip, n_freq, transposed(wide), transposed(t_out), &
                      transposed(t_in), new_t, line_info, rcond, info)
    call good('transform T')
    call check_same(transposed(new_t), transformed, 'transform T')
  end subroutine differences

  !> n_freq = 0, and n = 0: good, and nothing is read or written.
  subroutine no_lines()
    complex(dp) :: a(0), b(0), c(0), x(0)
    real(dp) :: r(0), s(0)
    integer(ip) :: i(0), stat(0)
    integer(ip), parameter :: one(1) = [1_ip], two(1) = [2_ip]
    real(dp), parameter :: offset(2) = [0.0_dp, 1.0_dp], number(4) = 1.0_dp

    call jf_invert(2_ip, 0_ip, a, x, stat, r, info)
    call empty('invert')
    call jf_solve('N', 2_ip, 1_ip, 0_ip, a, b, x, stat, r, info)
    call empty('solve')
    call jf_receptance('N', 2_ip, 0_ip, 1_ip, 1_ip, s, number, number, 0_ip, s, 0_ip, s, 0.0_dp, one, one, x, stat, &
                       r, info)
    call empty('receptance')
    call jf_receptance_banded('N', 2_ip, 0_ip, 0_ip, 0_ip, 1_ip, 1_ip, s, number, number, 0_ip, s, 0_ip, s, 0.0_dp, &
                              one, one, x, stat, r, info)
    call empty('receptance_banded')
    call jf_receptance_modal('N', 1_ip, 0_ip, 1_ip, 1_ip, s, number, number, number, number, number, x, stat, r, info)
    call empty('receptance_modal')
    call jf_couple('N', 1_ip, 1_ip, 1_ip, 0_ip, a, b, c, one, one, x, stat, r, info)
    call empty('couple')
    call jf_modify('N', 1_ip, 1_ip, 0_ip, a, b, one, x, stat, r, info)
    call empty('modify')
    call jf_find_modification('N', 1_ip, 0_ip, a, b, x, stat, r, info)
    call empty('find_modification')
    call jf_ismm('N', 1_ip, 0_ip, a, b, c, x, stat, r, info)
    call empty('ismm')
    call jf_inverse_substructuring('N', 1_ip, 0_ip, a, x, stat, r, info)
    call empty('inverse_substructuring')
    call jf_decouple(['r', 's'], 'N', 2_ip, 2_ip, 1_ip, 0_ip, a, b, c, one, one, two, two, x, stat, r, info)
    call empty('decouple')
    call jf_joint_compliance('N', 1_ip, 0_ip, a, x, stat, r, info)
    call empty('joint_compliance')
    call jf_compliance_factors('N', 1_ip, 2_ip, 0_ip, a, number, x, stat, r, info)
    call empty('compliance_factors')
    call jf_compliance_covariance('N', 0_ip, 1_ip, 2_ip, 0_ip, a, number, s, x, stat, r, info)
    call empty('compliance_covariance')
    call jf_central_difference('N', 2_ip, 0_ip, offset, a, x, stat, r, info)
    call empty('central_difference')
    call jf_transform('N', 1_ip, 1_ip, 2_ip, 2_ip, 0_ip, a, number, number, x, stat, r, info)
    call empty('transform')

    call jf_invert(0_ip, n_freq, a, x, line_info, rcond, info)
    call good('invert, n = 0')
    call jf_solve('T', 0_ip, 2_ip, n_freq, a, b, x, line_info, rcond, info)
    call good('solve, n = 0')
    call jf_receptance('T', 0_ip, n_freq, 0_ip, 0_ip, omega, s, s, 0_ip, s, 0_ip, s, 0.0_dp, i, i, x, line_info, &
                       rcond, info)
    call good('receptance, n = 0')
    call jf_receptance_banded('T', 0_ip, 0_ip, 0_ip, n_freq, 0_ip, 0_ip, omega, s, s, 0_ip, s, 0_ip, s, 0.0_dp, i, i, &
                              x, line_info, rcond, info)
    call good('receptance_banded, n = 0')
    call jf_receptance_modal('T', 0_ip, n_freq, 0_ip, 0_ip, omega, s, s, s, s, s, x, line_info, rcond, info)
    call good('receptance_modal, n = 0')
    call jf_couple('T', 0_ip, 0_ip, 0_ip, n_freq, a, b, c, i, i, x, line_info, rcond, info)
    call good('couple, n = 0')
    call jf_modify('T', 0_ip, 0_ip, n_freq, a, b, i, x, line_info, rcond, info)
    call good('modify, n = 0')
    call jf_find_modification('T', 0_ip, n_freq, a, b, x, line_info, rcond, info)
    call good('find_modification, n = 0')
    call jf_ismm('T', 0_ip, n_freq, a, b, c, x, line_info, rcond, info)
    call good('ismm, n = 0')
    call jf_inverse_substructuring('T', 0_ip, n_freq, a, x, line_info, rcond, info)
    call good('inverse_substructuring, n = 0')
    call jf_decouple(['s', 's'], 'T', 0_ip, 0_ip, 0_ip, n_freq, a, b, c, i, i, i, i, x, line_info, rcond, info)
    call good('decouple, n = 0')
    call jf_joint_compliance('T', 0_ip, n_freq, a, x, line_info, rcond, info)
    call good('joint_compliance, n = 0')
    call jf_compliance_factors('T', 0_ip, 0_ip, n_freq, a, s, x, line_info, rcond, info)
    call good('compliance_factors, n = 0')
    call jf_compliance_covariance('T', 1_ip, 0_ip, 0_ip, n_freq, a, s, r, x, line_info, rcond, info)
    call good('compliance_covariance, n = 0')
    call jf_transform('T', 0_ip, 0_ip, 0_ip, 0_ip, n_freq, a, s, r, x, line_info, rcond, info)
    call good('transform, n = 0')
  end subroutine no_lines

  !> A list whose length is wrong is not read: here it would lead far beyond the memory of the program.
  subroutine lists_too_long()
    complex(dp) :: a(0), x(0)
    real(dp) :: s(0)
    integer(ip) :: i(0)
    integer(ip) :: n

    n = huge(0)
    call jf_couple('N', 4_ip, 4_ip, n, n_freq, a, a, a, i, i, x, line_info, rcond, info)
    call check(info == -4, 'couple, more joint DOFs than there are')
    call jf_modify('N', 4_ip, n, n_freq, a, a, i, x, line_info, rcond, info)
    call check(info == -3, 'modify, more DOFs than there are')
    call jf_decouple(['r', 's'], 'N', 4_ip, 4_ip, n, n_freq, a, a, a, i, i, i, i, x, line_info, rcond, info)
    call check(info == -5, 'decouple, more DOFs than there are')
    call jf_receptance('N', -1_ip, n_freq, n, n, omega, s, s, 0_ip, s, 0_ip, s, 0.0_dp, i, i, x, line_info, rcond, info)
    call check(info == -2, 'receptance, no size')
  end subroutine lists_too_long

  subroutine empty(what)
    character(len=*), intent(in) :: what

    call check(info == 0, what//': no lines')
    info = -99
  end subroutine empty
end program test_api
