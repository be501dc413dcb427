!> Looking ahead: while one block of lines is computed, the caller's memory of the next one is brought near.
!>
!> The processor foresees one long stream, not eight lines read side by side; without this a sweep that does not fit the
!> caches takes up to twice as long. The memory is asked for in small pieces between the steps of an elimination,
!> because few requests can wait at a time.
module jointfrf_lookahead
  use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t
  implicit none
  private
  public :: lookahead, add_range, spread_over, advance

  integer, parameter, public :: most_ranges = 5

  !> Ranges of addresses that are to be brought near, and how much of each at a time.
  type :: lookahead
    integer :: n = 0
    integer(c_intptr_t) :: from(most_ranges), to(most_ranges), piece(most_ranges)
    integer(c_int) :: write(most_ranges)
  end type lookahead

  interface
    subroutine prefetch(from, to, write) bind(C, name='jointfrf_prefetch')
      import :: c_int, c_intptr_t
      implicit none
      integer(c_intptr_t), value :: from, to
      integer(c_int), value :: write
    end subroutine prefetch
  end interface

contains

  !> One range more. `write` says that it will be overwritten.
  pure subroutine add_range(ahead, from, to, write)
    type(lookahead), intent(inout) :: ahead
    integer(c_intptr_t), intent(in) :: from, to
    logical, intent(in) :: write

    if (ahead%n == most_ranges .or. to <= from) return
    ahead%n = ahead%n + 1
    ahead%from(ahead%n) = from
    ahead%to(ahead%n) = to
    ahead%piece(ahead%n) = to - from
    ahead%write(ahead%n) = merge(1_c_int, 0_c_int, write)
  end subroutine add_range

  !> What is left is asked for in this many steps.
  pure subroutine spread_over(ahead, steps)
    type(lookahead), intent(inout) :: ahead
    integer, intent(in) :: steps
    integer :: i

    do i = 1, ahead%n
      ahead%piece(i) = ((ahead%to(i) - ahead%from(i))/max(steps, 1)/64 + 1)*64
    end do
  end subroutine spread_over

  !> One step.
  subroutine advance(ahead)
    type(lookahead), intent(inout) :: ahead
    integer(c_intptr_t) :: to
    integer :: i

    do i = 1, ahead%n
      if (ahead%from(i) >= ahead%to(i)) cycle
      to = min(ahead%from(i) + ahead%piece(i), ahead%to(i))
      call prefetch(ahead%from(i), to, ahead%write(i))
      ahead%from(i) = to
    end do
  end subroutine advance
end module jointfrf_lookahead
