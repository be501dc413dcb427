! The joint of two beams (thesis case 3.3) from noisy FRFs at it, with standard errors, from modern Fortran. The same
! program, alike line by line: tests/f77/identify.f, tests/c/identify.c, tests/python/support/identify_joint.py.
!
! A is clamped, 300 elements of 1 mm; B is free, 225 elements; the elements are linear with shear and lumped mass. A
! joint in deflection and rotation connects them. Its stiffness and damping come from FRFs at both sides of it, 15 to
! 800 Hz, to which 5 % noise was added.
!
! Output, 6 significant digits: each parameter, its value and its standard error. Exit status 1 if anything is wrong.
program identify
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use jointfrf, only: jf_couple, jf_fit_joint, jf_info_text, jf_pollute, jf_receptance_banded
  implicit none
  integer, parameter :: n_a = 600, n_b = 452, n_j = 2, n_par = 4, n_freq = 786, n_near = 2
  integer, parameter :: tip_a(n_j) = [599, 600], tip_b(n_j) = [1, 2], joint_dofs(n_j) = [1, 2]
  ! The DOF of each parameter, and its kind: 0 stiffness, 2 viscous damping.
  integer, parameter :: dofs(n_par) = [1, 2, 1, 2], kinds(n_par) = [0, 0, 2, 2], seed(2) = [1, 0]
  real(dp), parameter :: level = 0.05_dp, pi = 4*atan(1.0_dp)
  character(8), parameter :: names(n_par) = [character(8) :: 'k_Fy', 'k_Mtheta', 'c_Fy', 'c_Mtheta']
  real(dp) :: omega(n_freq), rcond(n_freq), distance(n_freq), squares(n_freq), inverse_std(2*n_j, 2*n_j, n_freq)
  complex(dp), dimension(n_j, n_j, n_freq) :: h_a, h_b, k_joint, free_h, free_q, information
  complex(dp), dimension(2*n_j, 2*n_j, n_freq) :: gamma, measured
  complex(dp), dimension(n_j, n_freq) :: c_joint, gradient
  real(dp) :: spring(n_j), x(n_par), values(n_par), covariance(n_par, n_par), normal(n_par, n_par), descent(n_par)
  real(dp) :: line_descent(n_par, n_freq), whitening(1), cost, equations
  integer :: line_info(n_freq), used(n_freq), iterations, converged, info, i, j, l, first, last

  omega = [(2*pi*(15 + l - 1), l = 1, n_freq)]

  ! FRFs at the joint, coupled through it, and noise on them
  call beam(0.300_dp, n_a, 300, 2, tip_a, h_a)
  call beam(0.225_dp, n_b, 225, 0, tip_b, h_b)
  k_joint = 0
  k_joint(1, 1, :) = cmplx(6e5_dp, 20*omega, dp)
  k_joint(2, 2, :) = cmplx(5e3_dp, 1.5_dp*omega, dp)
  call jf_couple('N', n_j, n_j, n_j, n_freq, h_a, h_b, k_joint, joint_dofs, joint_dofs, gamma, line_info, rcond, info)
  call test(info)
  call jf_pollute('N', 'C', 'E', 0, 1, level, seed, 2*n_j, 2*n_j, n_freq, 0, 1, gamma, measured, info)
  call test(info)

  ! the mean of both directions, and one over the standard deviation of its noise, by the mean over neighbouring lines
  do l = 1, n_freq
    gamma(:, :, l) = 0.5_dp*(measured(:, :, l) + transpose(measured(:, :, l)))
  end do
  do l = 1, n_freq
    first = max(l - n_near, 1)
    last = min(l + n_near, n_freq)
    do j = 1, 2*n_j
      do i = 1, 2*n_j
        inverse_std(i, j, l) = sqrt((last - first + 1)/sum(gamma(i, j, first:last)%re**2 + &
                                                           gamma(i, j, first:last)%im**2))/level
        if (i /= j) inverse_std(i, j, l) = inverse_std(i, j, l)*sqrt(2.0_dp)
      end do
    end do
  end do

  ! the joint
  call jf_fit_joint('N', 1, n_j, n_par, 2*n_j, 2*n_j, 0, n_freq, 0, 8, 0, 0.0_dp, dofs, kinds, omega, gamma, gamma, &
                    inverse_std, whitening, spring, x, free_h, free_q, values, covariance, normal, descent, cost, &
                    equations, line_descent, distance, used, c_joint, information, gradient, squares, iterations, &
                    converged, line_info, info)
  call test(info)
  if (converged /= 1) stop 1
  do i = 1, n_par
    print '(a, 2(1x, 1pe13.5e2))', names(i), values(i), sqrt(covariance(i, i))
  end do

contains

  ! Stop where a call did not go well, and say in words what it was.
  subroutine test(info)
    integer, intent(in) :: info
    character :: text(80)

    if (info == 0) return
    call jf_info_text(info, size(text), text)
    print '(80a)', text
    stop 1
  end subroutine test

  ! Receptance at two DOFs of a beam of n DOFs, deflection and rotation of each node. The first n_fix are held. K and M
  ! are band matrices with three diagonals on each side: entry (p, q) at (4 + p - q, q).
  subroutine beam(length, n, n_elements, n_fix, tip, h)
    real(dp), intent(in) :: length
    integer, intent(in) :: n, n_elements, n_fix, tip(n_j)
    complex(dp), intent(out) :: h(n_j, n_j, n_freq)
    real(dp), parameter :: youngs_modulus = 67e9_dp, poisson = 0.33_dp, density = 2700, width = 0.025_dp
    real(dp), parameter :: height = 0.006_dp, loss = 0.01_dp
    real(dp) :: k(7, n), m(7, n), a, bending, shear, turn(4), angle(4), mass(4)
    integer :: e, i, j, p, q

    a = length/n_elements
    bending = youngs_modulus*(width*height*height*height/12)
    shear = 0.85_dp*youngs_modulus/(2*(1 + poisson))*(width*height)/(1 + 0.25_dp*a*a/(height*height))
    turn = [0.0_dp, -1/a, 0.0_dp, 1/a]
    angle = [-1/a, -0.5_dp, 1/a, -0.5_dp]
    mass = 0.5_dp*a*density*[width*height, width*height*height*height/12, width*height, width*height*height*height/12]
    k = 0
    m = 0
    do e = 1, n_elements
      do i = 1, 4
        do j = 1, 4
          p = 2*(e - 1) + i - n_fix
          q = 2*(e - 1) + j - n_fix
          if (p < 1 .or. q < 1) cycle
          k(4 + p - q, q) = k(4 + p - q, q) + a*(bending*turn(i)*turn(j) + shear*angle(i)*angle(j))
          if (i == j) m(4, q) = m(4, q) + mass(i)
        end do
      end do
    end do
    call jf_receptance_banded('N', n, 3, 3, n_freq, n_j, n_j, omega, k, m, 0, k, 0, k, loss, tip, tip, h, line_info, &
                              rcond, info)
    call test(info)
  end subroutine beam
end program identify
