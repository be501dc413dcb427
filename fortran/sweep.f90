!> A sweep: independent frequency lines, shared among threads, each with its own status and condition number.
!>
!> A physics module says what one line is (`line_operation`) and where its result goes; everything that is the same for
!> all of them is here, once: workspace (allocated before the loop, one piece a thread), threads, NaN in bad lines, the
!> count of bad lines. It may also say how a block of lines is done side by side (`line_block`); lines of a block that
!> are in doubt are done again one by one, so that both ways give the same codes.
!>
!> In memory of the caller nothing is allocated and no thread is started: lines are done one by one.
module jointfrf_sweep
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  !$ use omp_lib, only: omp_get_max_threads, omp_in_parallel
  use jointfrf_blas_threads, only: blas_takes_threads, hold_blas_threads, release_blas_threads
  use jointfrf_caller_memory, only: caller_memory, take_memory
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lanes, only: in_doubt, lane_kernels, lanes
  use jointfrf_line_layout, only: store_nan
  use jointfrf_lookahead, only: add_range, lookahead, most_ranges
  use jointfrf_status, only: info_good, info_no_memory, line_good
  use jointfrf_traps, only: hold_traps, host_state, release_traps
  implicit none
  private
  public :: line_operation, line_space, run_sweep, threads_for, worth_a_plan, area

  !> Below this many floating-point operations a sweep costs less than waking the threads (about 100 microseconds).
  real(dp), parameter :: serial_flops = 2.0e5_dp
  !> Lanes do about ten times as many in that time.
  real(dp), parameter, public :: serial_flops_lanes = 2.0e6_dp
  !> Most blocks that a thread takes at a time, and work enough to take fewer. Pivot rows are remembered within them only,
  !> so that results do not depend on the number of threads.
  integer, parameter :: most_blocks = 8
  real(dp), parameter :: chunk_flops = 2.0e6_dp
  !> A sweep that reads no more bytes than this stays in the caches, and looking ahead would only cost time.
  integer(c_intptr_t), parameter :: near_bytes = 2**23
  !> Lines of a block that needs no workspace.
  integer, parameter, public :: long_block = 64*lanes
  !> Fewer lines than these are not worth a block.
  integer, parameter :: fewest_lines = 3

  !> Memory that belongs to a workspace.
  type :: own_memory
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: r(:), x(:)
    integer(blas_ip), allocatable :: pivot(:)
  end type own_memory

  !> The workspace of one thread, handed out line by line.
  type :: line_space
    complex(dp), pointer, contiguous :: z(:) => null()
    real(dp), pointer, contiguous :: r(:) => null()
    integer(blas_ip), pointer, contiguous :: pivot(:) => null()
    integer(long) :: used = 0
    real(dp), pointer, contiguous :: x(:, :, :) => null()   !< elements of a block, shape (lanes, 2, n_element)
    integer, allocatable :: hint(:)          !< pivot rows of the block before
    type(lookahead) :: ahead                 !< memory of the next block
    type(own_memory) :: own                  !< where the others lie, unless in the caller's memory
  contains
    procedure :: set_up
    procedure :: matrix
  end type line_space

  !> An array of lines in the caller's memory.
  type :: stream
    integer(c_intptr_t) :: address, line_bytes
  end type stream

  !> What is done with one line. An extension holds pointers to the caller's arrays.
  type, abstract :: line_operation
    integer(long) :: n_complex = 0 !< complex workspace of one line
    integer(long) :: n_real = 0    !< real workspace of one line
    integer(long) :: n_pivot = 0   !< integer workspace of one line
    real(dp) :: flops = 0.0_dp     !< estimated work of one line
    integer :: n_element = 0       !< elements that a block takes, see jointfrf_lanes; 0: no block form
    integer :: n_hint = 0          !< pivot rows that a block remembers
    integer :: block_lines = lanes !< lines of a block
    integer :: n_stream = 0        !< the caller's large arrays that a block reads
    type(stream) :: streams(most_ranges - 1)
    !> The caller's array for the results, one matrix a line.
    complex(dp), pointer, contiguous :: result(:, :, :) => null()
  contains
    procedure(line_routine), deferred :: line
    procedure :: line_block => no_block
    procedure :: reads
  end type line_operation

  abstract interface
    !> Compute line i. `rcond` is the smallest reciprocal condition number (1-norm) of the matrices inverted.
    subroutine line_routine(self, i, space, line_info, rcond)
      import :: line_operation, line_space, dp, ip
      class(line_operation), intent(in) :: self
      integer, intent(in) :: i
      type(line_space), target, intent(inout) :: space
      integer(ip), intent(out) :: line_info
      real(dp), intent(out) :: rcond
    end subroutine line_routine
  end interface

contains

  !> A block reads these lines, given as pairs of real numbers.
  subroutine reads(self, lines)
    class(line_operation), intent(inout) :: self
    real(dp), contiguous, target, intent(in) :: lines(:, :, :)

    if (self%n_stream == size(self%streams) .or. size(lines) == 0) return
    self%n_stream = self%n_stream + 1
    self%streams(self%n_stream)%address = transfer(c_loc(lines), 0_c_intptr_t)
    self%streams(self%n_stream)%line_bytes = 16_c_intptr_t*size(lines, 2)
  end subroutine reads

  !> What to bring near while the block of lines from first to last is computed: what the next block reads, and where
  !> this one writes.
  subroutine look_ahead(operation, first, last, final, ahead)
    class(line_operation), intent(in) :: operation
    integer, intent(in) :: first, last, final
    type(lookahead), intent(out) :: ahead
    integer(c_intptr_t) :: address, bytes
    integer :: i, next

    next = min(last + operation%block_lines, final)
    do i = 1, operation%n_stream
      associate (s => operation%streams(i))
        call add_range(ahead, s%address + s%line_bytes*last, s%address + s%line_bytes*next, .false.)
      end associate
    end do
    bytes = 16_c_intptr_t*size(operation%result, 1)*size(operation%result, 2)
    address = transfer(c_loc(operation%result), address)
    call add_range(ahead, address + bytes*(first - 1), address + bytes*last, .true.)
  end subroutine look_ahead

  !> What an operation without block form has.
  !> kernels     what lanes can do
  !> first       the first line of the block
  !> n_lines     its number of lines, 1..block_lines
  !> line_info   shape (n_lines): 0 good; anything else: in doubt, to be done again
  !> rcond       shape (n_lines)
  subroutine no_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(line_operation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)

    line_info = in_doubt
    rcond = 0.0_dp
    associate (unused => self%flops, also => kernels, and => first, with => space)
    end associate
  end subroutine no_block

  !> Numbers in an n by m matrix.
  pure function area(n, m) result(numbers)
    integer, intent(in) :: n, m
    integer(long) :: numbers

    numbers = int(n, long)*m
  end function area

  !> Memory of its own, of these sizes.
  subroutine set_up(self, n_complex, n_real, n_pivot, stat)
    class(line_space), target, intent(inout) :: self
    integer(long), intent(in) :: n_complex, n_real, n_pivot
    integer, intent(out) :: stat

    allocate (self%own%z(n_complex), self%own%r(n_real), self%own%pivot(n_pivot), stat=stat)
    if (stat /= 0) return
    self%z => self%own%z
    self%r => self%own%r
    self%pivot => self%own%pivot
  end subroutine set_up

  !> The next n by m matrix of the workspace, valid until the line ends.
  function matrix(self, n, m) result(piece)
    class(line_space), target, intent(inout) :: self
    integer, intent(in) :: n, m
    complex(dp), pointer, contiguous :: piece(:, :)

    piece(1:n, 1:m) => self%z(self%used + 1:self%used + area(n, m))
    self%used = self%used + area(n, m)
  end function matrix

  !> Whether there are enough lines to plan how they are computed side by side, in memory that is allocated.
  pure function worth_a_plan(n_freq, memory) result(worth)
    integer, intent(in) :: n_freq
    type(caller_memory), intent(in), optional :: memory
    logical :: worth

    worth = n_freq >= fewest_lines .and. .not. present(memory)
  end function worth_a_plan

  !> Run an operation over its lines.
  !> n_freq      number of lines; 0 is a good sweep of nothing
  !> line_info   shape (n_freq), status of each line
  !> rcond       shape (n_freq), reciprocal condition number of each line, 0 in a bad one
  !> info        0 good, also after a query; > 0 number of bad lines; info_no_memory; -i argument i, a length of the
  !>             caller's memory, is too small
  !> memory      of the caller: then the lines are done one by one in it
  subroutine run_sweep(operation, n_freq, line_info, rcond, info, memory)
    class(line_operation), intent(in) :: operation
    integer(ip), intent(in) :: n_freq
    integer(ip), intent(out) :: line_info(n_freq)
    real(dp), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory

    if (present(memory)) then
      call run_in_memory(operation, memory, line_info, rcond, info)
    else
      call run_shared(operation, n_freq, line_info, rcond, info)
    end if
  end subroutine run_sweep

  subroutine run_in_memory(operation, memory, line_info, rcond, info)
    class(line_operation), intent(in) :: operation
    type(caller_memory), intent(in) :: memory
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    integer(ip), intent(out) :: info
    type(line_space), target :: space
    logical :: ready
    integer :: i

    call take_memory(memory, operation%n_complex, operation%n_real, operation%n_pivot, space%z, space%r, space%pivot, &
                     ready, info)
    if (.not. ready) return
    call hold_blas_threads()       ! threads of the BLAS allocate, and their rounding differs
    do i = 1, size(line_info)
      call run_line(operation, i, space, line_info(i), rcond(i))
    end do
    call release_blas_threads()
    info = count(line_info /= line_good, kind=ip)
  end subroutine run_in_memory

  !> Lines in blocks where the engine can, shared among threads.
  subroutine run_shared(operation, n_freq, line_info, rcond, info)
    class(line_operation), intent(in) :: operation
    integer(ip), intent(in) :: n_freq
    integer(ip), intent(out) :: line_info(n_freq)
    real(dp), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(line_space), allocatable, target :: space(:)
    type(lane_kernels) :: kernels
    integer :: threads, share, n_shares, t, stat
    logical :: hold, blocks, far

    call find_kernels(kernels, blocks, info)
    if (info /= info_good) return
    blocks = blocks .and. operation%n_element > 0 .and. n_freq >= fewest_lines
    share = 1
    if (blocks) share = lines_of_share(operation)
    n_shares = (int(n_freq) + share - 1)/share
    threads = threads_for(operation%flops*n_freq, n_shares, merge(serial_flops_lanes, serial_flops, blocks))
    far = sum(operation%streams(:operation%n_stream)%line_bytes)*n_freq > near_bytes
    call prepare(operation, blocks, threads, space, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if

    ! Threads of the BLAS serve a single line only. Over several they would get in the way, and their rounding differs.
    hold = .false.
    !$ hold = omp_in_parallel()
    !$ if (n_freq > 1) hold = .true.
    if (hold) call hold_blas_threads()
    if (threads == 1) then
      call run_shares(operation, kernels, blocks, far, share, 1, n_shares, space(1), line_info, rcond)
    else
      !$omp parallel do num_threads(threads) schedule(static) default(none) &
      !$omp shared(operation, kernels, blocks, far, share, n_shares, threads, space, line_info, rcond)
      do t = 1, threads
        call run_shares(operation, kernels, blocks, far, share, first_of(t), first_of(t + 1) - 1, space(t), line_info, &
                        rcond)
      end do
      !$omp end parallel do
    end if
    if (hold) call release_blas_threads()
    info = count(line_info /= line_good, kind=ip)

  contains

    !> The first share of a thread.
    pure function first_of(thread) result(first)
      integer, intent(in) :: thread
      integer :: first

      first = int((int(thread - 1, long)*n_shares)/threads) + 1
    end function first_of
  end subroutine run_shared

  !> Lines that a thread takes at a time, in blocks.
  pure function lines_of_share(operation) result(lines)
    class(line_operation), intent(in) :: operation
    integer :: lines
    real(dp) :: flops

    flops = max(operation%flops*operation%block_lines, 1.0_dp)
    lines = operation%block_lines*max(1, min(most_blocks*lanes/operation%block_lines, ceiling(chunk_flops/flops)))
  end function lines_of_share

  !> The shares of one thread, from first to last.
  !> blocks   whether lines are done side by side
  !> far      whether the sweep is too large for the caches
  !> share    lines of a share
  subroutine run_shares(operation, kernels, blocks, far, share, first, last, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    type(lane_kernels), intent(in) :: kernels
    logical, intent(in) :: blocks, far
    integer, intent(in) :: share, first, last
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    type(host_state) :: host
    integer :: s, i

    call hold_traps(host)
    do s = first, last
      if (blocks) then
        call run_blocks(operation, kernels, (s - 1)*share + 1, min(s*share, size(line_info)), far, space, line_info, &
                        rcond)
      else
        do i = (s - 1)*share + 1, min(s*share, size(line_info))
          call run_line(operation, i, space, line_info(i), rcond(i))
        end do
      end if
    end do
    call release_traps(host)
  end subroutine run_shares

  !> Workspace, one piece a thread.
  subroutine prepare(operation, blocks, threads, space, stat)
    class(line_operation), intent(in) :: operation
    logical, intent(in) :: blocks
    integer, intent(in) :: threads
    type(line_space), allocatable, target, intent(out) :: space(:)
    integer, intent(out) :: stat
    integer :: t

    allocate (space(threads), stat=stat)
    do t = 1, threads
      if (stat == 0) call space(t)%set_up(operation%n_complex, operation%n_real, operation%n_pivot, stat)
      if (stat == 0 .and. blocks) call place_elements(operation, space(t), stat)
    end do
  end subroutine prepare

  !> Elements begin at a multiple of their own length, so that no register is read across two cache lines.
  subroutine place_elements(operation, space, stat)
    class(line_operation), intent(in) :: operation
    type(line_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer(c_intptr_t) :: address
    integer :: skip, n

    n = lanes*2*operation%n_element
    allocate (space%own%x(n + lanes), space%hint(operation%n_hint), stat=stat)
    if (stat /= 0) return
    address = transfer(c_loc(space%own%x), address)/8
    skip = int(modulo(-address, int(lanes, c_intptr_t)))
    space%x(1:lanes, 1:2, 1:operation%n_element) => space%own%x(skip + 1:skip + n)
  end subroutine place_elements

  !> The lines from first to last, in blocks.
  !> far   whether the sweep is too large for the caches
  subroutine run_blocks(operation, kernels, first, last, far, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, last
    logical, intent(in) :: far
    type(line_space), intent(inout) :: space
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    integer :: i, k, n_lines

    space%hint = 0
    do i = first, last, operation%block_lines
      n_lines = min(operation%block_lines, last - i + 1)
      if (far) call look_ahead(operation, i, i + n_lines - 1, last, space%ahead)
      call operation%line_block(kernels, i, n_lines, space, line_info(i:i + n_lines - 1), rcond(i:i + n_lines - 1))
      if (count(line_info(i:i + n_lines - 1) /= line_good) == 0) cycle
      do k = i, i + n_lines - 1
        if (line_info(k) /= line_good) call run_line(operation, k, space, line_info(k), rcond(k))
      end do
    end do
  end subroutine run_blocks

  subroutine run_line(operation, i, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    integer, intent(in) :: i
    type(line_space), intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    space%used = 0
    call operation%line(i, space, line_info, rcond)
    if (line_info /= line_good) then
      rcond = 0.0_dp
      call store_nan(operation%result(:, :, i))
    end if
  end subroutine run_line

  !> One thread for little work, inside somebody else's parallel region, or where the BLAS takes one only; else what
  !> OpenMP would take.
  function threads_for(flops, n_shares, serial) result(threads)
    real(dp), intent(in) :: flops, serial
    integer, intent(in) :: n_shares
    integer :: threads

    threads = 1
    if (flops < serial .or. n_shares < 2) return
    !$ if (.not. omp_in_parallel() .and. blas_takes_threads()) threads = min(omp_get_max_threads(), n_shares)
  end function threads_for
end module jointfrf_sweep
