!> Each of the four decoupling equations returns the joint that the assembly was made with.
program test_decoupling
  use testing, only: assembled, check, check_bad_line, check_close, check_same, dp, finish, infinity, ip, &
    not_a_number, random_lines, random_regular, seed, set_threads, thesis_chain, transposed, two_pi
  use jointfrf_decoupling, only: decouple, is_equation
  implicit none
  character(len=2), parameter :: equations(4) = ['rr', 'rs', 'sr', 'ss']
  integer :: e

  call seed(9)
  call names()
  do e = 1, 4
    call chain(equations(e))
    call random_joint(equations(e))
    call nothing(equations(e))
    call bad_lines(equations(e))
    call scales(equations(e))
    call threads(equations(e))
  end do
  call nearly_singular()
  call unread_dofs()
  call finish('decoupling')

contains

  subroutine names()
    integer :: i

    do i = 1, 4
      call check(is_equation(equations(i)), 'is '//equations(i))
    end do
    call check(.not. (is_equation('rt') .or. is_equation('RR') .or. is_equation('  ') .or. is_equation('jr')), &
               'no other letters')
  end subroutine names

  !> The block of an assembly that an equation needs: responses at its first letter, forces at its second.
  function measured(equation, n_a, dofs_r, dofs_s, assembly) result(h)
    character(len=2), intent(in) :: equation
    integer, intent(in) :: n_a
    integer(ip), intent(in) :: dofs_r(:), dofs_s(:)
    complex(dp), intent(in) :: assembly(:, :, :)
    complex(dp) :: h(size(dofs_r), size(dofs_r), size(assembly, 3))
    integer :: out(size(dofs_r)), in(size(dofs_r))

    out = merge(int(dofs_r), n_a + int(dofs_s), equation(1:1) == 'r')
    in = merge(int(dofs_r), n_a + int(dofs_s), equation(2:2) == 'r')
    h = assembly(out, in, :)
  end function measured

  subroutine chain(equation)
    character(len=2), intent(in) :: equation
    integer, parameter :: lines = 20
    real(dp) :: freq_hz(lines), rcond(lines)
    complex(dp) :: h_a(2, 2, lines), h_b(2, 2, lines), assembly(4, 4, lines), exact(1, 1, lines), k(1, 1, lines)
    integer(ip) :: line_info(lines), info
    integer :: i

    freq_hz = [(0.5_dp*i, i=1, lines)]
    exact(1, 1, :) = cmplx(2000.0_dp, two_pi*freq_hz*3.0_dp, dp)
    call thesis_chain(freq_hz, exact(1, 1, :), h_a, h_b, assembly)
    call decouple(equation, .false., h_a, h_b, measured(equation, 2, [1_ip], [2_ip], assembly), [2_ip], [1_ip], &
                  [1_ip], [2_ip], k, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), equation//', chain: good')
    call check_close(k, exact, 1.0e-10_dp, equation//', chain')
  end subroutine chain

  !> Nothing is symmetric and all DOFs are out of order.
  subroutine random_joint(equation)
    character(len=2), intent(in) :: equation
    integer, parameter :: lines = 4
    integer(ip), parameter :: j(2) = [4_ip, 2_ip], k(2) = [1_ip, 5_ip], r(2) = [5_ip, 1_ip], s(2) = [4_ip, 2_ip]
    complex(dp) :: h_a(5, 5, lines), h_b(6, 6, lines), exact(2, 2, lines), assembly(11, 11, lines), h_c(2, 2, lines)
    complex(dp) :: found(2, 2, lines), found_t(2, 2, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines), rcond_t(lines)

    h_a = random_regular(5, lines)
    h_b = random_regular(6, lines)
    exact = random_lines(2, 2, lines)
    assembly = assembled(h_a, h_b, exact, j, k)
    h_c = measured(equation, 5, r, s, assembly)
    call decouple(equation, .false., h_a, h_b, h_c, j, k, r, s, found, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0) .and. all(rcond > 0.0_dp .and. rcond < 1.001_dp), equation//': good')
    call check_close(found, exact, 1.0e-10_dp, equation//': K* returns')
    call decouple(equation, .true., transposed(h_a), transposed(h_b), transposed(h_c), j, k, r, s, found_t, line_info, &
                  rcond_t, info)
    call check_same(transposed(found_t), found, equation//', transposed')
    call check_same(rcond_t, rcond, equation//': rcond knows no order of storage')
  end subroutine random_joint

  subroutine nothing(equation)
    character(len=2), intent(in) :: equation
    integer(ip), parameter :: no_dofs(0) = [integer(ip) ::]
    complex(dp) :: h(2, 2, 1), empty(0, 0, 1), k(0, 0, 1), no_line(2, 2, 0), no_c(1, 1, 0), no_k(1, 1, 0)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)

    h = random_regular(2, 1)
    call decouple(equation, .false., h, h, empty, no_dofs, no_dofs, no_dofs, no_dofs, k, line_info, rcond, info)
    call check(info == 0 .and. line_info(1) == 0 .and. rcond(1) >= 1.0_dp, equation//': no joint DOFs')
    call decouple(equation, .false., no_line, no_line, no_c, [1_ip], [1_ip], [2_ip], [2_ip], no_k, line_info(:0), &
                  rcond(:0), info)
    call check(info == 0, equation//': no lines')
  end subroutine nothing

  subroutine bad_lines(equation)
    character(len=2), intent(in) :: equation
    integer(ip), parameter :: j(1) = [1_ip], r(1) = [2_ip]
    complex(dp) :: h_a(2, 2, 4), h_b(2, 2, 4), h_c(1, 1, 4), good(1, 1, 4), k(1, 1, 4), a(2, 2, 4), b(2, 2, 4), c(1, &
      1, 4)
    complex(dp) :: m
    integer(ip) :: line_info(4), info
    real(dp) :: rcond(4)

    h_a = random_regular(2, 4)
    h_b = random_regular(2, 4)
    h_c = random_lines(1, 1, 4)
    call decouple(equation, .false., h_a, h_b, h_c, j, j, r, r, good, line_info, rcond, info)

    ! M = 0: the measured receptance says that there is no joint
    c = h_c
    c(1, 1, 2) = 0
    if (equation == 'rr') c(1, 1, 2) = h_a(2, 2, 2)
    if (equation == 'ss') c(1, 1, 2) = h_b(2, 2, 2)
    call decouple(equation, .false., h_a, h_b, c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 2, 1_ip, line_info, rcond, info, equation//': M singular')

    ! K*^-1 = P M^-1 Q - H_jj - H_kk = 0: a rigid joint
    a = h_a
    b = h_b
    a(:, :, 3) = reshape([1, 1, 1, 2], [2, 2])
    b(:, :, 3) = reshape([1, 1, 1, 2], [2, 2])
    m = 0.5_dp
    c = h_c
    c(1, 1, 3) = m
    if (equation == 'rr' .or. equation == 'ss') c(1, 1, 3) = 2 - m
    call decouple(equation, .false., a, b, c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 3, 1_ip, line_info, rcond, info, equation//': rigid joint')
    ! P = Q = 0, M = 1, and K* = -1/(H_jj + H_kk) too large for a number
    a(:, :, 3) = reshape([0, 0, 0, 2], [2, 2])
    b(:, :, 3) = reshape([0, 0, 0, 2], [2, 2])
    b(1, 1, 3) = -1.0e-310_dp
    c(1, 1, 3) = 1
    call decouple(equation, .false., a, b, c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 3, -2_ip, line_info, rcond, info, equation//': overflow')

    a = h_a
    a(1, 2, 1) = not_a_number()
    call decouple(equation, .false., a, h_b, h_c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 1, -1_ip, line_info, rcond, info, equation//': NaN in A')
    b = h_b
    b(1, 2, 4) = infinity()
    call decouple(equation, .false., h_a, b, h_c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 4, -1_ip, line_info, rcond, info, equation//': Inf in B')
    c = h_c
    c(1, 1, 2) = cmplx(0.0_dp, -infinity(), dp)
    call decouple(equation, .false., h_a, h_b, c, j, j, r, r, k, line_info, rcond, info)
    call check_bad_line(k, good, 2, -1_ip, line_info, rcond, info, equation//': Inf in the measured receptance')
  end subroutine bad_lines

  !> rcond is the smaller one of the two matrices inverted.
  subroutine nearly_singular()
    integer(ip), parameter :: j(2) = [1_ip, 2_ip], r(2) = [3_ip, 4_ip]
    complex(dp) :: h_a(4, 4, 1), h_b(4, 4, 1), h_c(2, 2, 1), k(2, 2, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)
    integer :: m

    h_a = 0
    h_b = 0
    do m = 1, 4
      h_a(m, m, 1) = 1
      h_b(m, m, 1) = 1
    end do
    h_a(1, 1, 1) = -1.0_dp + 1.0e-7_dp       ! H_jj + H_kk = diag(1e-7, 2), and P = Q = 0
    h_c = 0
    h_c(1, 1, 1) = 1
    h_c(2, 2, 1) = 1
    call decouple('rs', .false., h_a, h_b, h_c, j, j, r, r, k, line_info, rcond, info)
    call check(info == 0, 'nearly rigid is good')
    call check_close(rcond(1), 0.5e-7_dp, 1.0e-6_dp, 'rcond of a nearly rigid joint')
    h_c(2, 2, 1) = 1.0e-9_dp
    call decouple('rs', .false., h_a, h_b, h_c, j, j, r, r, k, line_info, rcond, info)
    call check_close(rcond(1), 1.0e-9_dp, 1.0e-6_dp, 'rcond of a nearly singular M')
  end subroutine nearly_singular

  !> Internal DOFs that the equation does not name may be anything.
  subroutine unread_dofs()
    complex(dp) :: h_a(2, 2, 1), h_b(2, 2, 1), h_c(1, 1, 1), good(1, 1, 1), k(1, 1, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)

    h_a = random_regular(2, 1)
    h_b = random_regular(2, 1)
    h_c = random_lines(1, 1, 1)
    call decouple('rr', .false., h_a, h_b, h_c, [1_ip], [1_ip], [2_ip], [2_ip], good, line_info, rcond, info)
    call decouple('rr', .false., h_a, h_b, h_c, [1_ip], [1_ip], [2_ip], [-9_ip], k, line_info, rcond, info)
    call check_same(k, good, 'rr does not read s')
    call decouple('ss', .false., h_a, h_b, h_c, [1_ip], [1_ip], [2_ip], [2_ip], good, line_info, rcond, info)
    call decouple('ss', .false., h_a, h_b, h_c, [1_ip], [1_ip], [huge(1_ip)], [2_ip], k, line_info, rcond, info)
    call check_same(k, good, 'ss does not read r')
  end subroutine unread_dofs

  subroutine scales(equation)
    character(len=2), intent(in) :: equation
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    integer(ip), parameter :: j(2) = [1_ip, 3_ip], r(2) = [4_ip, 2_ip]
    complex(dp) :: h_a(4, 4, 1), h_b(4, 4, 1), h_c(2, 2, 1), one(2, 2, 1), k(2, 2, 1)
    integer(ip) :: line_info(1), info
    real(dp) :: rcond(1)
    integer :: i

    h_a = random_regular(4, 1)
    h_b = random_regular(4, 1)
    h_c = random_regular(2, 1)
    call decouple(equation, .false., h_a, h_b, h_c, j, j, r, r, one, line_info, rcond, info)
    do i = 1, 2
      call decouple(equation, .false., factors(i)*h_a, factors(i)*h_b, factors(i)*h_c, j, j, r, r, k, line_info, &
                    rcond, info)
      call check_close(factors(i)*k, one, 1.0e-12_dp, equation//': scaled')
    end do
  end subroutine scales

  subroutine threads(equation)
    character(len=2), intent(in) :: equation
    integer, parameter :: lines = 1500
    integer(ip), parameter :: j(2) = [1_ip, 3_ip], r(2) = [4_ip, 2_ip]
    complex(dp) :: h_a(4, 4, lines), h_b(4, 4, lines), h_c(2, 2, lines), k(2, 2, lines, 2)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines, 2)
    integer :: t

    h_a = random_regular(4, lines)
    h_b = random_regular(4, lines)
    h_c = random_regular(2, lines)
    do t = 1, 2
      call set_threads(t)
      call decouple(equation, .false., h_a, h_b, h_c, j, j, r, r, k(:, :, :, t), line_info, rcond(:, t), info)
    end do
    call check_same(k(:, :, :, 1), k(:, :, :, 2), equation//': one thread and two')
    call check_same(rcond(:, 1), rcond(:, 2), equation//': rcond, one thread and two')
  end subroutine threads
end program test_decoupling
