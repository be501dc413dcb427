!> Processes made by fork() after a call with several threads: they compute on one, since those of OpenMP stay behind.
module jointfrf_forks
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none
  private
  public :: has_its_threads, watch_forks

  interface
    !> Not zero in the child of a process that had used several threads.
    function was_forked() bind(C, name='jointfrf_was_forked')
      import :: c_int
      implicit none
      integer(c_int) :: was_forked
    end function was_forked

    !> To be called before the first parallel region.
    subroutine watch_forks() bind(C, name='jointfrf_watch_forks')
      implicit none
    end subroutine watch_forks
  end interface

contains

  !> Whether a parallel region can find its threads.
  function has_its_threads()
    logical :: has_its_threads

    has_its_threads = was_forked() == 0_c_int
  end function has_its_threads
end module jointfrf_forks
