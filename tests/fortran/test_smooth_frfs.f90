!> Smooth FRFs of known rational functions with noise: their poles, the least sum of squares, outlying lines, threads.
program test_smooth_frfs
  use testing, only: check, check_close, dp, finish, infinity, ip, normal, not_a_number, seed, set_threads, two_pi, &
    untouched
  use jointfrf, only: jf_rational_fit, jf_relocate_poles, jf_smooth_frfs
  implicit none
  integer, parameter :: n_freq = 400, n_entries = 4, n_poles = 4, most = 12
  real(dp), parameter :: level = 0.02_dp
  !> Hz
  complex(dp), parameter :: exact(n_poles) = [(-0.4_dp, 40.0_dp), (-1.0_dp, 95.0_dp), (-0.8_dp, 160.0_dp), &
                                              (-2.0_dp, 230.0_dp)]
  real(dp) :: freq(n_freq), variance(n_freq, n_entries)
  complex(dp) :: h(n_freq, n_entries), measured(n_freq, n_entries)

  call seed(12)
  call known_functions()
  call finds_poles()
  call correlated_noise()
  call keeps_poles()
  call outlying_line()
  call few_poles()
  call threads()
  call nothing()
  call wrong_arguments()
  call finish('smooth_frfs')

contains

  subroutine known_functions()
    integer :: i, e, k

    freq = [(10 + 250*(i - 1)/real(n_freq - 1, dp), i=1, n_freq)]
    do e = 1, n_entries
      h(:, e) = 0.01_dp*normal()
      do k = 1, n_poles
        h(:, e) = h(:, e) + normal()/(cmplx(0.0_dp, freq, dp) - exact(k))
      end do
    end do
    variance = (level*abs(h))**2
    measured = noisy()
  end subroutine known_functions

  function noisy() result(x)
    complex(dp) :: x(n_freq, n_entries)
    integer :: i, e

    do e = 1, n_entries
      do i = 1, n_freq
        x(i, e) = h(i, e)*(1 + level*normal())
      end do
    end do
  end function noisy

  !> As many as there are; the noise that is left is that of the parameters; the fit is the best of these poles.
  subroutine finds_poles()
    complex(dp) :: poles(most), smooth(n_freq, n_entries), again(n_freq, n_entries), own(most)
    real(dp) :: squares, others, loss(most), moved
    integer(ip) :: n, info
    integer :: k

    call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 0_ip, 2_ip, 1.0_dp, freq, measured, variance, poles, n, &
                        smooth, squares, info)
    call check(info == 0 .and. n >= n_poles .and. n <= n_poles + 2, 'number of poles')
    do k = 1, n_poles
      call check(minval(abs(poles(:n)/two_pi - exact(k))) < 5*level*abs(real(exact(k))), 'poles')
    end do
    call check(all(real(poles(:n)) < 0), 'stable poles')
    call check_close(squares/(n_freq*n_entries - n_entries*(n + 1) - n), 1.0_dp, 0.1_dp, 'level')
    call check(sum(abs(smooth - h)**2/variance) < 2*(n_entries*(n + 1) + n), 'error of smooth FRFs')
    own(:n) = poles(:n)/two_pi
    call jf_rational_fit(n, 4_ip, int(n_freq, ip), cmplx(0.0_dp, freq, dp), measured, 1/sqrt(variance), own(:n), &
                         again, others, loss(:n), info)
    call check(all(abs(again - smooth) < 1.0e-9_dp*abs(again)), 'the fit with these poles')
    call check_close(squares/others, 1.0_dp, 1.0e-9_dp, 'its sum of squares')
    call jf_relocate_poles(n, 4_ip, int(n_freq, ip), 30_ip, 0.0_dp, cmplx(0.0_dp, freq, dp), measured, &
                           1/sqrt(variance), own(:n), moved, info)
    call check(moved > squares - 2, 'no better poles nearby')
  end subroutine finds_poles

  !> With an inflation that is found no pole follows noise that goes on over five lines; without it some do.
  subroutine correlated_noise()
    complex(dp) :: poles(most, 2), smooth(n_freq, n_entries), noise(n_freq + 4), x(n_freq, n_entries)
    real(dp) :: squares
    integer(ip) :: n(2), info
    integer :: e, i

    do e = 1, n_entries
      do i = 1, n_freq + 4
        noise(i) = normal()/sqrt(5.0_dp)
      end do
      do i = 1, n_freq
        x(i, e) = h(i, e)*(1 + level*sum(noise(i:i + 4)))
      end do
    end do
    call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 0_ip, 2_ip, 0.0_dp, freq, x, variance, poles(:, 1), &
                        n(1), smooth, squares, info)
    call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 0_ip, 2_ip, 1.0_dp, freq, x, variance, poles(:, 2), &
                        n(2), smooth, squares, info)
    call check(n(1) <= n_poles + 1 .and. n(2) > n(1), 'poles for correlated noise')
  end subroutine correlated_noise

  !> Without patience the first poles are relocated and no further ones are sought.
  subroutine keeps_poles()
    complex(dp) :: poles(most), smooth(n_freq, n_entries), fitted(n_freq, n_entries)
    real(dp) :: squares(2), loss(2)
    integer(ip) :: n, info

    poles = untouched
    poles(:2) = two_pi*exact([1, 3])*1.02_dp
    call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 2_ip, 0_ip, 1.0_dp, freq, measured, variance, poles, n, &
                        smooth, squares(1), info)
    call check(info == 0 .and. n == 2, 'no further poles')
    call check(all(abs(poles(3:) - untouched) <= 0), 'poles beyond their number stay as they are')
    call jf_rational_fit(2_ip, 4_ip, int(n_freq, ip), cmplx(0.0_dp, freq, dp), measured, 1/sqrt(variance), &
                         exact([1, 3])*1.02_dp, fitted, squares(2), loss, info)
    call check(squares(1) < squares(2), 'first poles are relocated')
  end subroutine keeps_poles

  !> No pole follows a line that is noise only, and the other lines hardly change.
  subroutine outlying_line()
    complex(dp) :: x(n_freq, n_entries), poles(most), smooth(n_freq, n_entries)
    real(dp) :: squares
    integer(ip) :: n, info
    integer :: e

    x = measured
    do e = 1, n_entries
      x(200, e) = 50*maxval(abs(h(:, e)))*normal()
    end do
    call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 0_ip, 2_ip, 1.0_dp, freq, x, variance, poles, n, smooth, &
                        squares, info)
    call check(info == 0 .and. all(abs(smooth(200, :) - h(200, :)) < 5*sqrt(variance(200, :))), 'an outlying line')
  end subroutine outlying_line

  !> No more poles than asked for, and than a third of the lines.
  subroutine few_poles()
    complex(dp) :: one(1), poles(most), smooth(n_freq, n_entries)
    real(dp) :: squares
    integer(ip) :: n, info

    call jf_smooth_frfs(4_ip, int(n_freq, ip), 1_ip, 0_ip, 2_ip, 1.0_dp, freq, measured, variance, one, n, smooth, &
                        squares, info)
    call check(info == 0 .and. n == 1, 'one pole')
    call jf_smooth_frfs(4_ip, 9_ip, int(most, ip), 0_ip, 2_ip, 1.0_dp, freq(:9), measured(:9, :), variance(:9, :), &
                        poles, n, smooth(:9, :), squares, info)
    call check(info == 0 .and. n >= 1 .and. n <= 2, 'poles for nine lines')
  end subroutine few_poles

  subroutine threads()
    complex(dp) :: poles(most, 2), smooth(n_freq, n_entries, 2)
    real(dp) :: squares(2)
    integer(ip) :: n(2), info
    integer :: i

    do i = 1, 2
      call set_threads(i)
      call jf_smooth_frfs(4_ip, int(n_freq, ip), int(most, ip), 0_ip, 2_ip, 1.0_dp, freq, measured, variance, &
                          poles(:, i), n(i), smooth(:, :, i), squares(i), info)
    end do
    call check(n(1) == n(2) .and. all(abs(poles(:n(1), 1) - poles(:n(1), 2)) <= 0.0_dp), 'poles on two threads')
    call check(all(abs(smooth(:, :, 1) - smooth(:, :, 2)) <= 0.0_dp), 'smooth FRFs on two threads')
  end subroutine threads

  subroutine nothing()
    complex(dp) :: no_h(0, 2), no_smooth(0, 2), poles(1)
    real(dp) :: no_freq(0), no_variance(0, 2), squares
    integer(ip) :: n, info

    call jf_smooth_frfs(2_ip, 0_ip, 1_ip, 0_ip, 2_ip, 1.0_dp, no_freq, no_h, no_variance, poles, n, no_smooth, &
                        squares, info)
    call check(info == 0 .and. n == 0 .and. abs(squares) <= 0.0_dp, 'no lines')
  end subroutine nothing

  subroutine wrong_arguments()
    real(dp) :: bad(n_freq), bad_variance(n_freq, n_entries)
    complex(dp) :: bad_h(n_freq, n_entries)

    call refused(-1_ip, 400_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, freq, measured, variance, 1)
    call refused(4_ip, -1_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, freq, measured, variance, 2)
    call refused(4_ip, 400_ip, 0_ip, 0_ip, 2_ip, 1.0_dp, freq, measured, variance, 3)
    call refused(4_ip, 400_ip, 12_ip, 13_ip, 2_ip, 1.0_dp, freq, measured, variance, 4)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, -1_ip, 1.0_dp, freq, measured, variance, 5)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, 0.5_dp, freq, measured, variance, 6)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, infinity(), freq, measured, variance, 6)
    bad = freq
    bad(7) = bad(6)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, bad, measured, variance, 7)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, freq - 20, measured, variance, 7)
    bad_h = measured
    bad_h(9, 2) = cmplx(0.0_dp, not_a_number(), dp)
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, freq, bad_h, variance, 8)
    bad_variance = variance
    bad_variance(3, 4) = 0
    call refused(4_ip, 400_ip, 12_ip, 0_ip, 2_ip, 1.0_dp, freq, measured, bad_variance, 9)
  end subroutine wrong_arguments

  subroutine refused(entries, lines, max_poles, n_start, patience, inflation, own_freq, x, own_variance, argument)
    integer(ip), intent(in) :: entries, lines, max_poles, n_start, patience
    real(dp), intent(in) :: inflation, own_freq(n_freq), own_variance(n_freq, n_entries)
    complex(dp), intent(in) :: x(n_freq, n_entries)
    integer, intent(in) :: argument
    complex(dp) :: poles(most), smooth(n_freq, n_entries)
    real(dp) :: squares
    integer(ip) :: n, info

    poles = untouched
    call jf_smooth_frfs(entries, lines, max_poles, n_start, patience, inflation, own_freq, x, own_variance, poles, n, &
                        smooth, squares, info)
    call check(info == -argument, 'a wrong argument')
    call check(all(abs(poles - untouched) <= 0), 'nothing was done')
  end subroutine refused
end program test_smooth_frfs
