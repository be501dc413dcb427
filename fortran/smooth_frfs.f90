!> Smooth FRFs: rational functions of frequency with common poles through several FRFs, as many poles as the data need.
!>
!> Poles are added at frequencies where the residual does not vanish in the mean over neighbouring lines, relocated, and
!> removed if they are not worth their parameters. Within the search the unit of frequency is the highest line.
module jointfrf_smooth_frfs
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_noise, only: line_correlation
  use jointfrf_rational_fit, only: fit_entries, least_damping, leave_lines_out, load_entries, prepare_space, &
    rational_space, relocate
  use jointfrf_status, only: info_good, info_no_memory
  implicit none
  private
  public :: smooth_frfs

  real(dp), parameter :: two_pi = 6.283185307179586476925286766559_dp
  !> Most relocations after new poles, and at the end; they end when the sum of squares no longer changes.
  integer, parameter :: relocations = 3, last_relocations = 8
  !> Relocation ends when it gains less than this share of the price of a pole.
  real(dp), parameter :: still = 0.1_dp
  !> A fit that leaves this share of the data is exact but for rounding of the normal equations.
  real(dp), parameter :: exact = 3.0e-5_dp
  !> Peaks are the largest lines within this share of all lines on either side, twice what lies between them.
  real(dp), parameter :: peak_window = 0.02_dp, peak_rise = 2.0_dp
  !> Poles with less damping than this part of the distance of lines may follow one line only: the fit is repeated
  !> without it, in so many rounds.
  real(dp), parameter :: narrow = 0.5_dp, left_out = 1.0e-4_dp
  integer, parameter :: rounds = 6
  !> An inflation found from a residual counts up to this while poles may be missing.
  real(dp), parameter :: most_inflation = 4.0_dp
  !> Damping of new poles relative to their frequency, usual in structures; relocation changes it.
  real(dp), parameter :: damping = 0.01_dp
  !> New poles above the lines, relative to the highest.
  real(dp), parameter :: above(2) = [1.2_dp, 1.5_dp]

  !> A fit with some poles.
  type :: pole_fit
    integer :: n = 0
    complex(dp), allocatable :: poles(:), smooth(:, :)
    real(dp), allocatable :: loss(:)
    real(dp) :: squares = 0.0_dp
  end type pole_fit

  !> FRFs with common poles, and the search for these.
  type :: pole_search
    integer :: n_freq, m, most, patience
    real(dp) :: given_inflation
    complex(dp), allocatable :: s(:)
    real(dp), allocatable :: x(:), weight(:, :)
    complex(dp), pointer, contiguous :: h(:, :) => null()
    !> Workspace: residuals, their sums over lines, gains by width, numbers of lines.
    complex(dp), allocatable :: residual(:, :), sums(:, :)
    real(dp), allocatable :: gains(:, :), line(:), usual(:), known(:, :)
    integer, allocatable :: widths(:), nearest(:)
    logical, allocatable :: alone(:), followed(:)              !< of poles, of lines
  end type pole_search

contains

  !> Smooth FRFs by rational functions with common poles.
  !> freq        Hz, rising, the last > 0, shape (n_freq)
  !> h           shape (n_freq, n_entries)
  !> variance    E|e|^2 up to one factor, > 0, shape (n_freq, n_entries)
  !> inflation   lines that carry the noise of one independent line; 0 to find them from the residual
  !> patience    orders in a row that may gain nothing before the search ends; 0 for no further poles
  !> n_start     number of first poles; 0 for poles at the peaks of the FRFs
  !> poles       in: first poles; out: poles, rad/s, as many as the search may take
  !> n_poles     number of poles found
  !> smooth      shape (n_freq, n_entries)
  !> squares     sum of |h - smooth|^2/variance
  !> info        > 0 so many FRFs had singular equations at last
  subroutine smooth_frfs(freq, h, variance, inflation, patience, n_start, poles, n_poles, smooth, squares, info)
    real(dp), contiguous, intent(in) :: freq(:), variance(:, :)
    complex(dp), contiguous, target, intent(in) :: h(:, :)
    real(dp), intent(in) :: inflation
    integer, intent(in) :: patience, n_start
    complex(dp), contiguous, intent(inout) :: poles(:)
    integer(ip), intent(out) :: n_poles
    complex(dp), contiguous, intent(out) :: smooth(:, :)
    real(dp), intent(out) :: squares
    integer(ip), intent(out) :: info
    type(rational_space), target :: space
    type(pole_search) :: search
    type(pole_fit) :: fit, best
    integer :: stat

    info = info_good
    if (size(h) == 0) then
      n_poles = 0
      squares = 0.0_dp
      return
    end if
    search%m = size(h, 2)
    search%n_freq = size(h, 1)
    search%given_inflation = inflation
    search%patience = patience
    search%most = max(1, min(size(poles), int(size(freq)/max(inflation, 1.0_dp)/3.0_dp) - 1))
    call prepare_search(search, fit, best, stat)
    if (stat == 0) call prepare_space(search%most, search%m, search%n_freq, space, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    search%h => h
    search%x(:) = freq/freq(size(freq))
    search%s(:) = cmplx(0.0_dp, search%x, dp)
    search%weight(:, :) = 1.0_dp/sqrt(variance)
    if (n_start > 0) then
      fit%n = min(n_start, search%most)
      fit%poles(:fit%n) = poles(:fit%n)/(two_pi*freq(size(freq)))
    else
      call first_poles(search, fit)
    end if
    call load_entries(h, search%weight, space)
    call search_poles(search, space, fit, best, info)
    n_poles = int(best%n, ip)
    poles(:best%n) = best%poles(:best%n)*(two_pi*freq(size(freq)))
    smooth(:, :) = best%smooth
    squares = best%squares
  end subroutine smooth_frfs

  subroutine prepare_search(search, fit, best, stat)
    type(pole_search), intent(inout) :: search
    type(pole_fit), intent(inout) :: fit, best
    integer, intent(out) :: stat
    integer :: k, n_widths

    n_widths = 1
    do while (3**(n_widths + 1) <= search%n_freq .and. n_widths < 11)
      n_widths = n_widths + 1
    end do
    allocate (search%s(search%n_freq), search%x(search%n_freq), search%weight(search%n_freq, search%m), &
              search%residual(search%n_freq, search%m), search%sums(0:search%n_freq, search%m), &
              search%known(search%n_freq, search%m), search%gains(search%n_freq, n_widths), &
              search%line(search%n_freq), search%usual(search%n_freq), search%widths(n_widths), &
              search%nearest(search%most), search%alone(search%most), search%followed(search%n_freq), &
              fit%poles(search%most), fit%smooth(search%n_freq, search%m), fit%loss(search%most), &
              best%poles(search%most), best%smooth(search%n_freq, search%m), best%loss(search%most), stat=stat)
    if (stat == 0) search%widths(:) = [(3**k, k=1, n_widths)]
  end subroutine prepare_search

  !> Fit with the number of poles that describes the data best.
  !> fit    first poles; workspace
  !> best   the fit
  subroutine search_poles(search, space, fit, best, info)
    type(pole_search), intent(inout) :: search
    type(rational_space), target, intent(inout) :: space
    type(pole_fit), intent(inout) :: fit, best
    integer(ip), intent(out) :: info
    real(dp) :: inflation
    integer :: round, k

    do round = 1, rounds
      inflation = search%given_inflation
      if (search%patience > 0 .or. .not. inflation > 0.0_dp) then
        call grow(search, space, fit, best, inflation)
      end if
      call prune(search, space, inflation, fit, best, info)
      call find_single_lines(search, space, inflation, best, fit)
      if (.not. any(search%followed)) exit
      call leave_lines_out(search%followed, left_out, space)
      do k = 1, search%n_freq
        if (search%followed(k)) search%weight(k, :) = search%weight(k, :)*left_out
      end do
      fit%n = 0
      do k = 1, best%n
        if (search%alone(k)) cycle
        fit%n = fit%n + 1
        fit%poles(fit%n) = best%poles(k)
      end do
      if (fit%n == 0) call first_poles(search, fit)
    end do
  end subroutine search_poles

  !> Add poles at frequencies with the largest residual, as long as they are worth their parameters.
  !> fit         first poles in, poles of the best fit out
  !> best        workspace
  !> inflation   of the best fit
  subroutine grow(search, space, fit, best, inflation)
    type(pole_search), intent(inout) :: search
    type(rational_space), target, intent(inout) :: space
    type(pole_fit), intent(inout) :: fit, best
    real(dp), intent(out) :: inflation
    real(dp) :: total, now, score, least
    integer :: failures, before
    integer(ip) :: info

    total = sum(search%weight**2*(real(search%h)**2 + aimag(search%h)**2))
    least = huge(least)
    inflation = 1.0_dp
    best%n = 0
    failures = 0
    do
      call converge(search, space, relocations, fit, info)
      call find_inflation(search, fit, now)
      score = score_of(search, now, fit)
      if (best%n == 0 .or. score < least) then
        best%n = fit%n
        best%poles(:fit%n) = fit%poles(:fit%n)
        least = score
        inflation = now
        failures = 0
      else
        failures = failures + 1
      end if
      if (failures >= search%patience .or. fit%n >= search%most .or. fit%squares < exact**2*total) exit
      before = fit%n
      call add_poles(search, now, min(max(1, fit%n/5), search%most - fit%n), fit)
      if (fit%n == before) exit
    end do
    fit%n = best%n
    fit%poles(:fit%n) = best%poles(:fit%n)
  end subroutine grow

  !> Fit without the poles that are not worth their parameters.
  !> fit    first poles; workspace
  !> best   the fit
  subroutine prune(search, space, inflation, fit, best, info)
    type(pole_search), intent(in) :: search
    type(rational_space), target, intent(inout) :: space
    real(dp), intent(in) :: inflation
    type(pole_fit), intent(inout) :: fit, best
    integer(ip), intent(out) :: info
    real(dp) :: score, least, limit
    integer(ip) :: own
    integer :: n_worthless, drop, k, one

    least = huge(least)
    best%n = 0
    do
      call converge(search, space, last_relocations, fit, own)
      score = score_of(search, inflation, fit)
      if (best%n > 0 .and. score > least) return
      call keep(fit, best)
      info = own
      least = score
      limit = price(search, inflation)*fit%squares/max(n_data(search) - n_parameters(search, fit%n), 1.0_dp)
      n_worthless = count(fit%loss(:fit%n) < limit)
      if (n_worthless == 0 .or. fit%n == 1) return
      ! Half of them at a time: what one describes another may describe as well.
      do drop = 1, min((n_worthless + 1)/2, fit%n - 1)
        one = minloc(fit%loss(:fit%n), 1)
        do k = one, fit%n - 1
          fit%poles(k) = fit%poles(k + 1)
          fit%loss(k) = fit%loss(k + 1)
        end do
        fit%n = fit%n - 1
      end do
    end do
  end subroutine prune

  pure subroutine keep(fit, best)
    type(pole_fit), intent(in) :: fit
    type(pole_fit), intent(inout) :: best

    best%n = fit%n
    best%squares = fit%squares
    best%poles(:fit%n) = fit%poles(:fit%n)
    best%loss(:fit%n) = fit%loss(:fit%n)
    best%smooth(:, :) = fit%smooth
  end subroutine keep

  !> Fit with poles relocated until the sum of squares stays.
  subroutine converge(search, space, most, fit, info)
    type(pole_search), intent(in) :: search
    type(rational_space), target, intent(inout) :: space
    integer, intent(in) :: most
    type(pole_fit), intent(inout) :: fit
    integer(ip), intent(out) :: info
    real(dp) :: squares

    call relocate(most, still*price(search, 1.0_dp)/n_data(search), search%s, space, fit%poles(:fit%n), squares, info)
    call fit_entries(search%s, search%h, fit%poles(:fit%n), space, fit%smooth, fit%squares, fit%loss(:fit%n), info)
  end subroutine converge

  !> Find poles that follow one outlying line, and these lines: without that line the pole is not worth its parameters.
  !> fit    the fit
  !> again  workspace
  subroutine find_single_lines(search, space, inflation, fit, again)
    type(pole_search), intent(inout) :: search
    type(rational_space), target, intent(inout) :: space
    real(dp), intent(in) :: inflation
    type(pole_fit), intent(in) :: fit
    type(pole_fit), intent(inout) :: again
    real(dp) :: limit, distance
    integer(ip) :: info
    integer :: k, n

    n = search%n_freq
    distance = (search%x(n) - search%x(1))/n
    search%followed(:) = .false.
    do k = 1, fit%n
      associate (damping_of => -real(fit%poles(k)), f => aimag(fit%poles(k)))
        search%alone(k) = damping_of < narrow*distance .and. f > search%x(1) .and. f < search%x(n)
        if (.not. search%alone(k)) cycle
        search%nearest(k) = minloc(abs(search%x - f), 1)
      end associate
      search%followed(search%nearest(k)) = .true.
    end do
    if (.not. any(search%followed)) return
    call leave_lines_out(search%followed, left_out, space)
    call fit_entries(search%s, search%h, fit%poles(:fit%n), space, again%smooth, again%squares, again%loss(:fit%n), &
                     info)
    call load_entries(search%h, search%weight, space)
    limit = price(search, inflation)*again%squares/max(n_data(search) - n_parameters(search, fit%n), 1.0_dp)
    search%followed(:) = .false.
    do k = 1, fit%n
      search%alone(k) = search%alone(k) .and. again%loss(k) < limit
      if (search%alone(k)) search%followed(search%nearest(k)) = .true.
    end do
  end subroutine find_single_lines

  !> The given inflation, or that of the residual, which missing poles increase.
  subroutine find_inflation(search, fit, inflation)
    type(pole_search), intent(inout) :: search
    type(pole_fit), intent(in) :: fit
    real(dp), intent(out) :: inflation

    inflation = search%given_inflation
    if (inflation > 0.0_dp) return
    search%residual(:, :) = search%weight*(search%h - fit%smooth)
    call line_correlation(search%residual, n_parameters(search, fit%n)/n_data(search), search%known, search%usual, &
                          inflation)
    inflation = min(inflation, most_inflation)
  end subroutine find_inflation

  !> Number of complex data.
  pure function n_data(search) result(number)
    type(pole_search), intent(in) :: search
    real(dp) :: number

    number = real(search%n_freq, dp)*search%m
  end function n_data

  !> Number of complex parameters of a fit with n poles.
  pure function n_parameters(search, n) result(number)
    type(pole_search), intent(in) :: search
    integer, intent(in) :: n
    real(dp) :: number

    number = real(search%m, dp)*(n + 1) + n
  end function n_parameters

  !> By how much a pole must reduce the sum of squares of noise of variance 1 to be worth its parameters: twice their
  !> number, as in generalised cross-validation, and the logarithm of the number of lines among which it was placed.
  pure function price(search, inflation) result(squares)
    type(pole_search), intent(in) :: search
    real(dp), intent(in) :: inflation
    real(dp) :: squares

    squares = inflation*(2.0_dp*(search%m + 1) + log(real(search%n_freq, dp)))
  end function price

  !> Generalised cross-validation: the least is the best.
  pure function score_of(search, inflation, fit) result(score)
    type(pole_search), intent(in) :: search
    real(dp), intent(in) :: inflation
    type(pole_fit), intent(in) :: fit
    real(dp) :: score, free

    free = 1.0_dp - (inflation*search%m + price(search, inflation)*fit%n/2.0_dp)/n_data(search)
    score = huge(score)
    if (free > 0.0_dp) score = fit%squares/free**2
  end function score_of

  !> Poles at the peaks of the FRFs, at the mirror image of the lowest, and two above the lines.
  subroutine first_poles(search, fit)
    type(pole_search), intent(inout) :: search
    type(pole_fit), intent(inout) :: fit
    real(dp) :: mean, low
    integer :: e, k, n, reach
    logical :: is_lowest

    n = search%n_freq
    search%line(:) = 0.0_dp
    do e = 1, search%m
      mean = sum(real(search%h(:, e))**2 + aimag(search%h(:, e))**2)/n
      if (mean > 0.0_dp) search%line(:) = search%line + (real(search%h(:, e))**2 + aimag(search%h(:, e))**2)/mean
    end do
    call median_of_three(search%line, search%usual)
    reach = max(2, nint(peak_window*n))
    is_lowest = .true.
    fit%n = 0
    call place(search%x(1), -1.0_dp)
    associate (value => search%usual)
      do k = 2, n - 1
        if (value(k) < maxval(value(max(1, k - reach):min(n, k + reach)))) cycle
        low = max(minval(value(max(1, k - reach):k - 1)), minval(value(k + 1:min(n, k + reach))))
        if (.not. value(k) > peak_rise*low) cycle
        if (is_lowest) then
          fit%n = 0
          call place(search%x(k), -1.0_dp)
        end if
        is_lowest = .false.
        call place(search%x(k), 1.0_dp)
      end do
    end associate
    do k = 1, size(above)
      call place(above(k), 1.0_dp)
    end do

  contains

    subroutine place(frequency, side)
      real(dp), intent(in) :: frequency, side

      if (fit%n == search%most) return
      fit%n = fit%n + 1
      fit%poles(fit%n) = cmplx(-max(damping*frequency, least_damping(search%s)), side*frequency, dp)
    end subroutine place
  end subroutine first_poles

  !> Median of each line and its neighbours: a single outlying line is not a mode.
  pure subroutine median_of_three(values, medians)
    real(dp), intent(in) :: values(:)
    real(dp), intent(out) :: medians(:)
    integer :: k, n

    n = size(values)
    do k = 1, n
      associate (before => values(max(k - 1, 1)), after => values(min(k + 1, n)))
        medians(k) = min(max(values(k), min(before, after)), max(before, after))
      end associate
    end do
  end subroutine median_of_three

  !> Add poles at frequencies where the residual does not vanish in the mean over neighbouring lines, at most so many.
  !>
  !> For windows of some widths the sum over the entries of |sum of residuals|^2/width is about the reduction of the sum
  !> of squares by a pole there; a window counts if that is the price of a pole. The pole takes its middle for frequency
  !> and its half-width for damping. Lines far above their neighbours are cut down to these: they are no modes.
  subroutine add_poles(search, inflation, most, fit)
    type(pole_search), intent(inout) :: search
    real(dp), intent(in) :: inflation
    integer, intent(in) :: most
    type(pole_fit), intent(inout) :: fit
    real(dp) :: limit
    integer :: added, best, first, last, w, k, places(size(search%widths))

    call sum_residuals(search, fit)
    limit = price(search, inflation)*fit%squares/max(n_data(search) - n_parameters(search, fit%n), 1.0_dp)
    do k = 1, size(search%widths)
      places(k) = maxloc(search%gains(:, k), 1)
    end do
    do added = 1, most
      best = 1
      do k = 2, size(search%widths)
        if (search%gains(places(k), k) > search%gains(places(best), best)) best = k
      end do
      first = places(best)
      if (.not. search%gains(first, best) >= limit) exit
      last = first + search%widths(best) - 1
      fit%n = fit%n + 1
      fit%poles(fit%n) = cmplx(-(search%x(last) - search%x(first))/2, (search%x(first) + search%x(last))/2, dp)
      do k = 1, size(search%widths)
        w = search%widths(k)
        search%gains(max(1, first - w + 1):last, k) = 0.0_dp
        places(k) = maxloc(search%gains(:, k), 1)
      end do
    end do
  end subroutine add_poles

  !> Gains of windows of each width that begin on each line, 0 for windows that end beyond the lines.
  subroutine sum_residuals(search, fit)
    type(pole_search), intent(inout) :: search
    type(pole_fit), intent(in) :: fit
    complex(dp) :: total
    integer :: e, k, line, w

    search%line(:) = 0.0_dp
    do e = 1, search%m
      do line = 1, search%n_freq
        search%residual(line, e) = search%weight(line, e)*(search%h(line, e) - fit%smooth(line, e))
        search%line(line) = search%line(line) + real(search%residual(line, e))**2 + aimag(search%residual(line, e))**2
      end do
    end do
    call median_of_three(search%line, search%usual)
    do line = 1, search%n_freq          ! by which residuals are multiplied
      search%line(line) = sqrt(min(1.0_dp, search%usual(line)/max(search%line(line), tiny(search%line))))
    end do
    search%gains(:, :) = 0.0_dp
    do e = 1, search%m
      total = 0.0_dp
      search%sums(0, e) = total
      do line = 1, search%n_freq
        total = total + search%residual(line, e)*search%line(line)
        search%sums(line, e) = total
      end do
      do k = 1, size(search%widths)
        w = search%widths(k)
        do line = 1, search%n_freq - w + 1
          total = search%sums(line + w - 1, e) - search%sums(line - 1, e)
          search%gains(line, k) = search%gains(line, k) + (real(total)**2 + aimag(total)**2)/w
        end do
      end do
    end do
  end subroutine sum_residuals
end module jointfrf_smooth_frfs
