!> Work in items that do not depend on each other, shared among threads: the one parallel region of the kernel.
!>
!> Whoever has such work (the lines of a sweep, the realisations of a study, noise) extends `shared_work`. Results must
!> not depend on who does which item.
module jointfrf_sharing
  !$ use omp_lib, only: omp_get_max_threads, omp_get_thread_num, omp_in_parallel
  use jointfrf_blas_threads, only: blas_takes_threads
  use jointfrf_forks, only: can_start, has_its_threads, watch_forks
  use jointfrf_kinds, only: dp, long
  use jointfrf_traps, only: hold_traps, host_state, release_traps
  implicit none
  private
  public :: shared_work, share, threads_for

  !> Below this many floating-point operations the work costs less than waking the threads (about 100 microseconds).
  real(dp), parameter, public :: serial_flops = 2.0e5_dp
  !> Lanes do about ten times as many in that time.
  real(dp), parameter, public :: serial_flops_lanes = 2.0e6_dp

  type, abstract :: shared_work
  contains
    procedure(items_routine), deferred :: do_items
  end type shared_work

  abstract interface
    !> Do the items from first to last.
    !> thread   1..threads: which workspace to use; several threads call this at the same time
    subroutine items_routine(self, first, last, thread)
      import :: long, shared_work
      implicit none
      class(shared_work), intent(in) :: self
      integer(long), intent(in) :: first, last
      integer, intent(in) :: thread
    end subroutine items_routine
  end interface

contains

  !> Do the items 1..n_items of the work.
  !> threads   from `threads_for`
  !> even      whether items take equally long: each thread then does one run of neighbours, the same in every call,
  !>           which keeps data in its cache; otherwise whoever is free takes the next item
  subroutine share(work, n_items, threads, even)
    class(shared_work), intent(in) :: work
    integer(long), intent(in) :: n_items
    integer, intent(in) :: threads
    logical, intent(in) :: even
    type(host_state) :: host
    integer(long) :: item
    integer :: t

    if (threads > 1) call watch_forks()
    if (threads == 1) then
      call hold_traps(host)
      call work%do_items(1_long, n_items, 1)
      call release_traps(host)
    else if (even) then
      !$omp parallel do num_threads(threads) schedule(static) default(none) shared(work, n_items, threads) private(host)
      do t = 1, threads
        call hold_traps(host)
        call work%do_items(first_of(t, threads, n_items), first_of(t + 1, threads, n_items) - 1, t)
        call release_traps(host)
      end do
      !$omp end parallel do
    else
      !$omp parallel num_threads(threads) default(none) shared(work, n_items) private(host, item, t)
      t = 1
      !$ t = omp_get_thread_num() + 1
      call hold_traps(host)
      !$omp do schedule(dynamic)
      do item = 1, n_items
        call work%do_items(item, item, t)
      end do
      !$omp end do
      call release_traps(host)
      !$omp end parallel
    end if
  end subroutine share

  !> The first item of a thread where items are even.
  pure function first_of(thread, threads, n_items) result(first)
    integer, intent(in) :: thread, threads
    integer(long), intent(in) :: n_items
    integer(long) :: first

    first = ((thread - 1)*n_items)/threads + 1
  end function first_of

  !> One thread for little work, inside somebody else's parallel region, in a forked process whose threads are in its
  !> parent, where the system starts no more threads, or where the BLAS takes one only; else what OpenMP would take.
  !> flops     floating-point operations of all items
  !> serial    so many are not worth a second thread
  function threads_for(flops, n_items, serial) result(threads)
    real(dp), intent(in) :: flops, serial
    integer(long), intent(in) :: n_items
    integer :: threads

    threads = 1
    if (flops < serial .or. n_items < 2) return
    !$ if (omp_in_parallel()) return
    if (.not. has_its_threads()) return
    !$ if (blas_takes_threads()) threads = int(min(int(omp_get_max_threads(), long), n_items))
    if (threads > 1) then
      if (.not. can_start(threads)) threads = 1
    end if
  end function threads_for
end module jointfrf_sharing
