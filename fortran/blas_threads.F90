!> Keeps a threaded BLAS to one thread while a sweep runs over several lines: threads inside threads run 10-25 times
!> slower from n = 96 on, and the rounding of the BLAS depends on its threads. JF_OPENBLAS is set by the build
!> where the BLAS is an OpenBLAS; where it is not, or starts no threads of its own, both routines do nothing.
!>
!> The thread count of OpenBLAS is one number for the whole process, so the hold is counted: the first of several
!> concurrent sweeps sets it and the last one puts it back. This counter is the only state the kernel keeps.
#ifndef JF_BLAS_PREFIX
#define JF_BLAS_PREFIX ""
#endif
module jointfrf_blas_threads
  use jointfrf_kinds, only: ip
  implicit none
  private
  public :: hold_blas_threads, release_blas_threads

#ifdef JF_OPENBLAS
  integer(ip) :: holders = 0
  integer(ip) :: threads_before = 1

  !> The count of an OpenBLAS built on OpenMP (2) is OpenMP's own and is left alone; it starts no threads in threads.
  integer(ip), parameter :: own_threads = 1

  interface
    function openblas_get_parallel() bind(C, name=JF_BLAS_PREFIX//"openblas_get_parallel") result(model)
      import :: ip
      integer(ip) :: model
    end function openblas_get_parallel

    function openblas_get_num_threads() bind(C, name=JF_BLAS_PREFIX//"openblas_get_num_threads") result(threads)
      import :: ip
      integer(ip) :: threads
    end function openblas_get_num_threads

    subroutine openblas_set_num_threads(threads) bind(C, name=JF_BLAS_PREFIX//"openblas_set_num_threads")
      import :: ip
      integer(ip), value :: threads
    end subroutine openblas_set_num_threads
  end interface
#endif

contains

  !> From here to the matching release the BLAS uses one thread.
  subroutine hold_blas_threads()
#ifdef JF_OPENBLAS
    !$omp critical (jointfrf_blas_threads_hold)
    if (holders == 0) then
      threads_before = 1
      if (openblas_get_parallel() == own_threads) threads_before = openblas_get_num_threads()
      if (threads_before /= 1) call openblas_set_num_threads(1_ip)
    end if
    holders = holders + 1
    !$omp end critical (jointfrf_blas_threads_hold)
#endif
  end subroutine hold_blas_threads

  !> The last holder gives the BLAS its threads back.
  subroutine release_blas_threads()
#ifdef JF_OPENBLAS
    !$omp critical (jointfrf_blas_threads_hold)
    holders = holders - 1
    if (holders == 0 .and. threads_before /= 1) call openblas_set_num_threads(threads_before)
    !$omp end critical (jointfrf_blas_threads_hold)
#endif
  end subroutine release_blas_threads
end module jointfrf_blas_threads
