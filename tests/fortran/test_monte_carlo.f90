!> The statistics are those of the realisations that `pollute` gives, identified one by one in quadruple precision.
program test_monte_carlo
  use testing, only: check, check_close, check_same, dp, finish, inverse, ip, not_a_number, qp, quad_inverse, &
    random_lines, random_regular, seed, set_threads, transposed
  use jointfrf, only: jf_monte_carlo
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_v4, set_engine
  use jointfrf_monte_carlo, only: monte_carlo
  use jointfrf_noise, only: make_noise, noise_model, pollute
  implicit none
  character, parameter :: methods(3) = ['I', 'S', 'C']
  integer(ip), parameter :: some_seed(2) = [3_ip, -8_ip]
  integer(ip) :: info

  call seed(22)
  call statistics(1, 1, 2)
  call statistics(2, 3, 9)
  call statistics(3, 2, 700)
  call statistics(6, 1, 20)
  call one_realisation()
  call no_noise()
  call engines_and_threads()
  call bad_lines()
  call some_bad_realisations()
  call arguments()
  call finish('monte_carlo')

contains

  !> Two passes over all realisations.
  subroutine statistics(n, lines, count)
    integer, intent(in) :: n, lines, count
    complex(dp) :: alpha(2*n, 2*n, lines), gamma(2*n, 2*n, lines), k_initial(n, n, lines), mean(n, n, lines)
    complex(dp), allocatable :: polluted(:, :, :)
    complex(qp) :: k(n, n, count)
    complex(dp) :: expected(n, n), off(n, n, count)
    real(dp) :: covariance(3, n, n, lines), rcond(lines)
    real(dp) :: square(3, n, n), error
    integer(ip) :: good(lines), line_info(lines)
    type(noise_model) :: noise
    integer :: m, i, r, t
    logical :: stored_transposed

    allocate (polluted(2*n, 2*n, lines*count))
    alpha = random_regular(2*n, lines)
    gamma = random_regular(2*n, lines)
    k_initial = random_lines(n, n, lines)
    noise = make_noise('C', 'L', n == 2, 1, 0.01_dp, some_seed)
    call pollute(.false., noise, 7_ip, int(count, ip), gamma, polluted, info)
    do m = 1, size(methods)
      do t = 0, 1
        stored_transposed = t == 1
        if (stored_transposed) then
          call monte_carlo(.true., methods(m), noise, 7_ip, int(count, ip), transposed(alpha), transposed(gamma), &
                           transposed(k_initial), good, mean, covariance, line_info, rcond, info)
          mean = transposed(mean)
        else
          call monte_carlo(.false., methods(m), noise, 7_ip, int(count, ip), alpha, gamma, k_initial, good, mean, &
                           covariance, line_info, rcond, info)
        end if
        call check(info == 0 .and. all(line_info == 0) .and. all(good == count), 'all good '//methods(m))
        call check(all(rcond > 0) .and. all(rcond <= 1), 'rcond '//methods(m))
        error = 0
        do i = 1, lines
          do r = 1, count
            k(:, :, r) = identified(methods(m), n, alpha(:, :, i), polluted(:, :, (r - 1)*lines + i), &
                                    k_initial(:, :, i))
          end do
          expected = cmplx(sum(k, dim=3)/count, kind=dp)
          off = cmplx(k, kind=dp) - spread(expected, 3, count)
          square(1, :, :) = sum(real(off, dp)**2, dim=3)/(count - 1)
          square(2, :, :) = sum(aimag(off)**2, dim=3)/(count - 1)
          square(3, :, :) = sum(real(off, dp)*aimag(off), dim=3)/(count - 1)
          error = max(error, maxval(abs(mean(:, :, i) - expected))/maxval(abs(expected)))
          if (stored_transposed) then
            square = reshape(square, shape(square), order=[1, 3, 2])      ! entries change places
          end if
          error = max(error, maxval(abs(covariance(:, :, :, i) - square))/maxval(abs(square)))
        end do
        call check(error < 1.0e-10_dp, 'mean and covariance '//methods(m))
      end do
    end do
  end subroutine statistics

  !> (2.40), (2.47), (2.48) as they stand, in quadruple precision.
  function identified(method, n, alpha, gamma, k_initial) result(k)
    character, intent(in) :: method
    integer, intent(in) :: n
    complex(dp), intent(in) :: alpha(:, :), gamma(:, :), k_initial(:, :)
    complex(qp) :: k(n, n), a(2*n, 2*n), g(2*n, 2*n), d(2*n, 2*n)

    a = alpha
    g = gamma
    select case (method)
    case ('I')
      d = matmul(quad_inverse(a), matmul(a - g, quad_inverse(g)))
      k = k_initial - d(:n, n + 1:)
    case ('S')
      d = quad_inverse(g)
      k = -d(:n, n + 1:)
    case default
      k = matmul(g(n + 1:, n + 1:), matmul(quad_inverse(g(:n, n + 1:)), g(:n, :n))) - g(n + 1:, :n)
    end select
  end function identified

  !> A mean but no covariance.
  subroutine one_realisation()
    complex(dp) :: gamma(2, 2, 1), mean(1, 1, 1)
    real(dp) :: covariance(3, 1, 1, 1), rcond(1)
    integer(ip) :: good(1), line_info(1)

    gamma = random_regular(2, 1)
    call monte_carlo(.false., 'S', make_noise('C', 'E', .false., 1, 0.1_dp, some_seed), 0_ip, 1_ip, gamma, gamma, &
                     gamma(1:1, 1:1, :), good, mean, covariance, line_info, rcond, info)
    call check(info == 0 .and. good(1) == 1 .and. abs(mean(1, 1, 1)) < 1.0e9_dp, 'one realisation has a mean')
    call check(all(.not. covariance <= huge(1.0_dp)), 'and no covariance')
  end subroutine one_realisation

  subroutine no_noise()
    complex(dp) :: gamma(4, 4, 2), mean(2, 2, 2), exact(4, 4, 2)
    real(dp) :: covariance(3, 2, 2, 2), rcond(2)
    integer(ip) :: good(2), line_info(2)

    gamma = random_regular(4, 2)
    exact = inverse(gamma)
    call monte_carlo(.false., 'S', make_noise('P', 'S', .false., 1, 0.0_dp, some_seed), 0_ip, 100_ip, gamma, gamma, &
                     gamma(1:2, 1:2, :), good, mean, covariance, line_info, rcond, info)
    call check_close(mean, -exact(1:2, 3:4, :), 1.0e-12_dp, 'no noise: exact')
    call check(all(covariance < 1.0e-24_dp), 'no noise: no variance')
  end subroutine no_noise

  !> Engines agree to rounding, any number of threads in every bit.
  subroutine engines_and_threads()
    integer, parameter :: n = 2, lines = 3
    integer(ip), parameter :: count = 3001
    complex(dp) :: alpha(2*n, 2*n, lines), gamma(2*n, 2*n, lines), k_initial(n, n, lines)
    complex(dp) :: first(n, n, lines), mean(n, n, lines), again(n, n, lines)
    real(dp), dimension(3, n, n, lines) :: covariance, reference, covariance_again
    real(dp) :: rcond(lines)
    integer(ip) :: good(lines), line_info(lines), engine
    type(noise_model) :: noise
    integer :: m

    alpha = random_regular(2*n, lines)
    gamma = random_regular(2*n, lines)
    k_initial = random_lines(n, n, lines)
    noise = make_noise('C', 'E', .false., 1, 0.02_dp, some_seed)
    do m = 1, size(methods)
      call set_engine(engine_lapack, info)
      call set_threads(2)
      call monte_carlo(.false., methods(m), noise, 0_ip, count, alpha, gamma, k_initial, good, first, reference, &
                       line_info, rcond, info)
      do engine = engine_automatic, engine_v4
        call set_engine(engine, info)
        if (info /= 0) cycle
        call set_threads(1)
        call monte_carlo(.false., methods(m), noise, 0_ip, count, alpha, gamma, k_initial, good, mean, covariance, &
                         line_info, rcond, info)
        call check_close(mean, first, 1.0e-11_dp, 'engines agree on the mean')
        call check(maxval(abs(covariance - reference)) < 1.0e-10_dp*maxval(abs(reference)), 'and on the covariance')
        call set_threads(2)
        call monte_carlo(.false., methods(m), noise, 0_ip, count, alpha, gamma, k_initial, good, again, &
                         covariance_again, line_info, rcond, info)
        call check_same(again, mean, 'the same mean on two threads')
        call check_same(reshape(covariance_again, [size(covariance)]), reshape(covariance, [size(covariance)]), &
                        'the same covariance on two threads')
      end do
      call set_engine(engine_automatic, info)
    end do
  end subroutine engines_and_threads

  !> Bad lines are named, filled with NaN, and harm no other.
  subroutine bad_lines()
    integer, parameter :: lines = 5
    complex(dp) :: alpha(2, 2, lines), gamma(2, 2, lines), k_initial(1, 1, lines)
    complex(dp) :: good_mean(1, 1, lines), mean(1, 1, lines)
    real(dp) :: covariance(3, 1, 1, lines), rcond(lines)
    integer(ip) :: good(lines), line_info(lines)
    type(noise_model) :: noise

    alpha = random_regular(2, lines)
    gamma = random_regular(2, lines)
    k_initial = random_lines(1, 1, lines)
    noise = make_noise('C', 'E', .false., 1, 0.02_dp, some_seed)
    call monte_carlo(.false., 'I', noise, 0_ip, 100_ip, alpha, gamma, k_initial, good, good_mean, covariance, &
                     line_info, rcond, info)
    gamma(:, :, 1) = 0                                ! the level refers to the entry: it stays zero
    gamma(1, 2, 2) = not_a_number()
    alpha(2, :, 3) = 0
    k_initial(1, 1, 4) = not_a_number()
    call monte_carlo(.false., 'I', noise, 0_ip, 100_ip, alpha, gamma, k_initial, good, mean, covariance, line_info, &
                     rcond, info)
    call check(info == 4 .and. all(line_info == [1_ip, -1_ip, 2_ip, -1_ip, 0_ip]), 'bad lines: codes')
    call check(all(good == [0_ip, 0_ip, 0_ip, 0_ip, 100_ip]), 'bad lines: counts')
    call check(all(.not. abs(mean(1, 1, :4)) <= huge(1.0_dp)) .and. all(abs(rcond(:4)) <= 0.0_dp), 'bad lines: NaN')
    call check(all(.not. covariance(:, 1, 1, :4) <= huge(1.0_dp)), 'bad lines: NaN in the covariance')
    call check_same(mean(:, :, 5:), good_mean(:, :, 5:), 'bad lines: the others')
  end subroutine bad_lines

  !> Noise that overflows in some realisations: these are left out and counted.
  subroutine some_bad_realisations()
    integer(ip), parameter :: count = 203
    complex(dp) :: gamma(2, 2, 1), polluted(2, 2, count), mean(1, 1, 1), expected(2, 2, 1)
    real(dp) :: covariance(3, 1, 1, 1), rcond(1)
    integer(ip) :: good(1), line_info(1), finite
    type(noise_model) :: noise
    integer :: r

    gamma(:, :, 1) = reshape([0.7_dp, 0.1_dp, 0.2_dp, 0.7_dp], [2, 2])*huge(1.0_dp)
    noise = make_noise('N', 'E', .false., 1, 0.4_dp, some_seed)
    call pollute(.false., noise, 0_ip, count, gamma, polluted, info)
    finite = 0
    mean = 0
    do r = 1, int(count)
      if (.not. all(abs(real(polluted(:, :, r), dp)) <= huge(1.0_dp))) cycle
      finite = finite + 1_ip
      expected = inverse(polluted(:, :, r:r)/huge(1.0_dp))
      mean = mean - expected(1:1, 2:2, :)
    end do
    expected(1, 1, 1) = mean(1, 1, 1)/finite
    call monte_carlo(.false., 'S', noise, 0_ip, count, gamma, gamma, gamma(1:1, 1:1, :), good, mean, covariance, &
                     line_info, rcond, info)
    call check(info == 0 .and. good(1) == finite .and. finite > 5 .and. finite < count - 5, &
               'bad realisations are counted')
    call check_close(mean*huge(1.0_dp), expected(1:1, 1:1, :), 1.0e-9_dp, 'and left out')
  end subroutine some_bad_realisations

  subroutine arguments()
    call refused(0, 'n', 's', 'c', 'e', 0, 2, 0.1_dp, 1, 1, 0, 3)
    call refused(-1, 'X', 'S', 'C', 'E', 0, 1, 0.1_dp, 1, 1, 0, 3)
    call refused(-2, 'N', 'X', 'C', 'E', 0, 1, 0.1_dp, 1, 1, 0, 3)
    call refused(-3, 'N', 'S', 'X', 'E', 0, 1, 0.1_dp, 1, 1, 0, 3)
    call refused(-4, 'N', 'S', 'C', 'X', 0, 1, 0.1_dp, 1, 1, 0, 3)
    call refused(-5, 'N', 'S', 'C', 'E', 2, 1, 0.1_dp, 1, 1, 0, 3)
    call refused(-6, 'N', 'S', 'C', 'E', 0, 3, 0.1_dp, 1, 1, 0, 3)
    call refused(-7, 'N', 'S', 'C', 'E', 0, 1, -0.1_dp, 1, 1, 0, 3)
    call refused(-9, 'N', 'S', 'C', 'E', 0, 1, 0.1_dp, 0, 1, 0, 3)
    call refused(-10, 'N', 'S', 'C', 'E', 0, 1, 0.1_dp, 1, -1, 0, 3)
    call refused(-11, 'N', 'S', 'C', 'E', 0, 1, 0.1_dp, 1, 1, -1, 3)
    call refused(-12, 'N', 'S', 'C', 'E', 0, 1, 0.1_dp, 1, 1, 0, 0)
    call refused(-12, 'N', 'S', 'C', 'E', 0, 1, 0.1_dp, 1, 1, huge(0), 3)
  end subroutine arguments

  subroutine refused(code, trans, method, kind, reference, reciprocal, block, level, n, n_freq, first, count)
    integer, intent(in) :: code, reciprocal, block, n, n_freq, first, count
    character, intent(in) :: trans, method, kind, reference
    real(dp), intent(in) :: level
    complex(dp) :: gamma(2, 2, 1), mean(1, 1, 1)
    real(dp) :: covariance(3, 1, 1, 1), rcond(1)
    integer(ip) :: good(1), line_info(1)
    character(len=6) :: text

    gamma = reshape([1, 2, 3, 4], [2, 2, 1])
    call jf_monte_carlo(trans, method, kind, reference, int(reciprocal, ip), int(block, ip), level, some_seed, &
                        int(n, ip), int(n_freq, ip), int(first, ip), int(count, ip), gamma, gamma, gamma(1:1, 1:1, :), &
                        good, mean, covariance, line_info, rcond, info)
    write (text, '(i0)') code
    call check(info == code, 'argument '//text)
  end subroutine refused
end program test_monte_carlo
