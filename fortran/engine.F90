!> Which engine a sweep uses: LAPACK line by line (the reference), or lanes with one of the instruction sets.
!>
!> The choice is one number for the whole process: that of the environment variable JOINTFRF_ENGINE when the kernel is
!> first used, until `set_engine` is called. The build defines JF_X86_V2, JF_X86_V3 and JF_X86_V4 where it has the
!> lane kernels of that level.
module jointfrf_engine
  use, intrinsic :: iso_c_binding, only: c_char, c_int
  use jointfrf_kinds, only: ip
  use jointfrf_lanes, only: lane_kernels
  use jointfrf_lane_kernels_plain, only: set_plain => set_kernels
  use jointfrf_manifold_kernels_plain, only: set_manifold_plain => set_manifold_kernels
  use jointfrf_noise_kernels_plain, only: set_noise_plain => set_noise_kernels
#ifdef JF_X86_V2
  use jointfrf_lane_kernels_v2, only: set_v2 => set_kernels
  use jointfrf_manifold_kernels_v2, only: set_manifold_v2 => set_manifold_kernels
  use jointfrf_noise_kernels_v2, only: set_noise_v2 => set_noise_kernels
#endif
#ifdef JF_X86_V3
  use jointfrf_lane_kernels_v3, only: set_v3 => set_kernels
  use jointfrf_manifold_kernels_v3, only: set_manifold_v3 => set_manifold_kernels
  use jointfrf_noise_kernels_v3, only: set_noise_v3 => set_noise_kernels
#endif
#ifdef JF_X86_V4
  use jointfrf_lane_kernels_v4, only: set_v4 => set_kernels
  use jointfrf_manifold_kernels_v4, only: set_manifold_v4 => set_manifold_kernels
  use jointfrf_noise_kernels_v4, only: set_noise_v4 => set_noise_kernels
#endif
  use jointfrf_status, only: info_good, info_no_engine
  implicit none
  private
  public :: set_engine, get_engine, find_kernels

  integer(ip), parameter, public :: engine_automatic = 0, engine_lapack = 1, engine_plain = 2
  integer(ip), parameter, public :: engine_v2 = 3, engine_v3 = 4, engine_v4 = 5
  character(len=9), parameter :: names(0:5) = [character(len=9) :: 'auto', 'lapack', 'plain', 'x86-64-v2', &
                                               'x86-64-v3', 'x86-64-v4']

  integer(ip), parameter :: not_asked = -1, unknown = -2
  integer(ip) :: choice = not_asked

  interface
    function cpu_level() bind(C, name='jointfrf_cpu_level') result(level)
      import :: c_int
      implicit none
      integer(c_int) :: level
    end function cpu_level

    !> JOINTFRF_ENGINE, padded with blanks, which it is where it is not set; question marks where it is longer.
    subroutine read_engine(length, word) bind(C, name='jointfrf_read_engine')
      import :: c_char, c_int
      implicit none
      integer(c_int), value :: length
      character(kind=c_char), intent(out) :: word(length)
    end subroutine read_engine
  end interface

contains

  !> Use this engine from now on; info is -1 where this machine does not have it.
  subroutine set_engine(engine, info)
    integer(ip), intent(in) :: engine
    integer(ip), intent(out) :: info

    info = -1
    if (.not. available(engine)) return
    info = info_good
    !$omp atomic write
    choice = engine
  end subroutine set_engine

  !> The engine in use; where the choice is automatic, the one that it comes to.
  subroutine get_engine(engine, info)
    integer(ip), intent(out) :: engine, info

    !$omp atomic read
    engine = choice
    if (engine == not_asked) then
      engine = from_environment()
      !$omp atomic write
      choice = engine
    end if
    info = info_good
    if (engine == unknown) info = info_no_engine
    if (engine == engine_automatic) engine = best()
  end subroutine get_engine

  !> The kernels of the engine in use; `found` is false for the reference engine. Those of the widest instruction set
  !> stand in for it where there is no LAPACK: for noise, which has the same bits with all of them, and the manifold.
  subroutine find_kernels(kernels, found, info)
    type(lane_kernels), intent(out) :: kernels
    logical, intent(out) :: found
    integer(ip), intent(out) :: info
    integer(ip) :: engine

    found = .false.
    call get_engine(engine, info)
    if (info /= info_good) return
    found = engine /= engine_lapack
    if (.not. found) engine = best()
    select case (engine)
    case (engine_plain)
      call set_plain(kernels)
      call set_noise_plain(kernels)
      call set_manifold_plain(kernels)
#ifdef JF_X86_V2
    case (engine_v2)
      call set_v2(kernels)
      call set_noise_v2(kernels)
      call set_manifold_v2(kernels)
#endif
#ifdef JF_X86_V3
    case (engine_v3)
      call set_v3(kernels)
      call set_noise_v3(kernels)
      call set_manifold_v3(kernels)
#endif
#ifdef JF_X86_V4
    case (engine_v4)
      call set_v4(kernels)
      call set_noise_v4(kernels)
      call set_manifold_v4(kernels)
#endif
    end select
  end subroutine find_kernels

  !> The widest instruction set there is.
  function best() result(engine)
    integer(ip) :: engine

    do engine = engine_v4, engine_v2, -1
      if (available(engine)) return
    end do
    engine = engine_plain
  end function best

  !> Whether this build and this processor have an engine.
  function available(engine) result(yes)
    integer(ip), intent(in) :: engine
    logical :: yes

    yes = engine >= engine_automatic .and. engine <= engine_plain
#ifdef JF_X86_V2
    if (engine == engine_v2) yes = cpu_level() >= 2
#endif
#ifdef JF_X86_V3
    if (engine == engine_v3) yes = cpu_level() >= 3
#endif
#ifdef JF_X86_V4
    if (engine == engine_v4) yes = cpu_level() >= 4
#endif
  end function available

  function from_environment() result(engine)
    integer(ip) :: engine
    character(len=16) :: word

    call read_engine(len(word, kind=c_int), word)
    engine = engine_automatic
    if (word == '') return
    engine = findloc(names, word, dim=1, kind=ip) - 1_ip
    if (.not. available(engine)) engine = unknown
  end function from_environment
end module jointfrf_engine
