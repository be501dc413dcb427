!> Probabilities of the gamma distribution by finite sums in quadruple precision and by the error function; quantiles by
!> their probabilities.
program test_gamma_distribution
  use testing, only: check, check_close, dp, finish, qp
  use jointfrf_gamma_distribution, only: gamma_probabilities, gamma_quantile
  implicit none
  real(dp), parameter :: places(7) = [1.0e-3_dp, 0.1_dp, 0.9_dp, 2.0_dp, 7.5_dp, 30.0_dp, 90.0_dp]
  integer :: n, k

  do k = 1, size(places)
    do n = 1, 40, 3
      call against_sum(n, places(k))
    end do
    call against_error_function(places(k))
  end do
  call quantiles()
  call finish('gamma_distribution')

contains

  !> Q(n, x) = exp(-x) sum x^k/k! below n.
  subroutine against_sum(n, x)
    integer, intent(in) :: n
    real(dp), intent(in) :: x
    real(qp) :: term, total
    real(dp) :: lower, upper
    integer :: i

    term = exp(-real(x, qp))
    total = term
    do i = 1, n - 1
      term = term*x/i
      total = total + term
    end do
    call gamma_probabilities(real(n, dp), x, lower, upper)
    call check(abs(upper - total) < 1.0e-12_qp*max(total, 1.0e-3_qp), 'upper probability')
    call check(abs(lower - (1 - total)) < 1.0e-12_qp, 'lower probability')
    if (x > n + 1) call check(abs(upper/total - 1) < 1.0e-11_qp, 'small upper probability')
  end subroutine against_sum

  !> P(1/2, x) = erf(sqrt(x)).
  subroutine against_error_function(x)
    real(dp), intent(in) :: x
    real(dp) :: lower, upper

    call gamma_probabilities(0.5_dp, x, lower, upper)
    call check_close(lower, erf(sqrt(x)), 1.0e-13_dp, 'error function')
    if (x > 1.5_dp) call check_close(upper/erfc(sqrt(x)), 1.0_dp, 1.0e-11_dp, 'its complement')
  end subroutine against_error_function

  subroutine quantiles()
    real(dp), parameter :: shapes(7) = [0.05_dp, 0.3_dp, 1.0_dp, 2.5_dp, 16.0_dp, 300.0_dp, 1.0e6_dp]
    real(dp), parameter :: tails(4) = [0.5_dp, 0.1_dp, 1.0e-5_dp, 1.0e-9_dp]
    real(dp) :: x, lower, upper
    integer :: i, j

    do i = 1, size(shapes)
      do j = 1, size(tails)
        x = gamma_quantile(shapes(i), 1.0_dp - tails(j), tails(j))
        call gamma_probabilities(shapes(i), x, lower, upper)
        call check_close(upper/tails(j), 1.0_dp, 1.0e-6_dp, 'upper quantile')
        if (shapes(i) < 0.1_dp) cycle               ! underflows
        x = gamma_quantile(shapes(i), tails(j), 1.0_dp - tails(j))
        call gamma_probabilities(shapes(i), x, lower, upper)
        call check_close(lower/tails(j), 1.0_dp, 1.0e-6_dp, 'lower quantile')
      end do
    end do
    call check_close(gamma_quantile(1.0_dp, 0.5_dp, 0.5_dp), log(2.0_dp), 1.0e-12_dp, 'median of the exponential')
    ! a - 1/3 + 8/(405 a) + ...
    call check_close(gamma_quantile(1.0e6_dp, 0.5_dp, 0.5_dp), 1.0e6_dp - 1/3.0_dp, 1.0e-11_dp, 'median of a large one')
  end subroutine quantiles
end program test_gamma_distribution
