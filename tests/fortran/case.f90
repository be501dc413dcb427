! Two beams and a joint (thesis case 3.2), from modern Fortran. The same case, alike line by line: tests/f77/case.f,
! tests/c/case.c, tests/python/support/case.py.
!
! A is clamped, two Euler-Bernoulli elements; B is free, one element. They are joined in deflection and rotation. The
! assembly through the actual joint K* stands for a measurement, the one through a first estimate K0 for a model. The
! joint comes back by ISMM and by inverse substructuring, as means over sensitive bands.
!
! Output, 17 significant digits: name(out,in), line, real part, imaginary part of gamma, k_ismm, k_short on all lines;
! then the means, method by method: k_Fy, k_Mtheta, c_Fy, c_Mtheta. Exit status 1 if anything is wrong.
program case
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use jointfrf, only: jf_couple, jf_info_text, jf_inverse_substructuring, jf_ismm, jf_receptance
  implicit none
  integer, parameter :: n = 4, n_j = 2, n_freq = 178
  real(dp), parameter :: loss = 0.01_dp, pi = 4*atan(1.0_dp)
  ! all DOFs of a beam; the joint's on A, on B, in the assembly
  integer, parameter :: all_dofs(n) = [1, 2, 3, 4], dofs_a(n_j) = [3, 4], dofs_b(n_j) = [1, 2]
  integer, parameter :: dofs_c(2*n_j) = [3, 4, 5, 6]
  real(dp) :: freq_hz(n_freq), omega(n_freq), rcond(n_freq)
  real(dp), dimension(n, n) :: k_a, m_a, k_b, m_b
  complex(dp), dimension(n, n, n_freq) :: h_a, h_b
  complex(dp), dimension(2*n, 2*n, n_freq) :: h_c, h_c0
  complex(dp), dimension(n_j, n_j, n_freq) :: k_joint, k_initial, k_ismm, k_short
  complex(dp), dimension(2*n_j, 2*n_j, n_freq) :: gamma, alpha
  integer :: line_info(n_freq), info, l

  freq_hz = [(15 + 5.0_dp*(l - 1), l = 1, n_freq)]
  omega = 2*pi*freq_hz

  ! the joint: stiffness N/m, N m/rad; damping N s/m, N m s/rad
  k_joint = joint([6e6_dp, 5e3_dp], [50.0_dp, 15.0_dp])
  k_initial = joint([1e6_dp, 1e3_dp], [25.0_dp, 5.0_dp])

  ! receptances of A and B
  call beam(0.300_dp, 2, 2, k_a, m_a)
  call beam(0.225_dp, 1, 0, k_b, m_b)
  call jf_receptance('N', n, n_freq, n, n, omega, k_a, m_a, 0, k_a, 0, k_a, loss, all_dofs, all_dofs, h_a, line_info, &
                     rcond, info)
  call test(info)
  call jf_receptance('N', n, n_freq, n, n, omega, k_b, m_b, 0, k_b, 0, k_b, loss, all_dofs, all_dofs, h_b, line_info, &
                     rcond, info)
  call test(info)

  ! the assembly through the joint and through the first estimate
  call jf_couple('N', n, n, n_j, n_freq, h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, info)
  call test(info)
  call jf_couple('N', n, n, n_j, n_freq, h_a, h_b, k_initial, dofs_a, dofs_b, h_c0, line_info, rcond, info)
  call test(info)

  ! its receptances at the joint
  gamma = h_c(dofs_c, dofs_c, :)
  alpha = h_c0(dofs_c, dofs_c, :)

  ! the joint again, two ways
  call jf_ismm('N', n_j, n_freq, alpha, gamma, k_initial, k_ismm, line_info, rcond, info)
  call test(info)
  call jf_inverse_substructuring('N', n_j, n_freq, gamma, k_short, line_info, rcond, info)
  call test(info)

  call print_lines('gamma', gamma)
  call print_lines('k_ismm', k_ismm)
  call print_lines('k_short', k_short)
  call print_means(k_ismm)
  call print_means(k_short)

contains

  ! Stiffness and consistent mass of a beam, N/m and kg. The first n_fix of its DOFs (deflection and rotation of each
  ! node) are held.
  subroutine beam(length, n_elements, n_fix, k, m)
    real(dp), intent(in) :: length
    integer, intent(in) :: n_elements, n_fix
    real(dp), intent(out) :: k(n, n), m(n, n)
    real(dp), parameter :: youngs_modulus = 67e9_dp, density = 2700, width = 0.025_dp, height = 0.006_dp
    real(dp), parameter :: table_k(4, 4) = reshape(real([12, 6, -12, 6,  6, 4, -6, 2,  -12, -6, 12, -6, &
                                                         6, 2, -6, 4], dp), [4, 4])
    real(dp), parameter :: table_m(4, 4) = reshape(real([156, 22, 54, -13,  22, 4, 13, -3,  54, 13, 156, -22, &
                                                         -13, -3, -22, 4], dp), [4, 4])
    real(dp) :: a, s, w, u(4)
    integer :: e, i, j, p, q

    a = length/n_elements
    s = youngs_modulus*(width*height*height*height/12)/(a*a*a)
    w = density*(width*height)*a/420
    u = [1.0_dp, a, 1.0_dp, a]
    k = 0
    m = 0
    do e = 1, n_elements
      do i = 1, 4
        do j = 1, 4
          p = 2*(e - 1) + i - n_fix
          q = 2*(e - 1) + j - n_fix
          if (p < 1 .or. q < 1) cycle
          k(p, q) = k(p, q) + s*table_k(i, j)*u(i)*u(j)
          m(p, q) = m(p, q) + w*table_m(i, j)*u(i)*u(j)
        end do
      end do
    end do
  end subroutine beam

  ! K* = k + i w c of a joint in deflection and rotation.
  function joint(stiffness, damping) result(k)
    real(dp), intent(in) :: stiffness(n_j), damping(n_j)
    complex(dp) :: k(n_j, n_j, n_freq)
    integer :: j

    k = 0
    do j = 1, n_j
      k(j, j, :) = cmplx(stiffness(j), omega*damping(j), dp)
    end do
  end function joint

  ! Stop where a call did not go well, and say in words what it was.
  subroutine test(info)
    integer, intent(in) :: info
    character :: text(80)

    if (info == 0) return
    call jf_info_text(info, size(text), text)
    print '(80a)', text
    stop 1
  end subroutine test

  subroutine print_lines(name, h)
    character(*), intent(in) :: name
    complex(dp), intent(in) :: h(:, :, :)
    integer :: i, j, l

    do l = 1, n_freq
      do i = 1, size(h, 1)
        do j = 1, size(h, 2)
          print '(a, "(", i1, ",", i1, ")", i4, 2(1x, 1pe24.16e2))', name, i, j, l, h(i, j, l)%re, h(i, j, l)%im
        end do
      end do
    end do
  end subroutine print_lines

  ! Print means of k and c over the sensitive bands: 200 to 900 Hz for deflection, 15 to 200 Hz for rotation.
  subroutine print_means(k)
    complex(dp), intent(in) :: k(:, :, :)
    real(dp), parameter :: low(n_j) = [200, 15], high(n_j) = [900, 200]
    real(dp) :: mean_k(n_j), mean_c(n_j)
    integer :: count, j, l

    do j = 1, n_j
      mean_k(j) = 0
      mean_c(j) = 0
      count = 0
      do l = 1, n_freq
        if (freq_hz(l) < low(j) .or. freq_hz(l) > high(j)) cycle
        mean_k(j) = mean_k(j) + k(j, j, l)%re
        mean_c(j) = mean_c(j) + k(j, j, l)%im/omega(l)
        count = count + 1
      end do
      mean_k(j) = mean_k(j)/count
      mean_c(j) = mean_c(j)/count
    end do
    print '(a, 1x, 1pe24.16e2)', 'k_Fy', mean_k(1), 'k_Mtheta', mean_k(2)
    print '(a, 1x, 1pe24.16e2)', 'c_Fy', mean_c(1), 'c_Mtheta', mean_c(2)
  end subroutine print_means
end program case
