!> Normal equations of the parameters of K*: against sums by definition, with derivatives of an inverse by differences.
program test_joint_derivatives
  use testing, only: check, check_same, dp, finish, infinity, inverse, ip, random_lines, random_regular, &
    seed, set_threads, transposed
  use jointfrf, only: jf_joint_normal_equations
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, set_engine
  implicit none

  !> A joint, which entries its parameters change, and forms.
  type :: sample
    integer :: n, n_par, n_entries, n_freq
    integer(ip), allocatable :: row(:), column(:)
    complex(dp), allocatable :: k(:, :, :), slope(:, :), c(:, :), w(:, :, :), r(:, :)
  end type sample

  call seed(33)
  call by_definition(make_sample(1, 1, 1))
  call by_definition(make_sample(1, 3, 19))
  call by_definition(make_sample(2, 5, 8))
  call by_definition(make_sample(3, 12, 37))
  call by_definition(make_sample(4, 7, 21))
  call by_definition(make_sample(6, 42, 530))
  call order_of_storage(make_sample(3, 12, 21))
  call threads_and_engines(make_sample(4, 20, 1500))
  call not_finite(make_sample(2, 4, 9))
  call no_lines(make_sample(2, 4, 0))
  call wrong_arguments(make_sample(2, 4, 5))
  call finish('joint_derivatives')

contains

  !> Several parameters share an entry; of some the row is below the column.
  function make_sample(n, n_par, n_freq) result(s)
    integer, intent(in) :: n, n_par, n_freq
    type(sample) :: s
    complex(dp) :: a(n, n), root((n*(n + 1))/2, (n*(n + 1))/2, n_freq), residual((n*(n + 1))/2, 1, n_freq)
    complex(dp) :: slope(n_par, 1, n_freq)
    integer :: i

    s%n = n
    s%n_par = n_par
    s%n_entries = (n*(n + 1))/2
    s%n_freq = n_freq
    s%row = [(int(1 + mod(i, n), ip), i=1, n_par)]
    s%column = [(int(1 + mod(i/2, n), ip), i=1, n_par)]
    s%k = random_regular(n, n_freq)
    root = random_lines(s%n_entries, s%n_entries, n_freq)
    residual = random_lines(s%n_entries, 1, n_freq)
    slope = random_lines(n_par, 1, n_freq)
    s%slope = slope(:, 1, :)
    s%r = residual(:, 1, :)
    allocate (s%c(s%n_entries, n_freq), s%w(s%n_entries, s%n_entries, n_freq))
    do i = 1, n_freq
      a = (s%k(:, :, i) + transpose(s%k(:, :, i)))/2
      s%k(:, :, i) = a
      s%w(:, :, i) = matmul(conjg(transpose(root(:, :, i))), root(:, :, i))
    end do
    s%c = upper(s, inverse(s%k))
  end function make_sample

  !> The upper triangle row by row.
  function upper(s, lines) result(entries)
    type(sample), intent(in) :: s
    complex(dp), intent(in) :: lines(:, :, :)
    complex(dp) :: entries(s%n_entries, s%n_freq)
    integer :: i, j, e

    e = 0
    do i = 1, s%n
      do j = i, s%n
        e = e + 1
        entries(e, :) = lines(i, j, :)
      end do
    end do
  end function upper

  subroutine find(s, normal, descent)
    type(sample), intent(in) :: s
    real(dp), intent(out) :: normal(:, :), descent(:)
    integer(ip) :: info

    call jf_joint_normal_equations('N', int(s%n, ip), int(s%n_par, ip), int(s%n_entries, ip), int(s%n_freq, ip), &
                                   s%row, s%column, s%slope, s%c, s%w, s%r, normal, descent, info)
    call check(info == 0, 'good')
  end subroutine find

  subroutine by_definition(s)
    type(sample), intent(in) :: s
    real(dp), parameter :: step = 1.0e-5_dp
    real(dp) :: normal(s%n_par, s%n_par), expected(s%n_par, s%n_par), descent(s%n_par), other(s%n_par)
    complex(dp) :: j(s%n_entries, s%n_par, s%n_freq), k(s%n, s%n, s%n_freq), there(s%n_entries, s%n_freq)
    integer :: i, l, sign

    j = 0
    do i = 1, s%n_par
      do sign = -1, 1, 2
        k = s%k
        k(s%row(i), s%column(i), :) = k(s%row(i), s%column(i), :) + sign*step*s%slope(i, :)
        if (s%row(i) /= s%column(i)) k(s%column(i), s%row(i), :) = k(s%row(i), s%column(i), :)
        there = upper(s, inverse(k))
        j(:, i, :) = j(:, i, :) + sign*there/(2*step)
      end do
    end do
    expected = 0
    other = 0
    do l = 1, s%n_freq
      expected = expected + real(matmul(conjg(transpose(j(:, :, l))), matmul(s%w(:, :, l), j(:, :, l))), dp)
      other = other + real(matmul(conjg(transpose(j(:, :, l))), s%r(:, l)), dp)
    end do
    call find(s, normal, descent)
    call check_same_to(1.0e-7_dp, [normal], [expected], 'normal equations')
    call check_same_to(1.0e-7_dp, descent, other, 'descent')
    call check_same([normal], [transpose(normal)], 'symmetric')
  end subroutine by_definition

  !> Alike within a share of the largest.
  subroutine check_same_to(share, actual, expected, what)
    real(dp), intent(in) :: share, actual(:), expected(:)
    character(*), intent(in) :: what

    call check(maxval(abs(actual - expected)) <= share*maxval(abs(expected)), what)
  end subroutine check_same_to

  subroutine order_of_storage(s)
    type(sample), intent(in) :: s
    real(dp), dimension(s%n_par, s%n_par) :: normal, normal_t
    real(dp), dimension(s%n_par) :: descent, descent_t
    integer(ip) :: info

    call find(s, normal, descent)
    call jf_joint_normal_equations('T', int(s%n, ip), int(s%n_par, ip), int(s%n_entries, ip), int(s%n_freq, ip), &
                                   s%row, s%column, s%slope, s%c, transposed(s%w), s%r, normal_t, descent_t, info)
    call check(info == 0, 'transposed')
    call check_same([normal_t], [normal], 'order of storage')
    call check_same(descent_t, descent, 'order of storage: descent')
  end subroutine order_of_storage

  subroutine threads_and_engines(s)
    type(sample), intent(in) :: s
    real(dp), dimension(s%n_par, s%n_par) :: normal, other
    real(dp), dimension(s%n_par) :: descent, there
    integer(ip) :: info
    integer :: threads

    call find(s, normal, descent)
    do threads = 1, 3
      call set_threads(threads)
      call find(s, other, there)
      call check_same([other], [normal], 'threads')
      call check_same(there, descent, 'threads: descent')
    end do
    call set_threads(1)
    call set_engine(engine_lapack, info)
    call find(s, other, there)
    call check_same([other], [normal], 'engine lapack')
    call set_engine(engine_plain, info)
    call find(s, other, there)
    call check_same_to(1.0e-13_dp, [other], [normal], 'engine plain')
    call set_engine(engine_automatic, info)
  end subroutine threads_and_engines

  subroutine not_finite(good)
    type(sample), intent(in) :: good
    type(sample) :: s
    real(dp) :: normal(good%n_par, good%n_par), descent(good%n_par)

    s = good
    s%c(2, 9) = cmplx(0.0_dp, infinity(), dp)
    call find(s, normal, descent)
    call check(.not. abs(normal(1, 1)) <= huge(1.0_dp), 'a compliance that is not finite')
  end subroutine not_finite

  subroutine no_lines(s)
    type(sample), intent(in) :: s
    real(dp) :: normal(s%n_par, s%n_par), descent(s%n_par)

    call find(s, normal, descent)
    call check_same([normal], [0*normal], 'no lines')
    call check_same(descent, 0*descent, 'no lines: descent')
  end subroutine no_lines

  subroutine wrong_arguments(good)
    type(sample), intent(in) :: good
    type(sample) :: s

    s = good
    call try(s, 0)
    call try(s, -1, trans='X')
    call try(s, -2, n=0)
    call try(s, -2, n=101)
    call try(s, -3, n_par=0)
    call try(s, -3, n_par=30001)
    call try(s, -4, n_entries=4)
    call try(s, -5, n_freq=-1)
    s%row(3) = 3
    call try(s, -6)
    s%row = good%row
    s%column(1) = 0
    call try(s, -7)
  end subroutine wrong_arguments

  subroutine try(s, code, trans, n, n_par, n_entries, n_freq)
    type(sample), intent(in) :: s
    integer, intent(in) :: code
    character, intent(in), optional :: trans
    integer, intent(in), optional :: n, n_par, n_entries, n_freq
    real(dp) :: normal(s%n_par, s%n_par), descent(s%n_par)
    character :: order
    integer(ip) :: size(4), info

    order = 'N'
    if (present(trans)) order = trans
    size = int([s%n, s%n_par, s%n_entries, s%n_freq], ip)
    if (present(n)) size(1) = int(n, ip)
    if (present(n_par)) size(2) = int(n_par, ip)
    if (present(n_entries)) size(3) = int(n_entries, ip)
    if (present(n_freq)) size(4) = int(n_freq, ip)
    call jf_joint_normal_equations(order, size(1), size(2), size(3), size(4), s%row, s%column, s%slope, s%c, s%w, s%r, &
                                   normal, descent, info)
    call check(info == code, 'code of a wrong argument')
  end subroutine try
end program test_joint_derivatives
