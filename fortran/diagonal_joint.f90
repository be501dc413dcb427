!> The joint without cross terms that fits best: least squares of quadratic forms of its compliance on every line.
!>
!> The compliance of DOF d is C_d = a_d/(1 + i (eta_d + w tau_d)), or a_d/(1 + i a_d (h_d + w c_d)) where damping is not
!> given by its rates: regular for a rigid DOF, a = 0. A line costs s - 2 Re(d^H p) + d^H W d with d = C - C0, as
!> jointfrf_manifold finds it. Levenberg-Marquardt steps, parameters inside their limits.
!>
!> Lanes are frequency lines, also with the engine that is LAPACK elsewhere. Sums are those of shares of the lines,
!> which do not depend on the number of threads.
module jointfrf_diagonal_joint
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc, c_size_t
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lanes, only: lane_kernels, lanes, to_register
  use jointfrf_lapack, only: dposv
  use jointfrf_sharing, only: serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory
  implicit none
  private
  public :: diagonal_joint, line_forms, search_limits
  public :: fit_diagonal_joint, lowest_diagonal_joint, rate_of_one, set_limits

  !> Their sums are counted by default integers, with room to spare.
  integer, parameter, public :: most_dofs = 1000
  !> Blocks of lines whose sums are found together.
  integer, parameter :: share_blocks = 64
  !> Levenberg's parameter: first value, factors after a good and a bad step, the least that is lowered or follows a bad
  !> step, and the largest.
  real(dp), parameter :: first_damping = 1.0e-4_dp, lowered = 1.0_dp/6.0_dp, raised = 6.0_dp
  real(dp), parameter :: least_lowered = 1.0e-12_dp, least_raised = 1.0e-6_dp, largest_damping = 1.0e10_dp
  !> Squares are the same to rounding within this share; with that of a residual the least gain grows in long sums.
  real(dp), parameter :: rounding = 1.0e-13_dp, share_of_cost = 1.0e-6_dp

  !> Largest rate of damping, in units of that at which damping is as large as stiffness on the highest line: the joint
  !> is then damping only. Share of it from which on a DOF is all damping.
  real(dp), parameter :: largest_rate = 100.0_dp, all_damping = 0.1_dp
  !> Minima from other starts are compared to this, in squares of one residual.
  real(dp), parameter :: coarse = 1.0e-2_dp

  !> Which terms the joint has.
  type :: diagonal_joint
    integer :: n = 0                          !< DOFs
    logical :: by_rate = .true.
    integer, allocatable :: dof(:)            !< of each parameter
    integer, allocatable :: kind(:)           !< 0 a, 1 eta or h, 2 tau or c
  end type diagonal_joint

  !> The caller's forms.
  type :: line_forms
    logical :: transposed = .false.
    real(dp), pointer, contiguous :: omega(:) => null()                  !< rad/s
    complex(dp), pointer, contiguous :: c_joint(:, :) => null()          !< C0, (n, n_freq)
    complex(dp), pointer, contiguous :: information(:, :, :) => null()   !< W, (n, n, n_freq)
    complex(dp), pointer, contiguous :: gradient(:, :) => null()         !< p, (n, n_freq)
    real(dp), pointer, contiguous :: squares(:) => null()                !< s, (n_freq)
  end type line_forms

  !> Where and how long is searched.
  type :: search_limits
    integer :: steps = 0, held = 0            !< the parameter that keeps its value, 0 for none
    real(dp) :: least_gain = 0.0_dp
    real(dp), allocatable :: lower(:), upper(:)
  end type search_limits

  !> Sums over the lines; an item is a share of them.
  type, extends(shared_work) :: form_sums
    integer :: n = 0, n_blocks = 0, threads = 1
    logical :: by_rate = .true., damped = .true.
    type(lane_kernels) :: kernels
    real(dp), allocatable :: room(:)                               !< where x lies
    integer, allocatable :: place(:)                               !< where the numbers of a line go
    real(dp), allocatable :: omega(:, :), squares(:, :)            !< (lanes, n_blocks)
    real(dp), pointer, contiguous :: x(:, :, :, :) => null()       !< of the kernel, (lanes, 2, elements, n_blocks)
    real(dp), allocatable :: joint(:, :)                           !< of the kernel, (3, n)
    real(dp), allocatable :: total(:)                              !< of all lines
    real(dp), allocatable :: partial_room(:), work_room(:)         !< where the next lie
    real(dp), pointer, contiguous :: work(:, :) => null()          !< of the kernel, one column a thread
    real(dp), pointer, contiguous :: partial(:, :, :) => null()    !< cost, descent, normal: (lanes, sums, shares)
  contains
    procedure :: do_items => sum_shares
  end type form_sums

  !> What is known at one set of parameters.
  type :: evaluation
    real(dp) :: cost = 0.0_dp
    real(dp), allocatable :: normal(:, :), descent(:)
  end type evaluation

  !> What a step takes, of the parameters that move.
  type :: step_space
    real(dp), allocatable :: scaled(:), damped(:)                  !< normal equations, column by column
    real(dp), allocatable :: length(:), step(:)
    integer, allocatable :: moving(:)
    real(dp), allocatable :: trial(:)                              !< of all parameters
  end type step_space

contains

  !> Minimise the squares.
  !> x         parameters: where to begin, then what was found
  !> normal    Re(J^H W J) of all lines there, half the second derivative
  !> descent   Re(J^H r) there, half of what the squares fall by
  !> cost      the squares; +Inf where they are not finite where the search begins, and x stays
  !> steps     in place of those of the limits
  subroutine fit_diagonal_joint(joint, forms, limits, x, normal, descent, cost, info, steps)
    type(diagonal_joint), intent(in) :: joint
    type(line_forms), intent(in) :: forms
    type(search_limits), intent(in) :: limits
    real(dp), intent(inout) :: x(:)
    real(dp), intent(out) :: normal(:, :), descent(:), cost
    integer(ip), intent(out) :: info
    integer, intent(in), optional :: steps
    type(form_sums), target :: sums
    type(evaluation) :: here, there
    type(step_space) :: space
    real(dp) :: damping
    logical :: found
    integer :: step, most_steps, small, i

    info = info_good
    most_steps = limits%steps
    if (present(steps)) most_steps = steps
    call find_kernels(sums%kernels, found, info)
    if (info == info_good) call prepare_search(size(x), here, there, space, info)
    if (info == info_good) call prepare(joint, forms, sums, info)
    if (info /= info_good) return
    call hold_blas_threads()
    do i = 1, size(x)
      if (i /= limits%held) x(i) = min(max(x(i), limits%lower(i)), limits%upper(i))
    end do
    call evaluate(joint, sums, x, here)
    damping = first_damping
    small = 0
    do step = 1, most_steps
      call take_step(joint, sums, limits, damping, x, here, there, space, found)
      if (.not. found) exit
      small = merge(small + 1, 0, here%cost - there%cost <= limits%least_gain*max(1.0_dp, share_of_cost*there%cost))
      here%cost = there%cost
      here%normal(:, :) = there%normal
      here%descent(:) = there%descent
      if (damping > least_lowered) damping = damping*lowered
      if (small == 2) exit
    end do
    call release_blas_threads()
    normal = here%normal
    descent = here%descent
    cost = here%cost
  end subroutine fit_diagonal_joint

  !> Minimise; where a DOF ends rigid or all damping, also from no damping and from some.
  !> A compliance and its rate are a vector in polar coordinates: at a = 0 nothing moves the rate any more, not even
  !> from the wrong sign of damping. The first n parameters are the compliances, DOF by DOF.
  subroutine lowest_diagonal_joint(joint, forms, limits, x, normal, descent, cost, info)
    type(diagonal_joint), intent(in) :: joint
    type(line_forms), intent(in) :: forms
    type(search_limits), intent(in) :: limits
    real(dp), intent(inout) :: x(:)
    real(dp), intent(out) :: normal(:, :), descent(:), cost
    integer(ip), intent(out) :: info
    type(search_limits) :: rough
    type(evaluation) :: best, there
    real(dp), allocatable :: x_best(:), x_there(:)
    logical, allocatable :: caught(:)
    real(dp) :: held_value
    integer :: p, start, stat

    p = size(x)
    allocate (best%normal(p, p), best%descent(p), there%normal(p, p), there%descent(p), x_best(p), x_there(p), &
              caught(joint%n), rough%lower(p), rough%upper(p), stat=stat)
    info = info_good
    if (stat /= 0) info = info_no_memory
    if (stat /= 0) return
    held_value = 0.0_dp
    if (limits%held > 0) held_value = x(limits%held)
    x_best(:) = x
    call fit_diagonal_joint(joint, forms, limits, x_best, best%normal, best%descent, best%cost, info)
    if (info /= info_good) return
    caught = .false.
    if (p > joint%n .and. size(forms%omega) > 0) call find_caught(joint, forms%omega, x_best, caught)
    rough%steps = limits%steps
    rough%held = limits%held
    rough%least_gain = max(limits%least_gain, coarse)
    rough%lower(:) = limits%lower
    rough%upper(:) = limits%upper
    do start = 0, 1
      if (.not. any(caught)) exit
      x_there(:) = x_best
      call start_again(joint, forms, caught, real(start, dp), limits%held, held_value, x_there)
      call fit_diagonal_joint(joint, forms, rough, x_there, there%normal, there%descent, there%cost, info)
      if (info /= info_good) return
      if (.not. there%cost < best%cost - coarse) cycle
      x_best(:) = x_there
      call fit_diagonal_joint(joint, forms, limits, x_best, best%normal, best%descent, best%cost, info)
      if (info /= info_good) return
    end do
    x = x_best
    normal = best%normal
    descent = best%descent
    cost = best%cost
  end subroutine lowest_diagonal_joint

  !> Which DOFs are rigid or all damping.
  pure subroutine find_caught(joint, omega, x, caught)
    type(diagonal_joint), intent(in) :: joint
    real(dp), intent(in) :: omega(:), x(:)
    logical, intent(out) :: caught(:)
    real(dp) :: rate
    integer :: i

    caught = x(:joint%n) <= 0.0_dp
    do i = joint%n + 1, size(x)
      rate = abs(x(i))
      if (.not. joint%by_rate) rate = rate*x(joint%dof(i))
      if (rate > all_damping*largest_rate*rate_of_one(joint%kind(i), omega)) caught(joint%dof(i)) = .true.
    end do
  end subroutine find_caught

  !> Parameters of the DOFs that are caught as if C were as large as in the forms, with a share of as much damping.
  subroutine start_again(joint, forms, caught, share, held, held_value, x)
    type(diagonal_joint), intent(in) :: joint
    type(line_forms), intent(in) :: forms
    logical, intent(in) :: caught(:)
    real(dp), intent(in) :: share, held_value
    integer, intent(in) :: held
    real(dp), intent(inout) :: x(:)
    integer :: d, i, k

    do d = 1, joint%n
      if (.not. caught(d)) cycle
      x(d) = 0.0_dp
      do k = 1, size(forms%squares)
        x(d) = x(d) + abs(forms%c_joint(d, k))
      end do
      x(d) = x(d)/size(forms%squares)
    end do
    if (held > 0) x(held) = held_value
    do i = joint%n + 1, size(x)
      if (i == held .or. .not. caught(joint%dof(i))) cycle
      x(i) = share*rate_of_one(joint%kind(i), forms%omega)
      if (.not. joint%by_rate) x(i) = x(i)/max(x(joint%dof(i)), tiny(1.0_dp))
    end do
  end subroutine start_again

  !> Rate eta or tau at which damping is as large as stiffness on the highest line.
  pure real(dp) function rate_of_one(kind, omega)
    integer, intent(in) :: kind
    real(dp), intent(in) :: omega(:)

    rate_of_one = 1.0_dp
    if (kind == 2) rate_of_one = 1/max(maxval(omega), tiny(1.0_dp))
  end function rate_of_one

  !> Limits of the parameters: compliances are not negative, rates not beyond the largest.
  subroutine set_limits(joint, omega, limits, stat)
    type(diagonal_joint), intent(in) :: joint
    real(dp), intent(in) :: omega(:)
    type(search_limits), intent(inout) :: limits
    integer, intent(out) :: stat
    integer :: i

    allocate (limits%lower(size(joint%kind)), limits%upper(size(joint%kind)), stat=stat)
    if (stat /= 0) return
    limits%upper(:) = ieee_value(1.0_dp, ieee_positive_inf)
    limits%lower(:) = 0.0_dp
    do i = 1, size(joint%kind)
      if (joint%kind(i) == 0) cycle
      if (joint%by_rate) limits%upper(i) = largest_rate*rate_of_one(joint%kind(i), omega)
      limits%lower(i) = -limits%upper(i)
    end do
  end subroutine set_limits

  !> Memory of a search for n_par parameters.
  subroutine prepare_search(n_par, here, there, space, info)
    integer, intent(in) :: n_par
    type(evaluation), intent(inout) :: here, there
    type(step_space), intent(inout) :: space
    integer(ip), intent(out) :: info
    integer :: stat

    allocate (here%normal(n_par, n_par), here%descent(n_par), there%normal(n_par, n_par), there%descent(n_par), &
              space%scaled(n_par*n_par), space%damped(n_par*n_par), space%length(n_par), space%trial(n_par), &
              space%step(n_par), space%moving(n_par), stat=stat)
    info = info_good
    if (stat /= 0) info = info_no_memory
  end subroutine prepare_search

  !> One step to squares that are no larger, with as much damping as it takes.
  !> found   whether there is one; x and `there` are then what it leads to
  subroutine take_step(joint, sums, limits, damping, x, here, there, space, found)
    type(diagonal_joint), intent(in) :: joint
    type(form_sums), intent(inout) :: sums
    type(search_limits), intent(in) :: limits
    real(dp), intent(inout) :: damping, x(:)
    type(evaluation), intent(in) :: here
    type(evaluation), intent(inout) :: there
    type(step_space), intent(inout) :: space
    logical, intent(out) :: found
    logical :: solved
    integer :: n, i, j

    found = .false.
    if (.not. here%cost <= huge(1.0_dp)) return
    n = 0
    do i = 1, size(x)
      if (i == limits%held .or. (x(i) <= limits%lower(i) .and. here%descent(i) < 0.0_dp) .or. &
          (x(i) >= limits%upper(i) .and. here%descent(i) > 0.0_dp)) cycle
      n = n + 1
      space%moving(n) = i
    end do
    if (n == 0) return
    do i = 1, n
      space%length(i) = sqrt(max(here%normal(space%moving(i), space%moving(i)), tiny(1.0_dp)))
    end do
    do i = 1, n
      do j = 1, n
        space%scaled((i - 1)*n + j) = here%normal(space%moving(j), space%moving(i))/(space%length(j)*space%length(i))
      end do
    end do
    if (.not. all(abs(space%scaled(:n*n)) <= huge(1.0_dp))) return
    do while (damping <= largest_damping)
      space%trial(:) = x
      call move(n, here%descent, damping, space, solved)
      if (solved) then
        do i = 1, n
          associate (p => space%moving(i))
            space%trial(p) = min(max(space%trial(p), limits%lower(p)), limits%upper(p))
          end associate
        end do
        call evaluate(joint, sums, space%trial, there)
        found = there%cost <= here%cost + rounding*abs(here%cost)
      end if
      if (found) exit
      damping = max(raised*damping, least_raised)
    end do
    if (found) x = space%trial
  end subroutine take_step

  !> The damped step of the n parameters that move.
  subroutine move(n, descent, damping, space, solved)
    integer, intent(in) :: n
    real(dp), intent(in) :: descent(:), damping
    type(step_space), intent(inout) :: space
    logical, intent(out) :: solved
    integer(blas_ip) :: m, stat
    integer :: i

    m = int(n, blas_ip)
    space%damped(:n*n) = space%scaled(:n*n)
    do i = 1, n
      space%damped((i - 1)*n + i) = space%damped((i - 1)*n + i) + damping
      space%step(i) = descent(space%moving(i))/space%length(i)
    end do
    call dposv('U', m, 1_blas_ip, space%damped, m, space%step, m, stat, 1_c_size_t)
    solved = stat == 0
    if (.not. solved) return
    do i = 1, n
      space%trial(space%moving(i)) = space%trial(space%moving(i)) + space%step(i)/space%length(i)
    end do
  end subroutine move

  !> Squares, normal equations and descent at some parameters; a cost that is not finite is +Inf.
  subroutine evaluate(joint, sums, x, at)
    type(diagonal_joint), intent(in) :: joint
    type(form_sums), intent(inout) :: sums
    real(dp), intent(in) :: x(:)
    type(evaluation), intent(inout) :: at
    integer :: k, i

    sums%joint = 0.0_dp
    do k = 1, size(x)
      sums%joint(1 + joint%kind(k), joint%dof(k)) = x(k)
    end do
    call share(sums, size(sums%partial, 3, kind=long), sums%threads, even=.true.)
    sums%total = 0.0_dp
    do k = 1, size(sums%partial, 3)
      do i = 1, size(sums%total)
        sums%total(i) = sums%total(i) + sum(sums%partial(:, i, k))
      end do
    end do
    at%cost = sums%total(1)
    if (.not. abs(at%cost) <= huge(1.0_dp)) at%cost = ieee_value(1.0_dp, ieee_positive_inf)
    call assemble(joint, sums%total, at%descent, at%normal)
  end subroutine evaluate

  !> Normal equations of the parameters from sums by DOFs.
  pure subroutine assemble(joint, total, descent, normal)
    type(diagonal_joint), intent(in) :: joint
    real(dp), intent(in) :: total(:)
    real(dp), intent(out) :: descent(:), normal(:, :)
    !> The sum for derivatives by a (0), eta (1) and tau (2) of the first DOF of a pair, and of the second.
    integer, parameter :: place(0:2, 0:2) = reshape([1, 4, 5, 2, 6, 7, 3, 7, 8], [3, 3])
    integer :: i, j, p, q, before

    before = 1 + 3*joint%n
    associate (dof => joint%dof, kind => joint%kind)
      do i = 1, size(descent)
        descent(i) = total(1 + 3*(dof(i) - 1) + kind(i) + 1)
        do j = 1, i
          p = merge(i, j, dof(i) < dof(j))
          q = i + j - p
          normal(p, q) = total(before + 8*((dof(q)*(dof(q) - 1))/2 + dof(p) - 1) + place(kind(p), kind(q)))
          normal(q, p) = normal(p, q)
        end do
      end do
    end associate
  end subroutine assemble

  !> The caller's forms into lanes.
  subroutine prepare(joint, forms, sums, info)
    type(diagonal_joint), intent(in) :: joint
    type(line_forms), intent(in) :: forms
    type(form_sums), target, intent(inout) :: sums
    integer(ip), intent(out) :: info
    integer(long) :: length
    integer :: n, n_element, n_sum, n_shares, n_freq, at, stat

    info = info_good
    n = joint%n
    n_freq = size(forms%squares)
    n_element = 2*n + (n*(n + 1))/2 + 1                    ! one that nobody reads
    n_sum = 1 + 3*n + 4*n*(n + 1)
    sums%n = n
    sums%by_rate = joint%by_rate
    sums%damped = any(joint%kind > 0)
    sums%n_blocks = (n_freq + lanes - 1)/lanes
    n_shares = (sums%n_blocks + share_blocks - 1)/share_blocks
    length = int(2*lanes, long)*n_element*sums%n_blocks
    sums%threads = threads_for((30.0_dp*n + 20.0_dp*n*(n + 1))*n_freq, int(n_shares, long), serial_flops_lanes)
    allocate (sums%room(length + lanes), sums%work_room(8*lanes*n*sums%threads), sums%omega(lanes, sums%n_blocks), &
              sums%squares(lanes, sums%n_blocks), sums%joint(3, n), sums%total(n_sum), sums%place(2*n + n*n), &
              sums%partial_room(int(lanes*n_sum, long)*n_shares), stat=stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    sums%partial(1:lanes, 1:n_sum, 1:n_shares) => sums%partial_room
    at = to_register(c_loc(sums%room))
    sums%x(1:lanes, 1:2, 1:n_element, 1:sums%n_blocks) => sums%room(at + 1:at + length)
    sums%work(1:8*lanes*n, 1:sums%threads) => sums%work_room
    if (n_freq > 0) call load_forms(forms, n, n_element, sums)
  end subroutine prepare

  !> Lanes beyond the last line hold forms that are zero.
  subroutine load_forms(forms, n, n_element, sums)
    type(line_forms), intent(in) :: forms
    integer, intent(in) :: n, n_element
    type(form_sums), intent(inout) :: sums
    real(dp), pointer, contiguous :: c_joint(:, :, :), gradient(:, :, :), information(:, :, :)
    integer :: b, first, n_lines, n_freq, i, j

    n_freq = size(forms%squares)
    do i = 1, 2*n
      sums%place(i) = i
    end do
    sums%place(2*n + 1:) = n_element
    do j = 1, n
      do i = 1, j
        sums%place(2*n + merge((i - 1)*n + j, (j - 1)*n + i, forms%transposed)) = 2*n + (j*(j - 1))/2 + i
      end do
    end do
    call c_f_pointer(c_loc(forms%c_joint), c_joint, [2, n, n_freq])
    call c_f_pointer(c_loc(forms%gradient), gradient, [2, n, n_freq])
    call c_f_pointer(c_loc(forms%information), information, [2, n*n, n_freq])
    do b = 1, sums%n_blocks
      first = (b - 1)*lanes + 1
      n_lines = min(lanes, n_freq - first + 1)
      associate (x => sums%x(:, :, :, b))
        call sums%kernels%load(n, sums%place(:n), first, n_lines, c_joint, x)
        call sums%kernels%load(n, sums%place(n + 1:2*n), first, n_lines, gradient, x)
        call sums%kernels%load(n*n, sums%place(2*n + 1:), first, n_lines, information, x)
        x(n_lines + 1:, :, n + 1:) = 0.0_dp
      end associate
      sums%omega(:, b) = forms%omega(first + n_lines - 1)
      sums%omega(:n_lines, b) = forms%omega(first:first + n_lines - 1)
      sums%squares(:, b) = 0.0_dp
      sums%squares(:n_lines, b) = forms%squares(first:first + n_lines - 1)
    end do
  end subroutine load_forms

  !> The shares from first to last.
  subroutine sum_shares(self, first, last, thread)
    class(form_sums), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: item
    integer :: b, before

    before = 1 + 3*self%n
    do item = first, last
      self%partial(:, :, item) = 0.0_dp
      do b = int(item - 1)*share_blocks + 1, min(int(item)*share_blocks, self%n_blocks)
        call self%kernels%diagonal_form(self%n, self%by_rate, self%damped, self%joint, self%omega(:, b), &
                                        self%squares(:, b), self%x(:, :, :, b), self%work(:, thread), &
                                        self%partial(:, 1, item), self%partial(:, 2:before, item), &
                                        self%partial(:, before + 1:, item))
      end do
    end do
  end subroutine sum_shares
end module jointfrf_diagonal_joint
