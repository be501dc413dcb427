!> Receptances of two substructures joined by a complex joint stiffness (2.24)-(2.26), (2.42)-(2.45).
module jointfrf_coupling
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_modification, only: apply_modification, modification_work
  use jointfrf_status, only: line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: couple

  type, extends(line_operation) :: coupling
    logical :: transposed
    integer :: n_a, n_b, n_j
    complex(dp), pointer, contiguous :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    integer(ip), pointer, contiguous :: dofs_a(:), dofs_b(:)
  contains
    procedure :: line => couple_one
  end type coupling

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
  subroutine couple(transposed, h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, info)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    integer(ip), contiguous, target, intent(in) :: dofs_a(:), dofs_b(:)
    complex(dp), contiguous, target, intent(out) :: h_c(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(coupling) :: operation
    integer :: n_a, n_b, n, n_j

    n_a = size(h_a, 1)
    n_b = size(h_b, 1)
    n = n_a + n_b
    n_j = size(dofs_a)
    operation%transposed = transposed
    operation%n_a = n_a
    operation%n_b = n_b
    operation%n_j = n_j
    operation%h_a => h_a
    operation%h_b => h_b
    operation%k_joint => k_joint
    operation%dofs_a => dofs_a
    operation%dofs_b => dofs_b
    operation%result => h_c
    operation%n_complex = n_a**2 + n_b**2 + n**2 + 2*n_j**2 + 2*n*n_j + modification_work(n, n_j)
    operation%n_real = 2*n_j
    operation%n_pivot = n_j
    operation%flops = 8.0_dp*n_j*(real(n, dp)**2 + 2.0_dp*real(n_j, dp)*n)
    call run_sweep(operation, size(h_a, 3, kind=ip), line_info, rcond, info)
  end subroutine couple

  subroutine couple_one(self, i, space, line_info, rcond)
    class(coupling), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: h_a(:, :), h_b(:, :), h(:, :), k_joint(:, :)
    complex(dp), pointer, contiguous :: columns(:, :), rows(:, :), h_relative(:, :)
    integer :: n_a, n

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. (all_finite(self%h_a(:, :, i)) .and. all_finite(self%h_b(:, :, i)) &
               .and. all_finite(self%k_joint(:, :, i)))) return
    n_a = self%n_a
    n = n_a + self%n_b
    h_a => space%matrix(n_a, n_a)
    h_b => space%matrix(self%n_b, self%n_b)
    h => space%matrix(n, n)
    k_joint => space%matrix(self%n_j, self%n_j)
    columns => space%matrix(n, self%n_j)
    rows => space%matrix(self%n_j, n)
    h_relative => space%matrix(self%n_j, self%n_j)
    call load(self%transposed, self%h_a(:, :, i), h_a)
    call load(self%transposed, self%h_b(:, :, i), h_b)
    call load(self%transposed, self%k_joint(:, :, i), k_joint)

    call take_relative(h_a, h_b, self%dofs_a, self%dofs_b, h, columns, rows, h_relative)
    call apply_modification(h, columns, rows, h_relative, k_joint, space, line_info, rcond) ! (2.26)
    call store(self%transposed, h, self%result(:, :, i))
  end subroutine couple_one

  !> Receptance of the unjoined substructures, and its columns, rows and square in the coordinates x_j - x_k.
  pure subroutine take_relative(h_a, h_b, dofs_a, dofs_b, h, columns, rows, h_relative)
    complex(dp), contiguous, intent(in) :: h_a(:, :), h_b(:, :)
    integer(ip), contiguous, intent(in) :: dofs_a(:), dofs_b(:)
    complex(dp), contiguous, intent(out) :: h(:, :), columns(:, :), rows(:, :), h_relative(:, :)
    integer :: n_a

    n_a = size(h_a, 1)
    h = 0
    h(:n_a, :n_a) = h_a
    h(n_a + 1:, n_a + 1:) = h_b
    columns(:n_a, :) = h_a(:, dofs_a)
    columns(n_a + 1:, :) = -h_b(:, dofs_b)
    rows(:, :n_a) = h_a(dofs_a, :)
    rows(:, n_a + 1:) = -h_b(dofs_b, :)
    h_relative = h_a(dofs_a, dofs_a) + h_b(dofs_b, dofs_b)
  end subroutine take_relative

end module jointfrf_coupling
