!> Medians, quantiles and the rising order, against counting.
program test_order_statistics
  use testing, only: check, check_close, dp, finish, random_real, seed
  use jointfrf_order_statistics, only: find_median, quantile, rising_order, sort
  implicit none
  integer :: n

  call seed(3)
  do n = 1, 70
    call against_counting(n)
  end do
  call known_quantiles()
  call finish('order_statistics')

contains

  !> Numbers of which many are equal.
  subroutine against_counting(n)
    integer, intent(in) :: n
    real(dp) :: values(n), moved(n), sorted(n), work(n), median, middle
    integer :: order(n), spare(n), k

    values = anint(5*pack(random_real(n, 1), .true.))
    moved = values
    call find_median(moved, median)
    sorted = values
    call sort(sorted, work, order, spare)
    call rising_order(values, order, spare)
    middle = (sorted((n + 1)/2) + sorted(n/2 + 1))/2
    call check(abs(median - middle) <= 0.0_dp, 'median')
    do k = 1, n
      call check(count(values < sorted(k)) < k .and. count(values <= sorted(k)) >= k, 'sorted number')
      call check(abs(values(order(k)) - sorted(k)) <= 0.0_dp .and. count(order == k) == 1, 'order')
    end do
    do k = 2, n
      call check(sorted(k - 1) < sorted(k) .or. order(k - 1) < order(k), 'equal numbers stay as they stand')
    end do
  end subroutine against_counting

  subroutine known_quantiles()
    real(dp), parameter :: sorted(5) = [0.0_dp, 1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]

    call check_close(quantile(sorted, 0.25_dp), 1.0_dp, 1.0e-15_dp, 'quarter')
    call check_close(quantile(sorted, 0.9_dp), 3.6_dp, 1.0e-15_dp, 'between two numbers')
    call check_close(quantile(sorted, 1.0_dp), 4.0_dp, 1.0e-15_dp, 'the largest')
    call check_close(quantile(sorted(2:2), 0.3_dp), 1.0_dp, 1.0e-15_dp, 'a single number')
  end subroutine known_quantiles
end program test_order_statistics
