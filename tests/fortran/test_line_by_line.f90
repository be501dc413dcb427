!> A program with a frequency loop of its own, one line at a time, in workspace that it asks for once before the loop:
!> the habit of LAPACK, by the explicit interfaces. The whole sweep at once gives the same bits.
program test_line_by_line
  use testing, only: check, check_same, dp, finish, infinity, ip, random_real, seed
  use jointfrf, only: jf_couple, jf_couple_work, jf_engine_automatic, jf_engine_lapack, jf_line_not_finite, &
    jf_receptance, jf_receptance_work, jf_set_engine
  implicit none
  integer(ip), parameter :: n = 3, n_j = 2, n_freq = 9, dofs(n) = [1_ip, 2_ip, 3_ip]
  integer(ip), parameter :: dofs_a(n_j) = [2_ip, 3_ip], dofs_b(n_j) = [1_ip, 2_ip]
  real(dp) :: stiffness(n, n), mass(n, n), omega(n_freq), rcond(n_freq, 2), rcond_one(n_freq, 2)
  complex(dp) :: h(n, n, n_freq), h_one(n, n, n_freq), h_c(2*n, 2*n, n_freq), h_c_one(2*n, 2*n, n_freq)
  complex(dp) :: k_joint(n_j, n_j, n_freq), ask(1)
  complex(dp), allocatable :: work(:)
  integer(ip), allocatable :: iwork(:)
  integer(ip) :: line_info(n_freq, 2), line_info_one(n_freq, 2), info(2), lwork(2), liwork(2), iask(1)
  integer :: i

  call seed(5)
  stiffness = 4.0_dp + random_real(int(n), int(n))
  mass = 0.1_dp*random_real(int(n), int(n))
  do i = 1, int(n)
    stiffness(i, i) = 20.0_dp
    mass(i, i) = 1.0_dp
  end do
  omega = [(0.4_dp*i, i=1, int(n_freq))]
  omega(4) = infinity()
  k_joint = 0
  do i = 1, int(n_j)
    k_joint(i, i, :) = cmplx(7.0_dp, 0.1_dp*omega, dp)
  end do
  call jf_set_engine(jf_engine_lapack, info(1))
  call check(info(1) == 0, 'the engine of the reference')
  call jf_receptance('T', n, n_freq, n, n, omega, stiffness, mass, 0_ip, mass, 0_ip, mass, 0.01_dp, dofs, dofs, h, &
                     line_info(:, 1), rcond(:, 1), info(1))
  call check(info(1) == 1 .and. line_info(4, 1) == jf_line_not_finite, 'one line is bad')
  call jf_couple('T', n, n, n_j, n_freq, h, h, k_joint, dofs_a, dofs_b, h_c, line_info(:, 2), rcond(:, 2), info(2))
  call check(info(2) == 1, 'and remains so')

  call jf_set_engine(jf_engine_automatic, info(1))
  call jf_receptance_work('T', n, 1_ip, n, n, omega, stiffness, mass, 0_ip, mass, 0_ip, mass, 0.01_dp, dofs, dofs, &
                          h_one, line_info_one, rcond_one, ask, -1_ip, iask, 1_ip, info(1))
  lwork(1) = int(ask(1), ip)
  liwork(1) = iask(1)
  call jf_couple_work('T', n, n, n_j, 1_ip, h_one, h_one, k_joint, dofs_a, dofs_b, h_c_one, line_info_one, rcond_one, &
                      ask, 1_ip, iask, -1_ip, info(2))
  lwork(2) = int(ask(1), ip)
  liwork(2) = iask(1)
  call check(all(info == 0) .and. all(lwork > 0) .and. all(liwork > 0), 'lengths')
  allocate (work(maxval(lwork)), iwork(maxval(liwork)))
  do i = 1, int(n_freq)
    call jf_receptance_work('T', n, 1_ip, n, n, omega(i), stiffness, mass, 0_ip, mass, 0_ip, mass, 0.01_dp, dofs, &
                            dofs, h_one(1, 1, i), line_info_one(i, 1), rcond_one(i, 1), work, size(work, kind=ip), &
                            iwork, size(iwork, kind=ip), info(1))
    call jf_couple_work('T', n, n, n_j, 1_ip, h_one(1, 1, i), h_one(1, 1, i), k_joint(1, 1, i), dofs_a, dofs_b, &
                        h_c_one(1, 1, i), line_info_one(i, 2), rcond_one(i, 2), work, size(work, kind=ip), iwork, &
                        size(iwork, kind=ip), info(2))
    call check(all(info == merge(1, 0, i == 4)), 'info of a line')
  end do
  call check(all(line_info_one == line_info), 'codes')
  do i = 1, 2
    call check_same(rcond_one(:, i), rcond(:, i), 'rcond')
  end do
  call check_same(h_one, h, 'receptance')
  call check_same(h_c_one, h_c, 'assembly')
  deallocate (work, iwork)
  call finish('line_by_line')
end program test_line_by_line
