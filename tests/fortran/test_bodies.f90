!> Bodies connected all at once: against the dynamic stiffness of the whole, springs and constraints put in by hand.
program test_bodies
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, infinity, inverse, ip, random_lines, &
    random_regular, seed, set_threads, transposed
  use jointfrf, only: jf_couple, jf_couple_bodies, jf_line_not_finite
  implicit none

  !> Bodies, rows of connections, and what is wanted.
  type :: sample
    integer(ip), allocatable :: sizes(:), ends(:, :), connection(:), rigid(:), outputs(:), inputs(:)
    complex(dp), allocatable :: h(:, :), t(:, :)
    complex(dp), allocatable :: whole(:, :, :)   !< receptance of the assembly, all DOFs
  end type sample
  integer, parameter :: n_freq = 7

  call seed(41)
  call flexible_ring()
  call rigid_row()
  call like_two_structures()
  call storage_threads_and_choice(ring())
  call bad_lines(ring())
  call wrong_arguments(ring())
  call finish('bodies')

contains

  !> Three bodies of 3, 2 and 4 DOFs in a ring, the third twice in one connection and held by the ground.
  function ring() result(s)
    type(sample) :: s
    complex(dp) :: z(9, 9, n_freq), h1(3, 3, n_freq), h2(2, 2, n_freq), h3(4, 4, n_freq), k(2, 2, n_freq)
    complex(dp) :: t(8, n_freq)
    integer :: i

    h1 = random_regular(3, n_freq)
    h2 = random_regular(2, n_freq)
    h3 = random_regular(4, n_freq)
    z = 0
    z(1:3, 1:3, :) = inverse(h1)
    z(4:5, 4:5, :) = inverse(h2)
    z(6:9, 6:9, :) = inverse(h3)
    k = random_regular(2, n_freq)
    t(1:4, :) = reshape(k, [4, n_freq])
    t(5:8, :) = reshape(random_lines(4, 1, n_freq), [4, n_freq])
    call make(s, [3, 2, 4], reshape([1, 4, 2, 5, 4, 6, 7, 3, 8, 0, 6, 9], [2, 6]), [1, 1, 2, 3, 4, 5], [(0, i=1, 6)], &
              reshape([(h1(:, :, i), h2(:, :, i), h3(:, :, i), i=1, n_freq)], [29, n_freq]), t)
    call add(z, [1, 2], [4, 5], k)
    do i = 2, 5
      call add(z, [int(s%ends(1, i + 1))], [int(s%ends(2, i + 1))], reshape(s%t(3 + i, :), [1, 1, n_freq]))
    end do
    allocate (s%whole, source=inverse(z))
  end function ring

  !> A sample of which all DOFs are wanted.
  subroutine make(s, sizes, ends, connection, rigid, h, t)
    type(sample), intent(out) :: s
    integer, intent(in) :: sizes(:), ends(:, :), connection(:), rigid(:)
    complex(dp), intent(in) :: h(:, :), t(:, :)
    integer :: i

    allocate (s%sizes, source=int(sizes, ip))
    allocate (s%ends, source=int(ends, ip))
    allocate (s%connection, source=int(connection, ip))
    allocate (s%rigid, source=int(rigid, ip))
    allocate (s%h, source=h)
    allocate (s%t, source=t)
    allocate (s%outputs, source=[(int(i, ip), i=1, sum(sizes))])
    allocate (s%inputs, source=s%outputs)
  end subroutine make

  !> Add a stiffness between DOFs to a dynamic stiffness; 0 is the ground.
  subroutine add(z, plus, minus, k)
    complex(dp), intent(inout) :: z(:, :, :)
    integer, intent(in) :: plus(:), minus(:)
    complex(dp), intent(in) :: k(:, :, :)
    integer :: i, j

    do i = 1, size(plus)
      do j = 1, size(plus)
        z(plus(i), plus(j), :) = z(plus(i), plus(j), :) + k(i, j, :)
        if (minus(j) > 0) z(plus(i), minus(j), :) = z(plus(i), minus(j), :) - k(i, j, :)
        if (minus(i) > 0) z(minus(i), plus(j), :) = z(minus(i), plus(j), :) - k(i, j, :)
        if (minus(i) > 0 .and. minus(j) > 0) z(minus(i), minus(j), :) = z(minus(i), minus(j), :) + k(i, j, :)
      end do
    end do
  end subroutine add

  subroutine find(s, y, info, line_info, rcond, trans)
    type(sample), intent(in) :: s
    complex(dp), intent(out) :: y(:, :, :)
    integer(ip), intent(out) :: info
    integer(ip), intent(out), optional :: line_info(:)
    real(dp), intent(out), optional :: rcond(:)
    character, intent(in), optional :: trans
    integer(ip) :: code(size(s%h, 2))
    real(dp) :: condition(size(s%h, 2))
    character :: order

    order = 'N'
    if (present(trans)) order = trans
    call jf_couple_bodies(order, size(s%sizes, kind=ip), size(s%ends, 2, kind=ip), size(s%h, 1, kind=ip), &
                          size(s%t, 1, kind=ip), size(s%outputs, kind=ip), size(s%inputs, kind=ip), &
                          size(s%h, 2, kind=ip), s%sizes, s%ends, s%connection, s%rigid, s%h, s%t, s%outputs, &
                          s%inputs, y, code, condition, info)
    if (present(line_info)) line_info = code
    if (present(rcond)) rcond = condition
  end subroutine find

  subroutine flexible_ring()
    type(sample) :: s
    complex(dp) :: y(9, 9, n_freq)
    integer(ip) :: info

    s = ring()
    call find(s, y, info)
    call check(info == 0, 'ring: info')
    call check_close(y, s%whole, 1.0e-11_dp, 'ring of three bodies')
  end subroutine flexible_ring

  !> A rigid row: the same as a mass matrix in which both DOFs are one.
  subroutine rigid_row()
    type(sample) :: s
    complex(dp) :: h1(2, 2, n_freq), h2(2, 2, n_freq), z1(2, 2, n_freq), z2(2, 2, n_freq), z(3, 3, n_freq)
    complex(dp) :: whole(3, 3, n_freq), y(4, 4, n_freq)
    integer :: i
    integer(ip) :: info

    h1 = random_regular(2, n_freq)
    h2 = random_regular(2, n_freq)
    z1 = inverse(h1)
    z2 = inverse(h2)
    z = 0
    z(1:2, 1:2, :) = z1
    z(2:3, 2:3, :) = z(2:3, 2:3, :) + z2
    whole = inverse(z)
    call make(s, [2, 2], reshape([2, 3], [2, 1]), [1], [1], &
              reshape([(h1(:, :, i), h2(:, :, i), i=1, n_freq)], [8, n_freq]), &
              reshape([((1.0_dp, 0.0_dp), i=1, n_freq)], [1, n_freq]))
    call find(s, y, info)
    call check(info == 0, 'rigid: info')
    call check_close(y, whole([1, 2, 2, 3], [1, 2, 2, 3], :), 1.0e-11_dp, 'a rigid connection')
  end subroutine rigid_row

  subroutine like_two_structures()
    type(sample) :: s
    complex(dp) :: h_a(5, 5, n_freq), h_b(4, 4, n_freq), k(2, 2, n_freq), expected(9, 9, n_freq), y(9, 9, n_freq)
    integer(ip) :: line_info(n_freq), info
    real(dp) :: rcond(n_freq)
    integer :: i

    h_a = random_regular(5, n_freq)
    h_b = random_regular(4, n_freq)
    k = random_regular(2, n_freq)
    call jf_couple('N', 5_ip, 4_ip, 2_ip, int(n_freq, ip), h_a, h_b, k, [3_ip, 1_ip], [2_ip, 4_ip], expected, &
                   line_info, rcond, info)
    call make(s, [5, 4], reshape([3, 7, 1, 9], [2, 2]), [1, 1], [0, 0], &
              reshape([(h_a(:, :, i), h_b(:, :, i), i=1, n_freq)], [41, n_freq]), reshape(k, [4, n_freq]))
    call find(s, y, info)
    call check(info == 0, 'two structures: info')
    call check_close(y, expected, 1.0e-11_dp, 'as two structures')
  end subroutine like_two_structures

  subroutine storage_threads_and_choice(s)
    type(sample), intent(in) :: s
    type(sample) :: other
    complex(dp) :: y(9, 9, n_freq), again(9, 9, n_freq), some(3, 2, n_freq), turned(2, 3, n_freq)
    complex(dp) :: h1(3, 3, n_freq), h2(2, 2, n_freq), h3(4, 4, n_freq), k(2, 2, n_freq)
    integer(ip) :: info
    integer :: threads, i

    call find(s, y, info)
    do threads = 2, 3
      call set_threads(threads)
      call find(s, again, info)
      call check_same(again, y, 'threads')
    end do
    call set_threads(1)
    other = s
    other%outputs = [3_ip, 1_ip, 8_ip]
    other%inputs = [5_ip, 7_ip]
    call find(other, some, info)
    call check_close(some, y([3, 1, 8], [5, 7], :), 1.0e-12_dp, 'some responses and forces')
    h1 = transposed(reshape(s%h(1:9, :), [3, 3, n_freq]))
    h2 = transposed(reshape(s%h(10:13, :), [2, 2, n_freq]))
    h3 = transposed(reshape(s%h(14:29, :), [4, 4, n_freq]))
    k = transposed(reshape(s%t(1:4, :), [2, 2, n_freq]))
    other%h = reshape([(h1(:, :, i), h2(:, :, i), h3(:, :, i), i=1, n_freq)], [29, n_freq])
    other%t(1:4, :) = reshape(k, [4, n_freq])
    call find(other, turned, info, trans='T')
    call check(info == 0, 'transposed: info')
    call check_close(transposed(turned), some, 1.0e-12_dp, 'order of storage')
  end subroutine storage_threads_and_choice

  subroutine bad_lines(good)
    type(sample), intent(in) :: good
    type(sample) :: s
    complex(dp) :: y(9, 9, n_freq), expected(9, 9, n_freq)
    integer(ip) :: line_info(n_freq), info
    real(dp) :: rcond(n_freq)

    call find(good, expected, info)
    s = good
    s%h(20, 3) = cmplx(0.0_dp, infinity(), dp)
    call find(s, y, info, line_info, rcond)
    call check_bad_line(y, expected, 3, jf_line_not_finite, line_info, rcond, info, 'a number that is not finite')
    s = good
    s%ends(:, 2) = s%ends(:, 1)                    ! the same constraint twice
    s%rigid(1:2) = 1
    s%t(1:4, :) = spread([(1.0_dp, 0.0_dp), (0.0_dp, 0.0_dp), (0.0_dp, 0.0_dp), (1.0_dp, 0.0_dp)], 2, n_freq)
    call find(s, y, info, line_info, rcond)
    call check(info == n_freq .or. all(rcond < 1.0e-14_dp), 'a constraint that is there twice')
  end subroutine bad_lines

  subroutine wrong_arguments(good)
    type(sample), intent(in) :: good
    type(sample) :: s
    complex(dp) :: y(9, 9, n_freq)
    integer(ip) :: info

    call find(good, y, info, trans='X')
    call check(info == -1, 'trans')
    s = good
    s%h = good%h(:28, :)
    call try(s, -4)
    s = good
    s%t = good%t(:7, :)
    call try(s, -5)
    s = good
    s%sizes(2) = 0
    call try(s, -9)
    s = good
    s%ends(1, 2) = 10
    call try(s, -10)
    s%ends(1, 2) = 0
    call try(s, -10)
    s = good
    s%connection(3) = 4
    call try(s, -11)
    s = good
    s%rigid(1) = 2
    call try(s, -12)
    s = good
    s%outputs(2) = 1
    call try(s, -15)
    s = good
    s%inputs = [4_ip, 1_ip]
    call try(s, -16)
    s%inputs = [10_ip]
    call try(s, -16)
  end subroutine wrong_arguments

  subroutine try(s, code)
    type(sample), intent(in) :: s
    integer, intent(in) :: code
    complex(dp) :: y(9, 9, n_freq)
    integer(ip) :: info

    call find(s, y, info)
    call check(info == code, 'code of a wrong argument')
  end subroutine try
end program test_bodies
