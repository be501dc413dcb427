!> The flat API in memory of the caller: jf_NAME_work takes the arguments of jf_NAME and, before INFO, workspace by
!> LAPACK's habit. Nothing is allocated and no thread is started; LAPACK does every line, as the reference engine does,
!> whatever engine is chosen. A program calls them line by line in its own loop, or for many lines at once.
module jointfrf_api_work
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_double_complex
  use jointfrf_arguments, only: as_lines, as_matrix, is_transposed, lower
  use jointfrf_caller_memory, only: as_memory
  use jointfrf_checks, only: check_compliance_covariance, check_compliance_factors, check_couple, check_decouple, &
    check_invert, check_matrices, check_modify, check_receptance, check_receptance_banded, &
    check_receptance_modal, check_solve, check_transform
  use jointfrf_compliance, only: compliance_covariance, compliance_factors, joint_compliance
  use jointfrf_coupling, only: couple
  use jointfrf_decoupling, only: decouple
  use jointfrf_dynamic_stiffness, only: receptance_banded, receptance_dense
  use jointfrf_finite_difference, only: transform_receptance
  use jointfrf_ismm, only: inverse_substructuring, ismm
  use jointfrf_kinds, only: ip, long
  use jointfrf_linear_algebra, only: invert, solve
  use jointfrf_modal, only: receptance_modal
  use jointfrf_modification, only: find_modification, modify
  use jointfrf_status, only: info_good
  use jointfrf_traps, only: hold_traps, host_state, release_traps
  implicit none
  private
  public :: jf_invert_work, jf_solve_work, jf_receptance_work, jf_receptance_banded_work, jf_receptance_modal_work
  public :: jf_couple_work, jf_modify_work, jf_find_modification_work, jf_ismm_work, jf_inverse_substructuring_work
  public :: jf_decouple_work, jf_joint_compliance_work, jf_compliance_factors_work, jf_compliance_covariance_work
  public :: jf_transform_work

contains

  ! Bounds are computed before sizes are checked: MIN and MAX in them keep those that will be refused from overflowing.

  !> jf_invert in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_invert_work(n, n_freq, a, a_inverse, line_info, rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_invert_work_')
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: a(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: a_inverse(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_invert(n, n_freq)
    if (info == info_good) then
      call invert(a, a_inverse, line_info, rcond, info, as_memory(8_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_invert_work

  !> jf_solve in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_solve_work(trans, n, n_rhs, n_freq, a, b, x, line_info, rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_solve_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_rhs, n_freq
    complex(c_double_complex), target, intent(in) :: a(n, n, n_freq), b(*)
    complex(c_double_complex), target, intent(inout) :: x(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: b_lines(:, :, :), x_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_solve(trans, n, n_rhs, n_freq)
    if (info == info_good) then
      call as_lines(trans, n, n_rhs, n_freq, b, b_lines)
      call as_lines(trans, n, n_rhs, n_freq, x, x_lines)
      call solve(is_transposed(trans), a, b_lines, x_lines, line_info, rcond, info, &
                 as_memory(11_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_solve_work

  !> jf_receptance in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_receptance_work(trans, n, n_freq, n_out, n_in, omega, stiffness, mass, n_damping, damping, &
                                n_structural, structural, loss_factor, outputs, inputs, h, line_info, rcond, work, &
                                lwork, iwork, liwork, info) bind(C, name='jf_receptance_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq, n_out, n_in, n_damping, n_structural
    real(c_double), target, intent(in) :: omega(n_freq), stiffness(n, n), mass(n, n)
    real(c_double), target, intent(in) :: damping(n, n_damping), structural(n, n_structural)
    real(c_double), intent(in) :: loss_factor
    integer(ip), target, intent(in) :: outputs(n_out), inputs(n_in)
    complex(c_double_complex), target, intent(inout) :: h(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_receptance(trans, n, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, outputs, inputs)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h, h_lines)
      call receptance_dense(is_transposed(trans), omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                            inputs, h_lines, line_info, rcond, info, as_memory(20_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_receptance_work

  !> jf_receptance_banded in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_receptance_banded_work(trans, n, kl, ku, n_freq, n_out, n_in, omega, stiffness, mass, n_damping, &
                                       damping, n_structural, structural, loss_factor, outputs, inputs, h, line_info, &
                                       rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_receptance_banded_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural
    real(c_double), target, intent(in) :: omega(n_freq), stiffness(1_long + kl + ku, n), mass(1_long + kl + ku, n)
    real(c_double), target, intent(in) :: damping(1_long + kl + ku, n_damping)
    real(c_double), target, intent(in) :: structural(1_long + kl + ku, n_structural)
    real(c_double), intent(in) :: loss_factor
    integer(ip), target, intent(in) :: outputs(n_out), inputs(n_in)
    complex(c_double_complex), target, intent(inout) :: h(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_receptance_banded(trans, n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, &
                                   outputs, inputs)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h, h_lines)
      call receptance_banded(is_transposed(trans), int(kl), int(ku), omega, stiffness, mass, damping, structural, &
                             loss_factor, outputs, inputs, h_lines, line_info, rcond, info, &
                             as_memory(22_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_receptance_banded_work

  !> jf_receptance_modal in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_receptance_modal_work(trans, n_modes, n_freq, n_out, n_in, omega, stiffness, damping, loss_factor, &
                                      shapes_out, shapes_in, h, line_info, rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_receptance_modal_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_modes, n_freq, n_out, n_in
    real(c_double), target, intent(in) :: omega(n_freq), stiffness(n_modes), damping(n_modes), loss_factor(n_modes)
    real(c_double), target, intent(in) :: shapes_out(*), shapes_in(*)
    complex(c_double_complex), target, intent(inout) :: h(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    real(c_double), pointer, contiguous :: out_matrix(:, :), in_matrix(:, :)
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_receptance_modal(trans, n_modes, n_freq, n_out, n_in)
    if (info == info_good) then
      call as_matrix(trans, n_out, n_modes, shapes_out, out_matrix)
      call as_matrix(trans, n_in, n_modes, shapes_in, in_matrix)
      call as_lines(trans, n_out, n_in, n_freq, h, h_lines)
      call receptance_modal(is_transposed(trans), omega, stiffness, damping, loss_factor, out_matrix, in_matrix, &
                            h_lines, line_info, rcond, info, as_memory(16_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_receptance_modal_work

  !> jf_couple in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_couple_work(trans, n_a, n_b, n_j, n_freq, h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, &
                            work, lwork, iwork, liwork, info) bind(C, name='jf_couple_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_a, n_b, n_j, n_freq
    complex(c_double_complex), target, intent(in) :: h_a(n_a, n_a, n_freq), h_b(n_b, n_b, n_freq)
    complex(c_double_complex), target, intent(in) :: k_joint(min(n_j, n_a), min(n_j, n_a), n_freq)
    integer(ip), target, intent(in) :: dofs_a(n_j), dofs_b(n_j)
    complex(c_double_complex), target, intent(out) :: h_c(0_long + n_a + n_b, 0_long + n_a + n_b, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_couple(trans, n_a, n_b, n_j, n_freq, dofs_a, dofs_b)
    if (info == info_good) then
      call couple(is_transposed(trans), h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, info, &
                  as_memory(15_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_couple_work

  !> jf_modify in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_modify_work(trans, n, n_m, n_freq, alpha, d, dofs, gamma, line_info, rcond, work, lwork, iwork, &
                            liwork, info) bind(C, name='jf_modify_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_m, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), d(min(n_m, n), min(n_m, n), n_freq)
    integer(ip), target, intent(in) :: dofs(n_m)
    complex(c_double_complex), target, intent(out) :: gamma(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_modify(trans, n, n_m, n_freq, dofs)
    if (info == info_good) then
      call modify(is_transposed(trans), alpha, d, dofs, gamma, line_info, rcond, info, &
                  as_memory(12_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_modify_work

  !> jf_find_modification in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_find_modification_work(trans, n, n_freq, alpha, gamma, d, line_info, rcond, work, lwork, iwork, &
                                       liwork, info) bind(C, name='jf_find_modification_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), gamma(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: d(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call find_modification(is_transposed(trans), alpha, gamma, d, line_info, rcond, info, &
                             as_memory(10_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_find_modification_work

  !> jf_ismm in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_ismm_work(trans, n, n_freq, alpha, gamma, k_initial, k_joint, line_info, rcond, work, lwork, iwork, &
                          liwork, info) bind(C, name='jf_ismm_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: k_initial(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: k_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call ismm(is_transposed(trans), alpha, gamma, k_initial, k_joint, line_info, rcond, info, &
                as_memory(11_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_ismm_work

  !> jf_inverse_substructuring in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_inverse_substructuring_work(trans, n, n_freq, gamma, k_joint, line_info, rcond, work, lwork, iwork, &
                                            liwork, info) bind(C, name='jf_inverse_substructuring_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(out) :: k_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call inverse_substructuring(is_transposed(trans), gamma, k_joint, line_info, rcond, info, &
                                  as_memory(9_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_inverse_substructuring_work

  !> jf_decouple in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_decouple_work(equation, trans, n_a, n_b, n, n_freq, h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, &
                              k_joint, line_info, rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_decouple_work_')
    character(kind=c_char), intent(in) :: equation(2)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_a, n_b, n, n_freq
    complex(c_double_complex), target, intent(in) :: h_a(n_a, n_a, n_freq), h_b(n_b, n_b, n_freq)
    complex(c_double_complex), target, intent(in) :: h_c(min(n, n_a), min(n, n_a), n_freq)
    integer(ip), target, intent(in) :: dofs_j(n), dofs_k(n), dofs_r(n), dofs_s(n)
    complex(c_double_complex), target, intent(out) :: k_joint(min(n, n_a), min(n, n_a), n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_decouple(equation, trans, n_a, n_b, n, n_freq, dofs_j, dofs_k, dofs_r, dofs_s)
    if (info == info_good) then
      call decouple(lower(equation), is_transposed(trans), h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, k_joint, &
                    line_info, rcond, info, as_memory(18_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_decouple_work

  !> jf_joint_compliance in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_joint_compliance_work(trans, n, n_freq, gamma, c_joint, line_info, rcond, work, lwork, iwork, liwork, &
                                      info) bind(C, name='jf_joint_compliance_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(out) :: c_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call joint_compliance(is_transposed(trans), gamma, c_joint, line_info, rcond, info, &
                            as_memory(9_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_joint_compliance_work

  !> jf_compliance_factors in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_compliance_factors_work(trans, n, m, n_freq, gamma, transform, factors, line_info, rcond, work, lwork, &
                                        iwork, liwork, info) bind(C, name='jf_compliance_factors_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, m, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: transform(*)
    complex(c_double_complex), target, intent(inout) :: factors(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    real(c_double), pointer, contiguous :: matrix(:, :)
    complex(c_double_complex), pointer, contiguous :: factor_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_compliance_factors(trans, n, m, n_freq)
    if (info == info_good) then
      call as_matrix(trans, 2*n, m, transform, matrix)
      call as_lines(trans, 2*n, m, n_freq, factors, factor_lines)
      call compliance_factors(is_transposed(trans), gamma, matrix, factor_lines, line_info, rcond, info, &
                              as_memory(11_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_compliance_factors_work

  !> jf_compliance_covariance in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_compliance_covariance_work(trans, reciprocal, n, m, n_freq, gamma, transform, variance, covariance, &
                                           line_info, rcond, work, lwork, iwork, liwork, info) &
    bind(C, name='jf_compliance_covariance_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, m, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: transform(*), variance(m, m, n_freq)
    complex(c_double_complex), target, intent(out) :: covariance(1_long*n*max(0_ip, n), 1_long*n*max(0_ip, n), n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    real(c_double), pointer, contiguous :: matrix(:, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_compliance_covariance(trans, reciprocal, n, m, n_freq)
    if (info == info_good) then
      call as_matrix(trans, 2*n, m, transform, matrix)
      call compliance_covariance(is_transposed(trans), gamma, matrix, variance, reciprocal == 1, covariance, &
                                 line_info, rcond, info, as_memory(13_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_compliance_covariance_work

  !> jf_transform in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line.
  subroutine jf_transform_work(trans, n_out, n_in, m_out, m_in, n_freq, h, t_out, t_in, h_new, line_info, rcond, work, &
                               lwork, iwork, liwork, info) bind(C, name='jf_transform_work_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_out, n_in, m_out, m_in, n_freq
    complex(c_double_complex), target, intent(in) :: h(*)
    real(c_double), target, intent(in) :: t_out(*), t_in(*)
    complex(c_double_complex), target, intent(inout) :: h_new(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :), new_lines(:, :, :)
    real(c_double), pointer, contiguous :: out_matrix(:, :), in_matrix(:, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_transform(trans, n_out, n_in, m_out, m_in, n_freq)
    if (info == info_good) then
      call as_lines(trans, m_out, m_in, n_freq, h, h_lines)
      call as_lines(trans, n_out, n_in, n_freq, h_new, new_lines)
      call as_matrix(trans, n_out, m_out, t_out, out_matrix)
      call as_matrix(trans, n_in, m_in, t_in, in_matrix)
      call transform_receptance(is_transposed(trans), h_lines, out_matrix, in_matrix, new_lines, line_info, rcond, &
                                info, as_memory(14_ip, work, lwork, iwork, liwork))
    end if
    call release_traps(host)
  end subroutine jf_transform_work
end module jointfrf_api_work
