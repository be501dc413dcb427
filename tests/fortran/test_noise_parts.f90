!> Parts of the variance against dense grids of the likelihood, against what made the noise, and robustly.
program test_noise_parts
  use testing, only: check, check_close, dp, finish, ip, qp, seed, uniform, untouched
  use jointfrf, only: jf_noise_parts
  implicit none

  call seed(4)
  call against_grid(20)
  call against_grid(32)
  call against_means_of_bins()
  call far_smaller_part()
  call medians_of_bins()
  call three_terms()
  call common_part()
  call nothing()
  call wrong_arguments()
  call finish('noise_parts')

contains

  !> An exponential variable of mean 1.
  function exponential() result(x)
    real(dp) :: x

    x = -log(uniform())
  end function exponential

  pure function loss(parts, y, terms) result(total)
    real(dp), intent(in) :: parts(:), y(:), terms(:, :)
    real(qp) :: total, v
    integer :: k

    total = 0
    do k = 1, size(y)
      v = sum(real(parts, qp)*terms(k, :))
      total = total + log(v) + y(k)/v
    end do
  end function loss

  !> So few lines are not binned: no point of a grid of odds, with the best size for each, is more likely.
  subroutine against_grid(n)
    integer, intent(in) :: n
    real(dp) :: y(n, 50), terms(n, 50, 2), parts(50, 2), odds, size_of
    real(qp) :: own, best
    integer(ip) :: info
    integer :: e, k

    do e = 1, 50
      odds = exp(24*uniform() - 12)
      do k = 1, n
        terms(k, e, :) = [exp(16*uniform() - 8), 1.0_dp]
        y(k, e) = (terms(k, e, 1) + merge(odds, 0.0_dp, mod(e, 3) > 0))*exponential()
      end do
    end do
    call jf_noise_parts('L', 2_ip, 50_ip, int(n, ip), y, terms, parts, info)
    call check(info == 0 .and. all(parts >= 0), 'parts')
    do e = 1, 50
      own = loss(parts(e, :), y(:, e), terms(:, e, :))
      best = own
      do k = -300, 300
        odds = exp(k/10.0_dp)
        size_of = sum(y(:, e)/(terms(:, e, 1) + odds))/n
        best = min(best, loss(size_of*[1.0_dp, odds], y(:, e), terms(:, e, :)))
      end do
      call check(own <= best + 1.0e-6_qp, 'no better odds')
    end do
  end subroutine against_grid

  !> Of many lines, means over 32 bins count.
  subroutine against_means_of_bins()
    integer, parameter :: n = 320
    real(dp) :: y(n, 1), terms(n, 1, 2), parts(1, 2), binned(1, 2)
    integer(ip) :: info
    integer :: k

    do k = 1, n                             ! constant within each bin, in falling order
      terms(k, 1, :) = [exp(-real((k - 1)/10, dp)), 1.0_dp]
      y(k, 1) = (0.3_dp*terms(k, 1, 1) + 1.0e-4_dp)*exponential()
    end do
    call jf_noise_parts('L', 2_ip, 1_ip, int(n, ip), y, terms, parts, info)
    call jf_noise_parts('L', 2_ip, 1_ip, 32_ip, reshape([(sum(y(k:k + 9, 1))/10, k=1, n, 10)], [32, 1]), &
                        terms(::10, :, :), binned, info)
    call check(all(abs(parts/binned - 1) < 1.0e-8_dp), 'parts by means')
    call check(all(abs(parts(1, :)/[0.3_dp, 1.0e-4_dp] - 1) < 0.3_dp), 'parts of the noise')
  end subroutine against_means_of_bins

  subroutine far_smaller_part()
    integer, parameter :: n = 2000
    real(dp) :: y(n, 1), terms(n, 1, 2), parts(1, 2)
    integer(ip) :: info
    integer :: k

    do k = 1, n
      terms(k, 1, :) = [10.0_dp**(14.0_dp*(k - n)/n), 1.0_dp]
      y(k, 1) = (0.3_dp*terms(k, 1, 1) + 1.0e-12_dp)*exponential()
    end do
    call jf_noise_parts('L', 2_ip, 1_ip, int(n, ip), y, terms, parts, info)
    call check(all(abs(parts(1, :)/[0.3_dp, 1.0e-12_dp] - 1) < 0.15_dp), 'a part that is far smaller')
  end subroutine far_smaller_part

  !> Lines with another error do not change medians, and change means.
  subroutine medians_of_bins()
    integer, parameter :: n = 3200
    real(dp) :: y(n, 1), terms(n, 1, 2), parts(1, 2)
    integer(ip) :: info
    integer :: k

    do k = 1, n
      terms(k, 1, :) = [exp(12*uniform() - 6), 1.0_dp]
      y(k, 1) = (0.01_dp*terms(k, 1, 1) + 0.01_dp)*exponential()
      if (mod(k, 40) == 0) y(k, 1) = 1000*y(k, 1)
    end do
    call jf_noise_parts('R', 2_ip, 1_ip, int(n, ip), y, terms, parts, info)
    call check(all(abs(parts(1, :)/0.01_dp - 1) < 0.15_dp), 'robust parts')
    call jf_noise_parts('L', 2_ip, 1_ip, int(n, ip), y, terms, parts, info)
    call check(all(parts(1, :)/0.01_dp > 5), 'parts of outlying lines')
  end subroutine medians_of_bins

  !> At the maximum the derivative of the likelihood by each part is zero.
  subroutine three_terms()
    integer, parameter :: n = 400
    real(dp) :: y(n, 1), terms(n, 1, 3), parts(1, 3), slope(3), v
    real(dp), parameter :: exact(3) = [1.0_dp, 0.5_dp, 2.0_dp]
    integer(ip) :: info
    integer :: k

    do k = 1, n
      terms(k, 1, :) = [exp(4*uniform() - 2), 1.0_dp, merge(3.0_dp, 0.1_dp, mod(k, 3) == 0)]
      y(k, 1) = sum(exact*terms(k, 1, :))*exponential()
    end do
    call jf_noise_parts('L', 3_ip, 1_ip, int(n, ip), y, terms, parts, info)
    slope = 0
    do k = 1, n
      v = sum(parts(1, :)*terms(k, 1, :))
      slope = slope + parts(1, :)*terms(k, 1, :)/v*(1 - y(k, 1)/v)
    end do
    call check(all(abs(slope) < 1.0_dp), 'derivative of the likelihood')
    call check(all(abs(parts(1, :)/exact - 1) < 0.6_dp), 'three parts')
  end subroutine three_terms

  !> One floor for all unless floors clearly differ; none where there is none.
  subroutine common_part()
    integer, parameter :: n = 400, m = 6
    real(dp) :: y(n, m), terms(n, m, 2), parts(m, 2), floors(m), rate
    integer(ip) :: info
    integer :: e, k, turn

    do turn = 1, 3
      do e = 1, m
        floors(e) = merge(16.0_dp**(real(e - 1, dp)/(m - 1)), 1.0_dp, turn == 2)
        if (turn == 3) floors(e) = 0
        do k = 1, n
          rate = real(k - 1, dp)/(n - 1)
          terms(k, e, :) = [1.0e-2_dp*1.0e5_dp**rate, 1.0_dp]
          y(k, e) = (terms(k, e, 1) + floors(e))*exponential()
        end do
      end do
      call jf_noise_parts('C', 2_ip, int(m, ip), int(n, ip), y, terms, parts, info)
      call check(all(abs(parts(:, 1) - 1) < 0.4_dp), 'first part')
      if (turn == 1) call check_close(maxval(parts(:, 2)), minval(parts(:, 2)), 1.0e-15_dp, 'one floor')
      if (turn < 3) call check(all(abs(log(parts(:, 2)/floors)) < 0.7_dp), 'floors')
      if (turn == 3) call check(all(parts(:, 2) <= 0), 'no floor')
    end do
  end subroutine common_part

  subroutine nothing()
    real(dp) :: none(0, 2), no_terms(0, 2, 2), parts(2, 2)
    integer(ip) :: info

    parts = untouched
    call jf_noise_parts('L', 2_ip, 2_ip, 0_ip, none, no_terms, parts, info)
    call check(info == 0, 'no lines')
  end subroutine nothing

  subroutine wrong_arguments()
    real(dp) :: y(3, 1), terms(3, 1, 2), parts(1, 2)
    integer(ip) :: info

    y = 1
    terms = 1
    parts = untouched
    call jf_noise_parts('X', 2_ip, 1_ip, 3_ip, y, terms, parts, info)
    call check(info == -1, 'method')
    call jf_noise_parts('C', 1_ip, 1_ip, 3_ip, y, terms, parts, info)
    call check(info == -2, 'terms')
    call jf_noise_parts('L', 2_ip, -1_ip, 3_ip, y, terms, parts, info)
    call check(info == -3, 'entries')
    call jf_noise_parts('L', 2_ip, 1_ip, -3_ip, y, terms, parts, info)
    call check(info == -4, 'lines')
    call check(all(abs(parts - untouched) <= 0), 'nothing was done')
  end subroutine wrong_arguments
end program test_noise_parts
