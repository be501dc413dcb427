!> Receptance of a model by superposition of its modes.
module jointfrf_modal
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_space, lane_kernels, lanes, real_lines
  use jointfrf_line_layout, only: all_finite, load_real, store
  use jointfrf_lines_lapack, only: product_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: receptance_modal

  type, extends(line_operation) :: superposition
    logical :: transposed
    integer :: n_modes, n_out, n_in
    real(dp), pointer, contiguous :: omega(:), stiffness(:), damping(:), loss_factor(:)
    real(dp), pointer, contiguous :: shapes_out(:, :), shapes_in(:, :)
    real(dp), allocatable :: loss(:)                  !< lambda eta of each mode
    real(dp), allocatable :: residue(:, :, :)         !< of entries that differ, by fours, shape (4, n_modes, n_four)
    integer, allocatable :: place(:)                  !< the element of each entry, in the caller's order
    real(dp), pointer, contiguous :: result_pairs(:, :, :)
  contains
    procedure :: line_block => superpose_block
    procedure :: line => superpose_one
  end type superposition

contains

  !> H = sum over modes of phi_out phi_in / (lambda (1 + i eta) - w^2 + i w c), modes normalised to unit modal mass.
  !> omega         angular frequencies, shape (n_freq), rad/s
  !> stiffness     lambda = w_r^2 of each mode, shape (n_modes), (rad/s)^2
  !> damping       viscous modal damping c = 2 zeta w_r, shape (n_modes), rad/s
  !> loss_factor   eta of each mode, shape (n_modes)
  !> shapes_out    mode shapes at the responses, shape (n_out, n_modes), (n_modes, n_out) where transposed, 1/sqrt(kg)
  !> shapes_in     mode shapes at the forces, shape (n_in, n_modes), (n_modes, n_in) where transposed
  !> h             receptance, shape (n_out, n_in, n_freq), m/N
  !> rcond         smallest modal denominator over the largest
  subroutine receptance_modal(transposed, omega, stiffness, damping, loss_factor, shapes_out, shapes_in, h, line_info, &
                              rcond, info, memory)
    logical, intent(in) :: transposed
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:), damping(:), loss_factor(:)
    real(dp), contiguous, target, intent(in) :: shapes_out(:, :), shapes_in(:, :)
    complex(dp), contiguous, target, intent(out) :: h(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(superposition) :: operation

    operation%transposed = transposed
    operation%omega => omega
    operation%stiffness => stiffness
    operation%damping => damping
    operation%loss_factor => loss_factor
    operation%result => h
    operation%shapes_out => shapes_out
    operation%shapes_in => shapes_in
    operation%n_modes = size(stiffness)
    operation%n_out = size(h, merge(2, 1, transposed))
    operation%n_in = size(h, merge(1, 2, transposed))
    operation%flops = 8.0_dp*operation%n_modes*(operation%n_in + operation%n_out*operation%n_in)
    if (worth_a_plan(size(omega), memory) .and. operation%n_modes > 0 .and. size(h) > 0) call prepare_block(operation)
    call run_sweep(operation, size(omega, kind=ip), line_info, rcond, info, memory)
  end subroutine receptance_modal

  !> Residues phi_out phi_in of the entries. Where responses and forces are at the same places, entries (i, j) and
  !> (j, i) are one.
  subroutine prepare_block(operation)
    class(superposition), intent(inout) :: operation
    type(element_space) :: room
    logical :: symmetric
    integer :: o, i, e, entries, mode, before, stat

    symmetric = operation%n_out == operation%n_in
    if (symmetric) symmetric = all(abs(operation%shapes_out - operation%shapes_in) <= 0.0_dp)
    entries = operation%n_out*operation%n_in
    if (symmetric) entries = (operation%n_out*(operation%n_out + 1))/2
    call room%new_list(operation%n_out*operation%n_in, operation%place)
    allocate (operation%residue(4, operation%n_modes, (entries + 3)/4), operation%loss(operation%n_modes), stat=stat)
    room%no_memory = room%no_memory .or. stat /= 0
    before = room%run(operation%n_modes)                              ! what the kernel works in
    before = room%run(4*((entries + 3)/4))
    call operation%lies_in(room, 0)
    if (room%no_memory) return
    operation%residue = 0.0_dp
    e = 0
    do i = 1, operation%n_in
      do o = merge(i, 1, symmetric), operation%n_out
        e = e + 1
        do mode = 1, operation%n_modes
          operation%residue(mod(e - 1, 4) + 1, mode, (e + 3)/4) = &
            shape_at(operation%transposed, operation%shapes_out, o, mode) &
            *shape_at(operation%transposed, operation%shapes_in, i, mode)
        end do
        operation%place(in_memory(o, i)) = before + e
        if (symmetric) operation%place(in_memory(i, o)) = before + e
      end do
    end do
    operation%loss(:) = operation%loss_factor*operation%stiffness
    operation%result_pairs => real_lines(operation%result)

  contains

    pure function in_memory(o, i) result(at)
      integer, intent(in) :: o, i
      integer :: at

      at = merge((o - 1)*operation%n_in + i, (i - 1)*operation%n_out + o, operation%transposed)
    end function in_memory
  end subroutine prepare_block

  !> A mode shape at one place.
  pure function shape_at(transposed, shapes, place, mode) result(value)
    logical, intent(in) :: transposed
    real(dp), contiguous, intent(in) :: shapes(:, :)
    integer, intent(in) :: place, mode
    real(dp) :: value

    if (transposed) then
      value = shapes(mode, place)
    else
      value = shapes(place, mode)
    end if
  end function shape_at

  subroutine superpose_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(superposition), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: omega(lanes), smallest(lanes), largest(lanes), total(lanes)
    integer :: l

    do l = 1, lanes
      omega(l) = self%omega(first + min(l, n_lines) - 1)
    end do
    call kernels%superpose(self%n_modes, size(self%residue, 3), self%stiffness, self%loss, self%damping, self%residue, &
                           omega, space%x, smallest, largest)
    call kernels%total(size(self%place), self%place, space%x, total)
    call kernels%store(size(self%place), self%place, first, n_lines, space%x, self%result_pairs)
    do l = 1, n_lines
      rcond(l) = sqrt(smallest(l)/largest(l))
      line_info(l) = line_overflow                                     ! in doubt
      if (total(l) <= huge(1.0_dp) .and. smallest(l) <= huge(1.0_dp)) line_info(l) = line_good
    end do
  end subroutine superpose_block

  subroutine superpose_one(self, i, space, line_info, rcond)
    class(superposition), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: shapes(:, :), weighted(:, :), h(:, :)
    complex(dp) :: denominator
    real(dp) :: smallest, largest, omega
    integer :: mode, place

    call space%take(self%n_out, self%n_modes, shapes)
    call space%take(self%n_modes, self%n_in, weighted)
    call space%take(self%n_out, self%n_in, h)
    line_info = line_good
    rcond = 0.0_dp
    if (space%only_counts) return
    omega = self%omega(i)
    smallest = huge(1.0_dp)
    largest = 0.0_dp
    do mode = 1, self%n_modes
      denominator = cmplx(self%stiffness(mode) - omega**2, &
                          self%loss_factor(mode)*self%stiffness(mode) + omega*self%damping(mode), dp)
      line_info = line_not_finite
      if (.not. abs(denominator) <= huge(1.0_dp)) return
      line_info = int(mode, ip)                                        ! as LAPACK would name a zero pivot
      if (.not. abs(denominator) > 0.0_dp) return
      smallest = min(smallest, abs(denominator))
      largest = max(largest, abs(denominator))
      do place = 1, self%n_in
        weighted(mode, place) = shape_at(self%transposed, self%shapes_in, place, mode)/denominator
      end do
    end do
    line_info = line_good
    rcond = 1.0_dp
    if (self%n_modes > 0) rcond = smallest/largest
    call load_real(self%transposed, self%shapes_out, shapes)
    h = 0
    call product_line('N', 'N', 1.0_dp, shapes, weighted, h)
    if (.not. all_finite(h)) line_info = line_overflow
    call store(self%transposed, h, self%result(:, :, i))
  end subroutine superpose_one

end module jointfrf_modal
