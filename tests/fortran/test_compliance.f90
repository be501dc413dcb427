!> Joint compliance against the inverse of K*, and its covariance against exact derivatives and against noise drawn.
program test_compliance
  use testing, only: assembled, check, check_bad_line, check_close, check_same, dp, finish, infinity, inverse, ip, &
    normal, not_a_number, qp, quad_inverse, random_lines, random_real, random_regular, seed, set_threads, &
    thesis_chain, transposed, two_pi, uniform
  use jointfrf_compliance, only: joint_compliance
  use jointfrf_compliance_noise, only: compliance_covariance, compliance_factors
  use jointfrf_engine, only: engine_automatic, engine_lapack, set_engine
  implicit none
  real(dp), parameter :: tolerance = 1.0e-11_dp

  call seed(10)
  call chain()
  call random_joint(1)
  call random_joint(2)
  call random_joint(4)
  call factors_against_derivatives()
  call against_derivatives(.false.)
  call against_derivatives(.true.)
  call against_noise(.false.)
  call against_noise(.true.)
  call nothing()
  call bad_lines()
  call bad_covariance_lines()
  call scales()
  call threads()
  call finish('compliance')

contains

  subroutine chain()
    integer, parameter :: lines = 20
    real(dp) :: freq_hz(lines), rcond(lines)
    complex(dp) :: h_a(2, 2, lines), h_b(2, 2, lines), gamma(4, 4, lines), joint(lines), c(1, 1, lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    freq_hz = [(0.5_dp*i, i=1, lines)]
    joint = cmplx(2000.0_dp, two_pi*freq_hz*3.0_dp, dp)
    call thesis_chain(freq_hz, joint, h_a, h_b, gamma)
    call joint_compliance(.false., gamma(2:3, 2:3, :), c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'chain: good')
    call check_close(c, reshape(1/joint, [1, 1, lines]), tolerance, 'chain')
  end subroutine chain

  subroutine random_joint(n)
    integer, intent(in) :: n
    integer, parameter :: lines = 4
    complex(dp) :: h_a(n + 1, n + 1, lines), h_b(n, n, lines), k(n, n, lines), h_c(2*n + 1, 2*n + 1, lines)
    complex(dp) :: gamma(2*n, 2*n, lines), c(n, n, lines), c_t(n, n, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)
    integer :: m

    h_a = random_regular(n + 1, lines)
    h_b = random_regular(n, lines)
    k = random_regular(n, lines)
    h_c = assembled(h_a, h_b, k, int([(m + 1, m=1, n)], ip), int([(m, m=1, n)], ip))
    gamma = h_c(2:, 2:, :)
    call joint_compliance(.false., gamma, c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'good')
    call check_close(c, inverse(k), tolerance, 'compliance')
    call joint_compliance(.true., transposed(gamma), c_t, line_info, rcond_t, info)
    call check_same(transposed(c_t), c, 'compliance, transposed')
    call check_same(rcond_t, rcond, 'rcond knows no order of storage')
  end subroutine random_joint

  !> C by another route, -((gamma^-1)_jk)^-1, in quadruple precision.
  function compliance(gamma) result(c)
    complex(qp), intent(in) :: gamma(:, :)
    complex(qp) :: c(size(gamma, 1)/2, size(gamma, 1)/2), z(size(gamma, 1), size(gamma, 1))
    integer :: n

    n = size(gamma, 1)/2
    z = quad_inverse(gamma)
    c = -quad_inverse(z(:n, n + 1:))
  end function compliance

  !> dC/dh_pq = U_p V_q for every entry pq, against central differences in quadruple precision.
  subroutine factors_against_derivatives()
    integer, parameter :: n = 2, m = 3, lines = 2
    complex(dp) :: gamma(2*n, 2*n, lines), factors(2*n, m, lines), factors_t(m, 2*n, lines)
    complex(dp) :: found(n, n, m*m), expected(n, n, m*m)
    complex(qp) :: centre(2*n, 2*n), step(2*n, 2*n)
    real(dp) :: t(2*n, m), rcond(lines), rcond_t(lines)
    real(qp) :: e(m, m)
    real(qp), parameter :: delta = 1.0e-12_qp
    integer(ip) :: line_info(lines), info
    integer :: i, a, p, q

    gamma = random_regular(2*n, lines)
    t = random_real(2*n, m)
    call compliance_factors(.false., gamma, t, factors, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'factors: good')
    do i = 1, lines
      centre = gamma(:, :, i)
      do q = 1, m
        do p = 1, m
          e = 0
          e(p, q) = delta
          step = matmul(t, matmul(e, transpose(real(t, qp))))
          expected(:, :, p + (q - 1)*m) = cmplx((compliance(centre + step) - compliance(centre - step))/(2*delta), &
            kind=dp)
          do a = 1, n
            found(a, :, p + (q - 1)*m) = factors(a, p, i)*factors(n + 1:, q, i)
          end do
        end do
      end do
      call check_close(found, expected, tolerance, 'factors')
    end do
    call compliance_factors(.true., transposed(gamma), transposed(t), factors_t, line_info, rcond_t, info)
    call check_same(transposed(factors_t), factors, 'factors, transposed')
    call check_same(rcond_t, rcond, 'factors: rcond knows no order of storage')
  end subroutine factors_against_derivatives

  !> Covariance from the exact derivatives: central differences in quadruple precision, entry by entry.
  function reference(gamma, t, variance, reciprocal) result(covariance)
    complex(dp), intent(in) :: gamma(:, :)
    real(dp), intent(in) :: t(:, :), variance(:, :)
    logical, intent(in) :: reciprocal
    complex(dp) :: covariance(size(gamma, 1)**2/4, size(gamma, 1)**2/4)
    complex(qp) :: jacobian(size(covariance, 1), size(variance)), step(size(t, 1), size(t, 1)), centre(size(t, 1), &
      size(t, 1))
    real(qp) :: e(size(variance, 1), size(variance, 1)), sigma(size(variance))
    real(qp), parameter :: delta = 1.0e-12_qp
    integer :: p, q, m, column

    m = size(variance, 1)
    centre = gamma
    do q = 1, m
      do p = 1, m
        e = 0
        e(p, q) = delta
        if (reciprocal) e = (e + transpose(e))/2
        step = matmul(t, matmul(e, transpose(real(t, qp))))
        column = p + (q - 1)*m
        jacobian(:, column) = reshape(compliance(centre + step) - compliance(centre - step), [size(covariance, &
          1)])/(2*delta)
        sigma(column) = sqrt(real(variance(p, q), qp))
      end do
    end do
    do column = 1, m*m
      jacobian(:, column) = sigma(column)*jacobian(:, column)
    end do
    covariance = cmplx(matmul(jacobian, conjg(transpose(jacobian))), kind=dp)
  end function reference

  !> The covariance with its rows and columns, entries ab of C, counted as the transposed C lies in memory.
  function reordered(covariance, n) result(other)
    complex(dp), intent(in) :: covariance(:, :)
    integer, intent(in) :: n
    complex(dp) :: other(n*n, n*n)
    integer :: order(n*n), a, b

    do b = 1, n
      do a = 1, n
        order(b + (a - 1)*n) = a + (b - 1)*n
      end do
    end do
    other = covariance(order, order)
  end function reordered

  subroutine against_derivatives(reciprocal)
    logical, intent(in) :: reciprocal
    integer, parameter :: n = 2, m = 5, lines = 3
    complex(dp) :: gamma(2*n, 2*n, lines), covariance(n*n, n*n, lines), expected(n*n, n*n, lines)
    real(dp) :: t(2*n, m), variance(m, m, lines), variance_t(m, m, lines), rcond(lines), rcond_t(lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    gamma = random_regular(2*n, lines)
    t = random_real(2*n, m)
    do i = 1, lines
      variance(:, :, i) = random_real(m, m)**2
      variance_t(:, :, i) = transpose(variance(:, :, i))
      expected(:, :, i) = reference(gamma(:, :, i), t, variance(:, :, i), reciprocal)
    end do
    call compliance_covariance(.false., gamma, t, variance, reciprocal, covariance, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'covariance: good')
    call check_close(covariance, expected, tolerance, 'covariance')
    call compliance_covariance(.true., transposed(gamma), transposed(t), variance_t, reciprocal, covariance, &
                               line_info, rcond_t, info)
    do i = 1, lines
      expected(:, :, i) = reordered(expected(:, :, i), n)
      ! E[dC_ab conj(dC_cd)] stored (in, out): the transpose of a Hermitian matrix
      expected(:, :, i) = transpose(expected(:, :, i))
    end do
    call check_close(covariance, expected, tolerance, 'covariance, transposed')
  end subroutine against_derivatives

  !> 4000 draws of small noise: the variances scatter by 1/sqrt(4000) = 1.6 %; six times that is allowed.
  subroutine against_noise(reciprocal)
    logical, intent(in) :: reciprocal
    integer, parameter :: n = 2, m = 4, draws = 4000
    real(dp), parameter :: level = 1.0e-5_dp
    complex(dp) :: h(m, m), e(m, m), gamma(2*n, 2*n, 1), noisy(2*n, 2*n, draws), c(n, n, draws), centre(n, n, 1)
    complex(dp) :: covariance(n*n, n*n, 1), sampled(n*n, n*n), change(n*n)
    real(dp) :: t(2*n, m), variance(m, m, 1), rcond(draws), scatter
    integer(ip) :: line_info(draws), info
    integer :: i, p, q

    t = random_real(2*n, m)
    do p = 1, m
      t(p, p) = t(p, p) + 2.0_dp
      do q = 1, m
        variance(p, q, 1) = (level*(0.5_dp + uniform()))**2
      end do
    end do
    gamma = random_regular(m, 1)
    h = gamma(:, :, 1)
    if (reciprocal) h = (h + transpose(h))/2
    gamma(:, :, 1) = matmul(t, matmul(h, transposed(t)))
    do i = 1, draws
      do q = 1, m
        do p = 1, m
          e(p, q) = sqrt(variance(p, q, 1))*normal()
        end do
      end do
      if (reciprocal) e = (e + transpose(e))/2
      noisy(:, :, i) = matmul(t, matmul(h + e, transposed(t)))
    end do
    call joint_compliance(.false., gamma, centre, line_info(:1), rcond(:1), info)
    call joint_compliance(.false., noisy, c, line_info, rcond, info)
    call check(info == 0, 'noise: good')
    sampled = 0
    do i = 1, draws
      change = reshape(c(:, :, i) - centre(:, :, 1), [n*n])
      do q = 1, n*n
        sampled(:, q) = sampled(:, q) + change*conjg(change(q))/draws
      end do
    end do
    call compliance_covariance(.false., gamma, t, variance, reciprocal, covariance, line_info(:1), rcond(:1), info)
    do q = 1, n*n
      do p = 1, n*n
        scatter = sqrt(real(covariance(p, p, 1))*real(covariance(q, q, 1))/draws)
        call check(abs(sampled(p, q) - covariance(p, q, 1)) < 6*scatter, 'covariance of noise drawn')
      end do
    end do
  end subroutine against_noise

  subroutine nothing()
    complex(dp) :: empty(0, 0, 2), c(0, 0, 2), no_line(2, 2, 0), no_c(1, 1, 0), gamma(2, 2, 2), covariance(1, 1, 2)
    complex(dp) :: no_factors(2, 3, 0)
    real(dp) :: rcond(2), no_t(0, 3), variance(3, 3, 2), no_points(2, 0), no_variance(0, 0, 2), t(2, 3), no_lines(3, &
      3, 0)
    integer(ip) :: line_info(2), info

    call joint_compliance(.false., empty, c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond >= 1.0_dp), 'no DOFs')
    call joint_compliance(.false., no_line, no_c, line_info(:0), rcond(:0), info)
    call check(info == 0, 'no lines')
    variance = 1
    call compliance_covariance(.false., empty, no_t, variance, .true., c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'covariance: no DOFs')
    t = 1
    call compliance_factors(.false., no_line, t, no_factors, line_info(:0), rcond(:0), info)
    call check(info == 0, 'factors: no lines')
    call compliance_covariance(.false., no_line, t, no_lines, .true., no_c, line_info(:0), rcond(:0), info)
    call check(info == 0, 'covariance: no lines')
    gamma = random_regular(2, 2)
    call compliance_covariance(.false., gamma, no_points, no_variance, .false., covariance, line_info, rcond, info)
    call check(info == 0 .and. .not. maxval(abs(covariance)) > 0.0_dp, 'covariance: nothing measured')
    call compliance_covariance(.false., gamma, t, 0*variance, .false., covariance, line_info, rcond, info)
    call check(info == 0 .and. .not. maxval(abs(covariance)) > 0.0_dp, 'covariance: no noise')
  end subroutine nothing

  subroutine bad_lines()
    complex(dp) :: gamma(4, 4, 4), bad(4, 4, 4), good(2, 2, 4), c(2, 2, 4)
    integer(ip) :: line_info(4), info
    real(dp) :: rcond(4)

    gamma = random_regular(4, 4)
    call joint_compliance(.false., gamma, good, line_info, rcond, info)
    bad = gamma
    bad(1:2, 3:4, 2) = reshape([1, 2, 2, 4], [2, 2])
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_bad_line(c, good, 2, 2_ip, line_info, rcond, info, 'gamma_jk singular')
    bad = gamma
    bad(4, 1, 3) = not_a_number()
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_bad_line(c, good, 3, -1_ip, line_info, rcond, info, 'NaN')
    bad = gamma
    bad(3, 3, 4) = cmplx(0.0_dp, infinity(), dp)
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_bad_line(c, good, 4, -1_ip, line_info, rcond, info, 'Inf')
    bad = gamma
    bad(:, :, 1) = 1.0e200_dp*gamma(:, :, 1)
    bad(1:2, 3:4, 1) = gamma(1:2, 3:4, 1)
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_bad_line(c, good, 1, -2_ip, line_info, rcond, info, 'overflow of the product')
    bad = gamma
    bad(1:2, 3:4, 1) = 1.0e-310_dp*reshape([1, 0, 0, 1], [2, 2])
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_bad_line(c, good, 1, -2_ip, line_info, rcond, info, 'overflow of the inverse')
    bad(1:2, 3:4, 1) = reshape([1, 0, 0, 0], [2, 2])
    bad(2, 4, 1) = 1.0e-6_dp
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check(info == 0, 'nearly singular is good')
    call check(abs(log(rcond(1)/1.0e-6_dp)) < log(3.0_dp), 'rcond of a nearly singular line')      ! an estimate
    call set_engine(engine_lapack, info)                       ! the reference engine knows it exactly
    call joint_compliance(.false., bad, c, line_info, rcond, info)
    call check_close(rcond(1), 1.0e-6_dp, 1.0e-10_dp, 'reference: rcond of a nearly singular line')
    call set_engine(engine_automatic, info)
  end subroutine bad_lines

  subroutine bad_covariance_lines()
    integer, parameter :: m = 4
    complex(dp) :: gamma(4, 4, 4), bad(4, 4, 4), good(4, 4, 4), covariance(4, 4, 4), good_factors(4, m, 4), &
      factors(4, m, 4)
    real(dp) :: t(4, m), variance(m, m, 4), bad_variance(m, m, 4), rcond(4)
    integer(ip) :: line_info(4), info

    gamma = random_regular(4, 4)
    t = random_real(4, m)
    variance = 1.0e-4_dp
    call compliance_covariance(.false., gamma, t, variance, .true., good, line_info, rcond, info)
    call compliance_factors(.false., gamma, t, good_factors, line_info, rcond, info)
    bad = gamma
    bad(1:2, 3:4, 2) = 0
    call compliance_factors(.false., bad, t, factors, line_info, rcond, info)
    call check_bad_line(factors, good_factors, 2, 1_ip, line_info, rcond, info, 'factors: gamma_jk singular')
    call compliance_covariance(.false., bad, t, variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 2, 1_ip, line_info, rcond, info, 'covariance: gamma_jk singular')
    bad = gamma
    bad(4, 4, 3) = not_a_number()
    call compliance_factors(.false., bad, t, factors, line_info, rcond, info)
    call check_bad_line(factors, good_factors, 3, -1_ip, line_info, rcond, info, 'factors: NaN')
    call compliance_covariance(.false., bad, t, variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 3, -1_ip, line_info, rcond, info, 'covariance: NaN in gamma')
    bad_variance = variance
    bad_variance(2, 1, 4) = infinity()
    call compliance_covariance(.false., gamma, t, bad_variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 4, -1_ip, line_info, rcond, info, 'covariance: variance Inf')
    bad_variance(2, 1, 4) = not_a_number()
    call compliance_covariance(.false., gamma, t, bad_variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 4, -1_ip, line_info, rcond, info, 'covariance: variance NaN')
    bad_variance(2, 1, 4) = -1.0e-9_dp
    call compliance_covariance(.false., gamma, t, bad_variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 4, -1_ip, line_info, rcond, info, 'covariance: variance negative')
    bad = gamma
    bad(1:2, 3:4, 1) = 1.0e-160_dp*gamma(1:2, 3:4, 1)
    call compliance_covariance(.false., bad, t, variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 1, -2_ip, line_info, rcond, info, 'covariance: overflow')
    bad(1:2, 3:4, 1) = 1.0e-310_dp*reshape([1, 0, 0, 1], [2, 2])
    bad(1:2, 1:2, 1) = 0
    call compliance_factors(.false., bad, t, factors, line_info, rcond, info)
    call check_bad_line(factors, good_factors, 1, -2_ip, line_info, rcond, info, 'factors: L overflows')
    call compliance_factors(.false., gamma, 1.0e308_dp*abs(t), factors, line_info, rcond, info)
    call check(info == 4 .and. all(line_info == -2), 'factors: the product with T overflows')
    call compliance_covariance(.false., bad, t, variance, .true., covariance, line_info, rcond, info)
    call check_bad_line(covariance, good, 1, -2_ip, line_info, rcond, info, 'covariance: L overflows')
  end subroutine bad_covariance_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: gamma(4, 4, 1), one(2, 2, 1), c(2, 2, 1), one_covariance(4, 4, 1), covariance(4, 4, 1)
    real(dp) :: rcond(1), t(4, 4), variance(4, 4, 1)
    integer(ip) :: line_info(1), info
    integer :: i

    gamma = random_regular(4, 1)
    t = random_real(4, 4)
    variance(:, :, 1) = random_real(4, 4)**2
    call joint_compliance(.false., gamma, one, line_info, rcond, info)
    call compliance_covariance(.false., gamma, t, variance, .true., one_covariance, line_info, rcond, info)
    do i = 1, 2
      call joint_compliance(.false., factors(i)*gamma, c, line_info, rcond, info)
      call check_close(c/factors(i), one, 1.0e-12_dp, 'scaled')
      call compliance_covariance(.false., factors(i)*gamma, t, factors(i)**2*variance, .true., covariance, line_info, &
                                 rcond, info)
      call check_close(covariance/factors(i)**2, one_covariance, 1.0e-12_dp, 'covariance: scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 400
    complex(dp) :: gamma(4, 4, lines), c(2, 2, 4*lines, 2), covariance(4, 4, lines, 2), many(4, 4, 4*lines)
    real(dp) :: t(4, 4), variance(4, 4, lines), rcond(4*lines, 2)
    integer(ip) :: line_info(4*lines), info
    integer :: i

    gamma = random_regular(4, lines)
    many = random_regular(4, 4*lines)
    t = random_real(4, 4)
    variance = abs(random_lines(4, 4, lines))
    do i = 1, 2
      call set_threads(i)
      call joint_compliance(.false., many, c(:, :, :, i), line_info, rcond(:, i), info)
      call compliance_covariance(.false., gamma, t, variance, .true., covariance(:, :, :, i), line_info(:lines), &
                                 rcond(:lines, i), info)
    end do
    call check_same(c(:, :, :, 1), c(:, :, :, 2), 'one thread and two')
    call check_same(covariance(:, :, :, 1), covariance(:, :, :, 2), 'covariance: one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads
end program test_compliance
