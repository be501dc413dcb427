!> The fit of a joint without cross terms: joints that exact FRFs come from, minima of the distance to noisy ones by
!> projections of their own, derivatives by differences.
program test_joint_fit
  use testing, only: check, check_close, check_same, dp, finish, infinity, ip, not_a_number, random_lines, seed, &
    set_threads, transposed, uniform
  use jointfrf, only: jf_fit_joint, jf_lowest_diagonal_joint, jf_start_joint
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, set_engine
  use jointfrf_manifold, only: project_on_joint
  implicit none

  !> FRFs of a joint, and what is asked.
  type :: sample
    logical :: reciprocal = .true.
    integer :: n, n_par, n_freq
    integer(ip), allocatable :: dof(:), kind(:)
    real(dp), allocatable :: omega(:), value(:), spring(:), w(:, :, :), whitening(:, :, :)
    complex(dp), allocatable :: smooth(:, :, :), measured(:, :, :)
  end type sample

  !> All that a fit returns.
  type :: outcome
    real(dp), allocatable :: spring(:), x(:), value(:), covariance(:, :), normal(:, :), descent(:), line_descent(:, :)
    real(dp), allocatable :: distance(:), squares(:)
    real(dp) :: cost, equations
    complex(dp), allocatable :: h(:, :, :), q(:, :, :), c(:, :), information(:, :, :), gradient(:, :)
    integer(ip), allocatable :: used(:), line_info(:)
    integer(ip) :: iterations, converged, info
  end type outcome

  call seed(31)
  call exact(1, 2, .true., .false.)
  call exact(2, 4, .true., .false.)
  call exact(2, 6, .false., .false.)
  call exact(3, 7, .true., .true.)
  call exact(6, 12, .true., .false.)
  call least_distance(1, 2, .true., .false.)
  call least_distance(2, 4, .true., .true.)
  call least_distance(2, 5, .false., .false.)
  call derivatives(2, 6, .true.)
  call derivatives(3, 7, .false.)
  call rigid_joint()
  call caught_joint()
  call far_lines()
  call noisy_lines()
  call orders_of_storage(.true.)
  call orders_of_storage(.false.)
  call starts()
  call threads_and_engines()
  call bad_lines()
  call no_lines()
  call wrong_arguments()
  call finish('joint_fit')

contains

  !> Values to a share of each.
  subroutine check_values(actual, expected, tolerance, what)
    real(dp), intent(in) :: actual(:), expected(:), tolerance
    character(len=*), intent(in) :: what

    call check(all(abs(actual - expected) <= tolerance*abs(expected)), what)
  end subroutine check_values

  !> n_par of stiffnesses, then h, then c; the FRFs are those of random H and Q, and fit the joint.
  function make_sample(n, n_par, n_freq, reciprocal, correlated, noise) result(s)
    integer, intent(in) :: n, n_par, n_freq
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in) :: noise
    type(sample) :: s
    complex(dp) :: h(n, n, n_freq), q(n, n, n_freq), e(2*n, 2*n, n_freq)
    integer :: i, k, n_entry

    s%reciprocal = reciprocal
    s%n = n
    s%n_par = n_par
    s%n_freq = n_freq
    s%dof = [(int(1 + mod(i - 1, n), ip), i=1, n_par)]
    s%kind = [(int((i - 1)/n, ip), i=1, n_par)]
    s%omega = [(1 + 3*real(i, dp)/max(n_freq, 1), i=1, n_freq)]
    allocate (s%value(n_par), s%spring(n))
    do i = 1, n_par
      s%value(i) = (0.5_dp + uniform())*merge(1.0_dp, merge(0.3_dp, 0.2_dp, s%kind(i) == 1), s%kind(i) == 0)
    end do
    s%spring = [(0.7_dp + 0.2_dp*i, i=1, n)]
    h = square(s)
    q = 0.3_dp*square(s)
    do i = 1, n
      h(i, i, :) = h(i, i, :) + 2
      q(i, i, :) = q(i, i, :) + 0.5_dp
    end do
    allocate (s%smooth(2*n, 2*n, n_freq), s%measured(2*n, 2*n, n_freq))
    s%smooth = frfs(s, h, q, compliance(s, coordinates(s, s%value)))
    e = random_lines(2*n, 2*n, n_freq)
    if (reciprocal) e = 0.5_dp*(e + transposed(e))
    s%measured = s%smooth + noise*e
    n_entry = merge(merge(n*(2*n + 1), 4*n*n, reciprocal), 0, correlated)
    allocate (s%w(2*n, 2*n, n_freq), s%whitening(n_entry, n_entry, n_freq))
    do k = 1, n_freq
      do i = 1, 2*n
        s%w(:, i, k) = [(50*(1 + uniform()), n_entry=1, 2*n)]
      end do
      if (reciprocal) s%w(:, :, k) = 0.5_dp*(s%w(:, :, k) + transpose(s%w(:, :, k)))
      do i = 1, size(s%whitening, 1)
        s%whitening(:, i, k) = [(0.2_dp*(uniform() - 0.5_dp), n_entry=1, size(s%whitening, 1))]
        s%whitening(i, i, k) = 1
        s%whitening(:i - 1, i, k) = not_a_number()                 ! not read
      end do
    end do
  end function make_sample

  function square(s) result(a)
    type(sample), intent(in) :: s
    complex(dp) :: a(s%n, s%n, s%n_freq)

    a = random_lines(s%n, s%n, s%n_freq)
    if (s%reciprocal) a = 0.5_dp*(a + transposed(a))
  end function square

  !> a = 1/(k + z), eta = h a, tau = c a.
  pure function coordinates(s, value) result(x)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: value(:)
    real(dp) :: x(size(value))
    integer :: i

    do i = 1, size(value)
      x(i) = 1/(value(s%dof(i)) + s%spring(s%dof(i)))
      if (s%kind(i) > 0) x(i) = value(i)*x(i)
    end do
  end function coordinates

  !> The diagonal of R.
  pure function compliance(s, x) result(r)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: x(:)
    complex(dp) :: r(s%n, s%n_freq), rate(s%n)
    integer :: i, k

    do k = 1, s%n_freq
      rate = 0
      do i = s%n + 1, size(x)
        rate(s%dof(i)) = rate(s%dof(i)) + x(i)*merge(1.0_dp, s%omega(k), s%kind(i) == 1)
      end do
      r(:, k) = x(:s%n)/(1 + (0.0_dp, 1.0_dp)*rate)
    end do
  end function compliance

  !> The FRFs of H, Q and R.
  function frfs(s, h, q, diagonal) result(gamma)
    type(sample), intent(in) :: s
    complex(dp), intent(in) :: h(:, :, :), q(:, :, :), diagonal(:, :)
    complex(dp) :: gamma(2*s%n, 2*s%n, s%n_freq)
    complex(dp), dimension(s%n, s%n) :: right, left, r, z, one
    integer :: i, a

    one = 0
    z = 0
    do a = 1, s%n
      one(a, a) = 1
      z(a, a) = s%spring(a)
    end do
    do i = 1, s%n_freq
      r = 0
      do a = 1, s%n
        r(a, a) = diagonal(a, i)
      end do
      right = matmul(one - matmul(z, r), one - matmul(q(:, :, i), r))
      left = matmul(one - matmul(r, q(:, :, i)), one - matmul(r, z))
      gamma(:s%n, :s%n, i) = h(:, :, i)
      gamma(:s%n, s%n + 1:, i) = matmul(h(:, :, i), right)
      gamma(s%n + 1:, :s%n, i) = matmul(left, h(:, :, i))
      gamma(s%n + 1:, s%n + 1:, i) = matmul(left, matmul(h(:, :, i), right)) + r - matmul(r, matmul(q(:, :, i), r))
    end do
  end function frfs

  !> Fit, from nothing or from coordinates, or from another outcome.
  function fit(s, x, near, trans) result(f)
    type(sample), intent(in) :: s
    real(dp), intent(in), optional :: x(:)
    type(outcome), intent(in), optional :: near
    character, intent(in), optional :: trans
    type(outcome) :: f
    integer(ip) :: start
    character :: order
    integer :: n, p, l

    n = s%n
    p = s%n_par
    l = s%n_freq
    allocate (f%spring(n), f%x(p), f%value(p), f%covariance(p, p), f%normal(p, p), f%descent(p), f%line_descent(p, l), &
              f%distance(l), f%squares(l), f%h(n, n, l), f%q(n, n, l), f%c(n, l), f%information(n, n, l), &
              f%gradient(n, l), f%used(l), f%line_info(l))
    f%spring = 0
    f%x = 0
    start = 0
    if (present(x)) then
      start = 1
      f%spring = s%spring
      f%x = x
    end if
    if (present(near)) then
      start = 2
      f%spring = near%spring
      f%x = near%x
      f%h = near%h
      f%q = near%q
    end if
    order = 'N'
    if (present(trans)) order = trans
    call jf_fit_joint(order, merge(1_ip, 0_ip, s%reciprocal), int(n, ip), int(p, ip), size(s%smooth, 1, kind=ip), &
                      size(s%smooth, 2, kind=ip), size(s%whitening, 1, kind=ip), int(l, ip), start, 8_ip, 0_ip, &
                      0.0_dp, s%dof, s%kind, s%omega, s%smooth, s%measured, s%w, s%whitening, f%spring, f%x, f%h, f%q, &
                      f%value, f%covariance, f%normal, f%descent, f%cost, f%equations, &
                      f%line_descent, f%distance, f%used, f%c, f%information, f%gradient, f%squares, f%iterations, &
                      f%converged, f%line_info, f%info)
  end function fit

  !> Exact FRFs give the joint they come from, whatever reference springs are taken.
  subroutine exact(n, n_par, reciprocal, correlated)
    integer, intent(in) :: n, n_par
    logical, intent(in) :: reciprocal, correlated
    type(sample) :: s
    type(outcome) :: f
    integer :: per_line

    s = make_sample(n, n_par, 61, reciprocal, correlated, 0.0_dp)
    f = fit(s)
    call check(f%info == 0 .and. f%converged == 1, 'exact FRFs: converged')
    call check_values(f%value, s%value, 1.0e-6_dp, 'exact FRFs: joint')
    call check(all(f%distance < 1.0e-6_dp) .and. all(f%used == 1), 'exact FRFs: distance')
    call check(abs(f%cost) < 1.0e-6_dp, 'exact FRFs: squares')
    per_line = merge(n*(2*n + 1) - n*(n + 1), 2*n*n, reciprocal)
    call check_same([f%equations], [61.0_dp*per_line], 'equations')
    f = fit(s, 1.3_dp*coordinates(s, s%value))
    call check_values(f%value, s%value, 1.0e-6_dp, 'springs that are given')
  end subroutine exact

  !> Squares of the distance between measured FRFs and those nearest to them that fit a joint.
  function distance(s, x, near) result(total)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: x(:)
    type(outcome), intent(in) :: near
    real(dp) :: total, squares(s%n_freq)
    complex(dp) :: r(s%n, s%n, s%n_freq), h(s%n, s%n, s%n_freq), q(s%n, s%n, s%n_freq), diagonal(s%n, s%n_freq)
    integer(ip) :: line_info(s%n_freq), info
    integer :: a

    diagonal = compliance(s, x)
    r = 0
    do a = 1, s%n
      r(a, a, :) = diagonal(a, :)
    end do
    h = near%h
    q = near%q
    call project_on_joint(.false., s%reciprocal, 60_ip, 1.0e-14_dp, s%measured, s%w, s%whitening, r, h, q, squares, &
                          line_info, info, s%spring)
    total = sum(squares)
  end function distance

  !> FRFs with noise that were not smoothed: no other joint is nearer, by projections of their own, and the curvature of
  !> the distance is the information.
  subroutine least_distance(n, n_par, reciprocal, correlated)
    integer, intent(in) :: n, n_par
    logical, intent(in) :: reciprocal, correlated
    type(sample) :: s
    type(outcome) :: f
    real(dp) :: least, error, there(2), step(n_par)
    integer :: i

    s = make_sample(n, n_par, 80, reciprocal, correlated, 3.0e-3_dp)
    s%smooth = s%measured
    f = fit(s, coordinates(s, s%value))
    call check(f%converged == 1, 'noisy FRFs: converged')
    call check(all(abs(f%value - s%value) < 6*[(sqrt(f%covariance(i, i)), i=1, n_par)]), 'noisy FRFs: joint')
    least = distance(s, f%x, f)
    call check_close(f%cost/least, 1.0_dp, 1.0e-3_dp, 'squares are the least distance')
    do i = 1, n_par
      error = 1/sqrt(f%normal(i, i))
      step = 0
      step(i) = error
      there = [distance(s, f%x + step, f), distance(s, f%x - step, f)]
      call check(all(there > least), 'no other joint is nearer')
      call check(abs(there(1) - there(2)) < 0.1_dp*sum(there - least), 'stationary')
      call check_close(0.5_dp*sum(there - least), 1.0_dp, 0.05_dp, 'information')
    end do
  end subroutine least_distance

  !> Derivatives of the forms and of the values, against differences.
  subroutine derivatives(n, n_par, reciprocal)
    integer, intent(in) :: n, n_par
    logical, intent(in) :: reciprocal
    type(sample) :: s
    type(outcome) :: f
    real(dp) :: expected(n_par, 40), value_slope(n_par, n_par), covariance(n_par, n_par), up(n_par), down(n_par), step
    integer :: i

    s = make_sample(n, n_par, 40, reciprocal, .false., 1.0e-3_dp)
    f = fit(s, 1.1_dp*coordinates(s, s%value))
    do i = 1, n_par
      step = 1.0e-5_dp*abs(f%x(i))
      up = f%x
      up(i) = f%x(i) + step
      down = f%x
      down(i) = f%x(i) - step
      expected(i, :) = (form(s, f, down) - form(s, f, up))/(4*step)
      value_slope(:, i) = (values(s, up) - values(s, down))/(2*step)
    end do
    call check(maxval(abs(f%line_descent - expected)) < 1.0e-6_dp*maxval(abs(expected)), 'descent of each line')
    call check(maxval(abs(sum(f%line_descent, 2) - f%descent)) < 1.0e-9_dp*maxval(abs(expected)), 'sum of descents')
    call check_close(sum(form(s, f, f%x)), f%cost, 1.0e-10_dp, 'squares of the forms')
    covariance = inverse(2*f%normal)
    covariance = matmul(value_slope, matmul(covariance, transpose(value_slope)))
    call check(maxval(abs(f%covariance - covariance)) < 1.0e-6_dp*maxval(abs(covariance)), 'covariance')
    call check_values(f%value, values(s, f%x), 1.0e-12_dp, 'values')
  end subroutine derivatives

  !> Squares of every line by their definition.
  pure function form(s, f, x) result(squares)
    type(sample), intent(in) :: s
    type(outcome), intent(in) :: f
    real(dp), intent(in) :: x(:)
    real(dp) :: squares(s%n_freq)
    complex(dp) :: d(s%n, s%n_freq)
    integer :: k

    d = compliance(s, x) - f%c
    do k = 1, s%n_freq
      squares(k) = f%squares(k) - 2*real(dot_product(d(:, k), f%gradient(:, k)), dp) + &
                   real(dot_product(d(:, k), matmul(f%information(:, :, k), d(:, k))), dp)
    end do
  end function form

  pure function values(s, x) result(value)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: x(:)
    real(dp) :: value(size(x))
    integer :: i

    do i = 1, size(x)
      value(i) = merge(1/x(i) - s%spring(s%dof(i)), x(i)/x(s%dof(i)), s%kind(i) == 0)
    end do
  end function values

  !> By Gauss and Jordan, for a positive definite matrix.
  pure function inverse(a) result(b)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: b(size(a, 1), size(a, 1)), c(size(a, 1), size(a, 1)), pivot
    integer :: i, k

    c = a
    b = 0
    do i = 1, size(a, 1)
      b(i, i) = 1
    end do
    do k = 1, size(a, 1)
      pivot = c(k, k)
      c(k, :) = c(k, :)/pivot
      b(k, :) = b(k, :)/pivot
      do i = 1, size(a, 1)
        if (i == k) cycle
        pivot = c(i, k)
        c(i, :) = c(i, :) - pivot*c(k, :)
        b(i, :) = b(i, :) - pivot*b(k, :)
      end do
    end do
  end function inverse

  !> A rigid DOF ends at a compliance that is nothing to its standard error; a free one without stiffness.
  subroutine rigid_joint()
    type(sample) :: s
    type(outcome) :: f
    real(dp) :: error

    s = make_sample(2, 2, 80, .true., .false., 0.0_dp)
    s%value = [1.0e12_dp, 0.0_dp]
    s%smooth = frfs(s, 2*square(s) + 3*eye(s), square(s) + eye(s), compliance(s, coordinates(s, s%value)))
    s%measured = s%smooth + 1.0e-3_dp*symmetric(s)
    f = fit(s)
    call check(f%info == 0 .and. f%converged == 1, 'rigid and free: converged')
    error = sqrt(0.5_dp/f%normal(1, 1))
    call check(f%x(1) < 6*error .and. error < 0.05_dp*f%x(2), 'a rigid DOF')
    call check(abs(f%value(2)) < 6*sqrt(f%covariance(2, 2)) .and. abs(f%value(2)) < 0.1_dp, 'a free DOF')
  end subroutine rigid_joint

  function eye(s) result(a)
    type(sample), intent(in) :: s
    complex(dp) :: a(s%n, s%n, s%n_freq)
    integer :: i

    a = 0
    do i = 1, s%n
      a(i, i, :) = 1
    end do
  end function eye

  function symmetric(s) result(e)
    type(sample), intent(in) :: s
    complex(dp) :: e(2*s%n, 2*s%n, s%n_freq)

    e = random_lines(2*s%n, 2*s%n, s%n_freq)
    e = 0.5_dp*(e + transposed(e))
  end function symmetric

  !> From a rigid joint with damping of the wrong sign a search alone finds nothing, one with other starts the joint.
  subroutine caught_joint()
    type(sample) :: s
    complex(dp) :: c(1, 40), w(1, 1, 40), p(1, 40)
    real(dp) :: squares(40), x(2), normal(2, 2), descent(2), cost, exact(2)
    integer(ip) :: info

    s = make_sample(1, 2, 40, .true., .false., 0.0_dp)
    s%kind(2) = 2
    exact = [0.5_dp, 0.7_dp]
    c = compliance(s, exact)
    w = 1.0e4_dp
    p = 0
    squares = 0
    x = [0.0_dp, -20.0_dp]
    call jf_lowest_diagonal_joint('N', 1_ip, 1_ip, 2_ip, 40_ip, 100_ip, 0_ip, 1.0e-10_dp, s%dof, s%kind, &
                                  [0.0_dp, -25.0_dp], [infinity(), 25.0_dp], s%omega, c, w, p, squares, x, normal, &
                                  descent, cost, info)
    call check(info == 0, 'lowest: good')
    call check_values(x, exact, 1.0e-5_dp, 'lowest: the joint')
    x = [0.3_dp, -20.0_dp]
    call jf_lowest_diagonal_joint('N', 1_ip, 1_ip, 2_ip, 40_ip, 100_ip, 1_ip, 1.0e-10_dp, s%dof, s%kind, &
                                  [0.0_dp, -25.0_dp], [infinity(), 25.0_dp], s%omega, c, w, p, squares, x, normal, &
                                  descent, cost, info)
    call check_same(x(1:1), [0.3_dp], 'lowest: what is held stays')
    call jf_lowest_diagonal_joint('N', 1_ip, 1_ip, 2_ip, 40_ip, 100_ip, 0_ip, 1.0e-10_dp, s%dof, s%kind(2:1:-1), &
                                  [0.0_dp, -25.0_dp], [infinity(), 25.0_dp], s%omega, c, w, p, squares, x, normal, &
                                  descent, cost, info)
    call check(info == -10, 'lowest: compliances come first')
  end subroutine caught_joint

  !> Lines that fit no joint are not used, and change nothing.
  subroutine far_lines()
    type(sample) :: s
    type(outcome) :: f
    complex(dp) :: wrong(4, 4, 61)
    integer :: k

    s = make_sample(2, 4, 61, .true., .false., 0.0_dp)
    wrong = symmetric(s)
    do k = 3, 61, 20
      s%smooth(:, :, k) = s%smooth(:, :, k) + wrong(:, :, k)
      s%measured(:, :, k) = s%smooth(:, :, k)
    end do
    f = fit(s)
    call check(f%converged == 1, 'far lines: converged')
    call check_values(f%value, s%value, 1.0e-6_dp, 'far lines: joint')
    call check(all(f%used(3:61:20) == 0) .and. count(f%used == 0) == 3, 'far lines are not used')
    call check(all(f%distance(3:61:20) > 12.0_dp), 'far lines: distance')
    call check(all(abs(f%gradient(:, 3:61:20)) <= 0.0_dp), 'far lines: forms')
  end subroutine far_lines

  !> With one DOF a line has one equation: noise takes one of twenty beyond three squares, and none is left out.
  subroutine noisy_lines()
    type(sample) :: s
    type(outcome) :: f

    s = make_sample(1, 2, 400, .true., .false., 3.0e-3_dp)
    s%w(:, :, :) = 1/sqrt(sum(abs(s%measured - s%smooth)**2)/size(s%smooth))
    s%smooth(:, :, :) = s%measured
    f = fit(s)
    call check(f%converged == 1, 'noisy lines: converged')
    call check(count(f%distance > 3.0_dp) > 4, 'noisy lines: some are beyond three squares')
    call check(all(f%used == 1), 'noisy lines: all are used')
  end subroutine noisy_lines

  subroutine orders_of_storage(reciprocal)
    logical, intent(in) :: reciprocal
    type(sample) :: s, t
    type(outcome) :: f, g
    integer :: k

    s = make_sample(2, 5, 33, reciprocal, .true., 2.0e-3_dp)
    if (reciprocal) then
      s%smooth(3, 1, :) = cmplx(not_a_number(), infinity(), dp)               ! not read
      s%measured(4, 2, :) = s%smooth(3, 1, :)
    end if
    t = s
    t%smooth = transposed(s%smooth)
    t%measured = transposed(s%measured)
    do k = 1, 33
      t%w(:, :, k) = transpose(s%w(:, :, k))
      t%whitening(:, :, k) = transpose(s%whitening(:, :, k))
    end do
    f = fit(s)
    g = fit(t, trans='T')
    call check(f%info == 0 .and. f%converged == 1, 'order of storage: good')
    call check_packed(s, f)
    call check_same(g%x, f%x, 'order of storage')
    call check_same(transposed(g%h), f%h, 'order of storage: H')
    call check_same(transposed(g%q), f%q, 'order of storage: Q')
    call check_same(transposed(g%information), f%information, 'order of storage: W')
    call check(maxval(abs(g%line_descent - f%line_descent)) <= 1.0e-10_dp*maxval(abs(f%line_descent)), &
               'order of storage: descents')
  end subroutine orders_of_storage

  !> The same of packed FRFs, row by row, in either order of storage.
  subroutine check_packed(s, f)
    type(sample), intent(in) :: s
    type(outcome), intent(in) :: f
    type(sample) :: t
    type(outcome) :: g
    integer :: n_entry, i, j, e

    n_entry = size(s%whitening, 1)
    t = s
    deallocate (t%smooth, t%measured, t%w)
    allocate (t%smooth(n_entry, 1, s%n_freq), t%measured(n_entry, 1, s%n_freq), t%w(n_entry, 1, s%n_freq))
    e = 0
    do i = 1, 2*s%n
      do j = merge(i, 1, s%reciprocal), 2*s%n
        e = e + 1
        t%smooth(e, 1, :) = s%smooth(i, j, :)
        t%measured(e, 1, :) = s%measured(i, j, :)
        t%w(e, 1, :) = s%w(i, j, :)
      end do
    end do
    g = fit(t)
    call check_same(g%x, f%x, 'packed')
    call check_same(g%line_descent(1, :), f%line_descent(1, :), 'packed: descents')
    do i = 1, s%n_freq
      t%whitening(:, :, i) = transpose(s%whitening(:, :, i))
    end do
    g = fit(t, trans='T')
    call check_same(g%x, f%x, 'packed, the other order of storage')
  end subroutine check_packed

  !> The first values of the joint, and fits that begin elsewhere.
  subroutine starts()
    type(sample) :: s
    type(outcome) :: f, g
    real(dp) :: fitted(4), undamped(4)
    integer(ip) :: info

    s = make_sample(2, 4, 61, .true., .false., 0.0_dp)
    call jf_start_joint('N', 1_ip, 2_ip, 4_ip, 4_ip, 4_ip, 61_ip, s%dof, s%kind, s%omega, s%spring, s%smooth, s%w, &
                        fitted, undamped, info)
    call check(info == 0, 'start: good')
    call check_values(fitted, coordinates(s, s%value), 1.0e-6_dp, 'start of exact FRFs')
    call check_same(undamped(3:4), [0.0_dp, 0.0_dp], 'start without damping')
    call jf_start_joint('N', 1_ip, 2_ip, 4_ip, 4_ip, 4_ip, 61_ip, s%dof, s%kind, s%omega, 0*s%spring, s%smooth, s%w, &
                        fitted, undamped, info)
    call check_values(1/fitted(:2), s%value(:2), 1.0e-6_dp, 'start without springs')
    s%measured = s%smooth + 1.0e-3_dp*symmetric(s)
    f = fit(s)
    g = fit(s, near=f)
    call check(g%iterations <= f%iterations, 'a near start takes no longer')
    call check(all(abs(g%value - f%value) < 0.05_dp*sqrt([f%covariance(1, 1), f%covariance(2, 2), f%covariance(3, 3), &
                                                         f%covariance(4, 4)])), 'the same from a near start')
    g = fit(s, 2*coordinates(s, s%value))
    call check(all(abs(g%value - f%value) < 0.05_dp*sqrt([f%covariance(1, 1), f%covariance(2, 2), f%covariance(3, 3), &
                                                         f%covariance(4, 4)])), 'the same from a far start')
  end subroutine starts

  subroutine threads_and_engines()
    type(sample) :: s
    type(outcome) :: f, g
    integer(ip) :: info
    integer :: threads

    s = make_sample(3, 9, 700, .true., .false., 2.0e-3_dp)
    f = fit(s)
    do threads = 1, 3
      call set_threads(threads)
      g = fit(s)
      call check_same(g%x, f%x, 'threads')
      call check_same(g%line_descent(1, :), f%line_descent(1, :), 'threads: descents')
    end do
    call set_threads(1)
    call set_engine(engine_lapack, info)
    g = fit(s)
    call check_values(g%value, f%value, 1.0e-6_dp, 'engine lapack')
    call set_engine(engine_plain, info)
    g = fit(s)
    call check_values(g%value, f%value, 1.0e-6_dp, 'engine plain')
    call set_engine(engine_automatic, info)
  end subroutine threads_and_engines

  !> A line with NaN is bad and not used; an entry without weight need not be a number.
  subroutine bad_lines()
    type(sample) :: s
    type(outcome) :: f

    s = make_sample(2, 4, 61, .true., .false., 0.0_dp)
    s%smooth(1, 4, 5) = cmplx(not_a_number(), 0.0_dp, dp)
    s%measured(3, 3, 9) = cmplx(0.0_dp, infinity(), dp)
    s%w(1, 1, 11) = 0
    s%smooth(1, 1, 11) = cmplx(not_a_number(), 0.0_dp, dp)
    s%measured(1, 1, 11) = cmplx(not_a_number(), 0.0_dp, dp)
    f = fit(s)
    call check(f%info == 1 .and. f%line_info(9) == -1, 'bad lines')
    call check(f%used(5) == 0 .and. f%used(11) == 1, 'bad lines are not used')
    call check_values(f%value, s%value, 1.0e-6_dp, 'bad lines: joint')
  end subroutine bad_lines

  subroutine no_lines()
    type(sample) :: s
    type(outcome) :: f

    s = make_sample(2, 4, 0, .true., .false., 0.0_dp)
    f = fit(s)
    call check(f%info == 0 .and. f%iterations == 0 .and. f%converged == 0, 'no lines')
    call check_same([f%cost, f%equations, f%normal(1, 1)], [0.0_dp, 0.0_dp, 0.0_dp], 'no lines, no squares')
  end subroutine no_lines

  subroutine wrong_arguments()
    type(sample) :: good, s

    good = make_sample(2, 4, 5, .true., .false., 0.0_dp)
    call try(good, -1, trans='X')
    call try(good, -2, at=2, number=2)
    call try(good, -3, at=3, number=0)
    call try(good, -3, at=3, number=1001)
    call try(good, -4, at=4, number=1)
    call try(good, -4, at=4, number=7)
    call try(good, -5, at=5, number=3)
    call try(good, -6, at=6, number=1)
    call try(good, -6, at=5, number=10)
    call try(good, -7, at=7, number=3)
    call try(good, -8, at=8, number=-1)
    call try(good, -9, at=9, number=3)
    call try(good, -10, at=10, number=-1)
    call try(good, -11, at=11, number=2)
    call try(good, -12, farthest=-1.0_dp)
    call try(good, -12, farthest=not_a_number())
    s = good
    s%dof(2) = 1
    call try(s, -13)
    s = good
    s%kind(3) = 3
    call try(s, -14)
    s = good
    s%dof(4) = 1
    call try(s, -14)
    s = good
    s%omega(2) = infinity()
    call try(s, -15)
    s = good
    s%spring(2) = 0
    call try(s, -20)
    s = good
    s%value(1) = not_a_number()
    call try(s, -21)
  end subroutine wrong_arguments

  subroutine try(s, expected, trans, at, number, farthest)
    type(sample), intent(in) :: s
    integer, intent(in) :: expected
    character, intent(in), optional :: trans
    integer, intent(in), optional :: at, number
    real(dp), intent(in), optional :: farthest
    real(dp) :: x(4), value(4), covariance(4, 4), normal(4, 4), descent(4), cost, equations, line_descent(4, 5)
    real(dp) :: distance(5), squares(5), limit, spring(2)
    complex(dp) :: h(2, 2, 5), q(2, 2, 5), c(2, 5), information(2, 2, 5), gradient(2, 5)
    integer(ip) :: i(11), used(5), line_info(5), iterations, converged, info
    character :: order

    i = int([0, 1, 2, 4, 4, 4, 0, 5, 1, 8, 0], ip)
    if (present(at)) i(at) = int(number, ip)
    order = 'N'
    if (present(trans)) order = trans
    limit = 0
    if (present(farthest)) limit = farthest
    x = s%value
    spring = s%spring
    h = 3
    q = 4
    call jf_fit_joint(order, i(2), i(3), i(4), i(5), i(6), i(7), i(8), i(9), i(10), i(11), limit, s%dof, s%kind, &
                      s%omega, s%smooth, s%measured, s%w, s%whitening, spring, x, h, q, value, covariance, normal, &
                      descent, cost, equations, line_descent, distance, used, c, information, gradient, squares, &
                      iterations, converged, line_info, info)
    call check(info == expected, 'wrong arguments')
    call check(all(abs(h - 3) <= 0.0_dp) .and. all(abs(q - 4) <= 0.0_dp), 'nothing is written')
  end subroutine try
end program test_joint_fit
