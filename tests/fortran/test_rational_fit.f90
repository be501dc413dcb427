!> Rational functions with common poles: poles that are known are found, and a fit against plain normal equations in
!> quadruple precision.
program test_rational_fit
  use testing, only: check, check_close, dp, finish, infinity, ip, qp, quad_inverse, random_real, seed, &
    set_threads
  use jointfrf, only: jf_rational_fit, jf_relocate_poles
  use jointfrf_rational_fit, only: rational_fit, relocate_poles
  implicit none
  integer, parameter :: n_freq = 300, n_entries = 3, n_poles = 3
  complex(dp), parameter :: exact_poles(n_poles) = [(-0.01_dp, 0.3_dp), (-0.02_dp, 0.55_dp), (-0.005_dp, 0.8_dp)]
  complex(dp) :: s(n_freq), h(n_freq, n_entries)
  real(dp) :: weight(n_freq, n_entries)

  call seed(9)
  call known_functions()
  call finds_poles()
  call against_normal_equations()
  call losses()
  call threads()
  call nothing()
  call wrong_arguments()
  call finish('rational_fit')

contains

  subroutine known_functions()
    complex(dp) :: residue
    real(dp) :: random(2, n_poles + 1, n_entries)
    integer :: i, e, k

    s = [(cmplx(0.0_dp, i/real(n_freq, dp), dp), i=1, n_freq)]
    random = reshape(random_real(2*(n_poles + 1), n_entries), [2, n_poles + 1, n_entries])
    do e = 1, n_entries
      h(:, e) = cmplx(random(1, 1, e), random(2, 1, e), dp)
      do k = 1, n_poles
        residue = cmplx(random(1, k + 1, e), random(2, k + 1, e), dp)
        h(:, e) = h(:, e) + residue/(s - exact_poles(k))
      end do
    end do
    weight = 1 + abs(random_real(n_freq, n_entries))
  end subroutine known_functions

  !> From poles elsewhere; the sum of squares of the first ones is that of their fit.
  subroutine finds_poles()
    complex(dp) :: poles(n_poles), smooth(n_freq, n_entries)
    real(dp) :: squares, first, loss(n_poles)
    integer(ip) :: info
    integer :: k

    poles = [(-0.01_dp, 0.2_dp), (-0.01_dp, 0.5_dp), (-0.01_dp, 0.9_dp)]
    call relocate_poles(0, 0.0_dp, s, h, weight, poles, first, info)
    call check(info == 0 .and. all(aimag(poles) > [0.19_dp, 0.49_dp, 0.89_dp]), 'no relocation leaves the poles')
    call rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    call check_close(first/squares, 1.0_dp, 1.0e-9_dp, 'sum of squares of given poles')
    call relocate_poles(10, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == 0 .and. squares < 1.0e-12_dp*first, 'sum of squares of the poles found')
    do k = 1, n_poles
      call check(minval(abs(poles - exact_poles(k))) < 1.0e-8_dp, 'poles are found')
    end do
    call rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    call check(info == 0 .and. all(abs(smooth - h) < 1.0e-7_dp*abs(h)), 'the fit with the poles found')
  end subroutine finds_poles

  subroutine against_normal_equations()
    complex(dp) :: poles(2), smooth(n_freq, n_entries)
    complex(qp) :: a(n_freq, 3), normal(3, 3), c(3), expected(n_freq)
    real(dp) :: squares, loss(2)
    real(qp) :: total
    integer(ip) :: info
    integer :: e, k

    poles = exact_poles(:2)
    call rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    total = 0
    a(:, 1) = 1
    do k = 1, 2
      a(:, k + 1) = 1/(cmplx(s, kind=qp) - poles(k))
    end do
    do e = 1, n_entries
      do k = 1, 3
        normal(k, :) = matmul(conjg(a(:, k))*real(weight(:, e), qp)**2, a)
        c(k) = sum(conjg(a(:, k))*real(weight(:, e), qp)**2*h(:, e))
      end do
      expected = matmul(a, matmul(quad_inverse(normal), c))
      total = total + sum((weight(:, e)*abs(h(:, e) - expected))**2)
      call check(all(abs(smooth(:, e) - expected) < 1.0e-11_dp*abs(expected)), 'fit against normal equations')
    end do
    call check_close(squares/real(total, dp), 1.0_dp, 1.0e-11_dp, 'sum of squares against normal equations')
  end subroutine against_normal_equations

  !> What the sum of squares gains where a pole goes.
  subroutine losses()
    complex(dp) :: poles(n_poles), smooth(n_freq, n_entries)
    real(dp) :: squares, others, loss(n_poles), other_loss(n_poles - 1)
    integer(ip) :: info
    integer :: k

    poles = [(-0.01_dp, 0.28_dp), (-0.02_dp, 0.5_dp), (-0.005_dp, 0.81_dp)]
    call rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    do k = 1, n_poles
      call rational_fit(s, h, weight, [poles(:k - 1), poles(k + 1:)], smooth, others, other_loss, info)
      call check_close(loss(k)/(others - squares), 1.0_dp, 1.0e-9_dp, 'what a pole is worth')
    end do
  end subroutine losses

  !> The same bits on any number of threads; more poles, so that there is work for several.
  subroutine threads()
    integer, parameter :: many = 40, lines = 3000
    complex(dp) :: poles(many), more(many), long_s(lines), long_h(lines, 2), smooth(lines, 2, 2)
    real(dp) :: squares(2), loss(many, 2), ones(lines, 2)
    integer(ip) :: info
    integer :: i

    long_s = [(cmplx(0.0_dp, i/real(lines, dp), dp), i=1, lines)]
    long_h = reshape(cmplx(random_real(lines, 2), random_real(lines, 2), dp), [lines, 2])
    ones = 1
    poles = [(cmplx(-0.01_dp, i/real(many, dp), dp), i=1, many)]
    more = poles
    call set_threads(1)
    call relocate_poles(2, 0.0_dp, long_s, long_h, ones, poles, squares(1), info)
    call rational_fit(long_s, long_h, ones, poles, smooth(:, :, 1), squares(1), loss(:, 1), info)
    call set_threads(2)
    call relocate_poles(2, 0.0_dp, long_s, long_h, ones, more, squares(2), info)
    call rational_fit(long_s, long_h, ones, more, smooth(:, :, 2), squares(2), loss(:, 2), info)
    call check(all(abs(poles - more) <= 0.0_dp), 'poles on two threads')
    call check(abs(squares(1) - squares(2)) <= 0.0_dp, 'sum of squares on two threads')
    call check(all(abs(smooth(:, :, 1) - smooth(:, :, 2)) <= 0.0_dp), 'fit on two threads')
  end subroutine threads

  subroutine nothing()
    complex(dp) :: none(0), no_h(0, 2), no_smooth(0, 2), poles(1)
    real(dp) :: squares, loss(1), no_weight(0, 2)
    integer(ip) :: info

    poles = exact_poles(:1)
    call jf_rational_fit(1_ip, 2_ip, 0_ip, none, no_h, no_weight, poles, no_smooth, squares, loss, info)
    call check(info == 0 .and. abs(squares) <= 0.0_dp .and. abs(loss(1)) <= 0.0_dp, 'no lines')
    call jf_relocate_poles(1_ip, 2_ip, 0_ip, 3_ip, 0.0_dp, none, no_h, no_weight, poles, squares, info)
    call check(info == 0 .and. abs(poles(1) - exact_poles(1)) <= 0.0_dp, 'no lines: poles stay')
    call jf_relocate_poles(0_ip, 3_ip, int(n_freq, ip), 3_ip, 0.0_dp, s, h, weight, none, squares, info)
    call check(info == 0 .and. squares > 0.0_dp, 'no poles: a constant')
  end subroutine nothing

  subroutine wrong_arguments()
    complex(dp) :: poles(1), smooth(n_freq, n_entries)
    real(dp) :: squares, loss(1)
    integer(ip) :: info

    poles = exact_poles(:1)
    call jf_relocate_poles(-1_ip, 3_ip, 5_ip, 1_ip, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == -1, 'poles: a negative number')
    call jf_relocate_poles(10001_ip, 3_ip, 5_ip, 1_ip, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == -1, 'poles: too many')
    call jf_relocate_poles(1_ip, -3_ip, 5_ip, 1_ip, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == -2, 'entries')
    call jf_relocate_poles(1_ip, 3_ip, -5_ip, 1_ip, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == -3, 'lines')
    call jf_relocate_poles(1_ip, 3_ip, 5_ip, -1_ip, 0.0_dp, s, h, weight, poles, squares, info)
    call check(info == -4, 'iterations')
    call jf_relocate_poles(1_ip, 3_ip, 5_ip, 1_ip, -infinity(), s, h, weight, poles, squares, info)
    call check(info == -5, 'still')
    call jf_rational_fit(1_ip, 3_ip, -5_ip, s, h, weight, poles, smooth, squares, loss, info)
    call check(info == -3, 'lines of a fit')
    call check(abs(poles(1) - exact_poles(1)) <= 0.0_dp, 'nothing was done')
  end subroutine wrong_arguments
end program test_rational_fit
