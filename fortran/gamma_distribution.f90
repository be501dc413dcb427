!> The gamma distribution of unit scale: probabilities and quantiles.
module jointfrf_gamma_distribution
  use jointfrf_kinds, only: dp
  implicit none
  private
  public :: gamma_probabilities, gamma_quantile

  integer, parameter :: most_steps = 100

contains

  !> P(a, x) and Q(a, x) = 1 - P, by the series or the continued fraction, whichever converges.
  !> a   shape, > 0
  !> x   > 0
  pure subroutine gamma_probabilities(a, x, lower, upper)
    real(dp), intent(in) :: a, x
    real(dp), intent(out) :: lower, upper
    real(dp) :: front, term, total, b, c, d, change, own
    integer :: k

    front = exp(a*log(x) - x - log_gamma(a))
    if (x < a + 1.0_dp) then
      own = a
      term = 1.0_dp/a
      total = term
      do while (term > epsilon(term)*total)
        own = own + 1.0_dp
        term = term*x/own
        total = total + term
      end do
      lower = min(front*total, 1.0_dp)
      upper = 1.0_dp - lower
    else
      b = x + 1.0_dp - a                            ! Lentz
      c = 1.0_dp/tiny(c)
      d = 1.0_dp/b
      total = d
      k = 0
      change = 0.0_dp
      do while (abs(change - 1.0_dp) > epsilon(change))
        k = k + 1
        own = -k*(k - a)
        b = b + 2.0_dp
        d = own*d + b
        if (abs(d) < tiny(d)) d = tiny(d)
        c = b + own/c
        if (abs(c) < tiny(c)) c = tiny(c)
        d = 1.0_dp/d
        change = d*c
        total = total*change
        if (k > 1000000) exit
      end do
      upper = min(front*total, 1.0_dp)
      lower = 1.0_dp - upper
    end if
  end subroutine gamma_probabilities

  !> x of given P(a, x), by Newton's method for the logarithm of the smaller probability.
  !> a              shape, > 0
  !> lower, upper   P and 1 - P, both > 0
  pure function gamma_quantile(a, lower, upper) result(x)
    real(dp), intent(in) :: a, lower, upper
    real(dp) :: x, p, q, density, step
    integer :: k

    x = a*(1.0_dp - 1.0_dp/(9.0_dp*a) + normal_quantile(lower, upper)/(3.0_dp*sqrt(a)))**3     ! Wilson and Hilferty
    if (.not. x > 0.0_dp) x = exp((log(lower) + log_gamma(a + 1.0_dp))/a)
    x = max(x, tiny(x))
    do k = 1, most_steps
      call gamma_probabilities(a, x, p, q)
      density = exp((a - 1.0_dp)*log(x) - x - log_gamma(a))
      if (lower <= upper) then
        step = log(lower/max(p, tiny(p)))*p/density
      else
        step = -log(upper/max(q, tiny(q)))*q/density
      end if
      step = min(max(step, -x/2.0_dp), x)
      x = x + step
      if (abs(step) <= 1.0e-12_dp*x) exit
    end do
  end function gamma_quantile

  !> Quantile of the normal distribution within 4.5e-4: C. Hastings, Approximations for Digital Computers, 1955.
  pure function normal_quantile(lower, upper) result(z)
    real(dp), intent(in) :: lower, upper
    real(dp) :: z, t

    t = sqrt(-2.0_dp*log(min(lower, upper)))
    z = t - (2.515517_dp + t*(0.802853_dp + t*0.010328_dp)) &
        /(1.0_dp + t*(1.432788_dp + t*(0.189269_dp + t*0.001308_dp)))
    if (lower < upper) z = -z
  end function normal_quantile
end module jointfrf_gamma_distribution
