!> Receptance of a model from its matrices (2.28)-(2.29): by solving, dense or banded.
!>
!> Side by side, a line is condensed: DOFs that are not wanted are eliminated with their own pivots, in an order found
!> once for all lines, and the small system that is left is solved with pivoting. The matrices are scaled by powers of
!> two first, so that displacements and rotations have pivots of one size; where one is small, the line is in doubt.
module jointfrf_dynamic_stiffness
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_elimination_plan, only: elimination_plan, make_plan
  use jointfrf_kinds, only: blas_ip, dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_solved, padded, real_lines, &
    rows_in_memory
  use jointfrf_lapack, only: zgbcon, zgbtrf, zgbtrs
  use jointfrf_line_layout, only: all_finite, store
  use jointfrf_lines_lapack, only: one_norm, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: receptance_dense, receptance_banded

  integer(c_size_t), parameter :: one_char = 1_c_size_t
  !> Lanes do about this many multiplications in the time that LAPACK takes for one.
  real(dp), parameter :: gain_of_lanes = 8.0_dp
  !> A pivot smaller than this, where those of the scaled matrices are about one, puts the line in doubt. A segment of m
  !> beam elements leaves pivots of m^-3, and errors no larger than those of zgbsv.
  real(dp), parameter :: smallest_pivot = 1.0e-8_dp
  !> So does a smaller reciprocal condition number of the scaled matrix that is left.
  real(dp), parameter :: doubtful = 1.0e-14_dp

  !> What both ways share: Z = (1 + i eta) K + i H + i w C - w^2 M at chosen DOFs.
  !> `damping` and `structural` may be empty.
  type, abstract, extends(line_operation) :: dynamic_stiffness
    logical :: transposed, has_damping, has_structural
    integer :: n
    real(dp) :: loss_factor
    real(dp), pointer, contiguous :: omega(:)
    real(dp), pointer, contiguous :: stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    integer(ip), pointer, contiguous :: outputs(:), inputs(:)
    type(elimination_plan) :: plan
    real(dp), allocatable :: scale(:)              !< of each DOF, a power of two
    real(dp) :: norms(4)                           !< of K, M, C and eta K + H
    real(dp), pointer, contiguous :: result_pairs(:, :, :)
    integer :: system_before                       !< the element before the system that is solved
    integer, allocatable :: from(:), to(:)         !< where the condensed matrix lies, and where the system wants it
    integer :: n_wanted                            !< outputs that differ
    integer, allocatable :: row_of(:)              !< slot of each retained DOF, shape (n)
    integer, allocatable :: rhs(:)                 !< where the right-hand sides lie
    complex(dp), allocatable :: forces(:)          !< what they hold
    real(dp), allocatable :: result_scale(:, :)    !< of each entry of the result, shape (n_out, n_in) or transposed
  contains
    procedure(coefficient_function), deferred :: coefficients
    procedure :: line_block => stiffness_block
  end type dynamic_stiffness

  abstract interface
    !> Entry (i, j) of K, M, C and eta K + H; zero outside the band.
    pure function coefficient_function(self, i, j) result(value)
      import :: dynamic_stiffness, dp
      implicit none
      class(dynamic_stiffness), intent(in) :: self
      integer, intent(in) :: i, j
      real(dp) :: value(4)
    end function coefficient_function
  end interface

  type, extends(dynamic_stiffness) :: dense_stiffness
  contains
    procedure :: line => dense_one
    procedure :: coefficients => dense_coefficients
  end type dense_stiffness

  type, extends(dynamic_stiffness) :: banded_stiffness
    integer :: kl, ku
  contains
    procedure :: line => banded_one
    procedure :: coefficients => banded_coefficients
  end type banded_stiffness

contains

  !> Receptance at chosen DOFs with zgesv. Eqs. (2.28), (2.29), and i w C for viscous damping.
  !> omega         angular frequencies, shape (n_freq), rad/s
  !> stiffness     K, shape (n, n), N/m; (in, out) where transposed, as all matrices here
  !> mass          M, shape (n, n), kg
  !> damping       C, shape (n, n), N s/m, or (0, 0) for none
  !> structural    H, shape (n, n), N/m, or (0, 0) for none
  !> loss_factor   eta: K (1 + i eta)
  !> outputs       DOFs of the response, shape (n_out), counted from 1
  !> inputs        DOFs of the force, shape (n_in), counted from 1
  !> h             receptance, shape (n_out, n_in, n_freq), m/N
  subroutine receptance_dense(transposed, omega, stiffness, mass, damping, structural, loss_factor, outputs, inputs, &
                              h, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    real(dp), intent(in) :: loss_factor
    integer(ip), contiguous, target, intent(in) :: outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(out) :: h(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(dense_stiffness) :: operation
    integer :: n

    n = size(stiffness, 1)
    call set_model(operation, transposed, n, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                   inputs, h)
    operation%flops = 8.0_dp*real(n, dp)**2*(n/3.0_dp + size(inputs))
    if (worth_a_plan(size(omega), memory) .and. n <= largest_solved) &
      call prepare_block(operation, n - 1, n - 1, .true.)
    call run_sweep(operation, size(omega, kind=ip), line_info, rcond, info, memory)
  end subroutine receptance_dense

  !> The same for matrices in LAPACK band storage, entry (i, j) at (ku + 1 + i - j, j), with zgbtrf and zgbtrs (zgbsv).
  !> kl, ku        number of diagonals below and above the main one
  !> stiffness     K, shape (kl + ku + 1, n); mass alike; damping and structural alike or (0, 0)
  !> the rest      as in `receptance_dense`; TRANS concerns h only
  subroutine receptance_banded(transposed, kl, ku, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                               inputs, h, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    integer, intent(in) :: kl, ku
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    real(dp), intent(in) :: loss_factor
    integer(ip), contiguous, target, intent(in) :: outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(out) :: h(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(banded_stiffness) :: operation
    integer :: n, n_in

    n = size(stiffness, 2)
    n_in = size(inputs)
    call set_model(operation, transposed, n, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                   inputs, h)
    operation%kl = kl
    operation%ku = ku
    operation%flops = 8.0_dp*real(n, dp)*(real(kl, dp)*(kl + ku + 1) + real(n_in, dp)*(2*kl + ku + 1))
    if (worth_a_plan(size(omega), memory)) call prepare_block(operation, kl, ku, .false.)
    call run_sweep(operation, size(omega, kind=ip), line_info, rcond, info, memory)
  end subroutine receptance_banded

  subroutine set_model(operation, transposed, n, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                       inputs, h)
    class(dynamic_stiffness), intent(inout) :: operation
    logical, intent(in) :: transposed
    integer, intent(in) :: n
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    real(dp), intent(in) :: loss_factor
    integer(ip), contiguous, target, intent(in) :: outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(inout) :: h(:, :, :)

    operation%transposed = transposed
    operation%n = n
    operation%omega => omega
    operation%stiffness => stiffness
    operation%mass => mass
    operation%damping => damping
    operation%structural => structural
    operation%has_damping = size(damping) > 0
    operation%has_structural = size(structural) > 0
    operation%loss_factor = loss_factor
    operation%outputs => outputs
    operation%inputs => inputs
    operation%result => h
  end subroutine set_model

  !> The plan of lines side by side, where they are worth it.
  !> retain_all   eliminate nothing in the plan's order, solve with pivoting
  subroutine prepare_block(operation, kl, ku, retain_all)
    class(dynamic_stiffness), intent(inout) :: operation
    integer, intent(in) :: kl, ku
    logical, intent(in) :: retain_all
    logical, allocatable :: coupled(:, :), is_output(:), retained(:)
    logical :: symmetric
    integer :: reach, stat
    real(dp) :: reference

    reach = max(kl, ku)
    if (size(operation%result) == 0 .or. reach >= largest_solved) return
    allocate (coupled(reach, operation%n), is_output(operation%n), retained(operation%n), stat=stat)
    operation%no_memory = stat /= 0
    if (operation%no_memory) return
    call mark(operation%outputs, is_output)
    call mark(operation%inputs, retained)
    retained(:) = retained .or. is_output .or. retain_all
    if (count(retained) > largest_solved) return
    call look_at_matrices(operation, reach, coupled, symmetric, stat)
    if (stat == 0) call plan_elimination(operation, coupled, retained, is_output, symmetric, stat)
    operation%no_memory = stat /= 0
    if (operation%no_memory) return
    associate (n_left => operation%plan%n_retained, n_in => size(operation%inputs))
      reference = real(operation%n, dp)*(real(kl, dp)*(kl + ku + 1) + real(n_in, dp)*(2*kl + ku + 1)) + n_left**2
      if (n_left > largest_solved .or. operation%plan%products > gain_of_lanes*reference) return
      operation%n_wanted = count(is_output)
      operation%n_hint = padded(n_left)
    end associate
    call set_coefficients(operation)
    call set_places(operation)
  end subroutine prepare_block

  !> Wanted are the outputs, in ascending order.
  subroutine plan_elimination(operation, coupled, retained, is_output, symmetric, stat)
    class(dynamic_stiffness), intent(inout) :: operation
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(inout) :: retained(:)
    logical, intent(in) :: is_output(:), symmetric
    integer, intent(out) :: stat
    integer, allocatable :: wanted(:)
    integer :: i, j

    allocate (wanted(count(is_output)), stat=stat)
    if (stat /= 0) return
    i = 0
    do j = 1, size(is_output)
      if (.not. is_output(j)) cycle
      i = i + 1
      wanted(i) = j
    end do
    call make_plan(operation%n, coupled, retained, wanted, symmetric, operation%plan, stat)
  end subroutine plan_elimination

  !> The numbers of the plan's entries, scaled.
  subroutine set_coefficients(operation)
    class(dynamic_stiffness), intent(inout) :: operation
    integer :: e, i, j

    do e = 1, size(operation%plan%coefficient, 2)
      i = operation%plan%row(e)
      j = operation%plan%column(e)
      operation%plan%coefficient(:, e) = operation%coefficients(i, j)*operation%scale(i)*operation%scale(j)
    end do
  end subroutine set_coefficients

  !> From the plan's square to the system that is solved, and its right-hand sides: a unit force at each input.
  subroutine set_places(operation)
    class(dynamic_stiffness), intent(inout) :: operation
    type(element_matrix) :: system, right
    type(element_space) :: room
    integer :: n_left, n_in, i, j, square, stat

    n_left = operation%plan%n_retained
    n_in = size(operation%inputs)
    square = room%run(operation%plan%n_slots**2)
    call room%system(n_left, n_in, operation%system_before, system, right)
    call room%in_memory(.true., system, operation%to)
    call room%in_memory(.true., right, operation%rhs)
    call room%new_list(n_left**2, operation%from)
    call room%new_list(operation%n, operation%row_of)
    call room%new_values(n_left*n_in, operation%forces)
    allocate (operation%result_scale(size(operation%result, 1), size(operation%result, 2)), stat=stat)
    room%no_memory = room%no_memory .or. stat /= 0
    call operation%lies_in(room, n_left + size(operation%outputs)*(1 + n_in))
    if (room%no_memory) return
    operation%row_of = 0
    do i = 1, n_left
      do j = 1, n_left
        operation%from((i - 1)*n_left + j) = square + element(operation%plan, i, j)
      end do
      do j = 1, n_in
        if (operation%plan%unknown(i) == operation%inputs(j)) operation%forces((i - 1)*n_in + j) = 1
      end do
      operation%row_of(operation%plan%unknown(i)) = i
    end do
    call set_result(operation)
  end subroutine set_places

  !> The caller's result as numbers to be stored, and the scale of each entry.
  subroutine set_result(operation)
    class(dynamic_stiffness), intent(inout) :: operation
    integer :: i, j

    do j = 1, size(operation%result, 2)
      do i = 1, size(operation%result, 1)
        if (operation%transposed) then
          operation%result_scale(i, j) = operation%scale(operation%inputs(i))*operation%scale(operation%outputs(j))
        else
          operation%result_scale(i, j) = operation%scale(operation%outputs(i))*operation%scale(operation%inputs(j))
        end if
      end do
    end do
    operation%result_pairs => real_lines(operation%result)
  end subroutine set_result

  !> Where the plan keeps entry (i, j) of the condensed matrix.
  pure function element(plan, i, j) result(at)
    type(elimination_plan), intent(in) :: plan
    integer, intent(in) :: i, j
    integer :: at

    at = (i - 1)*plan%n_slots + j
    if (plan%symmetric) at = (min(i, j) - 1)*plan%n_slots + max(i, j)
  end function element

  !> Which DOFs are named.
  pure subroutine mark(dofs, named)
    integer(ip), intent(in) :: dofs(:)
    logical, intent(out) :: named(:)
    integer :: j

    named = .false.
    do j = 1, size(dofs)
      named(dofs(j)) = .true.
    end do
  end subroutine mark

  !> Which DOFs are coupled, whether the matrices are symmetric, their norms, and the scale of each DOF.
  subroutine look_at_matrices(operation, reach, coupled, symmetric, stat)
    class(dynamic_stiffness), intent(inout) :: operation
    integer, intent(in) :: reach
    logical, intent(out) :: coupled(reach, operation%n)
    logical, intent(out) :: symmetric
    integer, intent(out) :: stat
    real(dp), allocatable :: sums(:, :)
    real(dp) :: above(4), below(4), omega, size_of_z
    integer :: i, j, d

    coupled = .false.
    symmetric = .true.
    allocate (operation%scale(operation%n), sums(4, operation%n), stat=stat)
    if (stat /= 0) return
    operation%scale = 1.0_dp
    omega = maxval(operation%omega, mask=abs(operation%omega) <= huge(1.0_dp))
    sums = 0
    do j = 1, operation%n
      above = operation%coefficients(j, j)
      sums(:, j) = sums(:, j) + abs(above)
      size_of_z = abs(above(1)) + omega*(omega*abs(above(2)) + abs(above(3))) + abs(above(4))
      if (size_of_z > 0.0_dp .and. size_of_z <= huge(1.0_dp)) &
        operation%scale(j) = 2.0_dp**(-((exponent(size_of_z))/2))
      do d = 1, min(reach, operation%n - j)
        i = j + d
        below = operation%coefficients(i, j)
        above = operation%coefficients(j, i)
        sums(:, j) = sums(:, j) + abs(below)
        sums(:, i) = sums(:, i) + abs(above)
        coupled(d, j) = .not. all(abs(below) <= 0.0_dp .and. abs(above) <= 0.0_dp)
        symmetric = symmetric .and. all(abs(below - above) <= 0.0_dp)
      end do
    end do
    operation%norms = maxval(sums, dim=2)
  end subroutine look_at_matrices

  pure function dense_coefficients(self, i, j) result(value)
    class(dense_stiffness), intent(in) :: self
    integer, intent(in) :: i, j
    real(dp) :: value(4)

    if (self%transposed) then
      value = stored_coefficients(self, j, i)
    else
      value = stored_coefficients(self, i, j)
    end if
  end function dense_coefficients

  pure function banded_coefficients(self, i, j) result(value)
    class(banded_stiffness), intent(in) :: self
    integer, intent(in) :: i, j
    real(dp) :: value(4)

    value = 0
    if (i - j <= self%kl .and. j - i <= self%ku) value = stored_coefficients(self, self%ku + 1 + i - j, j)
  end function banded_coefficients

  pure function stored_coefficients(self, i, j) result(value)
    class(dynamic_stiffness), intent(in) :: self
    integer, intent(in) :: i, j
    real(dp) :: value(4)

    value = 0
    value(1) = self%stiffness(i, j)
    value(2) = self%mass(i, j)
    if (self%has_damping) value(3) = self%damping(i, j)
    value(4) = self%loss_factor*self%stiffness(i, j)
    if (self%has_structural) value(4) = value(4) + self%structural(i, j)
  end function stored_coefficients

  !> Lines side by side: condensed to the DOFs that are wanted, then solved. Eq. (2.28).
  !> rcond   one over the norm of Z times that of its inverse at inputs and outputs: an estimate from above
  subroutine stiffness_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(dynamic_stiffness), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: omega(lanes), smallest(lanes), rcond_lanes(lanes), total(lanes), norm, largest
    integer :: n_left, n_in, n_out, last, l

    n_left = self%plan%n_retained
    n_in = size(self%inputs)
    last = first + n_lines - 1
    do l = 1, lanes
      omega(l) = self%omega(min(first + l - 1, last))
    end do
    call kernels%eliminate(self%plan, omega, space%x, smallest)
    call kernels%copy(n_left**2, 1.0_dp, self%from, self%to, space%x)
    call kernels%fill(n_left*n_in, self%forces, self%rhs, space%x)
    n_out = size(self%outputs)
    associate (row => space%list(:n_left), wanted => space%list(n_left + 1:n_left + n_out), &
               place => space%list(n_left + n_out + 1:))
      call kernels%solve(n_left, n_in, self%n_wanted, self%system_before, space%x, space%hint, row, rcond_lanes)  ! 2.28
      do l = 1, n_out
        wanted(l) = row(self%row_of(self%outputs(l)))
      end do
      call rows_in_memory(self%transposed, wanted, n_in, place)
      call kernels%total(n_out*n_in, place, space%x, total)
      call kernels%store(n_out*n_in, place, first, n_lines, space%x, self%result_pairs)
    end associate
    do l = 1, n_lines
      self%result(:, :, first + l - 1) = self%result(:, :, first + l - 1)*self%result_scale
      largest = largest_sum(self%transposed, self%result(:, :, first + l - 1))
      norm = self%norms(1) + omega(l)*(omega(l)*self%norms(2) + self%norms(3)) + self%norms(4)
      rcond(l) = min(1.0_dp, (1/norm)/largest)
      line_info(l) = line_overflow                                                                           ! in doubt
      if (smallest(l) >= smallest_pivot**2 .and. rcond_lanes(l) >= doubtful .and. total(l) <= huge(1.0_dp) &
          .and. largest <= huge(1.0_dp)) line_info(l) = line_good
    end do
  end subroutine stiffness_block

  !> The largest sum of |re| + |im| over the outputs.
  pure function largest_sum(transposed, h) result(largest)
    logical, intent(in) :: transposed
    complex(dp), contiguous, intent(in) :: h(:, :)
    real(dp) :: largest

    if (transposed) then
      largest = maxval(sum(abs(real(h)) + abs(aimag(h)), dim=2))
    else
      largest = maxval(sum(abs(real(h)) + abs(aimag(h)), dim=1))
    end if
  end function largest_sum

  !> One stored entry of Z = (1 + i eta) K + i H + i w C - w^2 M. Eq. (2.29), with viscous damping.
  pure function entry(self, omega, i, j) result(z)
    class(dynamic_stiffness), intent(in) :: self
    real(dp), intent(in) :: omega
    integer, intent(in) :: i, j
    complex(dp) :: z
    real(dp) :: loss

    loss = self%loss_factor*self%stiffness(i, j)
    if (self%has_damping) loss = loss + omega*self%damping(i, j)
    if (self%has_structural) loss = loss + self%structural(i, j)
    z = cmplx(self%stiffness(i, j) - omega**2*self%mass(i, j), loss, dp)
  end function entry

  !> Z(out, in), whatever the caller's order.
  pure subroutine fill(self, omega, z)
    class(dynamic_stiffness), intent(in) :: self
    real(dp), intent(in) :: omega
    complex(dp), contiguous, intent(out) :: z(:, :)
    integer :: i, j

    do j = 1, self%n
      do i = 1, self%n
        if (self%transposed) then
          z(j, i) = entry(self, omega, i, j)
        else
          z(i, j) = entry(self, omega, i, j)
        end if
      end do
    end do
  end subroutine fill

  subroutine dense_one(self, i, space, line_info, rcond)
    class(dense_stiffness), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: z(:, :), x(:, :), h(:, :)

    call space%take(self%n, self%n, z)
    call space%take(self%n, size(self%inputs), x)
    call space%take(size(self%outputs), size(self%inputs), h)
    call room_to_solve(self%n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    call fill(self, self%omega(i), z)
    if (.not. all_finite(z)) return
    call unit_forces(self%inputs, x)
    call solve_line(z, x, space, line_info, rcond)                     ! (2.28)
    call take_rows(x, self%outputs, h)
    call store(self%transposed, h, self%result(:, :, i))
  end subroutine dense_one

  subroutine banded_one(self, i, space, line_info, rcond)
    class(banded_stiffness), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: band(:, :), x(:, :), h(:, :), work(:, :)
    real(dp), pointer, contiguous :: real_work(:)
    integer(blas_ip), pointer, contiguous :: pivot(:)
    real(dp) :: norm
    integer(blas_ip) :: n, kl, ku, ld, code, ignored

    n = int(self%n, blas_ip)
    kl = int(self%kl, blas_ip)
    ku = int(self%ku, blas_ip)
    ld = 2*kl + ku + 1
    call space%take(int(ld), self%n, band)
    call space%take(self%n, size(self%inputs), x)
    call space%take(size(self%outputs), size(self%inputs), h)
    call space%take(2*self%n, 1, work)
    call space%take_reals(self%n, real_work)
    call space%take_pivots(self%n, pivot)
    line_info = line_good
    rcond = 1.0_dp
    if (space%only_counts .or. n == 0) return
    call fill_band(self, self%omega(i), band)
    norm = one_norm(band)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(band)) return
    line_info = line_good
    rcond = 1.0_dp
    if (size(self%inputs) == 0) return
    call zgbtrf(n, n, kl, ku, band, ld, pivot, code)
    line_info = int(code, ip)
    if (line_info /= line_good) return
    call unit_forces(self%inputs, x)
    call zgbtrs('N', n, kl, ku, size(self%inputs, kind=blas_ip), band, ld, pivot, x, n, ignored, one_char)
    call zgbcon('1', n, kl, ku, band, ld, pivot, norm, rcond, work, real_work, ignored, one_char)
    if (.not. all_finite(x)) line_info = line_overflow
    call take_rows(x, self%outputs, h)
    call store(self%transposed, h, self%result(:, :, i))
  end subroutine banded_one

  !> Z in band storage, below the kl rows that the factorisation fills.
  pure subroutine fill_band(self, omega, band)
    class(banded_stiffness), intent(in) :: self
    real(dp), intent(in) :: omega
    complex(dp), contiguous, intent(out) :: band(:, :)
    integer :: i, j

    band = 0
    do j = 1, self%n
      do i = max(1, self%ku + 2 - j), min(self%kl + self%ku + 1, self%ku + 1 + self%n - j) ! rows inside the matrix
        band(self%kl + i, j) = entry(self, omega, i, j)
      end do
    end do
  end subroutine fill_band

  !> The rows of x at the outputs.
  pure subroutine take_rows(x, outputs, h)
    complex(dp), contiguous, intent(in) :: x(:, :)
    integer(ip), contiguous, intent(in) :: outputs(:)
    complex(dp), contiguous, intent(out) :: h(:, :)

    h = x(outputs, :)
  end subroutine take_rows

  !> A unit force at each input, one a column.
  pure subroutine unit_forces(inputs, x)
    integer(ip), intent(in) :: inputs(:)
    complex(dp), contiguous, intent(out) :: x(:, :)
    integer :: j

    x = 0
    do j = 1, size(inputs)
      x(inputs(j), j) = 1
    end do
  end subroutine unit_forces

end module jointfrf_dynamic_stiffness
