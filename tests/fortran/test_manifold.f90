!> FRFs that fit a joint, against what they must satisfy: no distance where there is none, a least distance where there
!> is one, and quadratic forms that are what another joint costs.
program test_manifold
  use testing, only: check, check_close, check_same, dp, finish, infinity, ip, not_a_number, random_lines, seed, &
    set_threads, transposed, uniform
  use jointfrf, only: jf_expect_on_joint, jf_expect_with_springs, jf_forms_with_springs, jf_project_with_springs
  use jointfrf_manifold, only: expect_on_joint, joint_forms, project_on_joint
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, set_engine
  implicit none
  integer, parameter :: lines = 19
  real(dp), parameter :: gain = 1.0e-8_dp

  !> Matrices of a case, all lines.
  type :: sample
    logical :: reciprocal
    integer :: n, n_free, n_entry
    real(dp), allocatable :: spring(:)
    complex(dp), allocatable :: h(:, :, :), m(:, :, :), c(:, :, :), gamma(:, :, :)
    real(dp), allocatable :: w(:, :, :), whitening(:, :, :)
  end type sample

  call seed(12)
  call exact(1, .true., .false.)
  call exact(2, .true., .false.)
  call exact(2, .false., .false.)
  call exact(3, .true., .true.)
  call exact(6, .true., .false.)
  call stationary(2, .true., .false.)
  call stationary(3, .false., .false.)
  call stationary(2, .true., .true.)
  call other_joint(2, .true., .false.)
  call other_joint(2, .false., .true.)
  call other_joint(3, .true., .false.)
  call expected(1, .true., .false.)
  call expected(2, .true., .true.)
  call expected(3, .false., .false.)
  call expected(6, .true., .false.)
  call exact(1, .true., .false., 0.8_dp)
  call exact(3, .true., .true., 0.8_dp)
  call exact(2, .false., .false., 0.8_dp)
  call stationary(2, .true., .false., 0.5_dp)
  call stationary(3, .false., .false., 0.5_dp)
  call other_joint(2, .true., .false., 0.7_dp)
  call other_joint(2, .false., .true., 0.7_dp)
  call other_joint(3, .true., .false., 0.7_dp)
  call other_joint(6, .true., .false., 0.3_dp)
  call expected(1, .true., .false., 0.6_dp)
  call expected(3, .true., .false., 0.6_dp)
  call expected(2, .false., .true., 0.6_dp)
  call expected_arguments()
  call spring_arguments()
  call orders_of_storage(.true.)
  call orders_of_storage(.false.)
  call bad_lines()
  call threads_and_neighbours()
  call nothing()
  call finish('manifold')

contains

  function make_sample(n, reciprocal, correlated, spring) result(s)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in), optional :: spring
    type(sample) :: s
    integer :: i, p, q

    s%reciprocal = reciprocal
    s%n = n
    allocate (s%spring(n), source=0.0_dp)
    if (present(spring)) s%spring = [(spring*(1 + 0.2_dp*i), i=1, n)]
    s%n_free = merge((n*(n + 1))/2, n*n, reciprocal)
    s%n_entry = merge(n*(2*n + 1), 4*n*n, reciprocal)
    allocate (s%h(n, n, lines), s%m(n, n, lines), s%c(n, n, lines), s%gamma(2*n, 2*n, lines))
    s%h = square(s)
    s%m = square(s)/n
    s%c = square(s)/n
    s%gamma = frfs(s%spring, s%h, s%m, s%c)
    q = merge(s%n_entry, 0, correlated)
    allocate (s%w(2*n, 2*n, lines), s%whitening(q, q, lines))
    do i = 1, lines
      do q = 1, 2*n
        do p = 1, 2*n
          s%w(p, q, i) = 50*(1 + uniform())
        end do
      end do
      s%w(1 + mod(i, 2), 2, i) = 0                 ! one entry is not used
      s%gamma(1 + mod(i, 2), 2, i) = cmplx(not_a_number(), 0.0_dp, dp)
      if (reciprocal) s%gamma(2, 1, i) = cmplx(0.0_dp, infinity(), dp)
      do q = 1, size(s%whitening, 1)
        s%whitening(:, q, i) = [(0.3_dp*(uniform() - 0.5_dp), p=1, s%n_entry)]
        s%whitening(q, q, i) = 1
        s%whitening(:q - 1, q, i) = not_a_number()
      end do
    end do
  end function make_sample

  function square(s) result(a)
    type(sample), intent(in) :: s
    complex(dp) :: a(s%n, s%n, lines)

    a = random_lines(s%n, s%n, lines)
    if (s%reciprocal) a = (a + transposed(a))/2
  end function square

  !> The FRFs of H, Q (here m) and R (here c) with reference springs.
  function frfs(spring, h, m, c) result(gamma)
    real(dp), intent(in) :: spring(:)
    complex(dp), intent(in) :: h(:, :, :), m(:, :, :), c(:, :, :)
    complex(dp) :: gamma(2*size(h, 1), 2*size(h, 1), size(h, 3))
    complex(dp), dimension(size(h, 1), size(h, 1)) :: right, left, z, one
    integer :: i, a, n

    n = size(h, 1)
    z = 0
    one = 0
    do a = 1, n
      z(a, a) = spring(a)
      one(a, a) = 1
    end do
    do i = 1, size(h, 3)
      associate (r => c(:, :, i), q => m(:, :, i))
        right = matmul(one - matmul(z, r), one - matmul(q, r))
        left = matmul(one - matmul(r, q), one - matmul(r, z))
        gamma(:n, :n, i) = h(:, :, i)
        gamma(:n, n + 1:, i) = matmul(h(:, :, i), right)
        gamma(n + 1:, :n, i) = matmul(left, h(:, :, i))
        gamma(n + 1:, n + 1:, i) = matmul(left, matmul(h(:, :, i), right)) + r - matmul(r, matmul(q, r))
      end associate
    end do
  end function frfs

  !> Squares of the distance of FRFs, entries taken one by one.
  function distance(s, gamma) result(squares)
    type(sample), intent(in) :: s
    complex(dp), intent(in) :: gamma(:, :, :)
    real(dp) :: squares(lines)
    complex(dp) :: r(s%n_entry)
    integer :: i, p, q, e

    do i = 1, lines
      e = 0
      do p = 1, 2*s%n
        do q = merge(p, 1, s%reciprocal), 2*s%n
          e = e + 1
          r(e) = 0
          if (s%w(p, q, i) > 0.0_dp) r(e) = s%w(p, q, i)*(s%gamma(p, q, i) - gamma(p, q, i))
        end do
      end do
      squares(i) = 0
      do e = 1, s%n_entry
        if (size(s%whitening) > 0) then
          squares(i) = squares(i) + abs(sum(s%whitening(e, :e, i)*r(:e)))**2
        else
          squares(i) = squares(i) + abs(r(e))**2
        end if
      end do
    end do
  end function distance

  subroutine project(s, h, m, squares, steps)
    type(sample), intent(in) :: s
    complex(dp), contiguous, intent(inout) :: h(:, :, :), m(:, :, :)
    real(dp), intent(out) :: squares(lines)
    integer, intent(in) :: steps
    integer(ip) :: line_info(lines), info

    call project_on_joint(.false., s%reciprocal, int(steps, ip), gain, s%gamma, s%w, s%whitening, &
        s%c, h, m, squares, &
                          line_info, info, s%spring)
    call check(info == 0 .and. all(line_info == 0), 'good')
  end subroutine project

  subroutine exact(n, reciprocal, correlated, spring)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in), optional :: spring
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines)
    real(dp) :: squares(lines)

    s = make_sample(n, reciprocal, correlated, spring)
    h = s%h + 0.02_dp*square(s)
    m = s%m + 0.02_dp*square(s)
    call project(s, h, m, squares, 40)
    call check(all(squares < 1.0e-6_dp), 'exact FRFs have no distance')
    call check(maxval(abs(squares - distance(s, frfs(s%spring, h, m, s%c)))) < 1.0e-8_dp, 'squares of exact FRFs')
  end subroutine exact

  !> No change of H or M comes nearer to FRFs with noise.
  subroutine stationary(n, reciprocal, correlated, spring)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in), optional :: spring
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines), dh(n, n, lines), dm(n, n, lines)
    real(dp) :: squares(lines), there(lines), back(lines)
    integer :: k

    s = make_sample(n, reciprocal, correlated, spring)
    s%gamma = s%gamma + 0.02_dp*random_lines(2*n, 2*n, lines)
    h = s%h
    m = s%m
    call project(s, h, m, squares, 60)
    call check_close(sum(squares), sum(distance(s, frfs(s%spring, h, m, s%c))), 1.0e-12_dp, 'squares')
    do k = 1, 4
      dh = 1.0e-3_dp*square(s)
      dm = 1.0e-3_dp*square(s)
      there = distance(s, frfs(s%spring, h + dh, m + dm, s%c))
      back = distance(s, frfs(s%spring, h - dh, m - dm, s%c))
      call check(all(there + back > 2*squares), 'a minimum')
      call check(all(abs(there - back) < 0.1_dp*(there + back - 2*squares)), 'stationary')
    end do
  end subroutine stationary

  !> What a projection for another C costs is what W says.
  subroutine other_joint(n, reciprocal, correlated, spring)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in), optional :: spring
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines), d(n, n, lines), change(n*n)
    complex(dp), allocatable :: information(:, :, :), gradient(:, :, :)
    real(dp) :: squares(lines), left(lines, 1), cost
    integer(ip) :: line_info(lines), info
    integer :: i, a, b, k

    s = make_sample(n, reciprocal, correlated, spring)
    s%w = 1.0e4_dp*s%w
    allocate (information(s%n_free, s%n_free, lines), gradient(s%n_free, lines, 1))
    call joint_forms(.false., reciprocal, .false., reshape(s%gamma, [2*n, 2*n, lines, 1]), s%w, s%whitening, &
                     s%c, s%h, s%m, information, gradient, left, line_info, info, s%spring)
    call check(info == 0 .and. all(line_info == 0), 'forms: good')
    call by_diagonal(s, information)
    call check(all(left < 1.0e-12_dp), 'forms: no distance')
    d = 1.0e-6_dp*square(s)
    s%c = s%c + d
    h = s%h
    m = s%m
    call project(s, h, m, squares, 60)
    do i = 1, lines
      k = 0
      do a = 1, n
        do b = merge(a, 1, reciprocal), n
          k = k + 1
          change(k) = d(a, b, i)
        end do
      end do
      cost = real(dot_product(change(:k), matmul(information(:, :, i), change(:k))), dp)
      call check(abs(squares(i) - cost) < 1.0e-3_dp*cost + 1.0e-6_dp, 'the cost of another joint')
    end do
  end subroutine other_joint

  !> Forms of the diagonal of R alone are parts of those of all its entries.
  subroutine by_diagonal(s, information)
    type(sample), intent(in) :: s
    complex(dp), intent(in) :: information(:, :, :)
    complex(dp) :: own(s%n, s%n, lines), gradient(s%n, lines, 1), part(s%n, s%n, lines)
    real(dp) :: left(lines, 1)
    integer(ip) :: line_info(lines), info
    integer :: a, at(s%n)

    at = [(merge(((a - 1)*(2*s%n - a + 2))/2 + 1, (a - 1)*s%n + a, s%reciprocal), a=1, s%n)]
    call joint_forms(.false., s%reciprocal, .true., reshape(s%gamma, [2*s%n, 2*s%n, lines, 1]), s%w, s%whitening, &
                     s%c, s%h, s%m, own, gradient, left, line_info, info, s%spring)
    part = information(at, at, :)
    call check_close(own, part, 1.0e-10_dp, 'forms of the diagonal')
  end subroutine by_diagonal

  !> Expected H and M minimise squares of M over its deviations and of the linear change of the FRFs over their error:
  !> no other step is lower. A line that holds NaN is NaN.
  subroutine expected(n, reciprocal, correlated, spring)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal, correlated
    real(dp), intent(in), optional :: spring
    real(dp), parameter :: share = 0.3_dp
    type(sample) :: s
    complex(dp), dimension(n, n, lines) :: h, m, dh, dm
    real(dp) :: spread_m(n, n, lines), least(lines), other(lines)
    integer(ip) :: line_info(lines), info
    integer :: k

    s = make_sample(n, reciprocal, correlated, spring)
    s%c = 0.1_dp*s%c
    if (present(spring)) call make_diagonal(s)
    spread_m = 0.5_dp
    spread_m(1, n, :) = 2
    if (reciprocal) spread_m(n, 1, :) = 2
    h = s%h
    m = s%m
    m(n, 1, 4) = cmplx(not_a_number(), 0.0_dp, dp)
    call expect_on_joint(.false., reciprocal, share, spread_m, s%w, s%whitening, s%c, h, m, line_info, info, s%spring)
    call check(info == 1 .and. line_info(4) == -1 .and. count(line_info == 0) == lines - 1, 'expected: one bad line')
    call check(.not. abs(m(1, 1, 4)) <= huge(1.0_dp), 'expected: a bad line is NaN')
    h(:, :, 4) = s%h(:, :, 4)
    m(:, :, 4) = s%m(:, :, 4)
    least = expectation(s, share, spread_m, h - s%h, m - s%m)
    do k = 1, 20
      dh = 1.0e-4_dp*square(s)
      dm = 1.0e-3_dp*square(s)
      other = expectation(s, share, spread_m, h - s%h + dh, m - s%m + dm)
      other(4) = huge(1.0_dp)
      call check(all(other >= least*(1 - 1.0e-9_dp)), 'expected: least squares')
    end do
  end subroutine expected

  !> A joint without cross terms, whose M has entries that depend on one entry of Q each.
  subroutine make_diagonal(s)
    type(sample), intent(inout) :: s
    integer :: a, b

    do a = 1, s%n
      do b = 1, s%n
        if (a /= b) s%c(a, b, :) = 0
      end do
    end do
  end subroutine make_diagonal

  !> Squares of M = Z T' + T Q T' and of the change of the FRFs, which is linear in those of H and Q.
  function expectation(s, share, spread_m, dh, dm) result(squares)
    type(sample), intent(in) :: s
    real(dp), intent(in) :: share, spread_m(:, :, :)
    complex(dp), intent(in) :: dh(:, :, :), dm(:, :, :)
    real(dp) :: squares(lines)
    real(dp), parameter :: little = 1.0e-6_dp
    type(sample) :: moved
    complex(dp) :: t, entry_m
    integer :: i, a, b

    moved = s
    moved%gamma = (frfs(s%spring, s%h + little*dh, s%m + little*dm, s%c) - &
                   frfs(s%spring, s%h - little*dh, s%m - little*dm, s%c))/(2*little)
    squares = distance(moved, 0*moved%gamma)/share**2
    do i = 1, lines
      do a = 1, s%n
        do b = merge(a, 1, s%reciprocal), s%n
          t = (1 - s%spring(a)*s%c(a, a, i))*(1 - s%spring(b)*s%c(b, b, i))
          entry_m = t*(s%m(a, b, i) + dm(a, b, i))
          if (a == b) entry_m = entry_m + s%spring(a)*(1 - s%spring(a)*s%c(a, a, i))
          squares(i) = squares(i) + abs(entry_m/spread_m(a, b, i))**2
        end do
      end do
    end do
  end function expectation

  subroutine expected_arguments()
    call try_expected(0, 'N', 1, 2, 0, lines, 0.1_dp, 1.0_dp)
    call try_expected(0, 'T', 0, 2, 0, lines, 0.1_dp, 1.0_dp)
    call try_expected(0, 'N', 1, 2, 0, 0, 0.1_dp, 1.0_dp)
    call try_expected(-1, 'X', 1, 2, 0, lines, 0.1_dp, 1.0_dp)
    call try_expected(-2, 'N', 2, 2, 0, lines, 0.1_dp, 1.0_dp)
    call try_expected(-3, 'N', 1, 0, 0, lines, 0.1_dp, 1.0_dp)
    call try_expected(-4, 'N', 1, 2, 3, lines, 0.1_dp, 1.0_dp)
    call try_expected(-5, 'N', 1, 2, 0, -1, 0.1_dp, 1.0_dp)
    call try_expected(-6, 'N', 1, 2, 0, lines, 0.0_dp, 1.0_dp)
    call try_expected(-6, 'N', 1, 2, 0, lines, not_a_number(), 1.0_dp)
    call try_expected(-7, 'N', 1, 2, 0, lines, 0.1_dp, 0.0_dp)
  end subroutine expected_arguments

  subroutine try_expected(wanted, trans, reciprocal, n, n_correlated, n_freq, share, one_spread)
    integer, intent(in) :: wanted, reciprocal, n, n_correlated, n_freq
    character, intent(in) :: trans
    real(dp), intent(in) :: share, one_spread
    type(sample) :: s
    complex(dp) :: h(2, 2, lines), m(2, 2, lines)
    real(dp) :: spread_m(2, 2, lines)
    integer(ip) :: line_info(lines), info

    s = make_sample(2, .true., .false.)
    spread_m = 1
    spread_m(2, 1, 3) = one_spread
    h = s%h
    m = s%m
    call jf_expect_on_joint(trans, int(reciprocal, ip), int(n, ip), int(n_correlated, ip), int(n_freq, ip), share, &
                            spread_m, s%w, s%whitening, s%c, h, m, line_info, info)
    call check(info == wanted, 'expected: arguments')
    if (wanted == 0 .and. n_freq > 0) return
    call check_same(h, s%h, 'expected: H is not touched')
    call check_same(m, s%m, 'expected: M is not touched')
  end subroutine try_expected

  !> Springs that are negative, infinite or no number are refused before anything is touched.
  subroutine spring_arguments()
    type(sample) :: s
    complex(dp) :: h(2, 2, lines), m(2, 2, lines), w(3, 3, lines), p(3, lines, 1)
    real(dp) :: squares(lines), left(lines, 1), spread_m(2, 2, lines), bad(3)
    integer(ip), parameter :: symmetric = 1, n = 2, none = 0, steps = 3, n_free = 3, one = 1
    integer(ip) :: line_info(lines), info, n_freq
    integer :: i

    s = make_sample(2, .true., .false.)
    n_freq = lines
    spread_m = 1
    bad = [-1.0_dp, infinity(), not_a_number()]
    do i = 1, 3
      h = s%h
      m = s%m
      s%spring(2) = bad(i)
      call jf_project_with_springs('N', symmetric, n, none, n_freq, steps, gain, s%spring, s%gamma, s%w, &
          s%whitening, &
                                   s%c, h, m, squares, line_info, info)
      call check(info == -8, 'springs of a projection')
      call jf_expect_with_springs('N', symmetric, n, none, n_freq, 0.1_dp, spread_m, s%spring, s%w, &
          s%whitening, s%c, &
                                  h, m, line_info, info)
      call check(info == -8, 'springs of an expectation')
      call jf_forms_with_springs('N', symmetric, n, n_free, none, n_freq, one, s%spring, s%gamma, s%w, s%whitening, &
                                 s%c, h, m, w, p, left, line_info, info)
      call check(info == -8, 'springs of forms')
      call check_same(h, s%h, 'springs: H is not touched')
    end do
  end subroutine spring_arguments

  !> Lines stored as C does, several targets, and a gradient for each.
  subroutine orders_of_storage(reciprocal)
    logical, intent(in) :: reciprocal
    integer, parameter :: n = 2
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines), h_t(n, n, lines), m_t(n, n, lines)
    complex(dp) :: targets(2*n, 2*n, lines, 2), targets_t(2*n, 2*n, lines, 2)
    complex(dp), allocatable :: w(:, :, :), w_t(:, :, :), p(:, :, :), p_t(:, :, :)
    real(dp) :: squares(lines), squares_t(lines), left(lines, 2), left_t(lines, 2)
    real(dp), allocatable :: factor_t(:, :, :), weights_t(:, :, :)
    integer(ip) :: line_info(lines), info
    integer :: i

    s = make_sample(n, reciprocal, .true.)
    s%gamma = s%gamma + 0.02_dp*random_lines(2*n, 2*n, lines)
    allocate (w(s%n_free, s%n_free, lines), w_t(s%n_free, s%n_free, lines))
    allocate (p(s%n_free, lines, 2), p_t(s%n_free, lines, 2))
    allocate (factor_t, source=s%whitening)
    allocate (weights_t, source=s%w)
    do i = 1, lines
      factor_t(:, :, i) = transpose(s%whitening(:, :, i))
      weights_t(:, :, i) = transpose(s%w(:, :, i))
    end do
    h = s%h
    m = s%m
    call project(s, h, m, squares, 10)
    h_t = transposed(s%h)
    m_t = transposed(s%m)
    call project_on_joint(.true., reciprocal, 10_ip, gain, transposed(s%gamma), weights_t, factor_t, &
        transposed(s%c), &
                          h_t, m_t, squares_t, line_info, info, s%spring)
    call check_same(transposed(h_t), h, 'H, transposed')
    call check_same(transposed(m_t), m, 'M, transposed')
    call check_same(squares_t, squares, 'squares, transposed')

    targets(:, :, :, 1) = s%gamma
    targets(:, :, :, 2) = s%gamma + 0.01_dp*random_lines(2*n, 2*n, lines)
    do i = 1, 2
      targets_t(:, :, :, i) = transposed(targets(:, :, :, i))
    end do
    call joint_forms(.false., reciprocal, .false., targets, s%w, s%whitening, s%c, h, m, w, p, left, line_info, info, &
                     s%spring)
    call joint_forms(.true., reciprocal, .false., targets_t, weights_t, factor_t, transposed(s%c), h_t, m_t, &
        w_t, p_t, left_t, &
                     line_info, info, s%spring)
    call check_same(transposed(w_t), w, 'W, transposed')
    call check_close(w, conjg(transposed(w)), 0.0_dp, 'W is Hermitian')
    call check_same(p_t, p, 'gradients do not depend on the order of storage')
    call check_same(left_t(:, 2), left(:, 2), 'squares of the second target')
    call joint_forms(.false., reciprocal, .false., targets(:, :, :, 2:2), s%w, s%whitening, s%c, h, m, w_t, &
        p_t(:, :, :1), &
                     left_t(:, :1), line_info, info, s%spring)
    call check_close(p_t(:, :, 1:1), p(:, :, 2:2), 1.0e-10_dp, 'a target alone')
  end subroutine orders_of_storage

  subroutine bad_lines()
    integer, parameter :: n = 2
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines), good_h(n, n, lines), good_m(n, n, lines), w(3, 3, lines)
    complex(dp) :: p(3, lines, 1)
    real(dp) :: squares(lines), left(lines, 1)
    integer(ip) :: line_info(lines), info, expected(lines)
    integer :: i

    s = make_sample(n, .true., .false.)
    good_h = s%h
    good_m = s%m
    s%gamma = s%gamma + 0.02_dp*random_lines(2*n, 2*n, lines)
    call project(s, good_h, good_m, squares, 10)
    h = s%h
    m = s%m
    s%gamma(3, 3, 2) = cmplx(not_a_number(), 0.0_dp, dp)
    s%c(1, 1, 3) = cmplx(0.0_dp, infinity(), dp)
    s%w(3, 4, 9) = -1
    s%w(3, 4, 10) = not_a_number()
    m(:, :, 17) = 1.0e200_dp
    expected = 0
    expected([2, 3, 9, 10]) = -1
    expected(17) = -2
    call project_on_joint(.false., .true., 10_ip, gain, s%gamma, s%w, s%whitening, s%c, h, m, &
        squares, line_info, info, s%spring)
    call check(info == 5 .and. all(line_info == expected), 'bad lines')
    do i = 1, lines
      if (expected(i) == 0) then
        call check_same(h(:, :, i:i), good_h(:, :, i:i), 'H beside bad lines')
        call check_same(m(:, :, i:i), good_m(:, :, i:i), 'M beside bad lines')
      else
        call check(all(.not. abs(h(:, :, i)) <= huge(1.0_dp)) .and. all(.not. abs(m(:, :, i)) <= huge(1.0_dp)) .and. &
                   .not. squares(i) <= huge(1.0_dp), 'a bad line is NaN')
      end if
    end do
    m = s%m
    m(:, :, 17) = 1.0e200_dp
    call joint_forms(.false., .true., .false., reshape(s%gamma, [2*n, 2*n, lines, 1]), s%w, s%whitening, s%c, &
        s%h, m, w, p, &
                     left, line_info, info, s%spring)
    call check(info == 5 .and. all(line_info == expected), 'bad forms')
    do i = 1, lines
      call check(all(abs(w(:, :, i)) <= huge(1.0_dp) .eqv. expected(i) == 0) .and. &
                 all(abs(p(:, i, 1)) <= huge(1.0_dp) .eqv. expected(i) == 0), 'a bad form is NaN')
    end do
  end subroutine bad_lines

  !> The same bits for a line alone, on any number of threads, and with the engine that is LAPACK elsewhere.
  subroutine threads_and_neighbours()
    integer, parameter :: n = 3
    type(sample) :: s
    complex(dp) :: h(n, n, lines), m(n, n, lines), one_h(n, n, lines), one_m(n, n, lines)
    real(dp) :: squares(lines), one(lines)
    integer(ip) :: line_info(lines), info
    integer :: i, threads

    s = make_sample(n, .true., .false.)
    s%gamma = s%gamma + 0.02_dp*random_lines(2*n, 2*n, lines)
    h = s%h
    m = s%m
    call project(s, h, m, squares, 300)
    one_h = s%h
    one_m = s%m
    do i = 1, lines
      call project_on_joint(.false., .true., 300_ip, gain, s%gamma(:, :, i:i), s%w(:, :, i:i), &
          s%whitening, &
                            s%c(:, :, i:i), one_h(:, :, i:i), one_m(:, :, i:i), one(i:i), line_info(i:i), info, &
                            s%spring)
    end do
    call check_same(one_h, h, 'H of a line alone')
    call check_same(one_m, m, 'M of a line alone')
    call check_same(one, squares, 'squares of a line alone')
    do threads = 1, 3
      call set_threads(threads)
      one_h = s%h
      one_m = s%m
      call project(s, one_h, one_m, one, 300)
      call check_same(one_h, h, 'threads')
    end do
    call set_threads(1)
    call set_engine(engine_lapack, info)
    one_h = s%h
    one_m = s%m
    call project(s, one_h, one_m, one, 300)
    call check_same(one_m, m, 'engine lapack')
    call set_engine(engine_plain, info)
    one_h = s%h
    one_m = s%m
    call project(s, one_h, one_m, one, 300)
    call check_close(sum(one), sum(squares), 1.0e-8_dp, 'engine plain')
    call set_engine(engine_automatic, info)
  end subroutine threads_and_neighbours

  subroutine nothing()
    complex(dp) :: a(1, 1, 0), gamma(2, 2, 0), w(1, 1, 0), p(1, 0, 1)
    real(dp) :: weights(2, 2, 0), factor(0, 0, 0), squares(0), left(0, 1)
    integer(ip) :: line_info(0), info

    info = 5
    call project_on_joint(.true., .true., 3_ip, gain, gamma, weights, factor, a, a, a, squares, &
                          line_info, info, [real(dp) ::])
    call check(info == 0, 'no lines')
    info = 5
    call joint_forms(.true., .true., .false., reshape(gamma, [2, 2, 0, 1]), weights, factor, a, a, a, w, p, &
                     left, line_info, info, [real(dp) ::])
    call check(info == 0, 'no lines, forms')
  end subroutine nothing
end program test_manifold
