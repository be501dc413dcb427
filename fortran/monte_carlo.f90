!> Monte Carlo study of an identification: pollute, identify and accumulate, without keeping any realisation.
!>
!> Lanes are realisations of one frequency line: inputs are the same in all of them, only noise differs. The
!> realisations of a line are cut into slices whose number depends on the arguments alone; slices are shared among
!> threads and put together in a fixed order. So results do not depend on the number of threads.
module jointfrf_monte_carlo
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_c_binding, only: c_loc
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_engine, only: find_kernels
  use jointfrf_ismm, only: inverse_substructuring
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_solved, padded, real_lines, &
    rows_in_memory, to_register
  use jointfrf_line_layout, only: all_finite, load, store, take_block
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_noise, only: draw, entry_counters, find_scale, line_counter, noise_model, spectrum_peak, &
    upper
  use jointfrf_sharing, only: serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory, line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_space
  implicit none
  private
  public :: monte_carlo, is_method

  !> ISMM, inverse substructuring, joint compliance.
  character(len=*), parameter :: methods = 'ISC'
  !> Slices in all where there are few lines, and realisations that a slice has at least.
  integer, parameter :: most_slices = 64, fewest_realisations = 512

  !> What is the same for all lines: places of the elements in lanes.
  type :: study_plan
    logical :: transposed, compliance
    integer :: n, m, n_element
    integer, allocatable :: gamma(:)             !< gamma in lanes, in the caller's order
    integer, allocatable :: again(:)             !< gamma once more, for lanes that are in doubt
    integer :: system_before                     !< the element before the system that is solved
    integer, allocatable :: unit(:)              !< right-hand sides -E_k
    complex(dp), allocatable :: unit_value(:)
    integer, allocatable :: kk_row(:), c_row(:)  !< rows of gamma_kk and of C
    integer, allocatable :: result(:)            !< where results lie that come line by line
    integer(int64), allocatable :: counters(:)
  end type study_plan

  !> Moments of values: how many, mean, and sums of re*re, im*im and re*im about the mean.
  type :: moments
    real(dp) :: number = 0.0_dp
    real(dp), allocatable :: mean(:, :), square(:, :)
    real(dp) :: rcond = huge(1.0_dp)             !< the smallest
    integer(ip) :: code = line_good              !< of the first bad realisation
  end type moments

  !> The workspace of one thread.
  type :: study_space
    type(line_space) :: lapack
    real(dp), allocatable :: room(:)             !< where x, e, mean and square lie
    integer(int64), allocatable :: low_room(:)
    real(dp), pointer, contiguous :: x(:, :, :) => null(), e(:, :, :) => null()
    real(dp), pointer, contiguous :: mean(:, :, :) => null(), square(:, :, :) => null()
    integer(int64), pointer, contiguous :: low(:, :) => null()
    real(dp), allocatable :: scale(:, :)
    integer, allocatable :: hint(:), from(:)     !< where results lie
    complex(dp), allocatable :: gamma(:, :), found(:, :)
  end type study_space

  !> A study as work to be shared: an item is a slice of the realisations of one line, slices of a line side by side.
  type, extends(shared_work) :: study
    type(study_plan) :: plan
    type(noise_model) :: noise
    type(lane_kernels) :: kernels
    logical :: blocks = .false.                  !< whether realisations are done side by side
    integer :: first = 0, count = 0              !< realisations
    integer :: slices = 0, slice = 0             !< slices of a line, realisations of a slice
    complex(dp), pointer, contiguous :: gamma(:, :, :) => null()
    real(dp), pointer, contiguous :: gamma_pairs(:, :, :) => null()
    real(dp) :: peak = 0.0_dp                    !< see `spectrum_peak`
    integer(ip), pointer, contiguous :: line_info(:) => null()     !< what was wrong with a line from the start
    type(study_space), pointer, contiguous :: space(:) => null()   !< one a thread
    type(moments), pointer, contiguous :: part(:) => null()        !< one an item
  contains
    procedure :: do_items => do_slices
  end type study

contains

  pure function is_method(letter) result(known)
    character, intent(in) :: letter
    logical :: known

    known = index(methods, upper(letter)) > 0
  end function is_method

  !> Mean and covariance of what a method identifies from polluted FRFs.
  !>
  !> 'I' ISMM, K* = K0 - D_jk. Noise is on gamma only, so that by D = gamma^-1 - alpha^-1 (2.40) what belongs to alpha
  !> is done once a line: K* = K0 + (alpha^-1)_jk - (gamma^-1)_jk. 'S' inverse substructuring, K* = -(gamma^-1)_jk.
  !> 'C' compliance, C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj.
  !> first, count  realisations first .. first + count - 1, those that `pollute` gives of gamma
  !> alpha         receptance of the assembly with K0, shape (2 n, 2 n, n_freq), m/N; read by 'I' only
  !> gamma         exact receptance of the assembly, shape (2 n, 2 n, n_freq), m/N
  !> k_initial     K0, shape (n, n, n_freq), N/m; read by 'I' only
  !> good          realisations of every line that could be identified, shape (n_freq)
  !> mean          over the good ones, shape (n, n, n_freq), N/m or m/N
  !> covariance    of real and imaginary part of each entry, shape (3, n, n, n_freq): Var Re, Var Im, Cov(Re, Im)
  !> line_info     shape (n_freq): where no realisation is good, what was wrong with the first
  !> rcond         shape (n_freq): the smallest over the realisations
  subroutine monte_carlo(transposed, method, noise, first, count, alpha, gamma, k_initial, good, mean, covariance, &
                         line_info, rcond, info)
    logical, intent(in) :: transposed
    character, intent(in) :: method
    type(noise_model), intent(in) :: noise
    integer(ip), intent(in) :: first, count
    complex(dp), contiguous, target, intent(in) :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :)
    integer(ip), contiguous, intent(out) :: good(:)
    complex(dp), contiguous, target, intent(inout) :: mean(:, :, :)
    real(dp), contiguous, intent(out) :: covariance(:, :, :, :), rcond(:)
    integer(ip), contiguous, target, intent(out) :: line_info(:)
    integer(ip), intent(out) :: info
    type(study) :: work
    type(study_space), allocatable, target :: space(:)
    type(moments), allocatable, target :: part(:)
    integer :: n_freq, i, s, threads, stat

    n_freq = size(mean, 3)
    call find_kernels(work%kernels, work%blocks, info)
    if (info /= info_good .or. n_freq == 0) return
    call make_plan(transposed, upper(method) == 'C', size(mean, 1), noise, work%plan, stat)
    work%slices = max(1, min((most_slices + n_freq - 1)/n_freq, int(count)/fewest_realisations))
    threads = threads_for(16.0_dp*real(work%plan%m, dp)**3*count*n_freq, int(work%slices, long)*n_freq, &
                          serial_flops_lanes)
    if (stat == 0) call allocate_study(work%plan, threads, work%slices*n_freq, space, part, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    if (upper(method) == 'I') then
      call inverse_substructuring(transposed, alpha, mean, line_info, rcond, info)
      if (info < 0) return
      mean = k_initial - mean                                     ! K0 + (alpha^-1)_jk
      do i = 1, n_freq
        if (line_info(i) == line_good .and. .not. all_finite(mean(:, :, i))) line_info(i) = line_not_finite
      end do
    else
      mean = 0.0_dp
      line_info = line_good
      rcond = 1.0_dp
    end if

    work%noise = noise
    work%blocks = work%blocks .and. work%plan%m <= largest_solved
    work%first = int(first)
    work%count = int(count)
    work%slice = ((work%count - 1)/work%slices + lanes)/lanes*lanes
    work%gamma => gamma
    work%gamma_pairs => real_lines(gamma)
    work%peak = spectrum_peak(noise, work%kernels, work%gamma_pairs)
    work%space => space
    work%part => part
    work%line_info => line_info

    call hold_blas_threads()
    call share(work, size(part, kind=long), threads, even=.false.)
    call release_blas_threads()
    do i = 1, n_freq
      s = (i - 1)*work%slices + 1
      call put_together(part(s:s + work%slices - 1))
      good(i) = nint(part(s)%number, ip)
      line_info(i) = line_good
      if (good(i) == 0) line_info(i) = part(s)%code
      rcond(i) = merge(min(rcond(i), part(s)%rcond), 0.0_dp, good(i) > 0)
      call deliver(part(s), mean(:, :, i), covariance(:, :, :, i))
    end do
    info = int(sum(merge(1, 0, line_info /= line_good)), ip)
  end subroutine monte_carlo

  !> Workspace of every thread, and room for what comes of every item.
  subroutine allocate_study(plan, threads, n_items, space, part, stat)
    type(study_plan), intent(in) :: plan
    integer, intent(in) :: threads, n_items
    type(study_space), allocatable, target, intent(out) :: space(:)
    type(moments), allocatable, intent(out) :: part(:)
    integer, intent(out) :: stat
    integer :: t, item

    allocate (part(n_items), space(threads), stat=stat)
    do t = 1, threads
      if (stat == 0) call prepare(plan, space(t), stat)
    end do
    do item = 1, n_items
      ! allow(C181): the caller looks at it
      if (stat == 0) allocate (part(item)%mean(2, plan%n**2), part(item)%square(3, plan%n**2), stat=stat)
    end do
  end subroutine allocate_study

  !> The slices from first to last.
  subroutine do_slices(self, first, last, thread)
    class(study), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer :: item, line, done

    do item = int(first), int(last)
      line = (item - 1)/self%slices + 1
      done = mod(item - 1, self%slices)*self%slice
      if (self%line_info(line) == line_good .and. all_finite(self%gamma(:, :, line))) then
        call run_slice(self%plan, self%noise, self%kernels, self%blocks, line, int(self%first, int64) + done, &
                       min(self%slice, self%count - done), self%gamma_pairs(:, :, line), self%peak, &
                       self%space(thread), self%part(item))
      else
        call clear(self%part(item))
        self%part(item)%code = self%line_info(line)
        if (self%part(item)%code == line_good) self%part(item)%code = line_not_finite
      end if
    end do
  end subroutine do_slices

  !> The slices of one line, in their order, into the first.
  subroutine put_together(part)
    type(moments), intent(inout) :: part(:)
    integer :: item

    do item = 2, size(part)
      call add(part(item)%number, part(item)%mean, part(item)%square, part(1))
      part(1)%rcond = min(part(1)%rcond, part(item)%rcond)
      if (part(1)%code == line_good) part(1)%code = part(item)%code
    end do
  end subroutine put_together

  !> Where everything lies in lanes. For K*: the columns of gamma in the order k, j, so that only the last unknowns,
  !> rows j of the solution, must be found.
  subroutine make_plan(transposed, compliance, n, noise, plan, stat)
    logical, intent(in) :: transposed, compliance
    integer, intent(in) :: n
    type(noise_model), intent(in) :: noise
    type(study_plan), intent(out) :: plan
    integer, intent(out) :: stat
    type(element_matrix) :: jk, jj, kk, kj, gamma, unit
    type(element_space) :: room
    integer :: i

    plan%transposed = transposed
    plan%compliance = compliance
    plan%n = n
    plan%m = 2*n
    if (compliance) then
      call room%system(n, n, plan%system_before, jk, jj)   ! jk is the matrix, jj the right-hand sides
      kk = room%matrix(n, n)
      kj = room%matrix(n, n)                               ! where C will be
      call room%row_starts(kk, plan%kk_row)
      call room%row_starts(kj, plan%c_row)
      call room%in_memory(transposed, kj, plan%result)
      call room%in_memory(transposed, jj, jk, kj, kk, plan%gamma)
    else
      call room%system(2*n, n, plan%system_before, gamma, unit)
      gamma%turn = n
      call room%in_memory(.true., unit, plan%unit)
      call room%new_values(2*n*n, plan%unit_value)
      if (.not. room%no_memory) then
        do i = 1, n
          plan%unit_value((n + i - 1)*n + i) = -1
        end do
      end if
      call room%in_memory(transposed, unit%block(0, n, 0, n), plan%result)
      call room%in_memory(transposed, gamma, plan%gamma)
    end if
    call room%in_memory(.true., room%matrix(2*n, 2*n), plan%again)
    plan%n_element = room%taken
    stat = merge(1, 0, room%no_memory)
    if (stat == 0) allocate (plan%counters(4*n*n), stat=stat)
    if (stat == 0) call entry_counters(noise, transposed, 2*n, 2*n, plan%counters)
  end subroutine make_plan

  subroutine prepare(plan, space, stat)
    type(study_plan), intent(in) :: plan
    type(study_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer(ip) :: no_code
    real(dp) :: no_rcond
    integer :: n, m, at

    n = plan%n
    m = plan%m
    allocate (space%room(lanes*(2*plan%n_element + 2*m + 5*n*n + 1)), space%low_room(lanes*(m*m + 1)), &
              space%scale(2, m*m), space%hint(padded(m)), space%from(n*n), space%gamma(m, m), space%found(n, n), &
              stat=stat)
    if (stat /= 0) return
    call identify_one(plan, space%gamma, space%lapack, space%found, no_code, no_rcond)     ! counts what it takes
    call space%lapack%set_up(stat)
    if (stat /= 0) return
    at = to_register(c_loc(space%room))
    call place(2, plan%n_element, space%x)
    call place(2, m, space%e)
    call place(2, n*n, space%mean)
    call place(3, n*n, space%square)
    at = to_register(c_loc(space%low_room))
    space%low(1:lanes, 1:m*m) => space%low_room(at + 1:at + lanes*m*m)

  contains

    subroutine place(n_parts, n_elements, array)
      integer, intent(in) :: n_parts, n_elements
      real(dp), pointer, contiguous, intent(out) :: array(:, :, :)

      array(1:lanes, 1:n_parts, 1:n_elements) => space%room(at + 1:at + lanes*n_parts*n_elements)
      at = at + lanes*n_parts*n_elements
    end subroutine place
  end subroutine prepare

  !> The realisations first .. first + count - 1 of one line.
  subroutine run_slice(plan, noise, kernels, blocks, line, first, count, gamma, peak, space, part)
    type(study_plan), intent(in) :: plan
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    logical, intent(in) :: blocks
    integer, intent(in) :: line, count
    integer(int64), intent(in) :: first
    real(dp), contiguous, intent(in) :: gamma(:, :)
    real(dp), intent(in) :: peak
    type(study_space), target, intent(inout) :: space
    type(moments), intent(inout) :: part
    integer(int64) :: high(lanes)
    real(dp) :: taken(lanes), number(lanes), rcond(lanes)
    integer(ip) :: code(lanes)
    integer :: done, here, l

    call clear(part)
    call find_scale(noise, kernels, plan%m**2, gamma, peak, space%scale)
    do l = 1, lanes
      space%low(l, :) = plan%counters + line_counter(line)
    end do
    space%mean = 0.0_dp
    space%square = 0.0_dp
    space%hint = 0
    number = 0.0_dp
    do done = 0, count - 1, lanes
      here = min(lanes, count - done)
      high = [(first + done + l, l=0, lanes - 1)]
      code = not(line_good)
      space%from(:) = plan%result
      if (blocks) call identify_lanes(plan, noise, kernels, high, gamma, space, code, rcond)
      if (any(code(:here) /= line_good)) &
        call repeat_lanes(plan, noise, kernels, high, here, gamma, space, code, rcond)
      taken = 0.0_dp
      do l = 1, here
        if (code(l) == line_good) then
          taken(l) = 1.0_dp
          part%rcond = min(part%rcond, rcond(l))
        else if (part%code == line_good) then
          part%code = code(l)
        end if
      end do
      number = number + taken
      call kernels%moments(plan%n**2, space%from, space%x, taken, number, space%mean, space%square)
    end do
    do l = 1, lanes
      call add(number(l), space%mean(l, :, :), space%square(l, :, :), part)
    end do
  end subroutine run_slice

  !> One realisation a lane. A lane whose code is not good is in doubt.
  subroutine identify_lanes(plan, noise, kernels, high, gamma, space, code, rcond)
    type(study_plan), intent(in) :: plan
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer(int64), intent(in) :: high(lanes)
    real(dp), contiguous, intent(in) :: gamma(:, :)
    type(study_space), target, intent(inout) :: space
    integer(ip), intent(out) :: code(lanes)
    real(dp), intent(out) :: rcond(lanes)
    integer :: row(plan%m), n, m
    real(dp) :: total(lanes)

    n = plan%n
    m = plan%m
    call pollute_in_lanes(plan, noise, kernels, high, gamma, plan%gamma, space)
    if (plan%compliance) then
      call kernels%solve(n, n, n, plan%system_before, space%x, space%hint, row, rcond)   ! gamma_jk^-1 gamma_jj
      call kernels%copy(n*n, -1.0_dp, space%from, space%from, space%x)
      call kernels%product(n, n, n, 1.0_dp, plan%kk_row, row, plan%c_row, space%x)
    else
      call kernels%fill(m*n, plan%unit_value, plan%unit, space%x)
      call kernels%solve(m, n, n, plan%system_before, space%x, space%hint, row, rcond)   ! rows j of -gamma^-1 E_k
      call rows_in_memory(plan%transposed, row(n + 1:), n, space%from)
    end if
    call kernels%total(n*n, space%from, space%x, total)
    call kernels%judge(lanes, total, code, rcond)
  end subroutine identify_lanes

  !> The polluted gamma of every lane to its places, row by row of what the caller stores.
  subroutine pollute_in_lanes(plan, noise, kernels, high, gamma, place, space)
    type(study_plan), intent(in) :: plan
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer(int64), intent(in) :: high(lanes)
    real(dp), contiguous, intent(in) :: gamma(:, :)
    integer, intent(in) :: place(:)
    type(study_space), target, intent(inout) :: space
    integer :: i, m

    m = plan%m
    do i = 1, m*m, m
      call draw(noise, kernels, m, space%low(:, i:i + m - 1), high, space%e)
      call kernels%pollute_lanes(m, gamma(:, i:i + m - 1), space%scale(:, i:i + m - 1), space%e, place(i:i + m - 1), &
                                 space%x)
    end do
  end subroutine pollute_in_lanes

  !> Lanes in doubt once more by the reference engine.
  subroutine repeat_lanes(plan, noise, kernels, high, here, gamma, space, code, rcond)
    type(study_plan), intent(in) :: plan
    type(noise_model), intent(in) :: noise
    type(lane_kernels), intent(in) :: kernels
    integer(int64), intent(in) :: high(lanes)
    integer, intent(in) :: here
    real(dp), contiguous, intent(in) :: gamma(:, :)
    type(study_space), target, intent(inout) :: space
    integer(ip), intent(inout) :: code(lanes)
    real(dp), intent(inout) :: rcond(lanes)
    integer :: l, i, j, p

    call pollute_in_lanes(plan, noise, kernels, high, gamma, plan%again, space)
    do l = 1, here
      if (code(l) == line_good) cycle
      do j = 1, plan%m
        do i = 1, plan%m
          p = plan%again((j - 1)*plan%m + i)
          space%gamma(i, j) = cmplx(space%x(l, 1, p), space%x(l, 2, p), dp)
        end do
      end do
      call identify_one(plan, space%gamma, space%lapack, space%found, code(l), rcond(l))
      do j = 1, plan%n
        do i = 1, plan%n
          p = space%from((j - 1)*plan%n + i)
          space%x(l, 1, p) = real(space%found(i, j), dp)
          space%x(l, 2, p) = aimag(space%found(i, j))
        end do
      end do
    end do
  end subroutine repeat_lanes

  !> One realisation with LAPACK: -(gamma^-1)_jk or C, stored as gamma is.
  subroutine identify_one(plan, stored, space, found, code, rcond)
    type(study_plan), intent(in) :: plan
    complex(dp), contiguous, intent(in) :: stored(:, :)
    type(line_space), target, intent(inout) :: space
    complex(dp), contiguous, intent(out) :: found(:, :)
    integer(ip), intent(out) :: code
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: gamma(:, :), matrix(:, :), right(:, :), last(:, :), answer(:, :)
    integer :: n, i

    n = plan%n
    space%used = 0
    call space%take(2*n, 2*n, gamma)
    call space%take(n, n, answer)
    if (plan%compliance) then
      call space%take(n, n, matrix)
      call space%take(n, n, last)
      call space%take(n, n, right)
      call room_to_solve(n, space)
    else
      call space%take(2*n, n, right)
      call room_to_solve(2*n, space)
    end if
    found = 0.0_dp
    rcond = 0.0_dp
    code = line_overflow
    if (space%only_counts) return
    if (.not. all_finite(stored)) return
    call load(plan%transposed, stored, gamma)
    if (plan%compliance) then
      call take_block(.false., 1.0_dp, gamma, 0, n, matrix)
      call take_block(.false., 1.0_dp, gamma, 0, 0, right)
      call take_block(.false., 1.0_dp, gamma, n, n, last)
      call solve_line(matrix, right, space, code, rcond)                  ! gamma_jk^-1 gamma_jj
      if (code /= line_good) return
      call take_block(.false., -1.0_dp, gamma, n, 0, answer)
      call product_line('N', 'N', 1.0_dp, last, right, answer)
    else
      right = 0.0_dp
      do i = 1, n
        right(n + i, i) = -1.0_dp
      end do
      call solve_line(gamma, right, space, code, rcond)
      if (code /= line_good) return
      call take_block(.false., 1.0_dp, right, 0, 0, answer)
    end if
    if (.not. all_finite(answer)) code = line_overflow
    call store(plan%transposed, answer, found)
  end subroutine identify_one

  subroutine clear(part)
    type(moments), intent(inout) :: part

    part%number = 0.0_dp
    part%mean = 0.0_dp
    part%square = 0.0_dp
  end subroutine clear

  !> Moments of further values, put together with those of `part` (Chan, Golub, LeVeque).
  pure subroutine add(number, mean, square, part)
    real(dp), intent(in) :: number, mean(:, :), square(:, :)
    type(moments), intent(inout) :: part
    real(dp) :: share, re, im, weight
    integer :: i

    if (.not. number > 0.0_dp) return
    share = number/(part%number + number)
    weight = part%number*share
    do i = 1, size(mean, 2)
      re = mean(1, i) - part%mean(1, i)
      im = mean(2, i) - part%mean(2, i)
      part%mean(1, i) = part%mean(1, i) + share*re
      part%mean(2, i) = part%mean(2, i) + share*im
      part%square(1, i) = part%square(1, i) + (square(1, i) + weight*re*re)
      part%square(2, i) = part%square(2, i) + (square(2, i) + weight*im*im)
      part%square(3, i) = part%square(3, i) + (square(3, i) + weight*re*im)
    end do
    part%number = part%number + number
  end subroutine add

  !> Mean, onto what the line has without noise, and covariance; NaN where there are too few values.
  pure subroutine deliver(part, mean, covariance)
    type(moments), intent(in) :: part
    complex(dp), contiguous, intent(inout) :: mean(:, :)
    real(dp), contiguous, intent(out) :: covariance(:, :, :)
    real(dp) :: nan
    integer :: i, j, p

    nan = ieee_value(nan, ieee_quiet_nan)
    do j = 1, size(mean, 2)
      do i = 1, size(mean, 1)
        p = (j - 1)*size(mean, 1) + i
        mean(i, j) = mean(i, j) + cmplx(part%mean(1, p), part%mean(2, p), dp)
        if (part%number < 0.5_dp) mean(i, j) = cmplx(nan, nan, dp)
        covariance(:, i, j) = nan
        if (part%number > 1.5_dp) covariance(:, i, j) = part%square(:, p)/(part%number - 1.0_dp)
      end do
    end do
  end subroutine deliver
end module jointfrf_monte_carlo
