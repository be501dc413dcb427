!> First values of a joint without cross terms from the compliance of smooth FRFs.
!>
!> On every line C = L gamma_jj - gamma_kj with L = gamma_kk gamma_jk^-1, and to first order dC = U dgamma V with
!> U = [L, -1], V = [1; -gamma_jk^-1 gamma_jj]. In parallel with reference springs Z it is R = (1 + C Z)^-1 C, and
!> dR = (1 + C Z)^-1 dC (1 + Z C)^-1. Lines on which noise hides gamma_jk count little.
module jointfrf_joint_start
  use jointfrf_diagonal_joint, only: diagonal_joint, fit_diagonal_joint, line_forms, search_limits, set_limits
  use jointfrf_joint_frfs, only: joint_frfs
  use jointfrf_kinds, only: dp, ip
  use jointfrf_linear_algebra, only: invert
  use jointfrf_order_statistics, only: find_median
  use jointfrf_status, only: info_good, info_no_memory, line_good
  implicit none
  private
  public :: find_springs, start_joint

  !> Lines whose matrices are there at once.
  integer, parameter :: chunk = 512
  !> Error of smooth FRFs relative to their noise.
  real(dp), parameter :: smooth_share = 0.2_dp
  !> Relative noise of gamma_jk from which on a line counts less.
  real(dp), parameter :: hidden = 0.1_dp
  !> A compliance begins at this share of its standard error at least.
  real(dp), parameter :: least_share = 1.0e-3_dp
  integer, parameter :: steps = 100
  real(dp), parameter :: least_gain = 1.0e-6_dp

  !> R of the lines, the variance of its diagonal, and the largest relative noise of gamma_jk.
  type :: line_compliance
    complex(dp), allocatable :: value(:, :)        !< the diagonal, (n, n_freq)
    real(dp), allocatable :: variance(:, :), ratio(:)
    logical, allocatable :: good(:)
  end type line_compliance

  !> Matrices of some lines.
  type :: line_matrices
    complex(dp), allocatable :: gamma(:, :, :), system(:, :, :), inverse(:, :, :)
    complex(dp), allocatable :: c(:, :, :)         !< C
    complex(dp), allocatable :: u(:, :, :)         !< U, (n, 2 n)
    complex(dp), allocatable :: v(:, :, :)         !< V^T, (n, 2 n)
    real(dp), allocatable :: weight(:, :, :), rcond(:)
    integer(ip), allocatable :: line_info(:)
  end type line_matrices

contains

  !> Reference springs as stiff as the structure at each DOF: one over the median of its receptances, the larger of both
  !> sides.
  subroutine find_springs(frfs, spring, info)
    type(joint_frfs), intent(in) :: frfs
    real(dp), intent(out) :: spring(:)
    integer(ip), intent(out) :: info
    real(dp), allocatable :: values(:)
    real(dp) :: middle, largest
    integer :: n, d, side, i, m, line, stat

    n = frfs%n_dof()
    info = info_good
    allocate (values(frfs%n_freq()), stat=stat)
    if (stat /= 0) info = info_no_memory
    if (stat /= 0) return
    do d = 1, n
      largest = tiny(1.0_dp)
      do side = 0, 1
        i = frfs%place(side*n + d, side*n + d)
        m = 0
        do line = 1, frfs%n_freq()
          if (.not. abs(frfs%smooth(i, line)) <= huge(1.0_dp)) cycle
          m = m + 1
          values(m) = abs(frfs%smooth(i, line))
        end do
        if (m > 0) call find_median(values(:m), middle)
        if (m > 0) largest = max(largest, middle)
      end do
      spring(d) = 1/largest
    end do
  end subroutine find_springs

  !> Coordinates of the joint from which a fit may begin.
  !> spring      Z, shape (n), N/m
  !> fitted      least squares of the diagonal of R
  !> undamped    its mean, no damping
  subroutine start_joint(joint, frfs, spring, fitted, undamped, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), target, intent(in) :: frfs
    real(dp), intent(in) :: spring(:)
    real(dp), intent(out) :: fitted(:), undamped(:)
    integer(ip), intent(out) :: info
    type(line_compliance) :: lines
    real(dp), allocatable :: weight(:)
    integer :: stat

    fitted = 0.0_dp
    undamped = 0.0_dp
    call find_compliance(frfs, spring, lines, info)
    if (info /= info_good) return
    if (.not. any(lines%good)) return
    allocate (weight(frfs%n_freq()), stat=stat)
    if (stat /= 0) info = info_no_memory
    if (info == info_good) call weigh_lines(lines, 2*size(fitted), weight, info)
    if (info == info_good) call fit_lines(joint, frfs%omega, lines, weight, fitted, undamped, info)
  end subroutine start_joint

  !> R of every line, in chunks.
  subroutine find_compliance(frfs, spring, lines, info)
    type(joint_frfs), intent(in) :: frfs
    real(dp), intent(in) :: spring(:)
    type(line_compliance), intent(inout) :: lines
    integer(ip), intent(out) :: info
    type(line_matrices) :: some
    integer :: n, n_freq, first, m, i, line, stat

    n = frfs%n_dof()
    n_freq = frfs%n_freq()
    m = min(chunk, n_freq)
    info = info_good
    allocate (lines%value(n, n_freq), lines%variance(n, n_freq), lines%ratio(n_freq), lines%good(n_freq), &
              some%gamma(2*n, 2*n, m), some%system(n, n, m), some%inverse(n, n, m), some%c(n, n, m), &
              some%u(n, 2*n, m), some%v(n, 2*n, m), some%weight(2*n, 2*n, m), some%rcond(m), &
              some%line_info(m), stat=stat)
    if (stat /= 0) info = info_no_memory
    do first = 1, n_freq, chunk
      if (info < info_good) return
      m = min(chunk, n_freq - first + 1)
      do i = 1, m
        call frfs%load_line(first + i - 1, some%gamma(:, :, i), some%weight(:, :, i))
        some%system(:, :, i) = some%gamma(:n, n + 1:, i)
      end do
      call invert(some%system(:, :, :m), some%inverse(:, :, :m), some%line_info(:m), some%rcond(:m), info)
      if (info < info_good) return
      do i = 1, m
        line = first + i - 1
        lines%good(line) = some%line_info(i) == line_good
        lines%ratio(line) = hidden_share(n, some%inverse(:, :, i), some%weight(:, :, i))
        call linearise(n, spring, some%gamma(:, :, i), some%inverse(:, :, i), some%c(:, :, i), some%u(:, :, i), &
                       some%v(:, :, i), some%system(:, :, i))
      end do
      call invert(some%system(:, :, :m), some%inverse(:, :, :m), some%line_info(:m), some%rcond(:m), info)
      if (info < info_good) return
      do i = 1, m
        line = first + i - 1
        call propagate(n, frfs%reciprocal, spring, some%c(:, :, i), some%inverse(:, :, i), some%u(:, :, i), &
                       some%v(:, :, i), some%weight(:, :, i), lines%value(:, line), lines%variance(:, line))
        lines%good(line) = lines%good(line) .and. some%line_info(i) == line_good .and. &
                           sum(abs(lines%value(:, line))) + sum(lines%variance(:, line)) <= huge(1.0_dp) .and. &
                           lines%ratio(line) <= huge(1.0_dp)
      end do
    end do
    info = info_good
  end subroutine find_compliance

  !> Largest relative noise of gamma_jk: the root of the diagonal of |gamma_jk^-1|^2 times its variance.
  pure function hidden_share(n, inverse, weight) result(share)
    integer, intent(in) :: n
    complex(dp), intent(in) :: inverse(n, n)
    real(dp), intent(in) :: weight(2*n, 2*n)
    real(dp) :: share, squares
    integer :: d, i

    share = 0.0_dp
    do d = 1, n
      squares = 0.0_dp
      do i = 1, n
        squares = squares + (real(inverse(d, i), dp)**2 + aimag(inverse(d, i))**2)*variance(weight(i, n + d))
      end do
      share = max(share, sqrt(squares))
    end do
  end function hidden_share

  !> Variance of an entry by its weight; 0 where it is not used.
  pure elemental real(dp) function variance(weight)
    real(dp), intent(in) :: weight

    variance = 0.0_dp
    if (weight > 0.0_dp) variance = 1/weight**2
  end function variance

  !> C, U and V^T, and 1 + C Z.
  pure subroutine linearise(n, spring, gamma, inverse, c, u, v, system)
    integer, intent(in) :: n
    real(dp), intent(in) :: spring(n)
    complex(dp), intent(in) :: gamma(2*n, 2*n), inverse(n, n)
    complex(dp), intent(out) :: c(n, n), u(n, 2*n), v(n, 2*n), system(n, n)
    integer :: i, j, k

    u = 0.0_dp
    v = 0.0_dp
    c = -gamma(n + 1:, :n)
    do i = 1, n
      u(i, n + i) = -1.0_dp
      v(i, i) = 1.0_dp
    end do
    do j = 1, n
      do k = 1, n
        u(:, j) = u(:, j) + gamma(n + 1:, n + k)*inverse(k, j)             ! L = gamma_kk gamma_jk^-1
        v(:, n + j) = v(:, n + j) - inverse(j, k)*gamma(k, :n)             ! -(gamma_jk^-1 gamma_jj)^T
      end do
    end do
    do j = 1, n
      do k = 1, n
        c(:, j) = c(:, j) + u(:, k)*gamma(k, j)
      end do
      system(:, j) = c(:, j)*spring(j)
      system(j, j) = system(j, j) + 1.0_dp
    end do
  end subroutine linearise

  !> The diagonal of R = (1 + C Z)^-1 C, and its variance by dR = (1 - R Z) U dgamma V (1 - Z R).
  !> inverse   (1 + C Z)^-1 = 1 - R Z
  pure subroutine propagate(n, reciprocal, spring, c, inverse, u, v, weight, value, spread)
    integer, intent(in) :: n
    logical, intent(in) :: reciprocal
    real(dp), intent(in) :: spring(n), weight(2*n, 2*n)
    complex(dp), intent(in) :: c(n, n), inverse(n, n), u(n, 2*n), v(n, 2*n)
    complex(dp), intent(out) :: value(n)
    real(dp), intent(out) :: spread(n)
    complex(dp) :: r(n), left(2*n), right(2*n), slope
    integer :: d, i, p, q

    do d = 1, n
      r = 0.0_dp
      left = 0.0_dp
      do i = 1, n
        r = r + inverse(:, i)*c(i, d)
        left = left + inverse(d, i)*u(i, :)
      end do
      right = v(d, :)
      do i = 1, n
        right = right - spring(i)*r(i)*v(i, :)
      end do
      value(d) = r(d)
      spread(d) = 0.0_dp
      do q = 1, 2*n
        do p = 1, merge(q, 2*n, reciprocal)
          slope = left(p)*right(q)
          if (reciprocal .and. p /= q) slope = slope + left(q)*right(p)
          spread(d) = spread(d) + (real(slope, dp)**2 + aimag(slope)**2)*variance(weight(p, q))
        end do
      end do
      spread(d) = smooth_share**2*spread(d)
    end do
  end subroutine propagate

  !> Weights of the lines by the noise of gamma_jk.
  subroutine weigh_lines(lines, n_least, weight, info)
    type(line_compliance), intent(in) :: lines
    integer, intent(in) :: n_least
    real(dp), intent(out) :: weight(:)
    integer(ip), intent(out) :: info
    real(dp), allocatable :: ratio(:)
    real(dp) :: threshold
    integer :: stat

    info = info_good
    threshold = hidden
    if (count(lines%good .and. lines%ratio < hidden) <= n_least) then
      allocate (ratio(count(lines%good)), stat=stat)
      if (stat /= 0) info = info_no_memory
      if (stat /= 0) return
      ratio(:) = pack(lines%ratio, lines%good)
      call find_median(ratio, threshold)
    end if
    weight = 0.0_dp
    where (lines%good) weight = 1/(1 + (lines%ratio/max(threshold, tiny(1.0_dp)))**8)
  end subroutine weigh_lines

  !> The joint by the weighted diagonal of R, DOF by DOF.
  subroutine fit_lines(joint, omega, lines, weight, fitted, undamped, info)
    type(diagonal_joint), intent(in) :: joint
    real(dp), contiguous, target, intent(in) :: omega(:)
    type(line_compliance), target, intent(inout) :: lines
    real(dp), intent(in) :: weight(:)
    real(dp), intent(out) :: fitted(:), undamped(:)
    integer(ip), intent(out) :: info
    complex(dp), allocatable, target :: information(:, :, :), gradient(:, :)
    real(dp), allocatable, target :: squares(:)
    real(dp), allocatable :: normal(:, :), descent(:)
    type(search_limits) :: limits
    real(dp) :: error(joint%n), cost
    integer :: i, d, stat

    allocate (information(joint%n, joint%n, size(weight)), gradient(joint%n, size(weight)), squares(size(weight)), &
              normal(size(fitted), size(fitted)), descent(size(fitted)), stat=stat)
    info = info_good
    if (stat == 0) call set_limits(joint, omega, limits, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    information = 0.0_dp
    gradient = 0.0_dp
    squares = 0.0_dp
    error = 0.0_dp
    fitted = 0.0_dp
    do i = 1, size(weight)
      if (.not. lines%good(i)) lines%value(:, i) = 0.0_dp
      if (.not. lines%good(i)) cycle
      do d = 1, joint%n
        information(d, d, i) = weight(i)/max(lines%variance(d, i), tiny(1.0_dp))
        error(d) = error(d) + real(information(d, d, i), dp)
        fitted(d) = fitted(d) + real(information(d, d, i), dp)*real(lines%value(d, i), dp)
      end do
    end do
    fitted(:joint%n) = fitted(:joint%n)/error
    error = 1/sqrt(error)
    undamped = 0.0_dp
    undamped(:joint%n) = max(fitted(:joint%n), error)
    fitted = undamped
    limits%steps = steps
    limits%least_gain = least_gain
    call fit_diagonal_joint(joint, line_forms(.false., omega, lines%value, information, gradient, squares), limits, &
                            fitted, normal, descent, cost, info)
    fitted(:joint%n) = max(fitted(:joint%n), least_share*error)
  end subroutine fit_lines
end module jointfrf_joint_start
