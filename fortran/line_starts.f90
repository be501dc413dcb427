!> Where the projection of a line begins: algebraic first values of Q, exact without noise, and none last.
!>
!> For a joint without cross terms, R diagonal, in parallel with reference springs Z > 0. H begins as gamma_jj.
module jointfrf_line_starts
  use jointfrf_joint_frfs, only: joint_frfs
  use jointfrf_kinds, only: dp, ip
  use jointfrf_linear_algebra, only: solve
  use jointfrf_manifold, only: project_on_joint
  use jointfrf_order_statistics, only: find_median
  use jointfrf_status, only: info_good, info_no_memory, line_good
  implicit none
  private
  public :: start_lines

  !> Q of gamma_jk and gamma_kk by least squares, of gamma_kj and gamma_kk, and none.
  integer, parameter :: by_jk_and_kk = 1, by_kj = 2, by_nothing = 3
  !> Lines whose squares exceed the median by this factor are started again.
  real(dp), parameter :: far_off = 4.0_dp
  !> A line has arrived when a step gains less than this of the squares, in units of the noise.
  real(dp), parameter :: arrived = 1.0e-5_dp
  !> Lines that are there at once.
  integer, parameter :: chunk = 4096

  !> Some of the lines, (out, in).
  type :: chosen_lines
    complex(dp), allocatable :: gamma(:, :, :), r(:, :, :), h(:, :, :), q(:, :, :)
    complex(dp), allocatable :: system(:, :, :), right(:, :, :), solved(:, :, :)
    real(dp), allocatable :: weight(:, :, :), whitening(:, :, :), squares(:), rcond(:)
    integer(ip), allocatable :: line_info(:)
  end type chosen_lines

contains

  !> The FRFs nearest to the smooth ones on some lines, from several starts.
  !> spring     Z, shape (n), > 0, N/m
  !> r          R, shape (n, n, n_freq), m/N
  !> steps      of a projection at most
  !> chosen     the lines
  !> h, q, distance    the nearest FRFs so far, and their squares; replaced where nearer ones are found
  subroutine start_lines(frfs, spring, r, steps, chosen, h, q, distance, info)
    type(joint_frfs), intent(in) :: frfs
    real(dp), intent(in) :: spring(:)
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: steps
    logical, intent(in) :: chosen(:)
    complex(dp), intent(inout) :: h(:, :, :), q(:, :, :)
    real(dp), intent(inout) :: distance(:)
    integer(ip), intent(out) :: info
    type(chosen_lines) :: some
    integer, allocatable :: list(:)
    real(dp), allocatable :: squares(:), best(:)           !< best: of these starts
    real(dp) :: middle
    integer :: total, m, start, first, i, stat

    info = info_good
    total = count(chosen)
    if (total == 0) return
    allocate (list(total), squares(total), best(size(distance)), stat=stat)
    if (stat == 0) call prepare(frfs, min(chunk, total), some, stat)
    if (stat /= 0) info = info_no_memory
    if (stat /= 0) return
    best(:) = huge(1.0_dp)
    middle = -1.0_dp
    do start = by_jk_and_kk, by_nothing
      m = 0
      do i = 1, size(chosen)
        if (.not. chosen(i) .or. (best(i) <= far_off*middle .and. best(i) < huge(1.0_dp))) cycle
        m = m + 1
        list(m) = i
      end do
      do first = 1, m, chunk
        call try_start(frfs, spring, r, steps, start, list(first:min(first + chunk - 1, m)), some, h, q, distance, &
                       best, info)
        if (info /= info_good) return
      end do
      squares(:) = pack(best, chosen)
      call find_median(squares, middle)
    end do
  end subroutine start_lines

  subroutine prepare(frfs, m, some, stat)
    type(joint_frfs), intent(in) :: frfs
    integer, intent(in) :: m
    type(chosen_lines), intent(inout) :: some
    integer, intent(out) :: stat
    integer :: n, q

    n = frfs%n_dof()
    q = size(frfs%whitening, 1)
    ! allow(C181): the caller looks at it
    allocate (some%gamma(2*n, 2*n, m), some%r(n, n, m), some%h(n, n, m), some%q(n, n, m), some%system(n, n, m), &
              some%right(n, n, m), some%solved(n, n, m), some%weight(2*n, 2*n, m), some%whitening(q, q, m), &
              some%squares(m), some%rcond(m), some%line_info(m), stat=stat)
  end subroutine prepare

  !> Project from one start, and keep what is nearer.
  subroutine try_start(frfs, spring, r, steps, start, list, some, h, q, distance, best, info)
    type(joint_frfs), intent(in) :: frfs
    real(dp), intent(in) :: spring(:)
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: steps, start, list(:)
    type(chosen_lines), target, intent(inout) :: some
    complex(dp), intent(inout) :: h(:, :, :), q(:, :, :)
    real(dp), intent(inout) :: distance(:), best(:)
    integer(ip), intent(out) :: info
    integer :: m, i

    m = size(list)
    call gather(frfs, r, list, some)
    call set_first(frfs%reciprocal, spring, start, m, some, info)
    if (info < info_good) return
    call project_on_joint(.false., frfs%reciprocal, int(steps, ip), arrived, some%gamma(:, :, :m), &
                          some%weight(:, :, :m), some%whitening(:, :, :m), some%r(:, :, :m), some%h(:, :, :m), &
                          some%q(:, :, :m), some%squares(:m), some%line_info(:m), info, spring)
    if (info < info_good) return
    info = info_good
    do i = 1, m
      if (some%line_info(i) /= line_good) cycle
      best(list(i)) = min(best(list(i)), some%squares(i))
      if (some%squares(i) >= distance(list(i))) cycle
      distance(list(i)) = some%squares(i)
      call put(frfs%transposed, some%h(:, :, i), h(:, :, list(i)))
      call put(frfs%transposed, some%q(:, :, i), q(:, :, list(i)))
    end do
  end subroutine try_start

  !> Some lines of all arrays, (out, in).
  pure subroutine gather(frfs, r, list, some)
    type(joint_frfs), intent(in) :: frfs
    complex(dp), intent(in) :: r(:, :, :)
    integer, intent(in) :: list(:)
    type(chosen_lines), intent(inout) :: some
    integer :: n, i, j, k

    n = frfs%n_dof()
    do i = 1, size(list)
      call frfs%load_line(list(i), some%gamma(:, :, i), some%weight(:, :, i))
      some%r(:, :, i) = r(:, :, list(i))
      some%h(:, :, i) = some%gamma(:n, :n, i)
      do j = 1, size(some%whitening, 2)
        do k = 1, size(some%whitening, 1)
          some%whitening(k, j, i) = frfs%whitening(merge(j, k, frfs%transposed), merge(k, j, frfs%transposed), list(i))
        end do
      end do
    end do
  end subroutine gather

  !> First values of Q.
  subroutine set_first(reciprocal, spring, start, m, some, info)
    logical, intent(in) :: reciprocal
    real(dp), intent(in) :: spring(:)
    integer, intent(in) :: start, m
    type(chosen_lines), target, intent(inout) :: some
    integer(ip), intent(out) :: info
    integer :: n, i, d

    info = info_good
    n = size(spring)
    some%q(:, :, :m) = 0.0_dp
    if (start == by_nothing) return
    do i = 1, m
      if (start == by_jk_and_kk) then
        some%system(:, :, i) = some%gamma(:n, :n, i)
        some%right(:, :, i) = some%gamma(:n, n + 1:, i)
      else
        do d = 1, n
          some%system(:, d, i) = some%gamma(n + 1:, d, i)*(1 - spring(d)*some%r(d, d, i))
          some%system(d, d, i) = some%system(d, d, i) + some%r(d, d, i)
        end do
        some%right(:, :, i) = some%gamma(n + 1:, n + 1:, i)
      end if
    end do
    call solve(.false., some%system(:, :, :m), some%right(:, :, :m), some%solved(:, :, :m), some%line_info(:m), &
               some%rcond(:m), info)
    if (info < info_good) return
    do i = 1, m
      if (some%line_info(i) /= line_good) cycle
      if (start == by_jk_and_kk) then
        call by_least_squares(n, spring, some%gamma(:, :, i), some%solved(:, :, i), some%r(:, :, i), some%q(:, :, i))
      else
        call by_product(n, some%solved(:, :, i), some%r(:, :, i), some%q(:, :, i))
      end if
      if (.not. sum(abs(some%q(:, :, i))) <= huge(1.0_dp)) some%q(:, :, i) = 0.0_dp
      if (reciprocal) call make_symmetric(n, some%q(:, :, i))
    end do
    info = info_good
  end subroutine set_first

  !> Q by least squares, by entry, of gamma_jk = H F and gamma_kk - gamma_kj H^-1 gamma_jk = R - R Q R. The first
  !> equation is divided by the springs, so that both are compliances.
  !> ratio   gamma_jj^-1 gamma_jk
  pure subroutine by_least_squares(n, spring, gamma, ratio, r, q)
    integer, intent(in) :: n
    real(dp), intent(in) :: spring(n)
    complex(dp), intent(in) :: gamma(2*n, 2*n), ratio(n, n), r(n, n)
    complex(dp), intent(out) :: q(n, n)
    complex(dp) :: own, t, of_jk, of_kk, left, right
    integer :: i, j, k

    do j = 1, n
      do i = 1, n
        own = gamma(n + i, n + j)
        do k = 1, n
          own = own - gamma(n + i, k)*ratio(k, j)
        end do
        t = 1 - spring(i)*r(i, i)
        of_jk = t/spring(i)*r(j, j)
        of_kk = r(i, i)*r(j, j)
        left = -ratio(i, j)/spring(i)
        right = -own
        if (i == j) left = left + t/spring(i)
        if (i == j) right = right + r(i, i)
        q(i, j) = (conjg(of_jk)*left + conjg(of_kk)*right)/(abs(of_jk)**2 + abs(of_kk)**2)
      end do
    end do
  end subroutine by_least_squares

  !> Q = (1 - A) R^-1.
  pure subroutine by_product(n, a, r, q)
    integer, intent(in) :: n
    complex(dp), intent(in) :: a(n, n), r(n, n)
    complex(dp), intent(out) :: q(n, n)
    integer :: d

    do d = 1, n
      q(:, d) = -a(:, d)
      q(d, d) = q(d, d) + 1.0_dp
      q(:, d) = q(:, d)/r(d, d)
    end do
  end subroutine by_product

  pure subroutine make_symmetric(n, q)
    integer, intent(in) :: n
    complex(dp), intent(inout) :: q(n, n)
    integer :: i, j

    do j = 2, n
      do i = 1, j - 1
        q(i, j) = 0.5_dp*(q(i, j) + q(j, i))
        q(j, i) = q(i, j)
      end do
    end do
  end subroutine make_symmetric

  !> A matrix in the caller's order.
  pure subroutine put(transposed, a, b)
    logical, intent(in) :: transposed
    complex(dp), intent(in) :: a(:, :)
    complex(dp), intent(inout) :: b(:, :)
    integer :: j

    do j = 1, size(a, 2)
      if (transposed) then
        b(j, :) = a(:, j)
      else
        b(:, j) = a(:, j)
      end if
    end do
  end subroutine put
end module jointfrf_line_starts
