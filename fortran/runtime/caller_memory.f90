!> Workspace that the caller brings, by LAPACK's habit: WORK and IWORK with their lengths, of which -1 asks how long
!> they must be.
module jointfrf_caller_memory
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_status, only: info_good
  implicit none
  private
  public :: caller_memory, as_memory, take_memory

  type :: caller_memory
    complex(dp), pointer, contiguous :: work(:) => null()
    integer(ip), pointer, contiguous :: iwork(:) => null()
    logical :: query = .false.
    integer(ip) :: argument = 0      !< number of LWORK among the arguments; that of LIWORK is two more
  end type caller_memory

contains

  !> The four arguments as one.
  !> argument   number of LWORK among the arguments
  function as_memory(argument, work, lwork, iwork, liwork) result(memory)
    integer(ip), intent(in) :: argument, lwork, liwork
    complex(dp), target, intent(inout) :: work(*)
    integer(ip), target, intent(inout) :: iwork(*)
    type(caller_memory) :: memory

    memory%argument = argument
    memory%query = lwork == -1 .or. liwork == -1
    if (memory%query) then
      memory%work(1:1) => work(1:1)
      memory%iwork(1:1) => iwork(1:1)
    else
      memory%work(1:max(0_ip, lwork)) => work(1:max(0_ip, lwork))
      memory%iwork(1:max(0_ip, liwork)) => iwork(1:max(0_ip, liwork))
    end if
  end function as_memory

  !> Workspace of these sizes out of the caller's memory; a query is answered instead.
  !> z, r, pivot   the pieces, where `ready`
  !> ready         whether they are there
  !> info          0 good, or a query; -i argument i, a length, is too small
  subroutine take_memory(memory, n_complex, n_real, n_pivot, z, r, pivot, ready, info)
    type(caller_memory), intent(in) :: memory
    integer(long), intent(in) :: n_complex, n_real, n_pivot
    complex(dp), pointer, contiguous, intent(out) :: z(:)
    real(dp), pointer, contiguous, intent(out) :: r(:)
    integer(blas_ip), pointer, contiguous, intent(out) :: pivot(:)
    logical, intent(out) :: ready
    integer(ip), intent(out) :: info
    integer(long) :: n_work, n_iwork

    n_work = max(1_long, n_complex + (n_real + 1)/2)
    n_iwork = max(1_long, (n_pivot*storage_size(1_blas_ip) + storage_size(1_ip) - 1)/storage_size(1_ip))
    info = info_good
    ready = .false.
    nullify (z, r, pivot)
    if (memory%query) then
      memory%work(1) = cmplx(n_work, 0, dp)
      memory%iwork(1) = int(n_iwork, ip)
      return
    end if
    if (size(memory%iwork, kind=long) < n_iwork) info = -memory%argument - 2
    if (size(memory%work, kind=long) < n_work) info = -memory%argument
    if (info /= info_good) return
    z => memory%work(:n_complex)
    call c_f_pointer(c_loc(memory%work(min(n_complex + 1, n_work))), r, [n_real])
    call c_f_pointer(c_loc(memory%iwork(1)), pivot, [n_pivot])
    ready = .true.
  end subroutine take_memory
end module jointfrf_caller_memory
