!> Noise of FRFs whose smooth ones are known: parts, outlying lines, slow variation, floors, correlation.
program test_estimate_noise
  use testing, only: check, check_close, dp, finish, ip, normal, not_a_number, seed, untouched
  use jointfrf, only: jf_estimate_noise, jf_line_correlation, jf_line_levels
  implicit none
  integer, parameter :: n_freq = 600, m = 4
  real(dp) :: share(m), none(n_freq, m), ones(n_freq), shape_of(n_freq)
  complex(dp) :: smooth(n_freq, m)
  real(dp) :: parts(m, 3), variance(n_freq, m), level(n_freq), factor(n_freq), inflation
  integer(ip) :: is_shaped, info
  integer(ip), parameter :: first(1) = 2_ip, second(1) = 3_ip

  call seed(8)
  call known_frfs()
  call by_entry()
  call taken_up()
  call outlying_lines()
  call slow_variation()
  call shaped_floor()
  call given_variance()
  call correlation()
  call line_routines()
  call nothing()
  call wrong_arguments()
  call finish('estimate_noise')

contains

  !> Entries 2 and 3 are the same FRF.
  subroutine known_frfs()
    integer :: l

    do l = 1, n_freq
      smooth(l, 1) = 1/cmplx(2.0e4_dp - real(l, dp)**2, 300.0_dp, dp)
      smooth(l, 2) = 1/cmplx(9.0e4_dp - real(l, dp)**2, 500.0_dp, dp)
      smooth(l, 4) = 1/cmplx(2.0e5_dp - real(l, dp)**2, 900.0_dp, dp)
      shape_of(l) = (300.0_dp/l)**4
    end do
    smooth(:, 3) = smooth(:, 2)
    share = 0
    none = 0
    ones = 1
  end subroutine known_frfs

  function noisy(relative, floors) result(h)
    real(dp), intent(in) :: relative(m), floors(m)
    complex(dp) :: h(n_freq, m)
    integer :: e, l

    do e = 1, m
      do l = 1, n_freq
        h(l, e) = smooth(l, e) + relative(e)*abs(smooth(l, e))*normal() + floors(e)*normal()
      end do
    end do
  end function noisy

  subroutine estimate(n_pairs, h, own_shape, robust)
    integer(ip), intent(in) :: n_pairs, robust
    complex(dp), intent(in) :: h(n_freq, m)
    real(dp), intent(in) :: own_shape(n_freq)

    call jf_estimate_noise(int(m, ip), int(n_freq, ip), n_pairs, robust, own_shape, h, smooth, share, none, first, &
                           second, 1.0_dp, parts, variance, level, factor, is_shaped, inflation, info)
    call check(info == 0, 'estimate')
  end subroutine estimate

  subroutine by_entry()
    real(dp) :: relative(m), floors(m), expected
    complex(dp) :: h(n_freq, m)
    integer(ip) :: pairs, robust
    integer :: e, l

    relative = [0.01_dp, 0.02_dp, 0.05_dp, 0.1_dp]
    floors = [5.0e-6_dp, 1.0e-6_dp, 5.0e-7_dp, 1.0e-7_dp]
    h = noisy(relative, floors)
    do pairs = 0, 1
      do robust = 0, 1
        call estimate(pairs, h, ones, robust)
        call check(all(abs(parts(:, 1)/relative - 1) < 0.25_dp), 'relative parts')
        do e = 1, m
          do l = 1, n_freq
            expected = (relative(e)*abs(smooth(l, e)))**2 + floors(e)**2
            call check(abs(log(variance(l, e)/expected)) < 0.7_dp, 'variance')
          end do
        end do
        call check(all(abs(level - 1) <= 0) .and. count(factor > 1) < 3, 'no variation')
        call check(inflation < 1.2_dp, 'independent lines')
      end do
    end do
  end subroutine by_entry

  !> A residual that lacks what smoothing has taken up.
  subroutine taken_up()
    complex(dp) :: h(n_freq, m)

    share = [0.1_dp, 0.2_dp, 0.5_dp, 0.95_dp]
    h = smooth + sqrt(1 - spread(min(share, 0.8_dp), 1, n_freq))*(noisy(spread_of(0.02_dp), spread_of(0.0_dp)) - smooth)
    call estimate(0_ip, h, ones, 0_ip)
    call check(all(abs(parts(:, 1)/0.02_dp - 1) < 0.15_dp), 'noise that smoothing has taken up')
    share = 0
  end subroutine taken_up

  pure function spread_of(value) result(all_entries)
    real(dp), intent(in) :: value
    real(dp) :: all_entries(m)

    all_entries = value
  end function spread_of

  subroutine outlying_lines()
    complex(dp) :: h(n_freq, m)
    integer, parameter :: bad(5) = [1, 77, 300, 301, 600]

    h = noisy(spread_of(0.02_dp), spread_of(0.0_dp))
    h(bad, :) = smooth(bad, :) + 100*(h(bad, :) - smooth(bad, :))
    call estimate(0_ip, h, ones, 0_ip)
    call check(all(factor(bad) > 100) .and. count(factor > 1) < 8, 'outlying lines')
    call check(all(abs(parts(:, 1)/0.02_dp - 1) < 0.15_dp), 'parts beside them')
    call estimate(1_ip, h, ones, 1_ip)
    call check(count(factor(bad) > 1) >= 4, 'outlying lines of differences')
  end subroutine outlying_lines

  subroutine slow_variation()
    complex(dp) :: h(n_freq, m)
    real(dp) :: size_of, own(n_freq)
    integer :: l

    h = noisy(spread_of(0.02_dp), spread_of(0.0_dp))
    do l = 1, n_freq
      size_of = 10.0_dp**(real(l, dp)/n_freq)
      h(l, :) = smooth(l, :) + size_of*(h(l, :) - smooth(l, :))
      own(l) = sqrt(variance(l, 1))
    end do
    call estimate(0_ip, h, ones, 0_ip)
    do l = 1, n_freq
      own(l) = sqrt(variance(l, 1))/(0.02_dp*10.0_dp**(real(l, dp)/n_freq)*abs(smooth(l, 1)))
    end do
    call check(count(abs(log(own)) < 0.35_dp) > 0.9_dp*n_freq, 'noise that rises tenfold')
    call check(maxval(level)/minval(level) > 20, 'its level')
  end subroutine slow_variation

  subroutine shaped_floor()
    complex(dp) :: h(n_freq, m)
    real(dp) :: expected
    integer :: e, far, l

    do e = 1, m
      do l = 1, n_freq
        h(l, e) = smooth(l, e)*(1 + 0.01_dp*normal()) + 1.0e-6_dp*sqrt(shape_of(l))*normal()
      end do
    end do
    call estimate(0_ip, h, shape_of, 0_ip)
    call check(is_shaped == 1, 'a floor of acceleration')
    call check(all(abs(parts(:, 2)/1.0e-6_dp - 1) < 0.2_dp), 'its size')
    far = 0
    do l = 1, n_freq
      expected = (0.01_dp*abs(smooth(l, 1)))**2 + 1.0e-12_dp*shape_of(l)
      if (abs(log(variance(l, 1)/expected)) > 0.5_dp) far = far + 1
    end do
    call check(far <= count(factor > 1) .and. far < 4, 'its variance')
    call estimate(0_ip, noisy(spread_of(0.01_dp), spread_of(1.0e-6_dp)), shape_of, 0_ip)
    call check(is_shaped == 0, 'a floor of displacement')
  end subroutine shaped_floor

  !> Noise that is given but for a factor.
  subroutine given_variance()
    complex(dp) :: h(n_freq, m)
    real(dp) :: given(n_freq, m)
    integer :: e, l

    do e = 1, m
      do l = 1, n_freq
        given(l, e) = merge(16.0_dp, 1.0_dp, mod(l, 7) == 0)*1.0e-4_dp*abs(smooth(l, e))**2
        h(l, e) = smooth(l, e) + 1.5_dp*sqrt(given(l, e))*normal()
      end do
    end do
    call jf_estimate_noise(int(m, ip), int(n_freq, ip), 0_ip, 0_ip, ones, h, smooth, share, given, first, second, &
                           1.0_dp, parts, variance, level, factor, is_shaped, inflation, info)
    call check(info == 0 .and. all(abs(parts(:, 3)/1.5_dp - 1) < 0.15_dp), 'factor of what is given')
    call check(all(abs(log(variance/(2.25_dp*given))) < 0.5_dp), 'variance that is given')
  end subroutine given_variance

  subroutine correlation()
    complex(dp) :: h(n_freq, m), e(n_freq + 4)
    integer(ip) :: pairs
    integer :: k, l

    do k = 1, m
      do l = 1, n_freq + 4
        e(l) = normal()/sqrt(5.0_dp)
      end do
      do l = 1, n_freq
        h(l, k) = smooth(l, k)*(1 + 0.02_dp*sum(e(l:l + 4)))
      end do
    end do
    do pairs = 0, 1
      call estimate(pairs, h, ones, 0_ip)
      call check(inflation > 3 .and. inflation < 8, 'noise that goes on over five lines')
    end do
  end subroutine correlation

  !> What the parts of the estimate give by themselves.
  subroutine line_routines()
    complex(dp) :: noise(n_freq, m)
    real(dp) :: found
    integer :: l

    noise = exp(cmplx(0.0_dp, 1.0_dp, dp))
    noise(100, :) = 4*noise(100, :)
    do l = 2, n_freq, 2
      noise(l, :) = -noise(l, :)
    end do
    call jf_line_levels(int(m, ip), int(n_freq, ip), noise, 1.0_dp, 1_ip, level, factor, info)
    call check(info == 0 .and. count(factor > 1) == 1, 'line levels')
    call check_close(factor(100), 16.0_dp, 1.0e-12_dp, 'factor of a line')
    call jf_line_correlation(int(m, ip), int(n_freq, ip), noise, 0.0_dp, found, info)
    call check(info == 0 .and. abs(found - 1) <= 0, 'lines that alternate')
    call jf_line_levels(-1_ip, int(n_freq, ip), noise, 1.0_dp, 1_ip, level, factor, info)
    call check(info == -1, 'levels: entries')
    call jf_line_levels(int(m, ip), -1_ip, noise, 1.0_dp, 1_ip, level, factor, info)
    call check(info == -2, 'levels: lines')
    call jf_line_levels(int(m, ip), int(n_freq, ip), noise, 0.5_dp, 1_ip, level, factor, info)
    call check(info == -4, 'levels: inflation')
    call jf_line_levels(int(m, ip), int(n_freq, ip), noise, 1.0_dp, 2_ip, level, factor, info)
    call check(info == -5, 'levels: flag')
    call jf_line_correlation(int(m, ip), int(n_freq, ip), noise, -0.1_dp, found, info)
    call check(info == -4, 'correlation: share')
  end subroutine line_routines

  subroutine nothing()
    real(dp) :: no_shape(0), no_given(0, 2), no_share(2), no_parts(2, 3), no_variance(0, 2), no_level(0), no_factor(0)
    complex(dp) :: no_h(0, 2)
    real(dp) :: found

    no_share = 0
    call jf_estimate_noise(2_ip, 0_ip, 0_ip, 0_ip, no_shape, no_h, no_h, no_share, no_given, first, second, 1.0_dp, &
                           no_parts, no_variance, no_level, no_factor, is_shaped, found, info)
    call check(info == 0 .and. abs(found - 1) <= 0 .and. all(abs(no_parts) <= 0), 'no lines')
    call jf_line_levels(2_ip, 0_ip, no_h, 1.0_dp, 1_ip, no_level, no_factor, info)
    call check(info == 0, 'levels of no lines')
    call jf_line_correlation(2_ip, 0_ip, no_h, 0.0_dp, found, info)
    call check(info == 0 .and. abs(found - 1) <= 0, 'correlation of no lines')
  end subroutine nothing

  subroutine wrong_arguments()
    complex(dp) :: bad(n_freq, m)
    real(dp) :: zero(n_freq), negative(n_freq, m)
    integer(ip) :: beyond(1)

    bad = smooth
    bad(3, 2) = cmplx(0.0_dp, not_a_number(), dp)
    zero = 0
    negative = -1
    beyond = 5
    call refused(-4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share, none, first, second, 1.0_dp, 1)
    call refused(4_ip, -1_ip, 1_ip, 0_ip, ones, smooth, smooth, share, none, first, second, 1.0_dp, 2)
    call refused(4_ip, 600_ip, -1_ip, 0_ip, ones, smooth, smooth, share, none, first, second, 1.0_dp, 3)
    call refused(4_ip, 600_ip, 1_ip, 2_ip, ones, smooth, smooth, share, none, first, second, 1.0_dp, 4)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, zero, smooth, smooth, share, none, first, second, 1.0_dp, 5)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, bad, smooth, share, none, first, second, 1.0_dp, 6)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, bad, share, none, first, second, 1.0_dp, 7)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share - 1, none, first, second, 1.0_dp, 8)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share, negative, first, second, 1.0_dp, 9)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share, none, beyond, second, 1.0_dp, 10)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share, none, first, beyond - 5_ip, 1.0_dp, 11)
    call refused(4_ip, 600_ip, 1_ip, 0_ip, ones, smooth, smooth, share, none, first, second, 0.5_dp, 12)
  end subroutine wrong_arguments

  subroutine refused(entries, lines, pairs, robust, own_shape, h, own_smooth, own_share, given, one, other, known, &
                     argument)
    integer(ip), intent(in) :: entries, lines, pairs, robust, one(1), other(1)
    real(dp), intent(in) :: own_shape(n_freq), own_share(m), given(n_freq, m), known
    complex(dp), intent(in) :: h(n_freq, m), own_smooth(n_freq, m)
    integer, intent(in) :: argument

    variance = untouched
    call jf_estimate_noise(entries, lines, pairs, robust, own_shape, h, own_smooth, own_share, given, one, other, &
                           known, parts, variance, level, factor, is_shaped, inflation, info)
    call check(info == -argument, 'a wrong argument')
    call check(all(abs(variance - untouched) <= 0), 'nothing was done')
  end subroutine refused
end program test_estimate_noise
