!> Keeps a threaded BLAS to one thread while a sweep runs over several lines: threads inside threads run 10-25 times
!> slower from n = 96 on, and the rounding of the BLAS depends on its threads. Which BLAS it is shows at run time
!> (blas_threads.c); where it starts no threads of its own, both routines do nothing.
!>
!> The thread count of OpenBLAS is one number for the whole process, so the hold is counted: the first of several
!> concurrent sweeps sets it and the last one puts it back. MKL and BLIS are held for the calling thread, which puts
!> back what it found. This count and those numbers are the only state of the module.
module jointfrf_blas_threads
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none
  private
  public :: hold_blas_threads, release_blas_threads, blas_takes_threads

  integer(c_int) :: holders = 0
  integer(c_int) :: threads_before = 1

  interface
    function takes_threads() bind(C, name='jointfrf_blas_takes_threads') result(yes)
      import :: c_int
      implicit none
      integer(c_int) :: yes
    end function takes_threads

    function get_blas_threads() bind(C, name='jointfrf_get_blas_threads') result(threads)
      import :: c_int
      implicit none
      integer(c_int) :: threads
    end function get_blas_threads

    subroutine set_blas_threads(threads) bind(C, name='jointfrf_set_blas_threads')
      import :: c_int
      implicit none
      integer(c_int), value :: threads
    end subroutine set_blas_threads

    subroutine hold_own_blas_threads() bind(C, name='jointfrf_hold_own_blas_threads')
      implicit none
    end subroutine hold_own_blas_threads

    subroutine release_own_blas_threads() bind(C, name='jointfrf_release_own_blas_threads')
      implicit none
    end subroutine release_own_blas_threads
  end interface

contains

  !> Whether several threads may call the BLAS at once. An OpenBLAS built without threads gives wrong results then.
  function blas_takes_threads() result(yes)
    logical :: yes

    yes = takes_threads() /= 0
  end function blas_takes_threads

  !> From here to the matching release, by the same thread, the BLAS uses one thread.
  subroutine hold_blas_threads()
    !$omp critical (jointfrf_blas_threads_hold)
    if (holders == 0) then
      threads_before = get_blas_threads()
      if (threads_before /= 1) call set_blas_threads(1_c_int)
    end if
    holders = holders + 1
    !$omp end critical (jointfrf_blas_threads_hold)
    call hold_own_blas_threads()
  end subroutine hold_blas_threads

  !> The last holder gives the BLAS its threads back.
  subroutine release_blas_threads()
    call release_own_blas_threads()
    !$omp critical (jointfrf_blas_threads_hold)
    holders = holders - 1
    if (holders == 0 .and. threads_before /= 1) call set_blas_threads(threads_before)
    !$omp end critical (jointfrf_blas_threads_hold)
  end subroutine release_blas_threads
end module jointfrf_blas_threads
