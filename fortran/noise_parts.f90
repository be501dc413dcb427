!> Parts of the variance of noise by entry: E|e|^2 = sum of parts times terms, by maximum likelihood.
!>
!> The likelihood is -sum(log v + |e|^2/v), of exponentially distributed squares. The estimate holds for any
!> distribution of e with this variance; it is efficient for circular normal e.
module jointfrf_noise_parts
  use jointfrf_kinds, only: dp
  use jointfrf_order_statistics, only: find_median, rising_order
  implicit none
  private
  public :: likely_parts, noise_parts, parts_of_lines

  !> Lines are binned by the first term into so many bins: within one the variance is nearly the same.
  integer, parameter, public :: bins = 32
  !> Reach and points of the grid of the logarithm of the odds of two parts. |h|^2 of lightly damped structures spans 14
  !> decades, e^32, and either part may count at its end of them.
  real(dp), parameter :: widest = 40.0_dp
  integer, parameter :: grid_points = 33
  !> Change of the logarithm of the odds at which Newton's method ends, in at most so many steps.
  real(dp), parameter :: found = 1.0e-4_dp
  integer, parameter :: most_steps = 30
  !> Iterations of the likelihood of several parts; each lowers it, and the best of the starts is taken.
  integer, parameter :: iterations = 60
  !> The same if entries share a part, until parts change by less than a share: steps are slow if this part is small.
  integer, parameter :: common_iterations = 300
  real(dp), parameter :: settled = 1.0e-9_dp
  !> A part counts if it raises the logarithm of the likelihood by more than this.
  real(dp), parameter :: shown = 4.0_dp
  !> Initial value of the parts beside the one that a start begins with, relative to it.
  real(dp), parameter :: beside = 1.0e-3_dp

contains

  !> Parts of each entry.
  !> robust    whether medians of the bins of two terms count, which some lines with another error than noise do not
  !>           change; as exact as the squares are exponentially distributed
  !> squares   |e|^2, shape (n_freq, n_entries)
  !> terms     shape (n_freq, n_entries, n_terms); the first is |h|^2, by which lines are binned
  !> parts     not negative, shape (n_entries, n_terms)
  !> stat      not 0 without memory
  subroutine noise_parts(robust, squares, terms, parts, stat)
    logical, intent(in) :: robust
    real(dp), contiguous, intent(in) :: squares(:, :), terms(:, :, :)
    real(dp), contiguous, intent(out) :: parts(:, :)
    integer, intent(out) :: stat
    real(dp), allocatable :: work(:, :)
    integer, allocatable :: order(:), spare(:)
    real(dp) :: own(size(terms, 3))
    integer :: e, n

    n = size(squares, 1)
    allocate (work(n, size(terms, 3) + 1), order(n), spare(n), stat=stat)
    if (stat /= 0) return
    do e = 1, size(squares, 2)
      call rising_order(terms(:, e, 1), order, spare)
      call parts_of_lines(robust, squares(:, e), terms(:, e, :), order, work, own)
      parts(e, :) = own
    end do
  end subroutine noise_parts

  !> Parts of one entry.
  !> order   lines that count, in rising order of the first term
  !> work    workspace, shape (n_freq, n_terms + 1) or wider
  pure subroutine parts_of_lines(robust, squares, terms, order, work, parts)
    logical, intent(in) :: robust
    real(dp), intent(in) :: squares(:), terms(:, :)
    integer, intent(in) :: order(:)
    real(dp), contiguous, intent(out) :: work(:, :)
    real(dp), intent(out) :: parts(:)
    real(dp) :: y(bins), a(bins, 2), count(bins), scale(2)
    integer :: k, last, n

    n = size(order)
    last = size(terms, 2) + 1
    do k = 1, n
      work(k, 1) = squares(order(k))
      work(k, 2:last) = terms(order(k), :)
    end do
    if (last /= 3) then                         ! the variance is not the same within a bin
      call several_parts(work(:n, 1), work(:n, 2:last), parts)
      return
    end if
    call bin_lines(robust, n, work, y, a, count)
    k = min(n, bins)
    do n = 1, 2
      scale(n) = max(sum(count(:k)*a(:k, n)), tiny(scale))/sum(count(:k))
      a(:k, n) = a(:k, n)/scale(n)
    end do
    call two_parts(y(:k), a(:k, :), count(:k), parts)
    parts(:) = parts/scale
  end subroutine parts_of_lines

  !> Means over bins of lines that are in order; medians of the squares if robust. Few lines are their own bins.
  !> lines   squares and two terms, shape (:, 3); rearranged
  !> count   of each bin
  pure subroutine bin_lines(robust, n, lines, y, a, count)
    logical, intent(in) :: robust
    integer, intent(in) :: n
    real(dp), contiguous, intent(inout) :: lines(:, :)
    real(dp), intent(out) :: y(:), a(:, :), count(:)
    integer :: k, first, last

    y(:) = 0.0_dp
    a(:, :) = 0.0_dp
    count(:) = 1.0_dp
    do k = 1, min(n, bins)
      first = k
      last = k
      if (n > bins) then
        first = (k - 1)*n/bins + 1
        last = k*n/bins
      end if
      count(k) = last - first + 1
      a(k, 1) = sum(lines(first:last, 2))/count(k)
      a(k, 2) = sum(lines(first:last, 3))/count(k)
      if (robust .and. n > bins) then
        call find_median(lines(first:last, 1), y(k))
        y(k) = y(k)/log(2.0_dp)
      else
        y(k) = sum(lines(first:last, 1))/count(k)
      end if
    end do
  end subroutine bin_lines

  !> Parts of two terms of mean 1: the size of both follows from their odds. These are the best of a grid, improved by
  !> Newton's method between its neighbours.
  pure subroutine two_parts(y, a, count, parts)
    real(dp), intent(in) :: y(:), a(:, :), count(:)
    real(dp), intent(out) :: parts(:)
    real(dp) :: low, high, t, best, loss, least, slope, curvature, step, size_of
    integer :: k

    step = 2.0_dp*widest/(grid_points - 1)
    best = -widest
    least = huge(least)
    do k = 0, grid_points - 1
      t = -widest + k*step
      loss = profile_loss(t, y, a, count)
      if (loss < least) then
        best = t
        least = loss
      end if
    end do
    low = max(best - step, -widest)
    high = min(best + step, widest)
    t = best
    do k = 1, most_steps
      call profile_slope(t, y, a, count, slope, curvature, size_of)
      if (slope > 0.0_dp) high = t
      if (slope <= 0.0_dp) low = t
      step = -slope/max(curvature, tiny(curvature))
      if (.not. (curvature > 0.0_dp .and. t + step > low .and. t + step < high)) step = (low + high)/2.0_dp - t
      t = t + step
      if (abs(step) < found) exit
    end do
    if (profile_loss(t, y, a, count) > least) t = best
    call profile_slope(t, y, a, count, slope, curvature, size_of)
    parts(1) = size_of
    parts(2) = size_of*exp(t)
  end subroutine two_parts

  !> Minus twice the likelihood, but for constants, of the odds exp(t) with the best size.
  pure function profile_loss(t, y, a, count) result(loss)
    real(dp), intent(in) :: t, y(:), a(:, :), count(:)
    real(dp) :: loss, odds, v, total
    integer :: k

    odds = exp(t)
    loss = 0.0_dp
    total = 0.0_dp
    do k = 1, size(y)
      v = max(a(k, 1), tiny(v)) + odds*a(k, 2)
      loss = loss + count(k)*log(v)
      total = total + count(k)*y(k)/v
    end do
    loss = loss + sum(count)*log(max(total/sum(count), tiny(total)))
  end function profile_loss

  !> Its first and second derivative, and the part of the first term.
  pure subroutine profile_slope(t, y, a, count, slope, curvature, size_of)
    real(dp), intent(in) :: t, y(:), a(:, :), count(:)
    real(dp), intent(out) :: slope, curvature, size_of
    real(dp) :: odds, v, share, up(3), down(2), n
    integer :: k

    odds = exp(t)
    up = 0.0_dp
    down = 0.0_dp
    do k = 1, size(y)
      v = max(a(k, 1), tiny(v)) + odds*a(k, 2)
      share = odds*a(k, 2)/v
      up = up + count(k)*y(k)/v*[1.0_dp, share, share*(2.0_dp*share - 1.0_dp)]
      down = down + count(k)*share*[1.0_dp, 1.0_dp - share]
    end do
    n = sum(count)
    size_of = up(1)/n
    up(2:) = up(2:)/max(up(1), tiny(n))
    slope = down(1) - n*up(2)
    curvature = down(2) + n*(up(3) - up(2)**2)
  end subroutine profile_slope

  !> Parts of any number of terms: multiplicative updates part = part sqrt(sum(term y/v^2)/sum(term/v)), which never
  !> lower the likelihood, from one start a term with that term nearly alone, and one with all alike.
  pure subroutine several_parts(y, terms, parts)
    real(dp), intent(in) :: y(:), terms(:, :)
    real(dp), intent(out) :: parts(:)
    real(dp) :: scale(size(terms, 2)), own(size(terms, 2)), up(size(terms, 2)), down(size(terms, 2))
    real(dp) :: v, loss, least
    integer :: n_terms, start, turn, k

    n_terms = size(terms, 2)
    do k = 1, n_terms
      scale(k) = max(sum(terms(:, k)), tiny(v))/size(y)
    end do
    least = huge(least)
    parts(:) = 0.0_dp
    do start = 1, n_terms + 1
      own = merge(1.0_dp/n_terms, beside, start > n_terms)
      if (start <= n_terms) own(start) = 1.0_dp + beside
      own = own*sum(y)/size(y)/scale
      do turn = 1, iterations
        up = 0.0_dp
        down = 0.0_dp
        do k = 1, size(y)
          v = max(sum(own*terms(k, :)), tiny(v))
          up = up + terms(k, :)*(y(k)/v**2)
          down = down + terms(k, :)/v
        end do
        own = own*sqrt(up/max(down, tiny(v)))
      end do
      loss = 0.0_dp
      do k = 1, size(y)
        v = max(sum(own*terms(k, :)), tiny(v))
        loss = loss + log(v) + y(k)/v
      end do
      if (loss < least) then
        least = loss
        parts(:) = own
      end if
    end do
  end subroutine several_parts

  !> Parts of two terms, the second alike in all entries unless the squares clearly show that it differs: few lines of
  !> an entry may show its second part. Entries that do not clearly show one have none. Arguments as in `noise_parts`.
  subroutine likely_parts(squares, terms, parts, stat)
    real(dp), contiguous, intent(in) :: squares(:, :), terms(:, :, :)
    real(dp), contiguous, intent(out) :: parts(:, :)
    integer, intent(out) :: stat
    real(dp), allocatable :: common(:, :)
    real(dp) :: with, without, cost, cost_of_common, alone(2)
    integer :: e

    allocate (common(size(parts, 1), 2), stat=stat)
    if (stat /= 0) return
    call noise_parts(.false., squares, terms, parts, stat)
    if (stat /= 0) return
    call common_parts(squares, terms, common, stat)
    if (stat /= 0) return
    cost = 0.0_dp
    cost_of_common = 0.0_dp
    do e = 1, size(parts, 1)
      alone = [sum(squares(:, e)/max(terms(:, e, 1), tiny(cost)))/size(squares, 1), 0.0_dp]
      with = loss_of(parts(e, :), squares(:, e), terms(:, e, :)) + shown
      without = loss_of(alone, squares(:, e), terms(:, e, :))
      if (without <= with) parts(e, :) = alone
      cost = cost + min(with, without)
      cost_of_common = cost_of_common + loss_of(common(e, :), squares(:, e), terms(:, e, :))
    end do
    if (cost_of_common + shown < cost) parts(:, :) = common
  end subroutine likely_parts

  pure function loss_of(parts, squares, terms) result(loss)
    real(dp), intent(in) :: parts(:), squares(:), terms(:, :)
    real(dp) :: loss, v
    integer :: k

    loss = 0.0_dp
    do k = 1, size(squares)
      v = max(parts(1)*terms(k, 1) + parts(2)*terms(k, 2), tiny(v))
      loss = loss + log(v) + squares(k)/v
    end do
  end function loss_of

  !> Parts if that of the second term is the same for all entries.
  subroutine common_parts(squares, terms, parts, stat)
    real(dp), contiguous, intent(in) :: squares(:, :), terms(:, :, :)
    real(dp), contiguous, intent(out) :: parts(:, :)
    integer, intent(out) :: stat
    real(dp), allocatable :: lines(:, :), y(:, :), a(:, :, :)
    integer, allocatable :: order(:), spare(:)
    real(dp) :: count(bins), common, up(2), down(2), total(2), v, before
    integer :: e, k, n, m, turn

    n = size(squares, 1)
    m = size(squares, 2)
    allocate (lines(n, 3), y(bins, m), a(bins, 2, m), order(n), spare(n), stat=stat)
    if (stat /= 0) return
    total = 0.0_dp
    do e = 1, m
      call rising_order(terms(:, e, 1), order, spare)
      do k = 1, n
        lines(k, 1) = squares(order(k), e)
        lines(k, 2:) = terms(order(k), e, :)
      end do
      call bin_lines(.false., n, lines, y(:, e), a(:, :, e), count)
      parts(e, 1) = sum(count*y(:, e))/max(sum(count*a(:, 1, e)), tiny(v))
      total = total + [sum(count*y(:, e)), sum(count*a(:, 2, e))]
    end do
    common = total(1)/max(total(2), tiny(v))
    do turn = 1, common_iterations
      total = 0.0_dp
      do e = 1, m
        up = 0.0_dp
        down = 0.0_dp
        do k = 1, min(n, bins)
          v = max(parts(e, 1)*a(k, 1, e) + common*a(k, 2, e), tiny(v))
          up = up + a(k, :, e)*(count(k)*y(k, e)/v**2)
          down = down + a(k, :, e)*(count(k)/v)
        end do
        parts(e, 1) = parts(e, 1)*sqrt(up(1)/max(down(1), tiny(v)))
        total = total + [up(2), down(2)]
      end do
      before = common
      common = common*sqrt(total(1)/max(total(2), tiny(v)))
      if (abs(common - before) <= settled*common) exit
    end do
    parts(:, 2) = common
  end subroutine common_parts
end module jointfrf_noise_parts
