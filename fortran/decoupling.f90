!> FRF decoupling: the joint stiffness from receptances of the assembly away from the joint and of both substructures
!> (2.49)-(2.56).
module jointfrf_decoupling
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_layout, only: all_finite, load, store
  use jointfrf_lines_lapack, only: inverse_work, invert_line, product_line, solve_line
  use jointfrf_status, only: line_good, line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: decouple, is_equation

  type, extends(line_operation) :: decoupling
    character(len=2) :: equation
    logical :: transposed
    integer :: n_a, n_b, n
    complex(dp), pointer, contiguous :: h_a(:, :, :), h_b(:, :, :), h_c(:, :, :)
    integer(ip), pointer, contiguous :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
  contains
    procedure :: line => decouple_one
  end type decoupling

contains

  !> Whether the two letters name one of the four equations: 'rr' (2.53), 'rs' (2.54), 'sr' (2.55), 'ss' (2.56).
  pure function is_equation(equation) result(known)
    character(len=2), intent(in) :: equation
    logical :: known

    known = equation == 'rr' .or. equation == 'rs' .or. equation == 'sr' .or. equation == 'ss'
  end function is_equation

  !> K* by one of the four equations. All four have one form, K* = (P M^-1 Q - H_jj - H_kk)^-1, with
  !>   rr (2.53)  M = H_rr - H_rr^C,  P = H_jr,  Q = H_rj      rs (2.54)  M = H_rs^C,         P = H_ks,  Q = H_rj
  !>   sr (2.55)  M = H_sr^C,         P = H_jr,  Q = H_sk      ss (2.56)  M = H_ss - H_ss^C,  P = H_ks,  Q = H_sk
  !> h_a       receptance of A, shape (n_a, n_a, n_freq), m/N
  !> h_b       receptance of B, shape (n_b, n_b, n_freq), m/N
  !> h_c       measured receptance of the assembly: responses at the points of the first letter, forces at those of the
  !>           second, shape (n, n, n_freq), m/N
  !> dofs_j    joint DOFs among those of A, shape (n), counted from 1
  !> dofs_k    joint DOFs among those of B, shape (n), in the same order
  !> dofs_r    internal DOFs of A, shape (n); read where the equation names r
  !> dofs_s    internal DOFs of B, shape (n); read where the equation names s
  !> k_joint   K*, shape (n, n, n_freq), N/m
  subroutine decouple(equation, transposed, h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, k_joint, &
                      line_info, rcond, info)
    character(len=2), intent(in) :: equation
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: h_a(:, :, :), h_b(:, :, :), h_c(:, :, :)
    integer(ip), contiguous, target, intent(in) :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(decoupling) :: operation
    integer :: n

    n = size(dofs_j)
    operation%equation = equation
    operation%transposed = transposed
    operation%n_a = size(h_a, 1)
    operation%n_b = size(h_b, 1)
    operation%n = n
    operation%h_a => h_a
    operation%h_b => h_b
    operation%h_c => h_c
    operation%dofs_j => dofs_j
    operation%dofs_k => dofs_k
    operation%dofs_r => dofs_r
    operation%dofs_s => dofs_s
    operation%result => k_joint
    operation%n_complex = operation%n_a**2 + operation%n_b**2 + 4*n**2 + inverse_work(n)
    operation%n_real = 2*n
    operation%n_pivot = n
    operation%flops = 27.0_dp*real(n, dp)**3
    call run_sweep(operation, size(h_a, 3, kind=ip), line_info, rcond, info)
  end subroutine decouple

  subroutine decouple_one(self, i, space, line_info, rcond)
    class(decoupling), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: h_a(:, :), h_b(:, :), measured(:, :), to_joint(:, :), from_joint(:, :), z(:, :)
    real(dp) :: rcond_z
    integer :: n

    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. (all_finite(self%h_a(:, :, i)) .and. all_finite(self%h_b(:, :, i)) &
               .and. all_finite(self%h_c(:, :, i)))) return
    n = self%n
    h_a => space%matrix(self%n_a, self%n_a)
    h_b => space%matrix(self%n_b, self%n_b)
    measured => space%matrix(n, n)
    to_joint => space%matrix(n, n)
    from_joint => space%matrix(n, n)
    z => space%matrix(n, n)
    call load(self%transposed, self%h_a(:, :, i), h_a)
    call load(self%transposed, self%h_b(:, :, i), h_b)
    call load(self%transposed, self%h_c(:, :, i), measured)

    call take_terms(self%equation, h_a, h_b, self%dofs_j, self%dofs_k, self%dofs_r, self%dofs_s, &
                    measured, to_joint, from_joint, z)
    call solve_line(measured, from_joint, space, line_info, rcond)
    if (line_info /= line_good) return
    call product_line('N', 'N', 1.0_dp, to_joint, from_joint, z)
    call invert_line(z, space, line_info, rcond_z)             ! (2.53)-(2.56)
    rcond = min(rcond, rcond_z)
    call store(self%transposed, z, self%result(:, :, i))
  end subroutine decouple_one

  !> M, P and Q of the equation, and -H_jj - H_kk. The first letter names the responding point: it gives Q. The second
  !> names the excited point: it gives P.
  pure subroutine take_terms(equation, h_a, h_b, dofs_j, dofs_k, dofs_r, dofs_s, measured, to_joint, from_joint, z)
    character(len=2), intent(in) :: equation
    complex(dp), contiguous, intent(in) :: h_a(:, :), h_b(:, :)
    integer(ip), contiguous, intent(in) :: dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    complex(dp), contiguous, intent(inout) :: measured(:, :)
    complex(dp), contiguous, intent(out) :: to_joint(:, :), from_joint(:, :), z(:, :)

    if (equation(1:1) == 'r') then
      from_joint = h_a(dofs_r, dofs_j)
    else
      from_joint = h_b(dofs_s, dofs_k)
    end if
    if (equation(2:2) == 'r') then
      to_joint = h_a(dofs_j, dofs_r)
    else
      to_joint = h_b(dofs_k, dofs_s)
    end if
    if (equation == 'rr') measured = h_a(dofs_r, dofs_r) - measured
    if (equation == 'ss') measured = h_b(dofs_s, dofs_s) - measured
    z = -h_a(dofs_j, dofs_j) - h_b(dofs_k, dofs_k)
  end subroutine take_terms

end module jointfrf_decoupling
