!> Whether OpenMP has threads for a parallel region: not in processes made by fork() after a call with several, in which
!> those of OpenMP stay behind, and not where the system starts no more. Then one computes.
module jointfrf_forks
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none
  private
  public :: can_start, has_its_threads, watch_forks

  interface
    !> Not zero in the child of a process that had used several threads.
    function was_forked() bind(C, name='jointfrf_was_forked')
      import :: c_int
      implicit none
      integer(c_int) :: was_forked
    end function was_forked

    !> Not zero where so many threads can run at a time.
    function may_start(threads) bind(C, name='jointfrf_can_start')
      import :: c_int
      implicit none
      integer(c_int), value :: threads
      integer(c_int) :: may_start
    end function may_start

    !> To be called before the first parallel region.
    subroutine watch_forks() bind(C, name='jointfrf_watch_forks')
      implicit none
    end subroutine watch_forks
  end interface

contains

  !> Whether so many threads can run at a time, this one among them.
  function can_start(threads)
    integer, intent(in) :: threads
    logical :: can_start

    can_start = may_start(int(threads, c_int)) /= 0_c_int
  end function can_start

  !> Whether a parallel region can find its threads.
  function has_its_threads()
    logical :: has_its_threads

    has_its_threads = was_forked() == 0_c_int
  end function has_its_threads
end module jointfrf_forks
