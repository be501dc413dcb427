!> Order statistics of finite numbers: medians, quantiles, the rising order.
module jointfrf_order_statistics
  use jointfrf_kinds, only: dp
  implicit none
  private
  public :: find_median, quantile, rising_order, sort

  !> Numbers of a run that insertion sorts.
  integer, parameter :: run = 12

contains

  !> Median, the mean of both middle numbers of an even count.
  !> values   at least one; rearranged
  pure subroutine find_median(values, median)
    real(dp), contiguous, intent(inout) :: values(:)
    real(dp), intent(out) :: median
    integer :: half

    half = size(values)/2 + 1
    call move_smallest(half, values)
    median = values(half)
    if (mod(size(values), 2) == 0) median = (median + maxval(values(:half - 1)))/2
  end subroutine find_median

  !> Rearrange values so that the first k are the smallest and the k-th is the largest of them: C. A. R. Hoare, 1961.
  pure subroutine move_smallest(k, values)
    integer, intent(in) :: k
    real(dp), contiguous, intent(inout) :: values(:)
    real(dp) :: pivot, kept
    integer :: first, last, i, j

    first = 1
    last = size(values)
    do while (first < last)
      pivot = values((first + last)/2)
      i = first
      j = last
      do
        do while (values(i) < pivot)
          i = i + 1
        end do
        do while (values(j) > pivot)
          j = j - 1
        end do
        if (i <= j) then
          kept = values(i)
          values(i) = values(j)
          values(j) = kept
          i = i + 1
          j = j - 1
        end if
        if (i > j) exit
      end do
      if (k <= j) then
        last = j
      else if (k >= i) then
        first = i
      else
        exit
      end if
    end do
  end subroutine move_smallest

  !> Quantile of sorted numbers, interpolated between neighbours.
  !> share   from 0 to 1
  pure function quantile(sorted, share) result(value)
    real(dp), intent(in) :: sorted(:), share
    real(dp) :: value, place
    integer :: below

    place = share*(size(sorted) - 1)
    below = int(place)
    value = sorted(below + 1)
    value = value + (sorted(min(below + 2, size(sorted))) - value)*(place - below)
  end function quantile

  !> Sort numbers in place.
  !> work, order, spare   workspace of the same size
  pure subroutine sort(values, work, order, spare)
    real(dp), contiguous, intent(inout) :: values(:)
    real(dp), contiguous, intent(out) :: work(:)
    integer, contiguous, intent(out) :: order(:), spare(:)

    call rising_order(values, order, spare)
    work(:) = values(order)
    values(:) = work
  end subroutine sort

  !> Places of numbers in rising order, equal ones as they stand, by merging runs that insertion has sorted.
  !> spare   workspace of the same size
  pure subroutine rising_order(values, order, spare)
    real(dp), contiguous, intent(in) :: values(:)
    integer, contiguous, intent(out) :: order(:), spare(:)
    integer :: n, width, first, middle, last, i, j, k

    n = size(values)
    do first = 1, n, run
      do k = first, min(first + run - 1, n)
        i = k
        do while (i > first)
          if (values(order(i - 1)) <= values(k)) exit
          order(i) = order(i - 1)
          i = i - 1
        end do
        order(i) = k
      end do
    end do
    width = run
    do while (width < n)
      do first = 1, n, 2*width
        middle = min(first + width, n + 1)
        last = min(first + 2*width, n + 1)
        i = first
        j = middle
        k = first
        do while (i < middle .and. j < last)
          if (values(order(j)) < values(order(i))) then
            spare(k) = order(j)
            j = j + 1
          else
            spare(k) = order(i)
            i = i + 1
          end if
          k = k + 1
        end do
        spare(k:k + middle - i - 1) = order(i:middle - 1)
        k = k + middle - i
        spare(k:last - 1) = order(j:last - 1)
      end do
      order(:) = spare
      width = 2*width
    end do
  end subroutine rising_order
end module jointfrf_order_statistics
