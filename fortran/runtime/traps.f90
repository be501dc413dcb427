!> The floating-point state of the program that calls: its traps are held off while the kernel computes, because a bad
!> line gets its code from NaN and Inf, and it rounds to the nearest, because directed rounding overflows to the largest
!> number instead. Afterwards traps, flags and rounding are as they were.
module jointfrf_traps
  use, intrinsic :: iso_c_binding, only: c_int64_t
  implicit none
  private
  public :: host_state, hold_all_traps, hold_traps, release_all_traps, release_traps

  type, bind(C) :: host_state
    private
    integer(c_int64_t) :: room(8)
  end type host_state

  interface
    !> From here to the release no exception stops this thread, and it rounds to the nearest.
    subroutine hold_traps(host) bind(C, name='jointfrf_hold_traps')
      import :: host_state
      implicit none
      type(host_state), intent(out) :: host
    end subroutine hold_traps

    !> The same where LAPACK computes eigenvalues, in units of the processor that nothing else uses.
    subroutine hold_all_traps(host) bind(C, name='jointfrf_hold_all_traps')
      import :: host_state
      implicit none
      type(host_state), intent(out) :: host
    end subroutine hold_all_traps

    !> The state of this thread is that of `host` again, as it was before `hold_all_traps`.
    subroutine release_all_traps(host) bind(C, name='jointfrf_release_all_traps')
      import :: host_state
      implicit none
      type(host_state), intent(in) :: host
    end subroutine release_all_traps

    !> The state of this thread is that of `host` again.
    subroutine release_traps(host) bind(C, name='jointfrf_release_traps')
      import :: host_state
      implicit none
      type(host_state), intent(in) :: host
    end subroutine release_traps
  end interface
end module jointfrf_traps
