!> The joint without cross terms that fits FRFs at the joint best, and what they say of it.
!>
!> Maximum likelihood, linearised at FRFs that fit a joint: the smooth FRFs are projected on those that fit the present
!> joint (jointfrf_manifold), the quadratic forms of the measured FRFs about them are minimised
!> (jointfrf_diagonal_joint), and so on until the parameters move by less than a share of their standard errors.
!> Coordinates are a = 1/(k + z) of every DOF, with a reference spring z, and the rates eta = h a and tau = c a.
module jointfrf_joint_fit
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_diagonal_joint, only: diagonal_joint, fit_diagonal_joint, line_forms, lowest_diagonal_joint, &
    rate_of_one, search_limits, set_limits
  use jointfrf_gamma_distribution, only: gamma_quantile
  use jointfrf_joint_frfs, only: joint_frfs
  use jointfrf_joint_start, only: find_springs, start_joint
  use jointfrf_kinds, only: blas_ip, dp, ip
  use jointfrf_lapack, only: dsyev
  use jointfrf_line_starts, only: start_lines
  use jointfrf_linear_algebra, only: invert
  use jointfrf_manifold, only: expect_on_joint, joint_forms, project_on_joint
  use jointfrf_order_statistics, only: find_median
  use jointfrf_status, only: info_good, info_no_memory, line_good
  use jointfrf_traps, only: hold_all_traps, host_state, release_all_traps
  implicit none
  private
  public :: fit_joint, set_line_descent, set_values

  !> Linearisations at most. Steps of the projection: of the first one, of those that follow a small change of the
  !> joint, of lines started again.
  integer, parameter :: most = 25, first_steps = 30, next_steps = 8, other_steps = 25
  !> A line has arrived when a step gains less than this of the squares, in units of the noise.
  real(dp), parameter :: arrived = 1.0e-5_dp
  !> Lines farther from the manifold than this, in squares per unknown and of the noise, are started again. By default
  !> they are left out beyond this, and beyond the distance that noise reaches on any line with this probability.
  real(dp), parameter :: far = 3.0_dp, by_chance = 1.0e-3_dp
  !> The fit has converged when the coordinates move by less than this many standard errors, root mean square.
  real(dp), parameter :: moved_least = 0.02_dp
  !> Of a fit that swings between two points, the distance up to which it has converged between them.
  real(dp), parameter :: swings = 0.5_dp
  !> A fit is far from the data when the squares exceed their number by this factor.
  real(dp), parameter :: lost = 9.0_dp
  !> Steps of a search; it ends when two in a row gain less than this of the squares of one residual.
  integer, parameter :: search_steps = 100
  real(dp), parameter :: least_gain = 1.0e-6_dp
  !> A compliance is poorly determined when its standard error exceeds the first share of it: the FRFs may then hardly
  !> show M. Beyond the second nothing is known of its damping, whose rate is taken below 1 where it is linearised.
  real(dp), parameter :: poorly = 0.05_dp, hardly = 0.3_dp
  !> Steps that reverse, to this cosine, and shrink by less than this factor go to and fro between two points; the least
  !> part of such a step that is taken.
  real(dp), parameter :: reversed = -0.8_dp, shrunk = 0.5_dp, least_part = 0.1_dp
  !> After so many linearisations lines that are not used do not come back.
  integer, parameter :: long_search = 16
  !> Smooth FRFs have at least this share of the noise.
  real(dp), parameter :: least_share = 0.2_dp
  !> Directions of less information than this share of the largest are rounding.
  real(dp), parameter :: seen = 1.0e-15_dp

  !> What is given: nothing, springs and coordinates, H and Q as well.
  integer, parameter :: from_nothing = 0, from_points = 2

  !> What is asked.
  type, public :: fit_options
    integer :: patience = 8             !< linearisations after which a fit far from the data ends
    real(dp) :: farthest = 0.0_dp       !< squares of a line beyond which it is not used; 0 for the default
    integer :: start = from_nothing     !< what is given
    logical :: flexible = .false.       !< whether the sides may be flexible: lines are started again once only
  end type fit_options

  !> A minimum of the forms.
  type :: minimum
    real(dp) :: cost = 0.0_dp
    real(dp), allocatable :: x(:), normal(:, :), descent(:), covariance(:, :)
  end type minimum

  !> A fit: what was found, and all that it takes to find it.
  type, public :: joint_fit
    integer :: iterations = 0
    logical :: converged = .false.
    real(dp) :: equations = 0.0_dp, possible = 0.0_dp      !< complex equations of the lines used, and of all
    type(minimum) :: found
    real(dp), allocatable :: spring(:)                     !< Z, N/m
    logical, allocatable :: used(:)                        !< lines near enough to the manifold
    complex(dp), allocatable :: h(:, :, :), q(:, :, :)     !< the point of the manifold, (n, n, n_freq)
    real(dp), allocatable :: distance(:)                   !< its squares
    complex(dp), allocatable :: c_joint(:, :), information(:, :, :), gradient(:, :)      !< the forms about it
    real(dp), allocatable :: squares(:)
    ! What follows is workspace.
    type(minimum) :: trial
    logical, allocatable :: last_used(:), is_far(:)
    real(dp), allocatable :: count(:)                      !< equations of every line
    real(dp) :: farthest = 0.0_dp                          !< squares of a line beyond which it is not used
    complex(dp), allocatable :: r(:, :, :), point_h(:, :, :), point_q(:, :, :)
    real(dp), allocatable :: spread_m(:, :, :), real_line(:), at(:), change(:), last(:)
    integer(ip), allocatable :: line_info(:)
    real(dp) :: error_share = 1.0_dp                       !< error of the smooth FRFs over their noise
    real(dp) :: part = 1.0_dp                              !< of a step that is taken
    logical :: expects = .true.                            !< whether M is taken as expected
  end type joint_fit

contains

  !> Fit the joint.
  !> spring    Z, N/m
  !> x         coordinates where the fit begins; the compliances first, DOF by DOF
  !> h, q      where the projection begins
  subroutine fit_joint(joint, frfs, options, spring, x, h, q, fit, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    type(fit_options), intent(in) :: options
    real(dp), intent(in) :: spring(:), x(:)
    complex(dp), contiguous, intent(in) :: h(:, :, :), q(:, :, :)
    type(joint_fit), target, intent(inout) :: fit
    integer(ip), intent(out) :: info
    type(search_limits) :: limits

    call prepare(joint, frfs, size(x), limits, fit, info)
    if (info /= info_good .or. frfs%n_freq() == 0) return
    call hold_blas_threads()
    if (options%start == from_nothing) then
      call find_springs(frfs, fit%spring, info)
      if (info == info_good) call start_joint(joint, frfs, fit%spring, fit%found%x, fit%at, info)
    else
      fit%spring(:) = spring
      fit%found%x(:) = x
    end if
    fit%at(:) = fit%found%x
    if (options%start == from_points) then
      fit%h(:, :, :) = h
      fit%q(:, :, :) = q
    end if
    if (info == info_good) call find_prior(frfs, fit, info)
    if (info == info_good) call iterate(joint, frfs, options, limits, fit, info)
    if (info == info_good) info = count(fit%line_info /= line_good, kind=ip)
    call release_blas_threads()
  end subroutine fit_joint

  subroutine prepare(joint, frfs, p, limits, fit, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    integer, intent(in) :: p
    type(search_limits), intent(inout) :: limits
    type(joint_fit), intent(inout) :: fit
    integer(ip), intent(out) :: info
    integer :: n, l, stat

    n = joint%n
    l = frfs%n_freq()
    call set_limits(joint, frfs%omega, limits, stat)
    if (stat == 0) call allocate_minimum(p, fit%found, stat)
    if (stat == 0) call allocate_minimum(p, fit%trial, stat)
    if (stat == 0) allocate (fit%used(l), fit%last_used(l), fit%is_far(l), fit%h(n, n, l), fit%q(n, n, l), &
                             fit%distance(l), fit%c_joint(n, l), fit%information(n, n, l), fit%gradient(n, l), &
                             fit%squares(l), fit%count(l), fit%r(n, n, l), fit%point_h(n, n, l), fit%point_q(n, n, l), &
                             fit%spread_m(n, n, l), fit%real_line(l), fit%at(p), fit%change(p), &
                             fit%last(p), fit%line_info(l), fit%spring(n), stat=stat)
    info = info_good
    if (stat /= 0) info = info_no_memory
    if (stat /= 0) return
    limits%steps = search_steps
    limits%least_gain = least_gain
    fit%spring(:) = 1.0_dp
    fit%found%x(:) = 0.0_dp
    fit%found%normal(:, :) = 0.0_dp
    fit%found%descent(:) = 0.0_dp
    fit%found%covariance(:, :) = 0.0_dp
    fit%last(:) = 0.0_dp
    fit%last_used(:) = .true.
    fit%h(:, :, :) = 0.0_dp
    fit%q(:, :, :) = 0.0_dp
    fit%distance(:) = huge(1.0_dp)
    call count_equations(frfs, fit%count)
    fit%possible = sum(fit%count)
    fit%real_line(:) = fit%count
    fit%farthest = usual_distance(n, fit%real_line)
  end subroutine prepare

  !> The distance beyond which a line is not used by default.
  function usual_distance(n, equations) result(farthest)
    integer, intent(in) :: n
    real(dp), contiguous, intent(inout) :: equations(:)    !< of every line; reordered
    real(dp) :: farthest, middle, chance

    farthest = far*real(n, dp)**2
    if (size(equations) == 0) return
    call find_median(equations, middle)
    if (.not. middle > 0.0_dp) return
    chance = by_chance/real(size(equations), dp)
    farthest = max(farthest, gamma_quantile(middle, 1.0_dp - chance, chance))
  end function usual_distance

  subroutine allocate_minimum(p, here, stat)
    integer, intent(in) :: p
    type(minimum), intent(inout) :: here
    integer, intent(out) :: stat

    ! allow(C181): the caller looks at it
    allocate (here%x(p), here%normal(p, p), here%descent(p), here%covariance(p, p), stat=stat)
  end subroutine allocate_minimum

  !> Complex equations of every line: entries used, less what is free.
  pure subroutine count_equations(frfs, equations)
    type(joint_frfs), intent(in) :: frfs
    real(dp), intent(out) :: equations(:)
    integer :: n, line, i, j

    n = frfs%n_dof()
    do line = 1, size(equations)
      equations(line) = -real(merge(n*(n + 1), 2*n*n, frfs%reciprocal), dp)
      do j = 1, 2*n
        do i = 1, 2*n
          if (frfs%is_first(i, j) .and. frfs%inverse_std(frfs%place(i, j), line) > 0.0_dp) &
            equations(line) = equations(line) + 1
        end do
      end do
      equations(line) = max(equations(line), 0.0_dp)
    end do
  end subroutine count_equations

  !> What is known of M before the fit: entries as large as those of gamma_jj^-1, there and elsewhere in the band; and
  !> the error of the smooth FRFs over their noise, by what smoothing has taken away.
  subroutine find_prior(frfs, fit, info)
    type(joint_frfs), intent(in) :: frfs
    type(joint_fit), intent(inout) :: fit
    integer(ip), intent(out) :: info
    complex(dp) :: left
    real(dp) :: middle, squares
    integer :: n, line, i, j, at, used

    n = frfs%n_dof()
    squares = 0.0_dp
    used = 0
    do line = 1, frfs%n_freq()
      do j = 1, 2*n
        do i = 1, 2*n
          at = frfs%place(i, j)
          if (.not. frfs%is_first(i, j) .or. .not. frfs%inverse_std(at, line) > 0.0_dp) cycle
          left = (frfs%measured(at, line) - frfs%smooth(at, line))*frfs%inverse_std(at, line)
          if (.not. abs(left) <= huge(1.0_dp)) cycle
          squares = squares + real(left, dp)**2 + aimag(left)**2
          used = used + 1
        end do
      end do
      ! Entries in the caller's order: inverting and transposing commute.
      do j = 1, n
        do i = 1, n
          at = frfs%place(merge(j, i, frfs%transposed), merge(i, j, frfs%transposed))
          fit%point_h(i, j, line) = frfs%smooth(at, line)
        end do
      end do
    end do
    fit%error_share = sqrt(min(max(1 - squares/max(used, 1), least_share**2), 1.0_dp))
    call invert(fit%point_h, fit%point_q, fit%line_info, fit%real_line, info)
    if (info < info_good) return
    info = info_good
    do j = 1, n
      do i = 1, n
        do line = 1, frfs%n_freq()
          fit%spread_m(i, j, line) = abs(fit%point_q(i, j, line))
          if (.not. fit%spread_m(i, j, line) <= huge(1.0_dp)) fit%spread_m(i, j, line) = 0.0_dp
        end do
        fit%real_line(:) = fit%spread_m(i, j, :)
        call find_median(fit%real_line, middle)
        fit%spread_m(i, j, :) = max(hypot(fit%spread_m(i, j, :), middle), tiny(1.0_dp))
      end do
    end do
  end subroutine find_prior

  !> Linearise, minimise and judge until nothing moves, or no end is in sight.
  subroutine iterate(joint, frfs, options, limits, fit, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    type(fit_options), intent(in) :: options
    type(search_limits), intent(in) :: limits
    type(joint_fit), target, intent(inout) :: fit
    integer(ip), intent(out) :: info
    real(dp) :: moved
    logical :: whole, is_lost, spent, agrees
    integer :: before

    do
      fit%iterations = fit%iterations + 1
      call set_compliance(joint, frfs%omega, fit%at, fit%r)
      call find_points(frfs, options, fit, info)
      if (info /= info_good) return
      before = count(fit%last_used)
      call choose_lines(merge(options%farthest, fit%farthest, options%farthest > 0.0_dp), fit)
      ! The joint does not yet take account of lines that come near only now.
      whole = fit%iterations > 1 .and. count(fit%used) <= before
      fit%equations = sum(fit%count, mask=fit%used)
      call linearise(frfs, fit, info)
      if (info /= info_good) return
      fit%trial%x(:) = fit%found%x
      call lowest_diagonal_joint(joint, forms_of(frfs, fit), limits, fit%trial%x, fit%trial%normal, &
                                 fit%trial%descent, fit%trial%cost, info)
      if (info == info_good) call set_covariance(fit%trial, info)
      if (info /= info_good) return
      fit%change(:) = fit%trial%x - fit%found%x
      ! In standard errors along the direction of the step: coordinates that the data do not show may go anywhere.
      moved = sqrt(abs(2*form(fit%trial%normal, fit%change, fit%change))/size(fit%at))
      is_lost = fit%trial%cost > lost*fit%equations
      call judge_expectation(joint%n, fit, agrees)
      fit%converged = agrees .and. moved < moved_least .and. whole
      spent = fit%part <= least_part
      if (spent .and. .not. fit%converged .and. moved < swings) then
        ! Between the two ends, a tenth of the way of which was the last step.
        call look_there(joint, frfs, limits, fit%found, fit, info)
        fit%converged = .true.
        return
      end if
      if (fit%converged .or. spent .or. fit%iterations == most .or. &
          (is_lost .and. fit%iterations > options%patience)) exit
      call choose_part(is_lost, fit)
      fit%found%x(:) = fit%found%x + fit%part*fit%change
      call stay_in_sight(joint, frfs, limits, fit, info)
      if (info /= info_good) return
    end do
    fit%found%x(:) = fit%trial%x
    fit%found%normal(:, :) = fit%trial%normal
    fit%found%descent(:) = fit%trial%descent
    fit%found%covariance(:, :) = fit%trial%covariance
    fit%found%cost = fit%trial%cost
  end subroutine iterate

  !> R = a/(1 + i (eta + w tau)) of every DOF, a diagonal matrix on every line.
  pure subroutine set_compliance(joint, omega, x, r)
    type(diagonal_joint), intent(in) :: joint
    real(dp), intent(in) :: omega(:), x(:)
    complex(dp), intent(out) :: r(:, :, :)
    real(dp) :: rate(joint%n)
    integer :: line, i

    do line = 1, size(omega)
      rate = 0.0_dp
      do i = joint%n + 1, size(x)
        rate(joint%dof(i)) = rate(joint%dof(i)) + x(i)*merge(1.0_dp, omega(line), joint%kind(i) == 1)
      end do
      r(:, :, line) = 0.0_dp
      do i = 1, joint%n
        r(i, i, line) = x(i)/cmplx(1.0_dp, rate(i), dp)
      end do
    end do
  end subroutine set_compliance

  !> The FRFs nearest to the smooth ones that fit the joint.
  subroutine find_points(frfs, options, fit, info)
    type(joint_frfs), intent(in) :: frfs
    type(fit_options), intent(in) :: options
    type(joint_fit), intent(inout) :: fit
    integer(ip), intent(out) :: info

    if (fit%iterations > 1 .or. options%start == from_points) then
      call project(frfs, merge(first_steps, next_steps, fit%iterations == 1), fit, info)
    else
      fit%is_far(:) = .true.
      call start_lines(frfs, fit%spring, fit%r, first_steps, fit%is_far, fit%h, fit%q, fit%distance, info)
    end if
    if (info /= info_good .or. (fit%iterations > 1 .and. options%flexible)) return
    fit%is_far(:) = .not. fit%distance <= far*real(frfs%n_dof(), dp)**2
    if (any(fit%is_far) .and. .not. all(fit%is_far)) &
      call start_lines(frfs, fit%spring, fit%r, other_steps, fit%is_far, fit%h, fit%q, fit%distance, info)
  end subroutine find_points

  !> The FRFs nearest to the smooth ones, from those that were nearest before.
  subroutine project(frfs, steps, fit, info)
    type(joint_frfs), intent(in) :: frfs
    integer, intent(in) :: steps
    type(joint_fit), intent(inout) :: fit
    integer(ip), intent(out) :: info
    complex(dp), pointer, contiguous :: smooth(:, :, :)
    real(dp), pointer, contiguous :: weight(:, :, :)
    integer :: line

    fit%point_h(:, :, :) = fit%h
    fit%point_q(:, :, :) = fit%q
    smooth(1:frfs%n_row, 1:frfs%n_column, 1:frfs%n_freq()) => frfs%smooth
    weight(1:frfs%n_row, 1:frfs%n_column, 1:frfs%n_freq()) => frfs%inverse_std
    call project_on_joint(frfs%transposed, frfs%reciprocal, int(steps, ip), arrived, smooth, weight, frfs%whitening, &
                          fit%r, fit%point_h, fit%point_q, fit%distance, fit%line_info, info, &
                          fit%spring)
    if (info < info_good) return
    info = info_good
    do line = 1, size(fit%distance)
      if (fit%line_info(line) == line_good) then
        fit%h(:, :, line) = fit%point_h(:, :, line)
        fit%q(:, :, line) = fit%point_q(:, :, line)
      else
        fit%distance(line) = huge(1.0_dp)
      end if
    end do
  end subroutine project

  !> Which lines are near enough to the manifold; half of them where few are. In a long search none comes back.
  !> Few are those that are fewer than the parameters, or than a quarter of all; of so few in all none is left out.
  subroutine choose_lines(farthest, fit)
    real(dp), intent(in) :: farthest
    type(joint_fit), intent(inout) :: fit
    real(dp) :: middle
    integer :: least, n_freq

    n_freq = size(fit%distance)
    least = max(size(fit%at), n_freq/4)
    fit%used(:) = fit%distance <= farthest
    if (n_freq <= least) then
      fit%used(:) = .true.
    else if (count(fit%used) < least) then
      fit%real_line(:) = fit%distance
      call find_median(fit%real_line, middle)
      fit%used(:) = fit%distance <= middle
    end if
    if (fit%iterations > long_search .and. any(fit%used .and. fit%last_used)) &
      fit%used(:) = fit%used .and. fit%last_used
    fit%last_used(:) = fit%used
  end subroutine choose_lines

  !> Quadratic forms of the measured FRFs about the point, or about the one that is expected; zero on lines not used.
  subroutine linearise(frfs, fit, info)
    type(joint_frfs), intent(in) :: frfs
    type(joint_fit), target, intent(inout) :: fit
    integer(ip), intent(out) :: info
    complex(dp), pointer, contiguous :: measured(:, :, :, :), gradient(:, :, :)
    real(dp), pointer, contiguous :: weight(:, :, :), squares(:, :)
    integer :: n, n_freq, line, d

    n = frfs%n_dof()
    n_freq = frfs%n_freq()
    fit%point_h(:, :, :) = fit%h
    fit%point_q(:, :, :) = fit%q
    weight(1:frfs%n_row, 1:frfs%n_column, 1:n_freq) => frfs%inverse_std
    if (fit%expects) then
      call expect_on_joint(frfs%transposed, frfs%reciprocal, fit%error_share, fit%spread_m, weight, frfs%whitening, &
                           fit%r, fit%point_h, fit%point_q, fit%line_info, info, fit%spring)
      if (info < info_good) return
      do line = 1, n_freq
        if (fit%line_info(line) == line_good) cycle
        fit%point_h(:, :, line) = fit%h(:, :, line)
        fit%point_q(:, :, line) = fit%q(:, :, line)
      end do
    end if
    measured(1:frfs%n_row, 1:frfs%n_column, 1:n_freq, 1:1) => frfs%measured
    gradient(1:n, 1:n_freq, 1:1) => fit%gradient
    squares(1:n_freq, 1:1) => fit%squares
    call joint_forms(frfs%transposed, frfs%reciprocal, .true., measured, weight, frfs%whitening, fit%r, &
                     fit%point_h, fit%point_q, fit%information, gradient, squares, fit%line_info, info, fit%spring)
    if (info < info_good) return
    info = info_good
    do line = 1, n_freq
      do d = 1, n
        fit%c_joint(d, line) = fit%r(d, d, line)
      end do
      if (fit%used(line) .and. fit%line_info(line) == line_good) cycle
      fit%information(:, :, line) = 0.0_dp
      fit%gradient(:, line) = 0.0_dp
      fit%squares(line) = 0.0_dp
    end do
  end subroutine linearise

  function forms_of(frfs, fit) result(forms)
    type(joint_frfs), intent(in) :: frfs
    type(joint_fit), target, intent(in) :: fit
    type(line_forms) :: forms

    forms%transposed = frfs%transposed
    forms%omega => frfs%omega
    forms%c_joint => fit%c_joint
    forms%information => fit%information
    forms%gradient => fit%gradient
    forms%squares => fit%squares
  end function forms_of

  !> Whether M is taken as expected, or as that of the nearest FRFs, which overstates what is known of a stiff joint.
  !> The first step takes M as expected. It shows whether a compliance is poorly determined, and in which case that
  !> remains so to the end; a fit with M of the nearest FRFs that finds one is not the last.
  subroutine judge_expectation(n, fit, agrees)
    integer, intent(in) :: n
    type(joint_fit), intent(inout) :: fit
    logical, intent(out) :: agrees
    logical :: is_poor
    integer :: d

    is_poor = .false.
    do d = 1, n
      if (sqrt(max(fit%trial%covariance(d, d), tiny(1.0_dp))) > poorly*abs(fit%trial%x(d))) is_poor = .true.
    end do
    agrees = fit%expects .or. .not. is_poor
    fit%expects = is_poor .or. (fit%expects .and. fit%iterations > 1)
  end subroutine judge_expectation

  !> Which part of a step is taken.
  !> All of it, unless steps lead to and fro and hardly shrink: where all of the last one would have made the next step
  !> -r times as long, 1/(1 + r) of it would have ended at the fixed point. From then on parts do not grow: of two
  !> minima that are nearly as low, now the one is taken and now the other. All of it far from the data.
  subroutine choose_part(is_lost, fit)
    logical, intent(in) :: is_lost
    type(joint_fit), intent(inout) :: fit
    real(dp) :: own, before, along
    logical :: shrinks

    own = form(fit%trial%normal, fit%change, fit%change)
    before = form(fit%trial%normal, fit%last, fit%last)
    if (is_lost) then
      fit%part = 1.0_dp
    else if (own > 0.0_dp .and. before > 0.0_dp) then
      along = form(fit%trial%normal, fit%change, fit%last)/before
      shrinks = own < shrunk**2*before .or. along > reversed*sqrt(own/before)
      if (fit%part < 1.0_dp .or. .not. shrinks) fit%part = max(fit%part/max(1 - along, 1.0_dp), least_part)
    end if
    fit%last(:) = fit%change
  end subroutine choose_part

  !> u^T A v
  pure real(dp) function form(a, u, v)
    real(dp), intent(in) :: a(:, :), u(:), v(:)
    integer :: j

    form = 0.0_dp
    do j = 1, size(v)
      form = form + dot_product(u, a(:, j))*v(j)
    end do
  end function form

  !> Normal equations of the forms at some coordinates.
  subroutine look_there(joint, frfs, limits, here, fit, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    type(search_limits), intent(in) :: limits
    type(minimum), intent(inout) :: here
    type(joint_fit), target, intent(in) :: fit
    integer(ip), intent(out) :: info

    call fit_diagonal_joint(joint, forms_of(frfs, fit), limits, here%x, here%normal, here%descent, here%cost, info, &
                            steps=0)
    if (info == info_good) call set_covariance(here, info)
  end subroutine look_there

  !> Where is linearised next: no nearer to a rigid joint, nor at a larger rate, than the data resolve.
  subroutine stay_in_sight(joint, frfs, limits, fit, info)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    type(search_limits), intent(in) :: limits
    type(joint_fit), target, intent(inout) :: fit
    integer(ip), intent(out) :: info
    logical :: is_hardly(joint%n)
    real(dp) :: error(joint%n), size_of(joint%n), one
    integer :: d, i, line

    info = info_good
    fit%at(:) = fit%found%x
    do d = 1, joint%n
      error(d) = sqrt(max(fit%trial%covariance(d, d), tiny(1.0_dp)))
      is_hardly(d) = .not. error(d) <= hardly*fit%found%x(d)
    end do
    if (any(is_hardly)) then
      ! The size of C itself: of a DOF that is mostly damping, the compliance alone may be anything.
      call set_compliance(joint, frfs%omega, fit%found%x, fit%r)
      size_of = 0.0_dp
      do line = 1, frfs%n_freq()
        do d = 1, joint%n
          size_of(d) = size_of(d) + abs(fit%r(d, d, line))/frfs%n_freq()
        end do
      end do
      do i = joint%n + 1, size(fit%at)
        if (is_hardly(joint%dof(i))) fit%at(i) = 0.0_dp
      end do
      fit%trial%x(:) = fit%at
      call look_there(joint, frfs, limits, fit%trial, fit, info)
      if (info == info_good) call find_errors(joint, is_hardly, fit%trial%normal, error, info)
      if (info /= info_good) return
      where (is_hardly) fit%at(:joint%n) = max(size_of, error)
    end if
    where (error <= huge(1.0_dp)) fit%at(:joint%n) = max(fit%at(:joint%n), error)
    do i = joint%n + 1, size(fit%at)
      if (.not. is_hardly(joint%dof(i))) cycle
      one = rate_of_one(joint%kind(i), frfs%omega)
      fit%at(i) = min(max(fit%found%x(i), -one), one)
    end do
  end subroutine stay_in_sight

  !> Standard errors of the compliances where the damping of some DOFs is known.
  subroutine find_errors(joint, is_known, normal, error, info)
    type(diagonal_joint), intent(in) :: joint
    logical, intent(in) :: is_known(:)
    real(dp), intent(in) :: normal(:, :)
    real(dp), intent(out) :: error(:)
    integer(ip), intent(out) :: info
    real(dp), allocatable :: part(:, :), covariance(:, :)
    integer, allocatable :: sought(:)
    integer :: i, m, stat

    allocate (sought(size(normal, 1)), stat=stat)
    info = info_no_memory
    if (stat /= 0) return
    m = 0
    do i = 1, size(sought)
      if (i > joint%n .and. is_known(joint%dof(i))) cycle
      m = m + 1
      sought(m) = i
    end do
    allocate (part(m, m), covariance(m, m), stat=stat)
    if (stat /= 0) return
    do i = 1, m
      part(:, i) = 2*normal(sought(:m), sought(i))
    end do
    call inverse_information(part, covariance, info)
    do i = 1, size(error)
      error(i) = sqrt(max(covariance(i, i), 0.0_dp))
    end do
  end subroutine find_errors

  !> Covariance of the coordinates for independent noise: squares are in units of complex residuals.
  subroutine set_covariance(here, info)
    type(minimum), intent(inout) :: here
    integer(ip), intent(out) :: info

    here%normal = 2*here%normal
    call inverse_information(here%normal, here%covariance, info)
    here%normal = 0.5_dp*here%normal
  end subroutine set_covariance

  !> Inverse of an information matrix of parameters of very different size; a pseudo-inverse where it has none.
  subroutine inverse_information(information, inverse, info)
    real(dp), intent(in) :: information(:, :)
    real(dp), intent(out) :: inverse(:, :)
    integer(ip), intent(out) :: info
    real(dp), allocatable :: vector(:, :), value(:), length(:), work(:)
    real(dp) :: largest
    integer(blas_ip) :: stat_lapack, p
    type(host_state) :: host
    integer :: n, i, j, k, stat

    n = size(information, 1)
    p = int(n, blas_ip)
    allocate (vector(n, n), value(n), length(n), work(max(1, 34*n)), stat=stat)
    info = info_good
    if (stat /= 0) info = info_no_memory
    if (stat /= 0) return
    do i = 1, n
      length(i) = sqrt(max(information(i, i), tiny(1.0_dp)))
    end do
    do j = 1, n
      do i = 1, n
        vector(i, j) = information(i, j)/(length(i)*length(j))
      end do
    end do
    inverse = 0.0_dp
    if (.not. all(abs(vector) <= huge(1.0_dp))) return
    call hold_all_traps(host)
    call dsyev('V', 'U', p, vector, p, value, work, size(work, kind=blas_ip), stat_lapack, 1_c_size_t, 1_c_size_t)
    call release_all_traps(host)
    if (stat_lapack /= 0) return
    largest = maxval(abs(value))
    do k = 1, n
      if (.not. abs(value(k)) > seen*largest) cycle
      do j = 1, n
        do i = 1, n
          inverse(i, j) = inverse(i, j) + (vector(i, k)/length(i))*(vector(j, k)/length(j))/value(k)
        end do
      end do
    end do
  end subroutine inverse_information

  !> Re(J^H (p - W d)) of every line at the minimum: minus half the derivative of its squares.
  pure subroutine set_line_descent(joint, frfs, fit, descent)
    type(diagonal_joint), intent(in) :: joint
    type(joint_frfs), intent(in) :: frfs
    type(joint_fit), intent(in) :: fit
    real(dp), intent(out) :: descent(:, :)
    real(dp) :: rate(joint%n)
    complex(dp) :: turn(joint%n), change(joint%n), residual, slope
    integer :: line, i, d, j

    do line = 1, size(descent, 2)
      rate = 0.0_dp
      do i = joint%n + 1, size(descent, 1)
        rate(joint%dof(i)) = rate(joint%dof(i)) + fit%found%x(i)*merge(1.0_dp, frfs%omega(line), joint%kind(i) == 1)
      end do
      turn = 1/cmplx(1.0_dp, rate, dp)
      change = fit%found%x(:joint%n)*turn - fit%c_joint(:, line)
      do i = 1, size(descent, 1)
        d = joint%dof(i)
        residual = fit%gradient(d, line)
        do j = 1, joint%n
          residual = residual - change(j)*merge(fit%information(j, d, line), fit%information(d, j, line), &
                                                frfs%transposed)
        end do
        slope = turn(d)
        if (joint%kind(i) > 0) slope = cmplx(0.0_dp, -fit%found%x(d), dp)*turn(d)**2
        if (joint%kind(i) == 2) slope = slope*frfs%omega(line)
        descent(i, line) = real(conjg(slope)*residual, dp)
      end do
    end do
  end subroutine set_line_descent

  !> Stiffnesses k = 1/a - z and damping h = eta/a, c = tau/a, and their covariance from that of the coordinates; a
  !> rigid DOF has infinite ones.
  pure subroutine set_values(joint, spring, x, covariance, value, spread)
    type(diagonal_joint), intent(in) :: joint
    real(dp), intent(in) :: spring(:), x(:), covariance(:, :)
    real(dp), intent(out) :: value(:), spread(:, :)
    real(dp) :: by_compliance(size(x)), by_own(size(x))
    integer :: i, j

    do i = 1, size(x)
      associate (a => x(joint%dof(i)))
        if (joint%kind(i) == 0) then
          value(i) = 1/a - spring(joint%dof(i))
          by_own(i) = 0.0_dp
          by_compliance(i) = -1/a**2
        else
          value(i) = x(i)/a
          by_own(i) = 1/a
          by_compliance(i) = -x(i)/a**2
        end if
      end associate
    end do
    do j = 1, size(x)
      do i = 1, size(x)
        associate (a => joint%dof(i), b => joint%dof(j))
          spread(i, j) = by_compliance(i)*(covariance(a, b)*by_compliance(j) + covariance(a, j)*by_own(j)) + &
                         by_own(i)*(covariance(i, b)*by_compliance(j) + covariance(i, j)*by_own(j))
        end associate
      end do
    end do
  end subroutine set_values
end module jointfrf_joint_fit
