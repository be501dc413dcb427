!> Receptances of two substructures joined by a complex joint stiffness (2.24)-(2.26), (2.42)-(2.45).
module jointfrf_coupling
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_engine, only: engine_v4, get_engine
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_solved, largest_product, &
    padded, real_lines, rows_in_memory
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_lines_lapack, only: product_block, room_to_solve
  use jointfrf_modification, only: apply_in_lanes, find_forces, find_line_forces, forces_in_lanes, &
    modification_in_lanes, plan_forces, plan_modification
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: couple

  !> From so many DOFs of the assembly on products are faster line by line with the BLAS than in lanes, and from the
  !> second number on where a fifth of them are joint DOFs; with AVX-512 not before a block leaves the caches.
  integer, parameter :: fewest_for_blas(2) = [96, 64], fewest_with_avx512(2) = [largest_product + 1, 120]
  !> More elements than these, of which a system for the forces consists, leave the caches.
  integer, parameter :: most_in_system = 12000

  type, extends(line_operation) :: coupling
    logical :: transposed
    integer :: n_a, n_b, n_j
    complex(dp), pointer, contiguous :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    integer(ip), pointer, contiguous :: dofs_a(:), dofs_b(:)
    type(modification_in_lanes) :: plan
    real(dp), pointer, contiguous :: a_pairs(:, :, :), b_pairs(:, :, :), k_pairs(:, :, :), result_pairs(:, :, :)
    integer, allocatable :: a_place(:), b_place(:), k_place(:), h_place(:)
    integer, allocatable :: apart(:)                       !< blocks of H between the unjoined substructures
    complex(dp), allocatable :: apart_value(:)
    integer, allocatable :: of_a(:), from_a(:), of_b(:), from_b(:)     !< rows and columns in the coordinates x_j - x_k
    integer, allocatable :: relative(:), relative_a(:), relative_b(:)  !< their square
  contains
    procedure :: line => couple_one
    procedure :: line_block => couple_block
  end type coupling

  !> Many DOFs: only the forces in the joint are found in lanes.
  type, extends(coupling) :: large_coupling
    type(forces_in_lanes) :: forces
    integer, allocatable :: in_a(:), place_a(:)            !< rows j of A: which numbers of a line, and where in lanes
    integer, allocatable :: in_b(:), place_b(:)            !< rows k of B
  contains
    procedure :: line_block => couple_large_block
  end type large_coupling

contains

  !> Receptance of the assembly, all blocks: DOFs of A, then DOFs of B. Eq. (2.26).
  !>
  !> The joint acts on the relative displacements x_j - x_k, so coupling is a modification by K* in these coordinates:
  !> Z^-1 = (K*^-1 + H_jj + H_kk)^-1 = (I + K* (H_jj + H_kk))^-1 K*, which also holds for a joint DOF without stiffness.
  !> In (2.26) the entry jj lacks its first term; it reads H_jj - H_jj Z^-1 H_jj as in (2.42).
  !> h_a       receptance of A, shape (n_a, n_a, n_freq), m/N
  !> h_b       receptance of B, shape (n_b, n_b, n_freq), m/N
  !> k_joint   complex joint stiffness K*, shape (n_j, n_j, n_freq), N/m
  !> dofs_a    joint DOFs j among those of A, shape (n_j), counted from 1
  !> dofs_b    joint DOFs k among those of B, shape (n_j), in the same order
  !> h_c       receptance of the assembly, shape (n_a + n_b, n_a + n_b, n_freq)
  subroutine couple(transposed, h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    integer(ip), contiguous, target, intent(in) :: dofs_a(:), dofs_b(:)
    complex(dp), contiguous, target, intent(out) :: h_c(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(coupling) :: whole
    type(large_coupling) :: large
    logical :: planned, by_blas
    integer :: n, n_j

    n = size(h_a, 1) + size(h_b, 1)
    n_j = size(dofs_a)
    planned = worth_a_plan(size(h_a, 3), memory) .and. n_j >= 1 .and. n_j <= largest_solved
    by_blas = .false.
    if (planned) by_blas = products_by_blas(n, n_j)
    if (by_blas) then
      call set(large)
      call plan_large_coupling(large)
      call run_sweep(large, size(h_a, 3, kind=ip), line_info, rcond, info)
    else
      call set(whole)
      if (planned .and. n <= largest_product) call plan_coupling(whole)
      call run_sweep(whole, size(h_a, 3, kind=ip), line_info, rcond, info, memory)
    end if

  contains

    !> Whether products are left to the BLAS. Those of a single joint DOF stay in lanes.
    function products_by_blas(n, n_j) result(yes)
      integer, intent(in) :: n, n_j
      logical :: yes
      integer(ip) :: engine, info
      integer :: fewest(2)

      call get_engine(engine, info)
      fewest = merge(fewest_with_avx512, fewest_for_blas, engine == engine_v4)
      yes = n >= fewest(1) .or. (n >= fewest(2) .and. 5*n_j >= n)
      yes = yes .and. n_j > 1 .and. n_j*(n_j + n) <= most_in_system
    end function products_by_blas

    subroutine set(operation)
      class(coupling), intent(inout) :: operation

      operation%transposed = transposed
      operation%n_a = size(h_a, 1)
      operation%n_b = size(h_b, 1)
      operation%n_j = n_j
      operation%h_a => h_a
      operation%h_b => h_b
      operation%k_joint => k_joint
      operation%dofs_a => dofs_a
      operation%dofs_b => dofs_b
      operation%result => h_c
      operation%flops = 8.0_dp*n_j*(real(n, dp)**2 + 2.0_dp*real(n_j, dp)*n)
      operation%n_hint = padded(operation%n_j)
      operation%a_pairs => real_lines(h_a)
      operation%b_pairs => real_lines(h_b)
      operation%k_pairs => real_lines(k_joint)
      operation%result_pairs => real_lines(h_c)
      call operation%reads(operation%a_pairs)
      call operation%reads(operation%b_pairs)
      call operation%reads(operation%k_pairs)
    end subroutine set
  end subroutine couple

  subroutine plan_coupling(operation)
    type(coupling), intent(inout) :: operation
    type(element_space) :: room
    type(element_matrix) :: a, b
    integer :: n_a, n_b, n_j, used

    n_a = operation%n_a
    n_b = operation%n_b
    n_j = operation%n_j
    call plan_modification(n_a + n_b, n_j, room, operation%plan)
    associate (plan => operation%plan, j => operation%dofs_a, k => operation%dofs_b)
      a = plan%h%block(0, n_a, 0, n_a)
      b = plan%h%block(n_a, n_b, n_a, n_b)
      call room%in_memory(operation%transposed, a, operation%a_place)
      call room%in_memory(operation%transposed, b, operation%b_place)
      call room%in_memory(operation%transposed, plan%forces%d, operation%k_place)
      call room%in_memory(operation%transposed, plan%h, operation%h_place)
      call room%new_list(2*n_a*n_b, operation%apart)
      call room%new_values(2*n_a*n_b, operation%apart_value)
      used = 0
      call room%add(plan%h%block(0, n_a, n_a, n_b), operation%apart, used)
      call room%add(plan%h%block(n_a, n_b, 0, n_a), operation%apart, used)
      call list_relative(0, a, j, operation%of_a, operation%from_a)
      call list_relative(n_a, b, k, operation%of_b, operation%from_b)
      call room%pick(plan%forces%h_mm, operation%relative)
      call room%pick(a, operation%relative_a, j, j)
      call room%pick(b, operation%relative_b, k, k)
    end associate
    call operation%lies_in(room, n_j)

  contains

    !> Columns and rows of a substructure in the coordinates x_j - x_k, and where they come from.
    !> before   DOFs of the assembly before its own
    subroutine list_relative(before, h, dofs, to, from)
      integer, intent(in) :: before
      type(element_matrix), intent(in) :: h
      integer(ip), intent(in) :: dofs(:)
      integer, allocatable, intent(out) :: to(:), from(:)

      call room%new_list(2*n_j*h%n_rows, to)
      call room%new_list(2*n_j*h%n_rows, from)
      used = 0
      call room%add(operation%plan%columns%block(before, h%n_rows, 0, n_j), to, used)
      call room%add(operation%plan%forces%rows%block(0, n_j, before, h%n_rows), to, used)
      used = 0
      call room%add(h, from, used, columns=dofs)
      call room%add(h, from, used, rows=dofs)
    end subroutine list_relative
  end subroutine plan_coupling

  subroutine couple_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(coupling), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)

    associate (x => space%x)
      call kernels%load(size(self%a_place), self%a_place, first, n_lines, self%a_pairs, x)
      call kernels%load(size(self%b_place), self%b_place, first, n_lines, self%b_pairs, x)
      call kernels%load(size(self%k_place), self%k_place, first, n_lines, self%k_pairs, x)
      call kernels%fill(size(self%apart), self%apart_value, self%apart, x)
      call kernels%copy(size(self%of_a), 1.0_dp, self%from_a, self%of_a, x)
      call kernels%copy(size(self%of_b), -1.0_dp, self%from_b, self%of_b, x)
      call kernels%combine(size(self%relative), 1.0_dp, self%relative_a, 1.0_dp, self%relative_b, self%relative, x)
      call apply_in_lanes(self%plan, kernels, x, space%hint, space%list, rcond_lanes, space%ahead)  ! (2.26)
      call kernels%store(size(self%h_place), self%h_place, first, n_lines, x, self%result_pairs)
      call kernels%total(size(self%h_place), self%h_place, x, total)
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine couple_block

  subroutine plan_large_coupling(operation)
    type(large_coupling), intent(inout) :: operation
    type(element_space) :: room
    type(element_matrix) :: a, b
    integer :: n_a, n_b, n_j

    n_a = operation%n_a
    n_b = operation%n_b
    n_j = operation%n_j
    call plan_forces(n_a + n_b, n_j, room, operation%forces)
    associate (forces => operation%forces)
      a = forces%rows%block(0, n_j, 0, n_a)
      b = forces%rows%block(0, n_j, n_a, n_b)
      call room%in_memory(operation%transposed, forces%d, operation%k_place)
      call room%pick(a, operation%place_a)
      call room%pick(b, operation%place_b)
      call list_rows(n_a, operation%dofs_a, operation%in_a)
      call list_rows(n_b, operation%dofs_b, operation%in_b)
      call room%pick(forces%h_mm, operation%relative)
      call room%pick(a, operation%relative_a, columns=operation%dofs_a)
      call room%pick(b, operation%relative_b, columns=operation%dofs_b)
    end associate
    call operation%lies_in(room, n_j*(1 + n_a + n_b))

  contains

    !> Which numbers of a stored line of order n are these rows.
    subroutine list_rows(n, dofs, number)
      integer, intent(in) :: n
      integer(ip), intent(in) :: dofs(:)
      integer, allocatable, intent(out) :: number(:)
      integer :: i, j

      call room%new_list(n_j*n, number)
      if (room%no_memory) return
      do j = 1, n
        do i = 1, n_j
          number((j - 1)*n_j + i) = merge(n*int(dofs(i) - 1) + j, n*(j - 1) + int(dofs(i)), operation%transposed)
        end do
      end do
    end subroutine list_rows
  end subroutine plan_large_coupling

  !> Forces in the joint in lanes; then, line by line and where the result lies, their products with columns of H_A and
  !> H_B by the BLAS.
  subroutine couple_large_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(large_coupling), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    complex(dp), pointer, contiguous :: force(:, :)
    real(dp), pointer, contiguous :: force_pairs(:, :, :)
    real(dp) :: rcond_lanes(lanes), total(lanes)
    integer :: n, i, l

    n = self%n_a + self%n_b
    associate (x => space%x, force_row => space%list(:self%n_j), place => space%list(self%n_j + 1:))
      call kernels%pick(size(self%in_a), self%n_a**2, self%in_a, self%place_a, first, n_lines, self%a_pairs, x)
      call kernels%pick(size(self%in_b), self%n_b**2, self%in_b, self%place_b, first, n_lines, self%b_pairs, x)
      call kernels%load(size(self%k_place), self%k_place, first, n_lines, self%k_pairs, x)
      call kernels%combine(size(self%relative), 1.0_dp, self%relative_a, 1.0_dp, self%relative_b, self%relative, x)
      call find_forces(self%forces, kernels, x, space%hint, force_row, rcond_lanes, space%ahead)
      call rows_in_memory(self%transposed, force_row, n, place)
      call c_f_pointer(c_loc(x(1, 1, self%forces%right_before + 1)), force_pairs, [2, self%n_j*n, lanes])
      call kernels%store(size(place), place, 1, n_lines, x, force_pairs)
      call c_f_pointer(c_loc(force_pairs), force, [self%n_j*n, lanes])
      total = 0
      do l = 1, n_lines
        i = first + l - 1
        call join(self%transposed, self%n_a, self%n_b, self%n_j, self%h_a(:, :, i), self%h_b(:, :, i), self%dofs_a, &
                  self%dofs_b, force(:, l), space%z, self%result(:, :, i))
        call kernels%add_moduli(n*n, self%result_pairs(:, :, i), total(l))
      end do
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine couple_large_block

  !> The assembly from columns j of H_A, columns k of H_B, and forces in the joint that answer to their rows, unlike in
  !> (2.26) with the same sign on either side: each of the four blocks is one product.
  !> force     shape (n_j, n_a + n_b), or (n_a + n_b, n_j) where transposed
  !> columns   workspace, n_j*max(n_a, n_b)
  subroutine join(transposed, n_a, n_b, n_j, h_a, h_b, dofs_a, dofs_b, force, columns, h)
    logical, intent(in) :: transposed
    integer, intent(in) :: n_a, n_b, n_j
    complex(dp), intent(in) :: h_a(n_a, n_a), h_b(n_b, n_b), force(n_j*(n_a + n_b))
    integer(ip), intent(in) :: dofs_a(n_j), dofs_b(n_j)
    complex(dp), intent(inout) :: columns(*)
    complex(dp), intent(inout) :: h(n_a + n_b, n_a + n_b)

    h(:n_a, :n_a) = h_a
    h(n_a + 1:, n_a + 1:) = h_b
    if (min(n_a, n_b, n_j) == 0) then                ! no product; each substructure has all joint DOFs
      h(:n_a, n_a + 1:) = 0
      h(n_a + 1:, :n_a) = 0
      return
    end if
    call take_columns(transposed, h_a, dofs_a, columns)
    call add_product(n_a, 1, n_a, 1, -1.0_dp, 1.0_dp)
    call add_product(n_a, 1, n_b, n_a + 1, 1.0_dp, 0.0_dp)
    call take_columns(transposed, h_b, dofs_b, columns)
    call add_product(n_b, n_a + 1, n_a, 1, 1.0_dp, 0.0_dp)
    call add_product(n_b, n_a + 1, n_b, n_a + 1, -1.0_dp, 1.0_dp)

  contains

    !> One block = kept block + factor columns forces: n_out responses from number `out` on to n_in forces from `in` on.
    subroutine add_product(n_out, out, n_in, in, factor, kept)
      integer, intent(in) :: n_out, out, n_in, in
      real(dp), intent(in) :: factor, kept
      integer :: n

      n = n_a + n_b
      if (transposed) then
        call product_block(n_in, n_out, n_j, factor, force(in), n, columns, n_j, kept, h(in, out), n)
      else
        call product_block(n_out, n_in, n_j, factor, columns, n_out, force((in - 1)*n_j + 1), n_j, kept, h(out, in), n)
      end if
    end subroutine add_product
  end subroutine join

  !> Some columns of a matrix, all as the caller stores it.
  pure subroutine take_columns(transposed, h, dofs, columns)
    logical, intent(in) :: transposed
    complex(dp), contiguous, intent(in) :: h(:, :)
    integer(ip), contiguous, intent(in) :: dofs(:)
    complex(dp), intent(inout) :: columns(*)
    integer :: i, j, n_j

    n_j = size(dofs)
    if (transposed) then
      do i = 1, size(h, 2)
        do j = 1, n_j
          columns((i - 1)*n_j + j) = h(dofs(j), i)
        end do
      end do
    else
      do j = 1, n_j
        columns((j - 1)*size(h, 1) + 1:j*size(h, 1)) = h(:, dofs(j))
      end do
    end if
  end subroutine take_columns

  !> As `couple_large_block`, with forces by LAPACK.
  subroutine couple_one(self, i, space, line_info, rcond)
    class(coupling), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: k_joint(:, :), rows(:, :), h_relative(:, :), system(:, :), forces(:, :)
    complex(dp), pointer, contiguous :: stored(:, :), columns(:, :)
    integer :: n, n_j

    n = self%n_a + self%n_b
    n_j = self%n_j
    call space%take(n_j, n_j, k_joint)
    call space%take(n_j, n, rows)
    call space%take(n_j, n_j, h_relative)
    call space%take(n_j, n_j, system)
    call space%take(n_j, n, forces)
    call space%take(merge(n, n_j, self%transposed), merge(n_j, n, self%transposed), stored)
    call space%take(max(self%n_a, self%n_b), n_j, columns)
    call room_to_solve(n_j, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%h_a(:, :, i)) .and. all_finite(self%h_b(:, :, i)) &
               .and. all_finite(self%k_joint(:, :, i)))) return
    call load(self%transposed, self%k_joint(:, :, i), k_joint)
    call take_rows(self%transposed, self%h_a(:, :, i), self%dofs_a, rows(:, :self%n_a))
    call take_rows(self%transposed, self%h_b(:, :, i), self%dofs_b, rows(:, self%n_a + 1:))
    call add_squares(self%n_a, rows, self%dofs_a, self%dofs_b, h_relative)
    call find_line_forces(k_joint, h_relative, rows, system, forces, space, line_info, rcond)
    if (line_info /= line_good) return
    call store(self%transposed, forces, stored)
    call join(self%transposed, self%n_a, self%n_b, n_j, self%h_a(:, :, i), self%h_b(:, :, i), self%dofs_a, &
              self%dofs_b, stored, columns, self%result(:, :, i))                                               ! (2.26)
    if (.not. all_finite(self%result(:, :, i))) line_info = line_overflow
  end subroutine couple_one

  !> Some rows of a matrix that lies as the caller stores it.
  pure subroutine take_rows(transposed, h, dofs, rows)
    logical, intent(in) :: transposed
    complex(dp), contiguous, intent(in) :: h(:, :)
    integer(ip), contiguous, intent(in) :: dofs(:)
    complex(dp), contiguous, intent(out) :: rows(:, :)
    integer :: i, j

    if (transposed) then
      do i = 1, size(dofs)
        rows(i, :) = h(:, dofs(i))
      end do
    else
      do j = 1, size(h, 2)
        rows(:, j) = h(dofs, j)
      end do
    end if
  end subroutine take_rows

  !> H_jj + H_kk from rows j of H_A beside rows k of H_B.
  pure subroutine add_squares(n_a, rows, dofs_a, dofs_b, h)
    integer, intent(in) :: n_a
    complex(dp), contiguous, intent(in) :: rows(:, :)
    integer(ip), contiguous, intent(in) :: dofs_a(:), dofs_b(:)
    complex(dp), contiguous, intent(out) :: h(:, :)

    h = rows(:, dofs_a) + rows(:, n_a + dofs_b)
  end subroutine add_squares

end module jointfrf_coupling
