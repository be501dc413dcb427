!> Measurement noise on FRFs from a counter-based generator.
!>
!> The number of an entry is a function of the seed, the entry, the frequency line and the number of the realisation: it
!> depends neither on threads nor on the instruction set nor on how the caller stores a line.
module jointfrf_noise
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_lanes, only: lane_kernels, lanes, real_lines
  use jointfrf_sharing, only: serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory
  implicit none
  private
  public :: noise_model, make_noise, is_kind, is_reference, upper, pollute
  public :: entry_counters, line_counter, draw, find_scale, spectrum_peak

  !> Letters of the kinds: complex, complex per part, real normal, real uniform, real uniform by its standard deviation.
  character(len=*), parameter :: kinds = 'CPNUS'
  !> Letters of what the level refers to: the entry, the largest of the line, the largest of the spectrum.
  character(len=*), parameter :: references = 'ELS'
  !> Work of one number, as the sweeps count it.
  real(dp), parameter :: number_flops = 100.0_dp

  type :: noise_model
    character :: kind = 'C', reference = 'E'
    logical :: reciprocal = .false.      !< entries (p, q) and (q, p) share their noise
    integer :: block = 1                 !< so do the entries of square blocks of this size
    real(dp) :: level = 0.0_dp
    integer(int64) :: key(2) = 0
  end type noise_model

  !> What one thread needs for the numbers of `lanes` lines.
  type :: noise_space
    integer(int64), allocatable :: low(:, :)
    real(dp), allocatable :: e(:, :, :), scale(:, :)
  end type noise_space

  !> Polluted FRFs as work to be shared: an item is `lanes` lines of one realisation.
  type, extends(shared_work) :: pollution
    type(noise_model) :: noise
    type(lane_kernels) :: kernels
    integer :: n = 0, n_chunks = 0                         !< numbers of a line, items of a realisation
    integer(int64) :: first = 0                            !< realisation
    real(dp) :: peak = 0.0_dp                              !< see `spectrum_peak`
    integer(int64), allocatable :: counters(:, :)          !< of the entries of lines 1 .. lanes, in this order
    real(dp), pointer, contiguous :: from(:, :, :) => null(), to(:, :, :) => null()
    type(noise_space), pointer, contiguous :: space(:) => null()
  contains
    procedure :: do_items => pollute_items
  end type pollution

contains

  pure function is_kind(letter) result(known)
    character, intent(in) :: letter
    logical :: known

    known = index(kinds, upper(letter)) > 0
  end function is_kind

  pure function is_reference(letter) result(known)
    character, intent(in) :: letter
    logical :: known

    known = index(references, upper(letter)) > 0
  end function is_reference

  pure function upper(letter) result(capital)
    character, intent(in) :: letter
    character :: capital

    capital = letter
    if (letter >= 'a' .and. letter <= 'z') capital = achar(iachar(letter) - 32)
  end function upper

  !> seed   its lower and upper 32 bits
  pure function make_noise(kind, reference, reciprocal, block, level, seed) result(noise)
    character, intent(in) :: kind, reference
    logical, intent(in) :: reciprocal
    integer, intent(in) :: block
    real(dp), intent(in) :: level
    integer(ip), intent(in) :: seed(2)
    type(noise_model) :: noise

    noise%kind = upper(kind)
    noise%reference = upper(reference)
    noise%reciprocal = reciprocal
    noise%block = block
    noise%level = level
    noise%key(1) = ior(shiftl(int(seed(2), int64), 32), iand(int(seed(1), int64), int(z'FFFFFFFF', int64)))
  end function make_noise

  !> Realisations first .. first + count - 1 of the polluted sweep: H + S e with noise numbers e; S is the level times H
  !> itself or times the largest modulus.
  !> transposed  whether each matrix is stored as (in, out)
  !> h           exact FRFs, shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) where transposed
  !> polluted    shape (n_out, n_in, n_freq*count), one realisation after the other
  subroutine pollute(transposed, noise, first, count, h, polluted, info)
    logical, intent(in) :: transposed
    type(noise_model), intent(in) :: noise
    integer(ip), intent(in) :: first, count
    complex(dp), contiguous, target, intent(in) :: h(:, :, :)
    complex(dp), contiguous, target, intent(inout) :: polluted(:, :, :)
    integer(ip), intent(out) :: info
    type(pollution) :: work
    type(noise_space), allocatable, target :: space(:)
    integer(long) :: n_items
    integer :: n, n_freq, threads, t, stat
    logical :: found

    info = info_good
    n = size(h, 1)*size(h, 2)
    n_freq = size(h, 3)
    if (n == 0 .or. n_freq == 0 .or. count == 0) return
    call find_kernels(work%kernels, found, info)
    if (info /= info_good) return
    work%noise = noise
    work%n = n
    work%n_chunks = (n_freq + lanes - 1)/lanes
    work%first = first
    n_items = int(work%n_chunks, long)*count
    threads = threads_for(number_flops*n*n_freq*count, n_items, serial_flops_lanes)
    allocate (work%counters(lanes, n), space(threads), stat=stat)
    do t = 1, threads
      if (stat == 0) allocate (space(t)%low(lanes, n), space(t)%e(lanes, 2, n), space(t)%scale(2, n*lanes), stat=stat)
    end do
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    work%space => space
    call list_counters(noise, transposed, size(h, 1), size(h, 2), work%counters)
    work%from => real_lines(h)
    work%to => real_lines(polluted)
    work%peak = spectrum_peak(noise, work%kernels, work%from)
    call share(work, n_items, threads, even=.true.)
  end subroutine pollute

  !> Items from first to last.
  subroutine pollute_items(self, first, last, thread)
    class(pollution), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: item
    integer :: n_freq, r, line, n_lines

    n_freq = size(self%from, 3)
    do item = first - 1, last - 1
      r = int(item/self%n_chunks)
      line = int(mod(item, int(self%n_chunks, long)))*lanes + 1
      n_lines = min(lanes, n_freq - line + 1)
      call pollute_lines(self%noise, self%kernels, self%n, n_lines, line, self%first + r, self%counters, self%peak, &
                         self%from(:, :, line:line + n_lines - 1), self%space(thread), &
                         self%to(:, :, r*n_freq + line:r*n_freq + line + n_lines - 1))
    end do
  end subroutine pollute_items

  !> The lines of one block in one realisation. Numbers lie in lanes one after the other, over lines.
  !> counters   those of lines 1 .. lanes, in this order
  subroutine pollute_lines(noise, kernels, n, n_lines, line, realisation, counters, peak, h, space, polluted)
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: n, n_lines, line
    integer(int64), intent(in) :: realisation, counters(lanes, n)
    real(dp), intent(in) :: peak, h(2, n, n_lines)
    type(noise_space), intent(inout) :: space
    real(dp), intent(out) :: polluted(2, n, n_lines)
    integer(int64) :: high(lanes)
    integer :: k, groups

    groups = (n*n_lines + lanes - 1)/lanes
    space%low(:, :groups) = counters(:, :groups) + line_counter(line)
    do k = 1, n_lines
      call find_scale(noise, kernels, n, h(:, :, k), peak, space%scale(:, (k - 1)*n + 1:k*n))
    end do
    high = realisation
    call draw(noise, kernels, groups, space%low, high, space%e)
    call kernels%pollute_flat(n*n_lines, h, space%scale, space%e, polluted)
  end subroutine pollute_lines

  !> Counters of all entries of lines 1 .. lanes, in this order.
  subroutine list_counters(noise, transposed, n_first, n_second, counters)
    type(noise_model), intent(in) :: noise
    logical, intent(in) :: transposed
    integer, intent(in) :: n_first, n_second
    integer(int64), intent(out) :: counters(n_first*n_second, lanes)
    integer :: line

    call entry_counters(noise, transposed, n_first, n_second, counters(:, 1))
    do line = 2, lanes
      counters(:, line) = counters(:, 1) + line_counter(line)
    end do
    counters(:, 1) = counters(:, 1) + line_counter(1)
  end subroutine list_counters

  !> What every entry contributes to its counter, in the order in which the caller stores a line, shape
  !> (n_first*n_second). Entries with the same noise have the same counter.
  !> n_first, n_second   size of a stored line
  pure subroutine entry_counters(noise, transposed, n_first, n_second, counters)
    type(noise_model), intent(in) :: noise
    logical, intent(in) :: transposed
    integer, intent(in) :: n_first, n_second
    integer(int64), intent(out) :: counters(n_first*n_second)
    integer :: i, j, row, column, columns

    columns = merge(n_first, n_second, transposed)/noise%block
    do j = 1, n_second
      do i = 1, n_first
        row = (merge(j, i, transposed) - 1)/noise%block
        column = (merge(i, j, transposed) - 1)/noise%block
        if (noise%reciprocal .and. row > column) then
          counters((j - 1)*n_first + i) = int(column, int64)*columns + row
        else
          counters((j - 1)*n_first + i) = int(row, int64)*columns + column
        end if
      end do
    end do
  end subroutine entry_counters

  !> What a line contributes to the counters of its entries; lines count from 1.
  pure function line_counter(line) result(counter)
    integer, intent(in) :: line
    integer(int64) :: counter

    counter = shiftl(int(line - 1, int64), 32)
  end function line_counter

  !> Noise numbers for level 1.
  !> low, high   counters: entry and line, realisation
  !> e           shape (lanes, 2, n)
  subroutine draw(noise, kernels, n, low, high, e)
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: n
    integer(int64), intent(in) :: low(lanes, n), high(lanes)
    real(dp), intent(out) :: e(lanes, 2, n)

    select case (noise%kind)
    case ('C')
      call kernels%normals(n, 0.5_dp, noise%key, low, high, e)       ! E|e|^2 = 1
    case ('P')
      call kernels%normals(n, 1.0_dp, noise%key, low, high, e)
    case ('N')
      call kernels%normals(n, 1.0_dp, noise%key, low, high, e)
      e(:, 2, :) = 0.0_dp
    case ('U')
      call kernels%uniforms(n, 1.0_dp, noise%key, low, high, e)
    case ('S')
      call kernels%uniforms(n, sqrt(3.0_dp), noise%key, low, high, e)
    end select
  end subroutine draw

  !> The factor of the noise number of every entry of a line, shape (2, n): level times what it refers to.
  !> peak    the largest modulus of the spectrum where the level refers to it
  subroutine find_scale(noise, kernels, n, h, peak, scale)
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: n
    real(dp), intent(in) :: h(2, n), peak
    real(dp), intent(out) :: scale(2, n)

    select case (noise%reference)
    case ('E')
      scale = noise%level*h
    case ('L')
      scale(1, :) = noise%level*kernels%largest(n, h)
      scale(2, :) = 0.0_dp
    case ('S')
      scale(1, :) = noise%level*peak
      scale(2, :) = 0.0_dp
    end select
  end subroutine find_scale

  !> The largest modulus of all lines where the level refers to it, else 0. Numbers that are not finite do not count.
  function spectrum_peak(noise, kernels, h) result(peak)
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    real(dp), contiguous, intent(in) :: h(:, :, :)
    real(dp) :: peak
    integer :: i

    peak = 0.0_dp
    if (noise%reference /= 'S') return
    do i = 1, size(h, 3)
      peak = max(peak, kernels%largest(size(h, 2), h(:, :, i)))
    end do
  end function spectrum_peak
end module jointfrf_noise
