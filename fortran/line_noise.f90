!> Noise over the lines of a sweep: how neighbouring lines correlate, how its power varies, which lines are outlying.
module jointfrf_line_noise
  use jointfrf_gamma_distribution, only: gamma_quantile
  use jointfrf_kinds, only: dp
  use jointfrf_order_statistics, only: find_median, quantile, sort
  implicit none
  private
  public :: line_correlation, line_levels, prepare_levels

  !> Fewer lines show no correlation.
  integer, parameter :: fewest_lines = 16
  !> Noise beyond so many medians is cut to that, for correlations: 0.2 % of circular normal noise.
  real(dp), parameter :: cut = 3.0_dp
  !> An autocorrelation below so many standard deviations of that of independent lines, which these exceed with a
  !> probability of 0.6 %, ends the sum.
  real(dp), parameter :: significant = 2.5_dp
  !> Probability of calling one line of a sweep without outliers outlying.
  real(dp), parameter :: false_alarm = 1.0e-2_dp
  !> More outlying lines in a row than this may be a mode that smooth FRFs miss: it is one if neighbours correlate.
  integer, parameter :: short_run = 3
  real(dp), parameter :: alike = 0.5_dp
  !> Lines of a running median: so many, for a standard error of 22 % with one entry, and so many times those that
  !> correlate. It is taken at so many lines within its reach, as neighbouring windows share most of their lines.
  real(dp), parameter :: usual_lines = 41.0_dp, usual_correlated = 5.0_dp
  integer, parameter :: steps = 5
  !> A standard deviation of the logarithm of running medians so many times that of independent lines, and of at least
  !> 15 %, as smaller ones hardly change weights, is a variation over frequency.
  real(dp), parameter :: varies = 2.5_dp, varies_least = 0.15_dp
  !> Distance of the quartiles of a normal distribution, and of its outer deciles, in standard deviations.
  real(dp), parameter :: quartiles = 1.349_dp, deciles = 2.56_dp

  !> Workspace of `line_levels`.
  type, public :: level_space
    private
    real(dp), allocatable :: sorted(:), work(:)
    integer, allocatable :: order(:), spare(:)
    logical, allocatable :: outlying(:)
  end type level_space

contains

  !> How many neighbouring lines carry the noise of one independent line: 1 + 2 sum of the autocorrelations up to the
  !> first that is not significant; at least 1.
  !> noise          of unit variance, shape (n_freq, n_entries); NaN if it is not to count; cut to some medians
  !> share          part of the noise power that smoothing has taken up, 0 if no smooth FRF was subtracted
  !> known, sizes   workspace, shapes (n_freq, n_entries), (n_freq)
  !> inflation      the number
  pure subroutine line_correlation(noise, share, known, sizes, inflation)
    complex(dp), contiguous, intent(inout) :: noise(:, :)
    real(dp), intent(in) :: share
    real(dp), contiguous, intent(out) :: known(:, :), sizes(:)
    real(dp), intent(out) :: inflation
    logical :: whole
    real(dp) :: power, rho, total, pairs, number
    integer :: n, m, e, lag

    n = size(noise, 1)
    m = size(noise, 2)
    inflation = 1.0_dp
    if (n < fewest_lines) return
    do e = 1, m
      call cut_outliers(noise(:, e), known(:, e), sizes)
    end do
    whole = minval(known) > 0.0_dp
    number = max(sum(known), 1.0_dp)
    power = sum(real(noise)**2 + aimag(noise)**2)/number
    if (.not. power > 0.0_dp) return
    total = 0.0_dp
    do lag = 1, n/4 - 1
      pairs = real(m, dp)*(n - lag)
      if (.not. whole) pairs = max(sum(known(:n - lag, :)*known(lag + 1:, :)), 1.0_dp)
      rho = 0.0_dp
      do e = 1, m
        rho = rho + lagged_product(noise(:n - lag, e), noise(lag + 1:, e))
      end do
      rho = rho/pairs/power*(1.0_dp - share) + share
      if (rho < significant/sqrt(number)) exit
      total = total + rho*(1.0_dp - real(lag, dp)/n)
    end do
    inflation = max(1.0_dp, 1.0_dp + 2.0_dp*total)
  end subroutine line_correlation

  !> Real part of the sum of conjg(a) b, in four sums, each of which waits for its own last addition only.
  pure function lagged_product(a, b) result(total)
    complex(dp), contiguous, intent(in) :: a(:), b(:)
    real(dp) :: total, part(4)
    integer :: i, k, whole

    part = 0.0_dp
    whole = size(a) - mod(size(a), 4)
    do i = 1, whole, 4
      do k = 1, 4
        part(k) = part(k) + (real(a(i + k - 1))*real(b(i + k - 1)) + aimag(a(i + k - 1))*aimag(b(i + k - 1)))
      end do
    end do
    total = sum(part)
    do i = whole + 1, size(a)
      total = total + (real(a(i))*real(b(i)) + aimag(a(i))*aimag(b(i)))
    end do
  end function lagged_product

  !> Cut the noise of an entry to some medians of its size, and put 0 in place of NaN.
  !> known   1 where there is noise, 0 where there was NaN
  !> sizes   workspace
  pure subroutine cut_outliers(noise, known, sizes)
    complex(dp), contiguous, intent(inout) :: noise(:)
    real(dp), contiguous, intent(out) :: known(:), sizes(:)
    real(dp) :: usual
    integer :: line, n

    n = 0
    do line = 1, size(noise)
      known(line) = merge(1.0_dp, 0.0_dp, abs(noise(line)) <= huge(usual))
      if (known(line) > 0.0_dp) then
        n = n + 1
        sizes(n) = abs(noise(line))
      else
        noise(line) = 0.0_dp
      end if
    end do
    if (n == 0) return
    call find_median(sizes(:n), usual)
    do line = 1, size(noise)
      noise(line) = noise(line)*min(1.0_dp, cut*usual/max(abs(noise(line)), tiny(usual)))
    end do
  end subroutine cut_outliers

  !> Slow variation of the noise over frequency, and outlying lines, of all entries together.
  !>
  !> The mean square over the entries is compared with its running median. Its distribution without outliers is taken
  !> to be a gamma distribution whose shape follows from the quartiles of its logarithm, so entries that share their
  !> noise and noise that is not circular are allowed for. The running median, relative to its own median, is the slow
  !> variation if its spread is well above that of medians of so many independent lines. Of a residual more than a few
  !> lines in a row are outlying only if it jumps from line to line: else smooth FRFs do not fit there.
  !> noise         of unit variance, shape (n_freq, n_entries)
  !> inflation     lines that carry the noise of one independent line
  !> is_residual   whether the noise is measured minus smooth, in which modes that are missed show, too
  !> space         from `prepare_levels` of as many lines
  !> usual         slow variation, shape (n_freq); 1 if none is significant
  !> factor        by how much an outlying line exceeds the lines around, shape (n_freq); 1 for other lines
  pure subroutine line_levels(noise, inflation, is_residual, space, usual, factor)
    complex(dp), contiguous, intent(in) :: noise(:, :)
    real(dp), intent(in) :: inflation
    logical, intent(in) :: is_residual
    type(level_space), intent(inout) :: space
    real(dp), contiguous, intent(out) :: usual(:), factor(:)
    real(dp) :: shape_of, limit, by_chance, median, spread
    integer :: n, e, reach

    n = size(noise, 1)
    factor(:) = 0.0_dp
    do e = 1, size(noise, 2)
      factor(:) = factor + (real(noise(:, e))**2 + aimag(noise(:, e))**2)
    end do
    factor(:) = factor/size(noise, 2)
    reach = int(min(max(usual_lines, usual_correlated*inflation), real(n, dp)))/2
    call running_median(factor, reach, usual, space%work)
    usual(:) = max(usual, tiny(usual))
    factor(:) = factor/usual
    space%sorted(:) = log(max(factor, tiny(factor)))
    call sort(space%sorted, space%work(:n), space%order, space%spare)
    shape_of = (quartiles/max(quantile(space%sorted, 0.75_dp) - quantile(space%sorted, 0.25_dp), 1.0e-3_dp))**2
    limit = gamma_quantile(shape_of, 1.0_dp - false_alarm/n, false_alarm/n)/gamma_quantile(shape_of, 0.5_dp, 0.5_dp)
    by_chance = sqrt(inflation/(shape_of*(2*reach + 1)))
    space%sorted(:) = log(usual)
    call sort(space%sorted, space%work(:n), space%order, space%spare)
    spread = (quantile(space%sorted, 0.9_dp) - quantile(space%sorted, 0.1_dp))/deciles
    if (spread > max(varies*by_chance, varies_least)) then
      space%sorted(:) = usual
      call find_median(space%sorted, median)
      usual(:) = usual/median
    else
      usual(:) = 1.0_dp
    end if
    space%outlying(:) = factor > limit
    if (is_residual) call keep_missed(noise, space%outlying)
    factor(:) = merge(factor, 1.0_dp, space%outlying)
  end subroutine line_levels

  subroutine prepare_levels(n_freq, space, stat)
    integer, intent(in) :: n_freq
    type(level_space), intent(inout) :: space
    integer, intent(out) :: stat

    ! allow(C181): the caller looks at it
    allocate (space%sorted(n_freq), space%work(n_freq + 1), space%order(n_freq), space%spare(n_freq), &
              space%outlying(n_freq), stat=stat)
  end subroutine prepare_levels

  !> Take long runs with a smooth residual from the outlying lines.
  pure subroutine keep_missed(residual, outlying)
    complex(dp), contiguous, intent(in) :: residual(:, :)
    logical, contiguous, intent(inout) :: outlying(:)
    real(dp) :: correlation, before, now
    integer :: first, last, line

    first = 1
    do while (first <= size(outlying))
      last = first
      if (outlying(first)) then
        do while (last < size(outlying))
          if (.not. outlying(last + 1)) exit
          last = last + 1
        end do
        if (last - first + 1 > short_run) then
          correlation = 0.0_dp
          before = sqrt(sum(real(residual(first, :))**2 + aimag(residual(first, :))**2))
          do line = first + 1, last
            now = sqrt(sum(real(residual(line, :))**2 + aimag(residual(line, :))**2))
            correlation = correlation + real(dot_product(residual(line, :), residual(line - 1, :)), dp)/before/now
            before = now
          end do
          if (correlation/(last - first) > alike) outlying(first:last) = .false.
        end if
      end if
      first = last + 1
    end do
  end subroutine keep_missed

  !> Median over so many lines on either side, interpolated between every few lines; lines beyond the ends are
  !> reflected.
  !> window   workspace of at least 2 reach + 1
  pure subroutine running_median(values, reach, medians, window)
    real(dp), contiguous, intent(in) :: values(:)
    integer, intent(in) :: reach
    real(dp), contiguous, intent(out) :: medians(:), window(:)
    integer :: n, middle, before, line, k, step

    n = size(values)
    step = max(1, reach/steps)
    before = 1
    middle = 1
    do
      do k = -reach, reach
        window(reach + k + 1) = values(reflected(middle + k, n))
      end do
      call find_median(window(:2*reach + 1), medians(middle))
      do line = before + 1, middle - 1
        medians(line) = medians(before) + (medians(middle) - medians(before))*(line - before)/(middle - before)
      end do
      if (middle == n) exit
      before = middle
      middle = middle + step
      if (middle >= n) middle = n
    end do
  end subroutine running_median

  !> The line that stands for one beyond the ends.
  pure function reflected(line, n) result(inside)
    integer, intent(in) :: line, n
    integer :: inside

    inside = line
    do while (inside < 1 .or. inside > n)
      if (inside < 1) inside = 2 - inside
      if (inside > n) inside = 2*n - inside
      if (n == 1) inside = 1
    end do
  end function reflected
end module jointfrf_line_noise
