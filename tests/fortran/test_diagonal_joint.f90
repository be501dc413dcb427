!> The joint without cross terms that fits best: sums against loops over lines and parameters, minima that no other
!> parameters undercut.
program test_diagonal_joint
  use testing, only: check, check_close, check_same, dp, finish, infinity, ip, not_a_number, random_lines, &
    random_real, seed, set_threads, transposed, uniform
  use jointfrf, only: jf_fit_diagonal_joint
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, set_engine
  implicit none

  !> Forms of a joint seen with noise, and what is asked.
  type :: sample
    integer :: n, n_freq
    logical :: by_rate = .true.
    integer(ip), allocatable :: dof(:), kind(:)
    real(dp), allocatable :: omega(:), squares(:), exact(:), lower(:), upper(:)
    complex(dp), allocatable :: c0(:, :), w(:, :, :), p(:, :)
  end type sample

  call seed(21)
  call sums(make_sample(1, 3, 19, .true.))
  call sums(make_sample(2, 6, 37, .true.))
  call sums(make_sample(2, 3, 37, .false.))
  call sums(make_sample(3, 3, 8, .true.))
  call sums(make_sample(6, 18, 1100, .false.))
  call minimum(make_sample(1, 2, 40, .true.), 0)
  call minimum(make_sample(2, 6, 61, .true.), 0)
  call minimum(make_sample(2, 6, 61, .true.), 4)
  call minimum(make_sample(3, 7, 61, .false.), 2)
  call limits()
  call orders_of_storage(make_sample(3, 9, 21, .true.))
  call threads_and_engines(make_sample(6, 18, 3000, .true.))
  call not_finite(make_sample(2, 4, 9, .true.))
  call no_lines(make_sample(2, 4, 0, .true.))
  call wrong_arguments(make_sample(2, 4, 5, .true.))
  call finish('diagonal_joint')

contains

  !> n_par of the parameters a, then eta, then tau of all DOFs.
  function make_sample(n, n_par, n_freq, by_rate) result(s)
    integer, intent(in) :: n, n_par, n_freq
    logical, intent(in) :: by_rate
    type(sample) :: s
    complex(dp) :: a(n, n), r(n, 1, n_freq), mixed(n, n, n_freq), c(n)
    integer :: i, k

    s%n = n
    s%n_freq = n_freq
    s%by_rate = by_rate
    s%dof = [(int(1 + mod(i - 1, n), ip), i=1, n_par)]
    s%kind = [(int((i - 1)/n, ip), i=1, n_par)]
    allocate (s%exact(n_par), s%lower(n_par), s%upper(n_par), s%c0(n, n_freq), s%w(n, n, n_freq), s%p(n, n_freq), &
              s%squares(n_freq))
    do i = 1, n_par
      s%exact(i) = (0.5_dp + uniform())*merge(1.0_dp, merge(0.2_dp, 0.05_dp, s%kind(i) == 1), s%kind(i) == 0)
    end do
    s%lower = merge(0.0_dp, -infinity(), s%kind == 0)
    s%upper = infinity()
    s%omega = [(5*real(i, dp)/max(n_freq, 1), i=1, n_freq)]
    mixed = random_lines(n, n, n_freq)
    r = random_lines(n, 1, n_freq)
    do i = 1, n_freq
      a = 0.3_dp*mixed(:, :, i)
      do k = 1, n
        a(k, k) = a(k, k) + 10
      end do
      s%w(:, :, i) = matmul(conjg(transpose(a)), a)
      c = compliance(s, s%exact, s%omega(i))
      s%c0(:, i) = 1.1_dp*c
      ! Residual A (c + noise - C0) of what was seen.
      c = matmul(a, c - s%c0(:, i)) + 0.3_dp*r(:, 1, i)
      s%p(:, i) = matmul(conjg(transpose(a)), c)
      s%squares(i) = sum(abs(c)**2)
    end do
  end function make_sample

  pure function compliance(s, x, omega) result(c)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: x(:), omega
    complex(dp) :: c(s%n), rate(s%n)
    integer :: i

    rate = 0
    do i = s%n + 1, size(x)
      rate(s%dof(i)) = rate(s%dof(i)) + x(i)*merge(1.0_dp, omega, s%kind(i) == 1)
    end do
    if (.not. s%by_rate) rate = rate*x(:s%n)
    c = x(:s%n)/(1 + (0.0_dp, 1.0_dp)*rate)
  end function compliance

  !> The squares by their definition.
  pure function cost_of(s, x) result(cost)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: x(:)
    real(dp) :: cost
    complex(dp) :: d(s%n)
    integer :: i

    cost = 0
    do i = 1, s%n_freq
      d = compliance(s, x, s%omega(i)) - s%c0(:, i)
      cost = cost + s%squares(i) - 2*real(dot_product(d, s%p(:, i)), dp) + &
             real(dot_product(d, matmul(s%w(:, :, i), d)), dp)
    end do
  end function cost_of

  subroutine fit(s, steps, held, x, normal, descent, cost)
    type(sample), intent(in) :: s
    integer, intent(in) :: steps, held
    real(dp), intent(inout) :: x(:)
    real(dp), intent(out) :: normal(:, :), descent(:), cost
    integer(ip) :: info

    call jf_fit_diagonal_joint('N', merge(1_ip, 0_ip, s%by_rate), int(s%n, ip), size(x, kind=ip), int(s%n_freq, ip), &
                               int(steps, ip), int(held, ip), 1.0e-12_dp, s%dof, s%kind, s%lower, s%upper, s%omega, &
                               s%c0, s%w, s%p, s%squares, x, normal, descent, cost, info)
    call check(info == 0, 'good')
  end subroutine fit

  !> Without a step: squares, their derivatives, and J^H W J with J by differences.
  subroutine sums(s)
    type(sample), intent(in) :: s
    real(dp), dimension(size(s%exact)) :: x, descent, other
    real(dp) :: normal(size(x), size(x)), expected(size(x), size(x)), cost, step
    complex(dp) :: j(s%n, size(x), s%n_freq)
    integer :: i, k, l

    x = 1.2_dp*s%exact
    call fit(s, 0, 0, x, normal, descent, cost)
    call check_same(x, 1.2_dp*s%exact, 'no step leaves the parameters')
    call check_close(cost/cost_of(s, x), 1.0_dp, 1.0e-12_dp, 'squares')
    do k = 1, size(x)
      step = 1.0e-5_dp*x(k)
      other = x
      other(k) = x(k) + step
      do i = 1, s%n_freq
        j(:, k, i) = compliance(s, other, s%omega(i))
      end do
      expected(k, 1) = cost_of(s, other)
      other(k) = x(k) - step
      do i = 1, s%n_freq
        j(:, k, i) = (j(:, k, i) - compliance(s, other, s%omega(i)))/(2*step)
      end do
      expected(k, 1) = (cost_of(s, other) - expected(k, 1))/(4*step)
    end do
    call check(all(abs(descent - expected(:, 1)) < 1.0e-6_dp*maxval(abs(descent))), 'minus half the derivative')
    expected = 0
    do i = 1, s%n_freq
      do l = 1, size(x)
        do k = 1, size(x)
          expected(k, l) = expected(k, l) + real(dot_product(j(:, k, i), matmul(s%w(:, :, i), j(:, l, i))), dp)
        end do
      end do
    end do
    call check(maxval(abs(normal - expected)) < 1.0e-7_dp*maxval(abs(expected)), 'normal equations')
  end subroutine sums

  !> Nothing near is lower; what is held stays.
  subroutine minimum(s, held)
    type(sample), intent(in) :: s
    integer, intent(in) :: held
    real(dp), dimension(size(s%exact)) :: x, start, descent, error
    real(dp) :: normal(size(x), size(x)), cost, change(size(x), 1)
    integer :: i

    start = 1.5_dp*s%exact
    x = start
    call fit(s, 200, held, x, normal, descent, cost)
    call check_close(cost/cost_of(s, x), 1.0_dp, 1.0e-12_dp, 'squares at the minimum')
    call check(cost < cost_of(s, start), 'lower than the start')
    error = [(1/sqrt(normal(i, i)), i=1, size(x))]
    if (held > 0) then
      call check_same(x(held:held), start(held:held), 'held')
    else
      call check(all(abs(x - s%exact) < 20*error), 'near the joint that was seen')
    end if
    do i = 1, 30
      change = random_real(size(x), 1)
      if (held > 0) change(held, 1) = 0
      call check(cost_of(s, x + 0.01_dp*error*change(:, 1)) >= cost*(1 - 1.0e-13_dp), 'a minimum')
    end do
  end subroutine minimum

  !> A compliance that would be negative ends at zero, one above its upper limit there.
  subroutine limits()
    type(sample) :: s
    real(dp) :: x(2), normal(2, 2), descent(2), cost
    integer :: i

    s = make_sample(2, 2, 30, .true.)
    do i = 1, 30
      s%p(:, i) = matmul(s%w(:, :, i), [-0.3_dp, 5.0_dp] - s%c0(:, i))
    end do
    s%upper(2) = 2
    x = s%exact
    call fit(s, 100, 0, x, normal, descent, cost)
    call check_same(x, [0.0_dp, 2.0_dp], 'limits')
    call check(descent(1) < 0.0_dp .and. descent(2) > 0.0_dp, 'pressed against its limits')
    x = [3.0_dp, 7.0_dp]
    call fit(s, 0, 0, x, normal, descent, cost)
    call check_same(x, [3.0_dp, 2.0_dp], 'a start beyond a limit')
  end subroutine limits

  subroutine orders_of_storage(s)
    type(sample), intent(in) :: s
    real(dp), dimension(size(s%exact)) :: x, x_t, descent
    real(dp) :: normal(size(x), size(x)), cost, cost_t
    integer(ip) :: info

    x = 2*s%exact
    x_t = x
    call fit(s, 100, 0, x, normal, descent, cost)
    call jf_fit_diagonal_joint('T', 1_ip, int(s%n, ip), size(x, kind=ip), int(s%n_freq, ip), 100_ip, 0_ip, 1.0e-12_dp, &
                               s%dof, s%kind, s%lower, s%upper, s%omega, s%c0, transposed(s%w), s%p, s%squares, x_t, &
                               normal, descent, cost_t, info)
    call check(info == 0, 'transposed')
    call check_same(x_t, x, 'order of storage')
    call check_same([cost_t], [cost], 'order of storage: squares')
  end subroutine orders_of_storage

  subroutine threads_and_engines(s)
    type(sample), intent(in) :: s
    real(dp), dimension(size(s%exact)) :: x, other, descent
    real(dp) :: normal(size(x), size(x)), cost, there
    integer(ip) :: info
    integer :: threads

    x = 1.3_dp*s%exact
    call fit(s, 100, 0, x, normal, descent, cost)
    do threads = 1, 3
      call set_threads(threads)
      other = 1.3_dp*s%exact
      call fit(s, 100, 0, other, normal, descent, there)
      call check_same(other, x, 'threads')
    end do
    call set_threads(1)
    call set_engine(engine_lapack, info)
    other = 1.3_dp*s%exact
    call fit(s, 100, 0, other, normal, descent, there)
    call check_same(other, x, 'engine lapack')
    call set_engine(engine_plain, info)
    other = 1.3_dp*s%exact
    call fit(s, 100, 0, other, normal, descent, there)
    call check_close(there/cost, 1.0_dp, 1.0e-12_dp, 'engine plain')
    call set_engine(engine_automatic, info)
  end subroutine threads_and_engines

  subroutine not_finite(good)
    type(sample), intent(in) :: good
    type(sample) :: s
    real(dp), dimension(size(good%exact)) :: x, descent
    real(dp) :: normal(size(x), size(x)), cost

    s = good
    s%squares(7) = not_a_number()
    x = s%exact
    call fit(s, 100, 0, x, normal, descent, cost)
    call check(cost > huge(cost), 'squares that are NaN')
    call check_same(x, s%exact, 'no step from there')
    s = good
    s%w(1, 2, 3) = cmplx(0.0_dp, infinity(), dp)
    call fit(s, 100, 0, x, normal, descent, cost)
    call check(cost > huge(cost), 'a form that is not finite')
    call check_same(x, s%exact, 'no step, either')
  end subroutine not_finite

  subroutine no_lines(s)
    type(sample), intent(in) :: s
    real(dp), dimension(size(s%exact)) :: x, descent
    real(dp) :: normal(size(x), size(x)), cost

    x = s%exact
    call fit(s, 100, 0, x, normal, descent, cost)
    call check_same(x, s%exact, 'no lines')
    call check_same([cost, descent], [0.0_dp, 0*descent], 'no squares')
  end subroutine no_lines

  subroutine wrong_arguments(good)
    type(sample), intent(in) :: good
    type(sample) :: s

    s = good
    call try(s, 0)
    call try(s, -1, trans='X')
    call try(s, -2, by_rate=2)
    call try(s, -3, n=0)
    call try(s, -3, n=1001)
    call try(s, -4, n_par=1)
    call try(s, -4, n_par=7)
    call try(s, -5, n_freq=-1)
    call try(s, -6, steps=-1)
    call try(s, -7, held=-1)
    call try(s, -7, held=5)
    call try(s, -8, least_gain=-1.0_dp)
    call try(s, -8, least_gain=not_a_number())
    s%dof(3) = 3
    call try(s, -9)
    s%dof = good%dof
    s%kind(3) = 3
    call try(s, -10)
    s%kind(3) = 0
    call try(s, -10)
    s%kind = good%kind
    s%dof(4) = 1
    call try(s, -10)
    s%dof = good%dof
    s%lower(2) = not_a_number()
    call try(s, -12)
  end subroutine wrong_arguments

  subroutine try(s, expected, trans, by_rate, n, n_par, n_freq, steps, held, least_gain)
    type(sample), intent(in) :: s
    integer, intent(in) :: expected
    character, intent(in), optional :: trans
    integer, intent(in), optional :: by_rate, n, n_par, n_freq, steps, held
    real(dp), intent(in), optional :: least_gain
    integer(ip) :: i(6), info
    real(dp) :: x(4), normal(4, 4), descent(4), cost, gain
    character :: order

    i = [1, 2, 4, 5, 3, 0]
    order = 'N'
    gain = 0.1_dp
    if (present(trans)) order = trans
    if (present(by_rate)) i(1) = int(by_rate, ip)
    if (present(n)) i(2) = int(n, ip)
    if (present(n_par)) i(3) = int(n_par, ip)
    if (present(n_freq)) i(4) = int(n_freq, ip)
    if (present(steps)) i(5) = int(steps, ip)
    if (present(held)) i(6) = int(held, ip)
    if (present(least_gain)) gain = least_gain
    x = s%exact
    call jf_fit_diagonal_joint(order, i(1), i(2), i(3), i(4), i(5), i(6), gain, s%dof, s%kind, s%lower, s%upper, &
                               s%omega, s%c0, s%w, s%p, s%squares, x, normal, descent, cost, info)
    call check(info == expected, 'wrong arguments')
    if (expected == 0) return
    call check_same(x, s%exact, 'nothing is written')
  end subroutine try
end program test_diagonal_joint
