!> The linear algebra of one line against quadruple precision.
program test_lines_lapack
  use testing, only: check, check_close, dp, finish, infinity, inverse, ip, norm_1, random_lines, random_regular, seed
  use jointfrf_lines_lapack, only: invert_line, one_norm, product_line, room_to_invert, room_to_solve, solve_line
  use jointfrf_kinds, only: long
  use jointfrf_sweep, only: line_space
  implicit none
  real(dp), parameter :: tolerance = 1.0e-13_dp
  integer, parameter :: sizes(7) = [1, 2, 3, 7, 32, 33, 70]
  type(line_space), allocatable, target :: space
  integer(long) :: declared(3)
  integer :: i

  call seed(2)
  do i = 1, size(sizes)
    call solution_and_inverse(sizes(i))
  end do
  call nothing_to_do()
  call special_matrices()
  call products()
  deallocate (space)
  call finish('lines_lapack')

contains

  !> Workspace for one matrix of 3 numbers, and for solution and inverse of order n.
  subroutine make_space(n)
    integer, intent(in) :: n
    complex(dp), pointer, contiguous :: three(:, :)
    integer :: stat

    if (allocated(space)) deallocate (space)
    allocate (space)
    call space%take(3, 1, three)
    call room_to_solve(n, space)
    call room_to_invert(n, space)
    call check(space%used == 3 .and. .not. associated(three), 'counted, and given back')
    call space%set_up(stat)
    call check(stat == 0, 'workspace')
    declared = [space%most%z, space%most%r, space%most%pivot]
    space%most%z = 0
    space%most%r = 0
    space%most%pivot = 0
  end subroutine make_space

  !> Solution and inverse have taken what was declared for them.
  subroutine check_taken()
    call check(all(declared == [space%most%z, space%most%r, space%most%pivot]), 'what was declared, no more, no less')
  end subroutine check_taken

  subroutine solution_and_inverse(n)
    integer, intent(in) :: n
    complex(dp) :: a(n, n, 1), expected(n, n, 1), lu(n, n, 1), b(n, 2, 1), x(n, 2, 1)
    real(dp) :: rcond, exact, norm, true_norm
    integer(ip) :: info

    call make_space(n)
    a = random_regular(n, 1)
    b = random_lines(n, 2, 1)
    expected = inverse(a)
    exact = 1.0_dp/(norm_1(a(:, :, 1))*norm_1(expected(:, :, 1)))

    lu = a
    x = b
    call solve_line(lu(:, :, 1), x(:, :, 1), space, info, rcond)
    b(:, :, 1) = matmul(expected(:, :, 1), b(:, :, 1))
    call check(info == 0 .and. space%used == 3, 'solve: good, workspace given back')
    call check_close(x, b, tolerance, 'solve')
    call check(rcond >= 0.999_dp*exact .and. rcond <= 4.0_dp*exact, 'solve: rcond')
    lu = a
    space%estimates = .true.
    call solve_line(lu(:, :, 1), x(:, :, 1), space, info, rcond)
    space%estimates = .false.
    call check(rcond >= exact/30.0_dp .and. rcond <= 30.0_dp*exact, 'solve: estimated rcond')

    lu = a
    call invert_line(lu(:, :, 1), space, info, rcond)
    call check(info == 0 .and. space%used == 3, 'inverse: good, workspace given back')
    call check_close(lu, expected, tolerance, 'inverse')
    call check_close(rcond, exact, 1.0e-10_dp, 'inverse: rcond')
    call check_taken()
    norm = one_norm(a(:, :, 1))
    true_norm = maxval(sum(abs(a(:, :, 1)), dim=1))
    call check_close(norm, norm_1(a(:, :, 1)), tolerance, 'one_norm')
    call check(norm >= true_norm .and. norm <= sqrt(2.0_dp)*true_norm, 'one_norm: near the 1-norm')
  end subroutine solution_and_inverse

  subroutine nothing_to_do()
    complex(dp) :: a(0, 0), b(0, 2), c(2, 2, 1), none(2, 0)
    real(dp) :: rcond
    integer(ip) :: info

    call make_space(2)
    call solve_line(a, b, space, info, rcond)
    call check(info == 0 .and. rcond >= 1.0_dp, 'solve of order 0')
    call invert_line(a, space, info, rcond)
    call check(info == 0 .and. rcond >= 1.0_dp, 'inverse of order 0')
    call check(.not. one_norm(a) > 0.0_dp, 'norm of order 0')
    c = 0
    call solve_line(c(:, :, 1), none, space, info, rcond)
    call check(info == 0 .and. rcond >= 1.0_dp, 'no right-hand side: nothing is inverted')
  end subroutine nothing_to_do

  subroutine special_matrices()
    complex(dp) :: a(3, 3), x(3, 1)
    real(dp) :: rcond
    integer(ip) :: info

    call make_space(3)
    a = 0
    a(1, 1) = 2
    a(3, 3) = 1
    x = 1
    call solve_line(a, x, space, info, rcond)
    call check(info == 2, 'solve: second pivot is zero')
    a = 0
    a(1, 1) = 2
    a(3, 3) = 1
    call invert_line(a, space, info, rcond)
    call check(info == 2, 'inverse: second pivot is zero')

    a = 0
    a(1, 1) = 1
    a(2, 2) = 1.0e-12_dp
    a(3, 3) = (0.0_dp, 1.0_dp)
    call solve_line(a, x, space, info, rcond)
    call check(info == 0, 'solve: nearly singular is good')
    call check_close(rcond, 1.0e-12_dp, 1.0e-10_dp, 'solve: rcond, nearly singular')
    a = 0
    a(1, 1) = 1
    a(2, 2) = 1.0e-12_dp
    a(3, 3) = (0.0_dp, 1.0_dp)
    space%estimates = .true.
    call solve_line(a, x, space, info, rcond)
    space%estimates = .false.
    call check_close(rcond, 1.0e-12_dp, 1.0e-10_dp, 'solve: rcond, nearly singular, is no estimate')
    a = 0
    a(1, 1) = 1
    a(2, 2) = 1.0e-12_dp
    a(3, 3) = (0.0_dp, 1.0_dp)
    call invert_line(a, space, info, rcond)
    call check(info == 0, 'inverse: nearly singular is good')
    call check_close(rcond, 1.0e-12_dp, 1.0e-10_dp, 'inverse: rcond, nearly singular')

    a = 0
    a(1, 1) = 1
    a(2, 2) = 1.0e-300_dp
    a(3, 3) = 1
    x = 1.0e300_dp
    call solve_line(a, x, space, info, rcond)
    call check(info == -2, 'solve: overflow')
    a = 0
    a(1, 1) = 1
    a(2, 2) = 1.0e-310_dp
    a(3, 3) = 1
    call invert_line(a, space, info, rcond)
    call check(info == -2, 'inverse: overflow')
    a = 0
    a(1, 1) = 1.0e-200_dp
    a(1, 2) = 1
    a(2, 2) = 1.0e-200_dp
    a(3, 3) = 1
    x = 1
    x(2, 1) = 0
    call solve_line(a, x, space, info, rcond)
    call check(info == 0 .and. .not. rcond > 0.0_dp, 'solve: good, while the inverse overflows')
    call check(one_norm(reshape([cmplx(infinity(), 0.0_dp, dp)], [1, 1])) > huge(1.0_dp), 'norm of Inf')
  end subroutine special_matrices

  !> C + factor op(A) op(B) for every pair of operations, all shapes different.
  subroutine products()
    character, parameter :: ops(3) = ['N', 'T', 'C']
    complex(dp) :: a(4, 5, 1), b(5, 3, 1), start(4, 3, 1), expected(4, 3, 1), c(4, 3, 1)
    integer :: i, j

    a = random_lines(4, 5, 1)
    b = random_lines(5, 3, 1)
    start = random_lines(4, 3, 1)
    expected(:, :, 1) = start(:, :, 1) - 0.5_dp*matmul(a(:, :, 1), b(:, :, 1))
    do j = 1, 3
      do i = 1, 3
        c = start
        call product_line(ops(i), ops(j), -0.5_dp, stored(ops(i), a(:, :, 1)), stored(ops(j), b(:, :, 1)), c(:, :, 1))
        call check_close(c, expected, tolerance, 'product '//ops(i)//ops(j))
      end do
    end do
    c = start
    call product_line('N', 'N', 1.0_dp, a(:, :0, 1), b(:0, :, 1), c(:, :, 1))
    call check_close(c, start, tolerance, 'product over nothing')
  end subroutine products

  !> The matrix whose op is m.
  function stored(op, m) result(a)
    character, intent(in) :: op
    complex(dp), intent(in) :: m(:, :)
    complex(dp), allocatable :: a(:, :)

    a = m
    if (op == 'T') a = transpose(m)
    if (op == 'C') a = conjg(transpose(m))
  end function stored
end program test_lines_lapack
