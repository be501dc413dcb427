!> Coupled receptances against the assembled dynamic stiffness: the thesis' chain and random substructures.
program test_coupling
  use testing, only: assembled, check, check_bad_line, check_close, check_same, dp, finish, infinity, ip, &
    not_a_number, random_lines, random_regular, seed, set_threads, thesis_chain, transposed, two_pi
  use jointfrf_coupling, only: couple
  implicit none
  real(dp), parameter :: tolerance = 1.0e-12_dp

  call seed(7)
  call chain()
  call against_reference(5, 4, [4_ip, 1_ip, 5_ip], [2_ip, 4_ip, 1_ip])
  call against_reference(2, 6, [2_ip, 1_ip], [1_ip, 6_ip])
  call against_reference(1, 1, [1_ip], [1_ip])
  call many_dofs()
  call free_joint_dofs()
  call nothing()
  call bad_lines()
  call scales()
  call threads()
  call finish('coupling')

contains

  subroutine chain()
    integer, parameter :: lines = 40
    real(dp) :: freq_hz(lines), rcond(lines)
    complex(dp) :: h_a(2, 2, lines), h_b(2, 2, lines), h_c(4, 4, lines), expected(4, 4, lines), joint(lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    freq_hz = [(0.25_dp*i, i=0, lines - 1)]
    joint = cmplx(2000.0_dp, two_pi*freq_hz*3.0_dp, dp)
    call thesis_chain(freq_hz, joint, h_a, h_b, expected)
    call couple(.false., h_a, h_b, reshape(joint, [1, 1, lines]), [2_ip], [1_ip], h_c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'chain: good')
    call check_close(h_c, expected, tolerance, 'chain')
  end subroutine chain

  !> Nothing is symmetric, the joint couples all its DOFs, and their order differs on the two sides.
  subroutine against_reference(n_a, n_b, dofs_a, dofs_b)
    integer, intent(in) :: n_a, n_b
    integer(ip), intent(in) :: dofs_a(:), dofs_b(:)
    integer, parameter :: lines = 4
    complex(dp) :: h_a(n_a, n_a, lines), h_b(n_b, n_b, lines), k(size(dofs_a), size(dofs_a), lines)
    complex(dp) :: h_c(n_a + n_b, n_a + n_b, lines), h_c_t(n_a + n_b, n_a + n_b, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)

    h_a = random_regular(n_a, lines)
    h_b = random_regular(n_b, lines)
    k = random_lines(size(dofs_a), size(dofs_a), lines)
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, h_c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), 'good')
    call check_close(h_c, assembled(h_a, h_b, k, dofs_a, dofs_b), tolerance, 'assembly')
    call couple(.true., transposed(h_a), transposed(h_b), transposed(k), dofs_a, dofs_b, h_c_t, line_info, rcond_t, &
                info)
    call check_same(transposed(h_c_t), h_c, 'assembly, transposed')
    call check_same(rcond_t, rcond, 'rcond knows no order of storage')
  end subroutine against_reference

  !> So many that products are done line by line, in whole blocks and one that is not full; joint DOFs anywhere.
  subroutine many_dofs()
    integer, parameter :: n_a = 31, n_b = 22, n_j = 5, lines = 11
    integer(ip), parameter :: dofs_a(n_j) = [31_ip, 2_ip, 17_ip, 1_ip, 30_ip]
    integer(ip), parameter :: dofs_b(n_j) = [1_ip, 22_ip, 9_ip, 8_ip, 3_ip]
    complex(dp) :: h_a(n_a, n_a, lines), h_b(n_b, n_b, lines), k(n_j, n_j, lines)
    complex(dp) :: h_c(n_a + n_b, n_a + n_b, lines), h_c_t(n_a + n_b, n_a + n_b, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)

    h_a = random_regular(n_a, lines)
    h_b = random_regular(n_b, lines)
    k = random_lines(n_j, n_j, lines)
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, h_c, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'many DOFs: good')
    call check_close(h_c, assembled(h_a, h_b, k, dofs_a, dofs_b), tolerance, 'many DOFs')
    call couple(.true., transposed(h_a), transposed(h_b), transposed(k), dofs_a, dofs_b, h_c_t, line_info, rcond_t, &
                info)
    call check_close(transposed(h_c_t), h_c, tolerance, 'many DOFs, transposed')
    call check_same(rcond_t, rcond, 'many DOFs: rcond knows no order of storage')
    h_a(30, 7, 9) = not_a_number()
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, h_c_t, line_info, rcond, info)
    call check(info == 1 .and. line_info(9) == -1, 'many DOFs: NaN that no joint DOF sees')
    call check_same(h_c_t(:, :, :8), h_c(:, :, :8), 'many DOFs: the other lines')
  end subroutine many_dofs

  !> Joint DOFs without stiffness are allowed, though (2.25) inverts K*.
  subroutine free_joint_dofs()
    complex(dp) :: h_a(3, 3, 2), h_b(3, 3, 2), k(2, 2, 2), h_c(6, 6, 2), apart(6, 6, 2)
    integer(ip), parameter :: dofs_a(2) = [3_ip, 1_ip], dofs_b(2) = [1_ip, 2_ip]
    integer(ip) :: line_info(2), info
    real(dp) :: rcond(2)

    h_a = random_regular(3, 2)
    h_b = random_regular(3, 2)
    k = 0
    k(1, 1, 1) = (2.0_dp, 0.5_dp)
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, h_c, line_info, rcond, info)
    call check(info == 0, 'a joint DOF without stiffness is good')
    call check_close(h_c, assembled(h_a, h_b, k, dofs_a, dofs_b), tolerance, 'a joint DOF without stiffness')
    apart = 0
    apart(:3, :3, :) = h_a
    apart(4:, 4:, :) = h_b
    call check(.not. maxval(abs(h_c(:, :, 2) - apart(:, :, 2))) > 0.0_dp, 'K* = 0 leaves A and B apart')
  end subroutine free_joint_dofs

  subroutine nothing()
    integer(ip), parameter :: no_dofs(0) = [integer(ip) ::]
    complex(dp) :: h_a(2, 2, 1), h_b(1, 1, 1), no_k(0, 0, 1), h_c(3, 3, 1), empty(0, 0, 1), only_a(2, 2, 1)
    complex(dp) :: no_a(2, 2, 0), no_b(1, 1, 0), no_c(3, 3, 0), no_line_k(1, 1, 0), none(0, 0, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)

    h_a = random_regular(2, 1)
    h_b = random_regular(1, 1)
    call couple(.false., h_a, h_b, no_k, no_dofs, no_dofs, h_c, line_info, rcond, info)
    call check(info == 0 .and. rcond(1) >= 1.0_dp, 'no joint DOFs')
    call check_same(h_c(:2, :2, :), h_a, 'no joint DOFs: A unchanged')
    call check_same(h_c(3:, 3:, :), h_b, 'no joint DOFs: B unchanged')
    call check(.not. maxval(abs(h_c(3, :2, 1))) > 0.0_dp, 'no joint DOFs: nothing goes from A to B')
    call couple(.false., h_a, empty, no_k, no_dofs, no_dofs, only_a, line_info, rcond, info)
    call check(info == 0, 'B without DOFs')
    call check_same(only_a, h_a, 'B without DOFs changes nothing')
    call couple(.false., empty, empty, no_k, no_dofs, no_dofs, none, line_info, rcond, info)
    call check(info == 0 .and. line_info(1) == 0, 'no DOFs at all')
    call couple(.false., no_a, no_b, no_line_k, [2_ip], [1_ip], no_c, line_info(:0), rcond(:0), info)
    call check(info == 0, 'no lines')
  end subroutine nothing

  subroutine bad_lines()
    complex(dp) :: h_a(2, 2, 4), h_b(2, 2, 4), k(1, 1, 4), good(4, 4, 4), h_c(4, 4, 4), a(2, 2, 4), b(2, 2, 4)
    integer(ip), parameter :: dof_a(1) = [2_ip], dof_b(1) = [1_ip]
    integer(ip) :: line_info(4), info
    real(dp) :: rcond(4)

    h_a = random_regular(2, 4)
    h_b = random_regular(2, 4)
    k = 1
    call couple(.false., h_a, h_b, k, dof_a, dof_b, good, line_info, rcond, info)

    a = h_a
    b = h_b
    a(2, 2, 2) = -0.25_dp
    b(1, 1, 2) = -0.75_dp
    call couple(.false., a, b, k, dof_a, dof_b, h_c, line_info, rcond, info)
    call check_bad_line(h_c, good, 2, 1_ip, line_info, rcond, info, 'I + K* (H_jj + H_kk) singular')
    a = h_a
    a(1, 1, 4) = not_a_number()
    call couple(.false., a, h_b, k, dof_a, dof_b, h_c, line_info, rcond, info)
    call check_bad_line(h_c, good, 4, -1_ip, line_info, rcond, info, 'NaN in A')
    b = h_b
    b(2, 1, 1) = infinity()
    call couple(.false., h_a, b, k, dof_a, dof_b, h_c, line_info, rcond, info)
    call check_bad_line(h_c, good, 1, -1_ip, line_info, rcond, info, 'Inf in B')
    a = h_a
    a(:, :, 3) = reshape([0, 1, 1, 0], [2, 2])*1.0e200_dp
    call couple(.false., a, h_b, k, dof_a, dof_b, h_c, line_info, rcond, info)
    call check_bad_line(h_c, good, 3, -2_ip, line_info, rcond, info, 'overflow')
    k(1, 1, 2) = cmplx(1.0_dp, not_a_number(), dp)
    call couple(.false., h_a, h_b, k, dof_a, dof_b, h_c, line_info, rcond, info)
    call check_bad_line(h_c, good, 2, -1_ip, line_info, rcond, info, 'NaN in K*')
    call nearly_singular()
  end subroutine bad_lines

  !> One of two joint DOFs is within 1e-9 of I + K* (H_jj + H_kk) being singular.
  subroutine nearly_singular()
    complex(dp) :: h_a(2, 2, 1), h_b(2, 2, 1), k(2, 2, 1), h_c(4, 4, 1)
    integer(ip), parameter :: dofs(2) = [1_ip, 2_ip]
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)

    h_a = 0
    h_b = 0
    k = 0
    k(1, 1, 1) = 1
    k(2, 2, 1) = 1
    h_a(1, 1, 1) = -1.0_dp + 1.0e-9_dp
    call couple(.false., h_a, h_b, k, dofs, dofs, h_c, line_info, rcond, info)
    call check(info == 0, 'nearly singular is good')
    call check_close(rcond(1), 1.0e-9_dp, 1.0e-6_dp, 'rcond of a nearly singular line')
  end subroutine nearly_singular

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: h_a(3, 3, 1), h_b(2, 2, 1), k(2, 2, 1), one(5, 5, 1), h_c(5, 5, 1)
    integer(ip), parameter :: dofs_a(2) = [3_ip, 1_ip], dofs_b(2) = [1_ip, 2_ip]
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)
    integer :: i

    h_a = random_regular(3, 1)
    h_b = random_regular(2, 1)
    k = random_lines(2, 2, 1)
    call couple(.false., h_a, h_b, k, dofs_a, dofs_b, one, line_info, rcond, info)
    do i = 1, 2
      call couple(.false., factors(i)*h_a, factors(i)*h_b, k/factors(i), dofs_a, dofs_b, h_c, line_info, rcond, info)
      call check_close(h_c/factors(i), one, tolerance, 'scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 500
    complex(dp) :: h_a(3, 3, lines), h_b(2, 2, lines), k(2, 2, lines), h_c(5, 5, lines, 2)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines, 2)
    integer :: t

    h_a = random_regular(3, lines)
    h_b = random_regular(2, lines)
    k = random_lines(2, 2, lines)
    do t = 1, 2
      call set_threads(t)
      call couple(.false., h_a, h_b, k, [3_ip, 1_ip], [1_ip, 2_ip], h_c(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(h_c(:, :, :, 1), h_c(:, :, :, 2), 'one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), 'rcond: one thread and two')
  end subroutine threads
end program test_coupling
