!> The flat API of the kernel: routines jf_* for Fortran 77, modern Fortran, C and Python alike. No algebra here.
!>
!> Every routine is one symbol, `jf_name_`, which FORTRAN 77 programs reach by CALL JF_NAME, C programs by jointfrf.h
!> and modern Fortran by this module. CHARACTER arguments are single letters without hidden lengths.
!>
!> Common to all:
!> trans       'N': a line's matrix is stored h(out, in, freq), Fortran's habit. 'T': h(in, out, freq), which is the
!>             array (freq, out, in) of C and numpy seen from Fortran. It holds for all matrices of a call, unless said
!>             otherwise.
!> n_freq      number of frequency lines; 0 is allowed and does nothing
!> line_info   shape (n_freq), status of each line: 0 good, > 0 singular (LAPACK's INFO), -1 NaN or Inf in the line,
!>             -2 its result overflows. A bad line is filled with NaN; the others are not touched by it.
!> rcond       shape (n_freq), reciprocal condition number of the worst matrix inverted in the line; 0 in a bad line, 1
!>             where nothing is inverted. In the 1-norm with |re| + |im| for the modulus, within a factor 2 of the true
!>             one; an estimate where the fast engines solve, and for large or banded matrices
!> info        0 good; -i argument i is wrong and nothing was done; > 0 number of bad lines; -1000 no memory and nothing
!>             was done; -1001 the environment variable JOINTFRF_ENGINE names an engine that is not there, likewise
!> work        of jf_NAME_work: workspace, shape (max(1, lwork)); after a query work(1) is the least lwork that will do,
!>             otherwise what the lines took of it
!> lwork       length of work; -1 here or in liwork is a query: the arguments are checked, both least lengths are given
!>             back, and nothing else is done
!> iwork       of jf_NAME_work: workspace, shape (max(1, liwork)); iwork(1) likewise
!> liwork      length of iwork
!> Integers are default ones of four bytes, jf_int in C. The library jointfrf64 has the same routines with integers of
!> eight bytes, also in arrays, for programs compiled so (-fdefault-integer-8, -i8); sizes end at 2147483647 in both.
!> Where a program is built for the other library, the compiler refuses the module or the include file, and the linker a
!> C program. A FORTRAN 77 program without the include file is refused by nothing: single numbers may come through by
!> chance, arrays and info do not.
!>
!> Time convention exp(+i w t). Input and output arrays must not overlap.
!>
!> Engines: the same sweeps by LAPACK line by line (the reference), or several lines side by side in the vector
!> registers of the processor. jf_set_engine chooses for the whole process; without it JOINTFRF_ENGINE does, by one of
!> the words auto, lapack, plain, x86-64-v2, x86-64-v3, x86-64-v4. Results agree within the rounding that the condition
!> allows.
!>
!> One line at a time: jf_NAME with n_freq = 1 does a single line. jf_NAME_work does one line or many in memory of the
!> caller: nothing is allocated, no thread is started, and LAPACK does every line, whatever engine is chosen, so that
!> results have the same bits for one line and for many, and are those of a sweep by jf_NAME with the engine lapack; a
!> single large line by jf_NAME may take threads of the BLAS, and round otherwise. Lengths do not depend on n_freq, so
!> one query serves a whole loop.
!>
!> Floating-point traps of the program are held off during a call, so that a bad line gets its code instead of a signal,
!> and numbers are rounded to the nearest, whatever the program does; afterwards traps, flags and rounding are what they
!> were.
module jointfrf
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_double_complex
  use jointfrf_api_work       ! generated from this file; what is public of it is named below
  use jointfrf_arguments, only: as_lines, as_matrix, is_transposed, lower, spread_text
  use jointfrf_bodies, only: couple_bodies
  use jointfrf_brick, only: brick_matrices, brick_quality
  use jointfrf_checks, only: check_brick_matrices, check_brick_quality, check_central_difference, &
    check_compliance_covariance, check_compliance_factors, check_couple, check_couple_bodies, check_decouple, &
    check_difference_weights, check_expect_on_joint, check_fit_diagonal_joint, check_fit_joint, check_invert, &
    check_joint_forms, check_joint_normal_equations, check_matrices, check_modify, check_monte_carlo, check_pollute, &
    check_project_on_joint, check_rational_fit, check_receptance, check_receptance_banded, &
    check_receptance_modal, check_relocate_poles, check_smooth_frfs, check_solve, check_springs, check_start_joint, &
    check_terms, check_transform, check_estimate_noise, check_line_noise, check_noise_parts
  use jointfrf_compliance, only: joint_compliance
  use jointfrf_compliance_noise, only: compliance_covariance, compliance_factors
  use jointfrf_coupling, only: couple
  use jointfrf_decoupling, only: decouple
  use jointfrf_diagonal_joint, only: diagonal_joint, fit_diagonal_joint, line_forms, lowest_diagonal_joint, &
    search_limits
  use jointfrf_dynamic_stiffness, only: receptance_banded, receptance_dense
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, engine_v2, engine_v3, engine_v4, &
    get_engine, set_engine
  use jointfrf_estimate_noise, only: estimate_noise
  use jointfrf_finite_difference, only: central_difference, difference_weights, transform_receptance
  use jointfrf_ismm, only: inverse_substructuring, ismm
  use jointfrf_joint_derivatives, only: joint_normal_equations
  use jointfrf_joint_fit, only: fit_joint, fit_options, joint_fit, set_line_descent, set_values
  use jointfrf_joint_frfs, only: joint_frfs
  use jointfrf_joint_start, only: start_joint
  use jointfrf_kinds, only: ip, long
  use jointfrf_line_noise, only: level_space, line_correlation, line_levels, prepare_levels
  use jointfrf_linear_algebra, only: invert, solve
  use jointfrf_manifold, only: expect_on_joint, joint_forms, project_on_joint
  use jointfrf_modal, only: receptance_modal
  use jointfrf_modification, only: find_modification, modify
  use jointfrf_monte_carlo, only: monte_carlo
  use jointfrf_noise, only: make_noise, pollute
  use jointfrf_noise_parts, only: likely_parts, noise_parts
  use jointfrf_rational_fit, only: rational_fit, relocate_poles
  use jointfrf_smooth_frfs, only: smooth_frfs
  use jointfrf_status, only: info_good, info_no_engine, info_no_memory, info_text, line_good, line_not_finite, &
    line_overflow, line_text
  use jointfrf_traps, only: hold_traps, host_state, release_traps
  implicit none
  private

  public :: jf_version, jf_info_text, jf_line_text
  public :: jf_set_engine, jf_get_engine
  public :: jf_invert, jf_solve
  public :: jf_receptance, jf_receptance_banded, jf_receptance_modal
  public :: jf_couple, jf_couple_bodies, jf_modify, jf_find_modification
  public :: jf_ismm, jf_inverse_substructuring, jf_decouple
  public :: jf_joint_compliance, jf_compliance_factors, jf_compliance_covariance
  public :: jf_project_with_springs, jf_expect_with_springs, jf_forms_with_springs
  public :: jf_project_on_joint, jf_expect_on_joint, jf_joint_forms, jf_fit_diagonal_joint, &
    jf_lowest_diagonal_joint, jf_joint_normal_equations
  public :: jf_start_joint, jf_fit_joint
  public :: jf_difference_weights, jf_central_difference, jf_transform
  public :: jf_pollute, jf_monte_carlo
  public :: jf_brick_matrices, jf_brick_quality
  public :: jf_rational_fit, jf_relocate_poles, jf_smooth_frfs
  public :: jf_estimate_noise, jf_line_correlation, jf_line_levels, jf_noise_parts
  public :: jf_invert_work, jf_solve_work, jf_receptance_work, jf_receptance_banded_work, jf_receptance_modal_work
  public :: jf_couple_work, jf_modify_work, jf_find_modification_work, jf_ismm_work, jf_inverse_substructuring_work
  public :: jf_decouple_work, jf_joint_compliance_work, jf_compliance_factors_work, jf_compliance_covariance_work
  public :: jf_transform_work

  !> info: 0 good; -i argument i is wrong, counted from 1; > 0 number of bad lines
  integer(ip), parameter, public :: jf_info_good = info_good
  integer(ip), parameter, public :: jf_info_no_memory = info_no_memory
  integer(ip), parameter, public :: jf_info_no_engine = info_no_engine

  !> line_info: 0 good; > 0 singular
  integer(ip), parameter, public :: jf_line_good = line_good
  integer(ip), parameter, public :: jf_line_not_finite = line_not_finite
  integer(ip), parameter, public :: jf_line_overflow = line_overflow

  !> engines; JF_ENGINE_AUTOMATIC is the widest there is
  integer(ip), parameter, public :: jf_engine_automatic = engine_automatic
  integer(ip), parameter, public :: jf_engine_lapack = engine_lapack
  integer(ip), parameter, public :: jf_engine_plain = engine_plain
  integer(ip), parameter, public :: jf_engine_x86_64_v2 = engine_v2
  integer(ip), parameter, public :: jf_engine_x86_64_v3 = engine_v3
  integer(ip), parameter, public :: jf_engine_x86_64_v4 = engine_v4

  !> No reference springs.
  real(c_double), parameter :: no_springs(0) = [real(c_double) ::]

contains

  ! Bounds are computed before sizes are checked: MIN and MAX in them keep those that will be refused from overflowing.

  !> Version of the library.
  !> major, minor, patch   the three numbers of the version
  subroutine jf_version(major, minor, patch) bind(C, name='jf_version_')
    integer(ip), intent(out) :: major, minor, patch

    major = JF_VERSION_MAJOR
    minor = JF_VERSION_MINOR
    patch = JF_VERSION_PATCH
  end subroutine jf_version

  !> What an `info` means, in words.
  !> info     as returned by any routine
  !> n_text   characters of room, 80 suffice
  !> text     shape (n_text), padded with blanks, no terminating null
  subroutine jf_info_text(info, n_text, text) bind(C, name='jf_info_text_')
    integer(ip), intent(in) :: info, n_text
    character(kind=c_char), intent(out) :: text(n_text)

    call spread_text(info_text(info), text)
  end subroutine jf_info_text

  !> What a `line_info` means, in words.
  !> line_info   that of one line
  !> n_text      as in jf_info_text
  !> text        as in jf_info_text
  subroutine jf_line_text(line_info, n_text, text) bind(C, name='jf_line_text_')
    integer(ip), intent(in) :: line_info, n_text
    character(kind=c_char), intent(out) :: text(n_text)

    call spread_text(line_text(line_info), text)
  end subroutine jf_line_text

  !> Choose the engine of all sweeps that begin after this call, in every thread.
  !> engine   0 automatic, the widest registers there are; 1 LAPACK line by line; side by side with 2 the instructions
  !>          of any processor, 3 x86-64-v2, 4 x86-64-v3 (AVX2), 5 x86-64-v4 (AVX-512)
  !> info     0 good; -1 this machine or this build does not have it, and the choice stays
  subroutine jf_set_engine(engine, info) bind(C, name='jf_set_engine_')
    integer(ip), intent(in) :: engine
    integer(ip), intent(out) :: info

    call set_engine(engine, info)
  end subroutine jf_set_engine

  !> The engine in use: never 0, but what automatic comes to.
  !> engine   as in jf_set_engine; -1 with info -1001
  !> info     0 good; -1001 the environment variable JOINTFRF_ENGINE names an engine that is not there
  subroutine jf_get_engine(engine, info) bind(C, name='jf_get_engine_')
    integer(ip), intent(out) :: engine, info

    call get_engine(engine, info)
    if (info /= info_good) engine = -1
  end subroutine jf_get_engine

  !> Inverse of every line.
  !> n           order of the matrices
  !> a           shape (n, n, n_freq); the order of storage does not matter
  !> a_inverse   shape (n, n, n_freq)
  subroutine jf_invert(n, n_freq, a, a_inverse, line_info, rcond, info) bind(C, name='jf_invert_')
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: a(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: a_inverse(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_invert(n, n_freq)
    if (info == info_good) then
      call invert(a, a_inverse, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_invert

  !> Solve A X = B on every line.
  !> n       order of the matrices
  !> n_rhs   number of right-hand sides
  !> a       shape (n, n, n_freq)
  !> b, x    shape (n, n_rhs, n_freq), or (n_rhs, n, n_freq) with trans 'T'
  subroutine jf_solve(trans, n, n_rhs, n_freq, a, b, x, line_info, rcond, info) bind(C, name='jf_solve_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_rhs, n_freq
    complex(c_double_complex), target, intent(in) :: a(n, n, n_freq), b(*)
    complex(c_double_complex), target, intent(inout) :: x(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: b_lines(:, :, :), x_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_solve(trans, n, n_rhs, n_freq)
    if (info == info_good) then
      call as_lines(trans, n, n_rhs, n_freq, b, b_lines)
      call as_lines(trans, n, n_rhs, n_freq, x, x_lines)
      call solve(is_transposed(trans), a, b_lines, x_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_solve

  !> Receptance of a model by solving, dense (zgesv). Eqs. (2.28), (2.29): ((1 + i eta) K + i H + i w C - w^2 M)^-1.
  !> n              number of DOFs of the model
  !> n_out, n_in    number of responses and of forces
  !> omega          angular frequencies, shape (n_freq), rad/s
  !> stiffness      K, shape (n, n), N/m
  !> mass           M, same shape, kg
  !> n_damping      n, or 0 for no viscous damping: damping is not read then
  !> damping        C, shape (n, n_damping), N s/m
  !> n_structural   n, or 0 for no structural damping matrix: structural is not read then
  !> structural     H, shape (n, n_structural), N/m
  !> loss_factor    eta of the whole stiffness, K (1 + i eta)
  !> outputs        DOFs of the response, shape (n_out), counted from 1
  !> inputs         DOFs of the force, shape (n_in), counted from 1
  !> h              receptance, shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T', m/N
  subroutine jf_receptance(trans, n, n_freq, n_out, n_in, omega, stiffness, mass, n_damping, damping, &
                           n_structural, structural, loss_factor, outputs, inputs, h, line_info, rcond, info) &
    bind(C, name='jf_receptance_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq, n_out, n_in, n_damping, n_structural
    real(c_double), target, intent(in) :: omega(n_freq), stiffness(n, n), mass(n, n)
    real(c_double), target, intent(in) :: damping(n, n_damping), structural(n, n_structural)
    real(c_double), intent(in) :: loss_factor
    integer(ip), target, intent(in) :: outputs(n_out), inputs(n_in)
    complex(c_double_complex), target, intent(inout) :: h(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_receptance(trans, n, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, outputs, inputs)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h, h_lines)
      call receptance_dense(is_transposed(trans), omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                            inputs, h_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_receptance

  !> Receptance as by jf_receptance of a model with band matrices, with zgbtrf and zgbtrs. LAPACK's band storage: entry
  !> (i, j) at (ku + 1 + i - j, j).
  !> trans          as above; concerns h only
  !> n              number of DOFs of the model
  !> kl, ku         number of diagonals below and above the main one
  !> n_out, n_in    number of responses and of forces
  !> omega          angular frequencies, shape (n_freq), rad/s
  !> stiffness      K, shape (kl + ku + 1, n), N/m
  !> mass           M, same shape, kg
  !> n_damping      n, or 0 for no viscous damping: damping is not read then
  !> damping        C, shape (kl + ku + 1, n_damping), N s/m
  !> n_structural   n, or 0 for no structural damping matrix: structural is not read then
  !> structural     H, shape (kl + ku + 1, n_structural), N/m
  !> loss_factor    eta of the whole stiffness, K (1 + i eta)
  !> outputs        DOFs of the response, shape (n_out), counted from 1
  !> inputs         DOFs of the force, shape (n_in), counted from 1
  !> h              receptance, shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T', m/N
  subroutine jf_receptance_banded(trans, n, kl, ku, n_freq, n_out, n_in, omega, stiffness, mass, n_damping, &
                                  damping, n_structural, structural, loss_factor, outputs, inputs, h, &
                                  line_info, rcond, info) bind(C, name='jf_receptance_banded_')
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
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: h_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_receptance_banded(trans, n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, &
                                   outputs, inputs)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h, h_lines)
      call receptance_banded(is_transposed(trans), int(kl), int(ku), omega, stiffness, mass, damping, structural, &
                             loss_factor, outputs, inputs, h_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_receptance_banded

  !> Receptance by superposition of modes: sum of phi_out phi_in / (lambda (1 + i eta) - w^2 + i w c).
  !> n_modes       number of modes, normalised to unit modal mass
  !> n_out, n_in   number of responses and of forces
  !> omega         angular frequencies, shape (n_freq), rad/s
  !> stiffness     lambda = w_r^2, shape (n_modes), (rad/s)^2
  !> damping       c = 2 zeta w_r, shape (n_modes), rad/s
  !> loss_factor   eta, shape (n_modes)
  !> shapes_out    shape (n_out, n_modes), or (n_modes, n_out) with trans 'T', 1/sqrt(kg)
  !> shapes_in     shape (n_in, n_modes), or (n_modes, n_in) with trans 'T', 1/sqrt(kg)
  !> h             receptance, shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T', m/N
  !> line_info     as above; > 0 is the mode without damping that the line hits exactly
  subroutine jf_receptance_modal(trans, n_modes, n_freq, n_out, n_in, omega, stiffness, damping, loss_factor, &
                                 shapes_out, shapes_in, h, line_info, rcond, info) bind(C, name='jf_receptance_modal_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_modes, n_freq, n_out, n_in
    real(c_double), target, intent(in) :: omega(n_freq), stiffness(n_modes), damping(n_modes), loss_factor(n_modes)
    real(c_double), target, intent(in) :: shapes_out(*), shapes_in(*)
    complex(c_double_complex), target, intent(inout) :: h(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
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
                            h_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_receptance_modal

  !> Receptance of A and B coupled by a flexible joint, all blocks. Eqs. (2.24)-(2.26), (2.42)-(2.45).
  !> n_a, n_b   number of DOFs of A and of B
  !> n_j        number of joint DOFs
  !> h_a        receptance of A, shape (n_a, n_a, n_freq), m/N (rotational rows and columns rad/N, m/(N m), rad/(N m))
  !> h_b        receptance of B, shape (n_b, n_b, n_freq)
  !> k_joint    complex joint stiffness K*, shape (n_j, n_j, n_freq), N/m; DOFs without stiffness are allowed
  !> dofs_a     joint DOFs j among those of A, shape (n_j), counted from 1, none twice
  !> dofs_b     joint DOFs k among those of B, shape (n_j), in the same order, none twice
  !> h_c        receptance of the assembly, DOFs of A, then of B, shape (n_a + n_b, n_a + n_b, n_freq)
  subroutine jf_couple(trans, n_a, n_b, n_j, n_freq, h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, &
                       info) bind(C, name='jf_couple_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_a, n_b, n_j, n_freq
    complex(c_double_complex), target, intent(in) :: h_a(n_a, n_a, n_freq), h_b(n_b, n_b, n_freq)
    complex(c_double_complex), target, intent(in) :: k_joint(min(n_j, n_a), min(n_j, n_a), n_freq)
    integer(ip), target, intent(in) :: dofs_a(n_j), dofs_b(n_j)
    complex(c_double_complex), target, intent(out) :: h_c(0_long + n_a + n_b, 0_long + n_a + n_b, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_couple(trans, n_a, n_b, n_j, n_freq, dofs_a, dofs_b)
    if (info == info_good) then
      call couple(is_transposed(trans), h_a, h_b, k_joint, dofs_a, dofs_b, h_c, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_couple

  !> Receptances of bodies connected all at once, by stiffnesses and rigidly, in loops and to the ground: dual assembly.
  !> Row m of the connections takes the motion u = x_plus - x_minus of two DOFs, of one where the other is the ground.
  !> Its connection has forces f with S f = T u: S = 1 and T = K* where it gives way, S = 0 and T = 1 where it is rigid.
  !> n_body       number of bodies
  !> n_row        number of rows of all connections
  !> n_h, n_t     numbers of a line in h and in t
  !> n_out, n_in  number of wanted responses and forces
  !> sizes        number of DOFs of each body, shape (n_body); their squares have the sum n_h
  !> ends         DOFs plus and minus of each row, shape (2, n_row), counted from 1 through all bodies; 0 for the ground
  !> connection   number of the connection of each row, shape (n_row), from 1 on without gaps; squares of how many rows
  !>              they have sum to n_t
  !> rigid        1 for a row without S, 0 for the others, shape (n_row)
  !> h            receptances of the bodies, one after the other, shape (n_h, n_freq), m/N
  !> t            T of the connections, one after the other, shape (n_t, n_freq), N/m; 1 where they are rigid
  !> outputs      responses that are wanted, shape (n_out): DOFs counted from 1, none twice, bodies in their order
  !> inputs       forces that are wanted, shape (n_in), likewise
  !> h_c          shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T'
  subroutine jf_couple_bodies(trans, n_body, n_row, n_h, n_t, n_out, n_in, n_freq, sizes, ends, connection, rigid, h, &
                              t, outputs, inputs, h_c, line_info, rcond, info) bind(C, name='jf_couple_bodies_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_body, n_row, n_h, n_t, n_out, n_in, n_freq
    integer(ip), intent(in) :: sizes(n_body), ends(2, n_row), connection(n_row), rigid(n_row)
    complex(c_double_complex), target, intent(in) :: h(n_h, n_freq), t(n_t, n_freq)
    integer(ip), intent(in) :: outputs(n_out), inputs(n_in)
    complex(c_double_complex), target, intent(inout) :: h_c(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_couple_bodies(trans, n_body, n_row, n_h, n_t, n_out, n_in, n_freq, sizes, ends, connection, rigid, &
                               outputs, inputs)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h_c, lines)
      if (is_transposed(trans)) then
        call couple_bodies(sizes, ends, connection, rigid, h, t, inputs, outputs, lines, line_info, rcond, info)
      else
        call couple_bodies(sizes, ends, connection, rigid, h, t, outputs, inputs, lines, line_info, rcond, info)
      end if
    end if
    call release_traps(host)
  end subroutine jf_couple_bodies

  !> Receptance of a locally modified structure. Eqs. (2.34)-(2.36).
  !> n       number of DOFs
  !> n_m     number of modified DOFs
  !> alpha   receptance before, shape (n, n, n_freq), m/N
  !> d       dynamic stiffness added at the modified DOFs, shape (n_m, n_m, n_freq), N/m
  !> dofs    the modified DOFs, shape (n_m), counted from 1, none twice
  !> gamma   receptance after, shape (n, n, n_freq), m/N
  subroutine jf_modify(trans, n, n_m, n_freq, alpha, d, dofs, gamma, line_info, rcond, info) bind(C, name='jf_modify_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_m, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), d(min(n_m, n), min(n_m, n), n_freq)
    integer(ip), target, intent(in) :: dofs(n_m)
    complex(c_double_complex), target, intent(out) :: gamma(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_modify(trans, n, n_m, n_freq, dofs)
    if (info == info_good) then
      call modify(is_transposed(trans), alpha, d, dofs, gamma, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_modify

  !> The modification D = alpha^-1 (alpha - gamma) gamma^-1 that turns alpha into gamma. Eqs. (2.40), (2.47).
  !> n       number of DOFs
  !> alpha   receptance before, shape (n, n, n_freq), m/N
  !> gamma   receptance after, shape (n, n, n_freq), m/N
  !> d       dynamic stiffness added, shape (n, n, n_freq), N/m
  subroutine jf_find_modification(trans, n, n_freq, alpha, gamma, d, line_info, rcond, info) &
    bind(C, name='jf_find_modification_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(n, n, n_freq), gamma(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: d(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call find_modification(is_transposed(trans), alpha, gamma, d, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_find_modification

  !> Joint stiffness by inverse structural modification, K* = K0 - D_jk. Eqs. (2.37)-(2.48).
  !> n           number of joint DOFs
  !> alpha       calculated receptance of the assembly with K0 at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> gamma       measured receptance of the assembly, same DOFs, shape (2 n, 2 n, n_freq), m/N
  !> k_initial   K0, shape (n, n, n_freq), N/m
  !> k_joint     K*, shape (n, n, n_freq), N/m
  subroutine jf_ismm(trans, n, n_freq, alpha, gamma, k_initial, k_joint, line_info, rcond, info) &
    bind(C, name='jf_ismm_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: alpha(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: k_initial(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: k_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call ismm(is_transposed(trans), alpha, gamma, k_initial, k_joint, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_ismm

  !> Joint stiffness K* = -(gamma^-1)_jk, which ISMM is where alpha was assembled through K0.
  !> n         number of joint DOFs
  !> gamma     measured receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> k_joint   K*, shape (n, n, n_freq), N/m
  subroutine jf_inverse_substructuring(trans, n, n_freq, gamma, k_joint, line_info, rcond, info) &
    bind(C, name='jf_inverse_substructuring_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(out) :: k_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call inverse_substructuring(is_transposed(trans), gamma, k_joint, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_inverse_substructuring

  !> Joint stiffness by FRF decoupling, by one of four equations. Eqs. (2.53)-(2.56).
  !> equation   shape (2), letters of the responding and of the excited point: 'rr' (2.53), 'rs' (2.54), 'sr' (2.55),
  !>            'ss' (2.56)
  !> n_a, n_b   number of DOFs of A and of B
  !> n          number of joint DOFs, and of internal DOFs at each point used
  !> h_a        receptance of A, shape (n_a, n_a, n_freq), m/N
  !> h_b        receptance of B, shape (n_b, n_b, n_freq), m/N
  !> h_c        measured receptance of the assembly, first point by second point, shape (n, n, n_freq), m/N
  !> dofs_j     joint DOFs among those of A, shape (n), counted from 1
  !> dofs_k     joint DOFs among those of B, shape (n), in the same order
  !> dofs_r     internal DOFs of A, shape (n); must be valid only where the equation names r
  !> dofs_s     internal DOFs of B, shape (n); must be valid only where the equation names s
  !> k_joint    K*, shape (n, n, n_freq), N/m
  subroutine jf_decouple(equation, trans, n_a, n_b, n, n_freq, h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, &
                         k_joint, line_info, rcond, info) bind(C, name='jf_decouple_')
    character(kind=c_char), intent(in) :: equation(2)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_a, n_b, n, n_freq
    complex(c_double_complex), target, intent(in) :: h_a(n_a, n_a, n_freq), h_b(n_b, n_b, n_freq)
    complex(c_double_complex), target, intent(in) :: h_c(min(n, n_a), min(n, n_a), n_freq)
    integer(ip), target, intent(in) :: dofs_j(n), dofs_k(n), dofs_r(n), dofs_s(n)
    complex(c_double_complex), target, intent(out) :: k_joint(min(n, n_a), min(n, n_a), n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_decouple(equation, trans, n_a, n_b, n, n_freq, dofs_j, dofs_k, dofs_r, dofs_s)
    if (info == info_good) then
      call decouple(lower(equation), is_transposed(trans), h_a, h_b, h_c, dofs_j, dofs_k, dofs_r, dofs_s, k_joint, &
                    line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_decouple

  !> Joint compliance C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj = K*^-1, without model or first estimate.
  !> n         number of joint DOFs
  !> gamma     receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> c_joint   C, shape (n, n, n_freq), m/N
  subroutine jf_joint_compliance(trans, n, n_freq, gamma, c_joint, line_info, rcond, info) &
    bind(C, name='jf_joint_compliance_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(out) :: c_joint(n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_matrices(trans, n, n_freq)
    if (info == info_good) then
      call joint_compliance(is_transposed(trans), gamma, c_joint, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_joint_compliance

  !> How a small change of the measured FRFs moves the joint compliance, dC = U dh V to first order, gamma = T h T^T.
  !> n            number of joint DOFs
  !> m            number of measured points and directions
  !> gamma        receptance about which is linearised, shape (2 n, 2 n, n_freq), m/N
  !> transform    T, shape (2 n, m), or (m, 2 n) with trans 'T'; the unit matrix where gamma itself was measured
  !> factors      U above V^T, shape (2 n, m, n_freq), or (m, 2 n, n_freq) with trans 'T'
  subroutine jf_compliance_factors(trans, n, m, n_freq, gamma, transform, factors, line_info, rcond, info) &
    bind(C, name='jf_compliance_factors_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, m, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: transform(*)
    complex(c_double_complex), target, intent(inout) :: factors(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    real(c_double), pointer, contiguous :: matrix(:, :)
    complex(c_double_complex), pointer, contiguous :: factor_lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_compliance_factors(trans, n, m, n_freq)
    if (info == info_good) then
      call as_matrix(trans, 2*n, m, transform, matrix)
      call as_lines(trans, 2*n, m, n_freq, factors, factor_lines)
      call compliance_factors(is_transposed(trans), gamma, matrix, factor_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_compliance_factors

  !> Covariance of the entries of the joint compliance from the noise of the measured FRFs, to first order.
  !> The noise is circular and independent between the measured entries; gamma = T h T^T.
  !> reciprocal   0: h used as measured; 1: h made reciprocal, (h + h^T)/2
  !> n            number of joint DOFs
  !> m            number of measured points and directions
  !> gamma        receptance about which is linearised, shape (2 n, 2 n, n_freq), m/N
  !> transform    T, shape (2 n, m), or (m, 2 n) with trans 'T'; the unit matrix where gamma itself was measured
  !> variance     E|e|^2 of the measured FRFs, shape (m, m, n_freq), (m/N)^2
  !> covariance   shape (n^2, n^2, n_freq), (m/N)^2; entry ab of C counts as C lies in memory
  subroutine jf_compliance_covariance(trans, reciprocal, n, m, n_freq, gamma, transform, variance, covariance, &
                                      line_info, rcond, info) bind(C, name='jf_compliance_covariance_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, m, n_freq
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: transform(*), variance(m, m, n_freq)
    complex(c_double_complex), target, intent(out) :: covariance(1_long*n*max(0_ip, n), 1_long*n*max(0_ip, n), n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    real(c_double), pointer, contiguous :: matrix(:, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_compliance_covariance(trans, reciprocal, n, m, n_freq)
    if (info == info_good) then
      call as_matrix(trans, 2*n, m, transform, matrix)
      call compliance_covariance(is_transposed(trans), gamma, matrix, variance, reciprocal == 1, covariance, &
                                 line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_compliance_covariance

  !> The FRFs nearest to measured ones that fit a joint of compliance C, on every line.
  !> Such FRFs are gamma_jj = H, gamma_jk = H T, gamma_kj = T' H, gamma_kk = T' H T + C T with T = 1 - M C, T' = 1 - C M
  !> and two free matrices H and M. They are found by Levenberg-Marquardt steps, in lanes whatever engine is chosen.
  !> reciprocal     1: C, H and M are symmetric, and of gamma the upper triangle is read; 0: they are general
  !> n              number of joint DOFs, at least 1
  !> n_correlated   n_entry, or 0 for no whitening: whitening is not read then. n_entry is the number of entries of
  !>                gamma that are read, n (2 n + 1) or 4 n^2.
  !> steps          at most
  !> least_gain     a line has arrived when a step lowers its squares by no more
  !> gamma          FRFs at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> inverse_std    1/sqrt(E|e|^2) of the noise e of gamma, shape (2 n, 2 n, n_freq), N/m; 0 where an entry is not used,
  !>                and then it is not read
  !> whitening      lower triangular matrix that makes the entries, divided by their deviations, uncorrelated,
  !>                shape (n_correlated, n_correlated, n_freq). Entries of gamma count row by row, with reciprocal 1
  !>                from the diagonal on.
  !> c_joint        C, shape (n, n, n_freq), m/N
  !> free_h         H, shape (n, n, n_freq), m/N: where to begin, then what was found; symmetric with reciprocal 1
  !> free_m         M, shape (n, n, n_freq), N/m: likewise
  !> squares        weighted squares of the distance, shape (n_freq)
  !> line_info      as above; -1 also for a weight that is negative
  subroutine jf_project_on_joint(trans, reciprocal, n, n_correlated, n_freq, steps, least_gain, gamma, inverse_std, &
                                 whitening, c_joint, free_h, free_m, squares, line_info, info) &
    bind(C, name='jf_project_on_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq, steps
    real(c_double), intent(in) :: least_gain
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: c_joint(n, n, n_freq)
    complex(c_double_complex), target, intent(inout) :: free_h(n, n, n_freq), free_m(n, n, n_freq)
    real(c_double), target, intent(out) :: squares(n_freq)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_project_on_joint(trans, reciprocal, n, n_correlated, n_freq, steps, least_gain)
    if (info == info_good) then
      call project_on_joint(is_transposed(trans), reciprocal == 1, steps, least_gain, gamma, inverse_std, &
                            whitening, c_joint, free_h, free_m, squares, line_info, info, no_springs)
    end if
    call release_traps(host)
  end subroutine jf_project_on_joint

  !> The expected FRFs of a joint of compliance C near ones that fit it, where entries of M are normal about 0.
  !> FRFs show M by the product M C alone: those nearest to FRFs with errors have an M that grows as C shrinks. The mean
  !> of M, and of the H that belongs to it, is the least squares of M over its deviations and of the change of the FRFs
  !> over their error, by one Gauss-Newton step.
  !> reciprocal, n, n_correlated, inverse_std, whitening, c_joint    as in jf_project_on_joint
  !> share          error of the FRFs that H and M come from over the noise that inverse_std says, > 0
  !> spread_m       standard deviations of the entries of M, shape (n, n, n_freq), > 0, N/m; with reciprocal 1 the upper
  !>                triangle counts
  !> free_h         H, shape (n, n, n_freq), m/N: of the FRFs that fit the joint, then expected
  !> free_m         M, shape (n, n, n_freq), N/m: likewise
  !> line_info      as in jf_project_on_joint
  subroutine jf_expect_on_joint(trans, reciprocal, n, n_correlated, n_freq, share, spread_m, inverse_std, whitening, &
                                c_joint, free_h, free_m, line_info, info) bind(C, name='jf_expect_on_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq
    real(c_double), intent(in) :: share
    real(c_double), target, intent(in) :: spread_m(n, n, n_freq)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: c_joint(n, n, n_freq)
    complex(c_double_complex), target, intent(inout) :: free_h(n, n, n_freq), free_m(n, n, n_freq)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_expect_on_joint(trans, reciprocal, n, n_correlated, n_freq, share, spread_m)
    if (info == info_good) then
      call expect_on_joint(is_transposed(trans), reciprocal == 1, share, spread_m, inverse_std, whitening, &
                           c_joint, free_h, free_m, line_info, info, no_springs)
    end if
    call release_traps(host)
  end subroutine jf_expect_on_joint

  !> What measured FRFs say of the compliance C of a joint near FRFs that fit it, H and M being free.
  !> With d the change of the free entries of C, the weighted squares of the residual, least over H and M, are
  !> s - 2 Re(d^H p) + d^H W d near that point. Free entries are all n^2, row by row, or with reciprocal 1 the
  !> n (n + 1)/2 of the upper triangle.
  !> reciprocal, n, n_correlated, inverse_std, whitening, c_joint    as in jf_project_on_joint
  !> n_free         number of free entries of C
  !> n_target       number of FRFs whose gradients are wanted, at least 1
  !> gamma          measured FRFs at DOFs j, then k, shape (2 n, 2 n, n_freq, n_target), m/N
  !> free_h         H of the point, shape (n, n, n_freq), m/N
  !> free_m         M of the point, shape (n, n, n_freq), N/m
  !> information    W, shape (n_free, n_free, n_freq), (N/m)^2
  !> gradient       p, shape (n_free, n_freq, n_target), N/m
  !> squares        s, shape (n_freq, n_target)
  !> line_info      as in jf_project_on_joint
  subroutine jf_joint_forms(trans, reciprocal, n, n_free, n_correlated, n_freq, n_target, gamma, inverse_std, &
                            whitening, c_joint, free_h, free_m, information, gradient, squares, line_info, info) &
    bind(C, name='jf_joint_forms_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_free, n_correlated, n_freq, n_target
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq, n_target)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: c_joint(n, n, n_freq), free_h(n, n, n_freq), free_m(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: information(n_free, n_free, n_freq)
    complex(c_double_complex), target, intent(out) :: gradient(n_free, n_freq, n_target)
    real(c_double), target, intent(out) :: squares(n_freq, n_target)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_joint_forms(trans, reciprocal, n, n_free, n_correlated, n_freq, n_target)
    if (info == info_good) then
      call joint_forms(is_transposed(trans), reciprocal == 1, .false., gamma, inverse_std, whitening, c_joint, free_h, &
                       free_m, information, gradient, squares, line_info, info, no_springs)
    end if
    call release_traps(host)
  end subroutine jf_joint_forms

  !> The FRFs nearest to measured ones that fit a joint in parallel with reference springs, on every line.
  !> With the springs Z, a diagonal matrix, and R = (K* + Z)^-1 such FRFs are gamma_jj = H, gamma_jk = H F,
  !> gamma_kj = F' H, gamma_kk = F' H F + R A with A = 1 - Q R, A' = 1 - R Q, F = (1 - Z R) A, F' = A' (1 - R Z) and two
  !> free matrices H and Q. The form is regular for rigid DOFs, R = 0, and for free ones, R = 1/Z. With Z = 0 it is the
  !> form of jf_project_on_joint, with R for C and Q for M.
  !> reciprocal, n, n_correlated, steps, least_gain, gamma, inverse_std, whitening    as in jf_project_on_joint
  !> spring         Z, shape (n), >= 0, N/m
  !> r_joint        R, shape (n, n, n_freq), m/N
  !> free_h         H, shape (n, n, n_freq), m/N: where to begin, then the result; symmetric with reciprocal 1
  !> free_q         Q, shape (n, n, n_freq), N/m: likewise
  !> squares        weighted squares of the distance, shape (n_freq)
  !> line_info      as in jf_project_on_joint
  subroutine jf_project_with_springs(trans, reciprocal, n, n_correlated, n_freq, steps, least_gain, spring, gamma, &
                                     inverse_std, whitening, r_joint, free_h, free_q, squares, line_info, info) &
    bind(C, name='jf_project_with_springs_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq, steps
    real(c_double), intent(in) :: least_gain, spring(n)
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: r_joint(n, n, n_freq)
    complex(c_double_complex), target, intent(inout) :: free_h(n, n, n_freq), free_q(n, n, n_freq)
    real(c_double), target, intent(out) :: squares(n_freq)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_project_on_joint(trans, reciprocal, n, n_correlated, n_freq, steps, least_gain)
    if (info == info_good) info = check_springs(spring, -8_ip)
    if (info == info_good) then
      call project_on_joint(is_transposed(trans), reciprocal == 1, steps, least_gain, gamma, inverse_std, &
                            whitening, r_joint, free_h, free_q, squares, line_info, info, spring)
    end if
    call release_traps(host)
  end subroutine jf_project_with_springs

  !> The expected FRFs of a joint in parallel with reference springs near FRFs that fit it, if M is normal about 0.
  !> M = (Y_B + K*^-1)^-1 = Z (1 - R Z) + (1 - Z R) Q (1 - R Z), where Y_B is the receptance of side k alone; of 1 - Z R
  !> the diagonal is taken. Else as jf_expect_on_joint.
  !> reciprocal, n, n_correlated, inverse_std, whitening    as in jf_project_on_joint
  !> share, spread_m    as in jf_expect_on_joint
  !> spring, r_joint    as in jf_project_with_springs
  !> free_h         H, shape (n, n, n_freq), m/N: of the FRFs that fit the joint, then expected
  !> free_q         Q, shape (n, n, n_freq), N/m: likewise
  !> line_info      as in jf_project_on_joint
  subroutine jf_expect_with_springs(trans, reciprocal, n, n_correlated, n_freq, share, spread_m, spring, inverse_std, &
                                    whitening, r_joint, free_h, free_q, line_info, info) &
    bind(C, name='jf_expect_with_springs_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq
    real(c_double), intent(in) :: share
    real(c_double), target, intent(in) :: spread_m(n, n, n_freq)
    real(c_double), intent(in) :: spring(n)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: r_joint(n, n, n_freq)
    complex(c_double_complex), target, intent(inout) :: free_h(n, n, n_freq), free_q(n, n, n_freq)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_expect_on_joint(trans, reciprocal, n, n_correlated, n_freq, share, spread_m)
    if (info == info_good) info = check_springs(spring, -8_ip)
    if (info == info_good) then
      call expect_on_joint(is_transposed(trans), reciprocal == 1, share, spread_m, inverse_std, whitening, &
                           r_joint, free_h, free_q, line_info, info, spring)
    end if
    call release_traps(host)
  end subroutine jf_expect_with_springs

  !> Information of measured FRFs on the compliance R of a joint in parallel with reference springs, near FRFs that fit
  !> it, with H and Q free. The form is that of jf_joint_forms, d being the change of the free entries of R.
  !> reciprocal, n, n_correlated, inverse_std, whitening    as in jf_project_on_joint
  !> n_free, n_target, gamma    as in jf_joint_forms
  !> spring, r_joint    as in jf_project_with_springs
  !> free_h         H of the point, shape (n, n, n_freq), m/N
  !> free_q         Q of the point, shape (n, n, n_freq), N/m
  !> information    W, shape (n_free, n_free, n_freq), (N/m)^2
  !> gradient       p, shape (n_free, n_freq, n_target), N/m
  !> squares        s, shape (n_freq, n_target)
  !> line_info      as in jf_project_on_joint
  subroutine jf_forms_with_springs(trans, reciprocal, n, n_free, n_correlated, n_freq, n_target, spring, gamma, &
                                   inverse_std, whitening, r_joint, free_h, free_q, information, gradient, squares, &
                                   line_info, info) &
    bind(C, name='jf_forms_with_springs_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_free, n_correlated, n_freq, n_target
    real(c_double), intent(in) :: spring(n)
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq, n_target)
    real(c_double), target, intent(in) :: inverse_std(2_long*n, 2_long*n, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    complex(c_double_complex), target, intent(in) :: r_joint(n, n, n_freq), free_h(n, n, n_freq), free_q(n, n, n_freq)
    complex(c_double_complex), target, intent(out) :: information(n_free, n_free, n_freq)
    complex(c_double_complex), target, intent(out) :: gradient(n_free, n_freq, n_target)
    real(c_double), target, intent(out) :: squares(n_freq, n_target)
    integer(ip), target, intent(out) :: line_info(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_joint_forms(trans, reciprocal, n, n_free, n_correlated, n_freq, n_target)
    if (info == info_good) info = check_springs(spring, -8_ip)
    if (info == info_good) then
      call joint_forms(is_transposed(trans), reciprocal == 1, .false., gamma, inverse_std, whitening, r_joint, free_h, &
                       free_q, information, gradient, squares, line_info, info, spring)
    end if
    call release_traps(host)
  end subroutine jf_forms_with_springs

  !> The joint without cross terms that minimises quadratic forms of its compliance, as jf_joint_forms finds them.
  !> The squares are the sum over the lines of s - 2 Re(d^H p) + d^H W d, where d = C - C0 has an entry for each DOF:
  !> C = a/(1 + i (eta + w tau)), or a/(1 + i a (h + w c)), so that k = 1/a and a rigid DOF has a = 0. By
  !> Levenberg-Marquardt steps, in lanes whatever engine is chosen.
  !> by_rate       1: damping is given by its rates eta = h/k and tau = c/k, s; 0: by h, N/m, and c, N s/m
  !> n             number of joint DOFs, 1 to 1000
  !> n_par         number of parameters, n to 3 n
  !> steps         at most
  !> held          the parameter that keeps its value, counted from 1; 0 for none
  !> least_gain    the search ends when two steps in a row lower the squares by no more; >= 0
  !> dofs          the DOF of each parameter, counted from 1, shape (n_par)
  !> kinds         what it is, shape (n_par): 0 a, m/N, which every DOF has; 1 eta or h; 2 tau or c. None twice.
  !> lower         least value of each parameter, shape (n_par)
  !> upper         largest value, shape (n_par)
  !> omega         angular frequencies, shape (n_freq), rad/s
  !> c_joint       C0, shape (n, n_freq), m/N
  !> information   W, shape (n, n, n_freq), (N/m)^2; its upper triangle is read
  !> gradient      p, shape (n, n_freq), N/m
  !> squares       s, shape (n_freq)
  !> x             the parameters, shape (n_par): where to begin, then what was found
  !> normal        Re(J^H W J) summed over the lines, J the derivative of C by the parameters: half the second
  !>               derivative of the squares, shape (n_par, n_par)
  !> descent       Re(J^H (p - W d)), minus half the first derivative, shape (n_par)
  !> cost          the squares; +Inf, and x as it was, where they are not finite to begin with
  !> info          0, -i, -1000 as above
  subroutine jf_fit_diagonal_joint(trans, by_rate, n, n_par, n_freq, steps, held, least_gain, dofs, kinds, lower, &
                                   upper, omega, c_joint, information, gradient, squares, x, normal, descent, &
                                   cost, info) bind(C, name='jf_fit_diagonal_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: by_rate, n, n_par, n_freq, steps, held, dofs(n_par), kinds(n_par)
    real(c_double), intent(in) :: least_gain, lower(n_par), upper(n_par)
    real(c_double), target, intent(in) :: omega(n_freq), squares(n_freq)
    complex(c_double_complex), target, intent(in) :: c_joint(n, n_freq), information(n, n, n_freq), gradient(n, n_freq)
    real(c_double), intent(inout) :: x(n_par)
    real(c_double), intent(out) :: normal(n_par, n_par), descent(n_par), cost
    integer(ip), intent(out) :: info
    type(diagonal_joint) :: joint
    type(line_forms) :: forms
    type(search_limits) :: limits
    type(host_state) :: host

    call hold_traps(host)
    info = check_fit_diagonal_joint(trans, by_rate, n, n_par, n_freq, steps, held, least_gain, dofs, kinds, lower, &
                                    upper)
    if (info == info_good) call set_search(by_rate, n, steps, held, least_gain, dofs, kinds, lower, upper, joint, &
                                           limits, info)
    if (info == info_good) then
      forms = line_forms(is_transposed(trans), omega, c_joint, information, gradient, squares)
      call fit_diagonal_joint(joint, forms, limits, x, normal, descent, cost, info)
    end if
    call release_traps(host)
  end subroutine jf_fit_diagonal_joint

  !> The same, also from other starts: where a DOF ends rigid, or its damping near its limit, from no damping and from
  !> some. At a = 0 nothing moves a rate any more, not even from the wrong sign of damping.
  !> by_rate, n, n_par, steps, held, least_gain, lower, upper    as in jf_fit_diagonal_joint
  !> omega, c_joint, information, gradient, squares    as in jf_fit_diagonal_joint
  !> dofs          the DOF of each parameter, counted from 1, shape (n_par); those of the compliances come first, in
  !>               their order
  !> kinds         as in jf_fit_diagonal_joint
  !> x, normal, descent, cost, info    as in jf_fit_diagonal_joint
  subroutine jf_lowest_diagonal_joint(trans, by_rate, n, n_par, n_freq, steps, held, least_gain, dofs, kinds, lower, &
                                      upper, omega, c_joint, information, gradient, squares, x, normal, descent, &
                                      cost, info) bind(C, name='jf_lowest_diagonal_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: by_rate, n, n_par, n_freq, steps, held, dofs(n_par), kinds(n_par)
    real(c_double), intent(in) :: least_gain, lower(n_par), upper(n_par)
    real(c_double), target, intent(in) :: omega(n_freq), squares(n_freq)
    complex(c_double_complex), target, intent(in) :: c_joint(n, n_freq), information(n, n, n_freq), gradient(n, n_freq)
    real(c_double), intent(inout) :: x(n_par)
    real(c_double), intent(out) :: normal(n_par, n_par), descent(n_par), cost
    integer(ip), intent(out) :: info
    type(diagonal_joint) :: joint
    type(line_forms) :: forms
    type(search_limits) :: limits
    type(host_state) :: host

    call hold_traps(host)
    info = check_fit_diagonal_joint(trans, by_rate, n, n_par, n_freq, steps, held, least_gain, dofs, kinds, lower, &
                                    upper)
    if (info == info_good) info = check_terms(n, dofs, kinds, -9_ip, -10_ip)
    if (info == info_good) call set_search(by_rate, n, steps, held, least_gain, dofs, kinds, lower, upper, joint, &
                                           limits, info)
    if (info == info_good) then
      forms = line_forms(is_transposed(trans), omega, c_joint, information, gradient, squares)
      call lowest_diagonal_joint(joint, forms, limits, x, normal, descent, cost, info)
    end if
    call release_traps(host)
  end subroutine jf_lowest_diagonal_joint

  !> Coordinates from which the fit of a joint without cross terms may begin, from the compliance of smooth FRFs.
  !> R = (C^-1 + Z)^-1 is the compliance of the joint in parallel with reference springs Z. On every line C and, to
  !> first order, the variance of R follow from gamma; lines on which noise hides gamma_jk count little.
  !> reciprocal     as in jf_project_on_joint
  !> n              number of joint DOFs, 1 to 1000
  !> n_par          number of parameters, n to 3 n
  !> n_row          2 n; or n_entry of jf_project_on_joint for packed FRFs: the entries that are read, row by row
  !> n_column       2 n; or 1 for packed FRFs
  !> dofs           the DOF of each parameter, counted from 1, shape (n_par); those of the compliances come first, in
  !>                their order
  !> kinds          what it is, shape (n_par): 0 a = 1/(k + z), m/N, first for every DOF; 1 eta = h a; 2 tau = c a, s.
  !>                None twice.
  !> omega          angular frequencies, shape (n_freq), rad/s
  !> spring         Z, shape (n), >= 0, N/m
  !> smooth         smooth FRFs at DOFs j, then k, shape (n_row, n_column, n_freq), m/N
  !> inverse_std    1/sqrt(E|e|^2) of the noise e of the measured FRFs, shape (n_row, n_column, n_freq), N/m; 0 where an
  !>                entry is not used
  !> fitted         least squares of the diagonal of R, shape (n_par); 0 where no line gives it
  !> undamped       its mean, no damping, shape (n_par)
  !> info           0, -i, -1000 as above
  subroutine jf_start_joint(trans, reciprocal, n, n_par, n_row, n_column, n_freq, dofs, kinds, omega, spring, smooth, &
                            inverse_std, fitted, undamped, info) bind(C, name='jf_start_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_par, n_row, n_column, n_freq, dofs(n_par), kinds(n_par)
    real(c_double), target, intent(in) :: omega(n_freq)
    real(c_double), intent(in) :: spring(n)
    complex(c_double_complex), target, intent(in) :: smooth(n_row, n_column, n_freq)
    real(c_double), target, intent(in) :: inverse_std(n_row, n_column, n_freq)
    real(c_double), intent(out) :: fitted(n_par), undamped(n_par)
    integer(ip), intent(out) :: info
    type(diagonal_joint) :: joint
    type(joint_frfs) :: frfs
    real(c_double), allocatable :: starts(:, :)
    type(host_state) :: host
    integer :: stat

    call hold_traps(host)
    info = check_start_joint(trans, reciprocal, n, n_par, n_row, n_column, n_freq, dofs, kinds, omega, spring)
    if (info == info_good) call set_terms(n, dofs, kinds, joint, info)
    if (info == info_good) then
      allocate (starts(n_par, 2), stat=stat)
      if (stat /= 0) info = info_no_memory
    end if
    if (info == info_good) call set_frfs(is_transposed(trans), reciprocal == 1, n, n_row, n_column, omega, smooth, &
                                         inverse_std, frfs, info)
    if (info == info_good) then
      call start_joint(joint, frfs, spring, starts(:, 1), starts(:, 2), info)
    end if
    if (info == info_good) then
      fitted = starts(:, 1)
      undamped = starts(:, 2)
    end if
    call release_traps(host)
  end subroutine jf_start_joint

  !> The joint without cross terms that fits FRFs at the joint best: stiffnesses, damping, and their covariance.
  !> Maximum likelihood for FRFs with independent noise of known size: smooth FRFs are projected on those that fit the
  !> present joint, measured ones are linearised there, the sum over all lines is minimised, and so on until the joint
  !> moves by less than a share of its standard error. Coordinates are a = 1/(k + z) with reference springs z, which are
  !> regular for rigid and free DOFs, and the rates eta = h a and tau = c a. In lanes whatever engine is chosen; lines
  !> are shared among threads, and results do not depend on their number.
  !> reciprocal, n_correlated    as in jf_project_on_joint
  !> n, n_par, n_row, n_column, dofs, kinds    as in jf_start_joint
  !> start          0: springs, x, H and Q are found; 1: spring and x are given; 2: free_h and free_q as well
  !> patience       linearisations after which a fit far from the data ends, for example 8
  !> flexible       1: the sides may be flexible between channels and joint, and no joint need be near all lines; 0:
  !>                they are rigid
  !> farthest       a line whose distance exceeds this is not used; 0: 3 n^2, or the distance that noise exceeds on any
  !>                line with probability 0.001 if it is larger
  !> omega          angular frequencies, shape (n_freq), rad/s
  !> smooth         smooth FRFs at DOFs j, then k, shape (n_row, n_column, n_freq), m/N; the measured ones where they
  !>                were not smoothed
  !> measured       measured FRFs, shape (n_row, n_column, n_freq), m/N
  !> inverse_std    as in jf_start_joint
  !> whitening      as in jf_project_on_joint
  !> spring         z, shape (n), > 0, N/m: given, or with start 0 as stiff as the structure
  !> x              coordinates, shape (n_par): where to begin, then what was found
  !> free_h         H of the FRFs that fit the joint, nearest to the smooth ones, shape (n, n, n_freq), m/N; with
  !>                start 2 where to begin
  !> free_q         Q, shape (n, n, n_freq), N/m: likewise
  !> values         stiffness k = 1/a - z, N/m, damping h = eta/a, N/m, and c = tau/a, N s/m, shape (n_par); infinite
  !>                for a rigid DOF
  !> covariance     of the values, for independent noise between lines, shape (n_par, n_par)
  !> normal         Re(J^H W J) summed over the lines, shape (n_par, n_par): half the information on the coordinates
  !> descent        Re(J^H (p - W d)), shape (n_par): 0 but for coordinates at their limits
  !> cost           squares of the residual; their mean is 1 for each equation
  !> equations      complex equations of the lines that are used
  !> line_descent   descent of each line, shape (n_par, n_freq): for a covariance that is robust, N^-1 G N^-1 with the
  !>                sum N of normal and the sum G of the products of descents
  !> distance       squares between the smooth FRFs and those that fit the joint, shape (n_freq)
  !> used           1 for a line that is used, 0 for another, shape (n_freq)
  !> c_joint        entries of R about which was linearised last, shape (n, n_freq), m/N
  !> information    W of the quadratic forms s - 2 Re(d^H p) + d^H W d of the diagonal of R = c_joint + d, shape
  !>                (n, n, n_freq); forms are zero on lines that are not used
  !> gradient       p, shape (n, n_freq)
  !> squares        s, shape (n_freq)
  !> iterations     linearisations
  !> converged      1: the joint did not move any more; 0: it did
  subroutine jf_fit_joint(trans, reciprocal, n, n_par, n_row, n_column, n_correlated, n_freq, start, patience, &
                          flexible, farthest, dofs, kinds, omega, smooth, measured, inverse_std, whitening, spring, &
                          x, free_h, free_q, values, covariance, normal, descent, cost, equations, line_descent, &
                          distance, used, c_joint, information, gradient, squares, iterations, converged, line_info, &
                          info) &
    bind(C, name='jf_fit_joint_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_par, n_row, n_column, n_correlated, n_freq, start, patience, flexible
    real(c_double), intent(in) :: farthest
    integer(ip), intent(in) :: dofs(n_par), kinds(n_par)
    real(c_double), target, intent(in) :: omega(n_freq)
    complex(c_double_complex), target, intent(in) :: smooth(n_row, n_column, n_freq)
    complex(c_double_complex), target, intent(in) :: measured(n_row, n_column, n_freq)
    real(c_double), target, intent(in) :: inverse_std(n_row, n_column, n_freq)
    real(c_double), target, intent(in) :: whitening(n_correlated, n_correlated, n_freq)
    real(c_double), intent(inout) :: spring(n), x(n_par)
    complex(c_double_complex), intent(inout) :: free_h(n, n, n_freq), free_q(n, n, n_freq)
    real(c_double), intent(out) :: values(n_par), covariance(n_par, n_par), normal(n_par, n_par), descent(n_par)
    real(c_double), intent(out) :: cost, equations, line_descent(n_par, n_freq), distance(n_freq)
    integer(ip), intent(out) :: used(n_freq)
    complex(c_double_complex), intent(out) :: c_joint(n, n_freq), information(n, n, n_freq), gradient(n, n_freq)
    real(c_double), intent(out) :: squares(n_freq)
    integer(ip), intent(out) :: iterations, converged, line_info(n_freq), info
    type(diagonal_joint) :: joint
    type(joint_frfs) :: frfs
    type(fit_options) :: options
    type(joint_fit) :: fit
    type(host_state) :: host

    call hold_traps(host)
    info = check_fit_joint(trans, reciprocal, n, n_par, n_row, n_column, n_correlated, n_freq, start, patience, &
                           flexible, farthest, dofs, kinds, omega, spring, x)
    if (info == info_good) call set_terms(n, dofs, kinds, joint, info)
    if (info == info_good) call set_frfs(is_transposed(trans), reciprocal == 1, n, n_row, n_column, omega, smooth, &
                                         inverse_std, frfs, info)
    if (info == info_good) then
      frfs%measured(1:size(frfs%smooth, 1), 1:n_freq) => measured
      frfs%whitening => whitening
      options%patience = int(patience)
      options%farthest = farthest
      options%flexible = flexible == 1
      options%start = int(start)
      call fit_joint(joint, frfs, options, spring, x, free_h, free_q, fit, info)
    end if
    if (info >= info_good) then
      spring = fit%spring
      x = fit%found%x
      free_h = fit%h
      free_q = fit%q
      call set_values(joint, spring, x, fit%found%covariance, values, covariance)
      normal = fit%found%normal
      descent = fit%found%descent
      cost = fit%found%cost
      equations = fit%equations
      call set_line_descent(joint, frfs, fit, line_descent)
      distance = fit%distance
      used = merge(1_ip, 0_ip, fit%used)
      c_joint = fit%c_joint
      information = fit%information
      gradient = fit%gradient
      squares = fit%squares
      iterations = int(fit%iterations, ip)
      converged = merge(1_ip, 0_ip, fit%converged)
      line_info = fit%line_info
    end if
    call release_traps(host)
  end subroutine jf_fit_joint

  !> FRFs at a joint in the caller's memory.
  subroutine set_frfs(transposed, reciprocal, n, n_row, n_column, omega, smooth, inverse_std, frfs, info)
    logical, intent(in) :: transposed, reciprocal
    integer(ip), intent(in) :: n, n_row, n_column
    real(c_double), contiguous, target, intent(in) :: omega(:), inverse_std(:, :, :)
    complex(c_double_complex), contiguous, target, intent(in) :: smooth(:, :, :)
    type(joint_frfs), intent(inout) :: frfs
    integer(ip), intent(out) :: info
    integer :: stat

    frfs%transposed = transposed
    frfs%reciprocal = reciprocal
    frfs%n_row = int(n_row)
    frfs%n_column = int(n_column)
    frfs%omega => omega
    frfs%smooth(1:n_row*n_column, 1:size(omega)) => smooth
    frfs%inverse_std(1:n_row*n_column, 1:size(omega)) => inverse_std
    call frfs%set_places(int(n), stat)
    info = merge(info_good, info_no_memory, stat == 0)
  end subroutine set_frfs

  !> Terms of a joint without cross terms.
  subroutine set_terms(n, dofs, kinds, joint, info)
    integer(ip), intent(in) :: n, dofs(:), kinds(:)
    type(diagonal_joint), intent(inout) :: joint
    integer(ip), intent(out) :: info
    integer :: stat

    allocate (joint%dof(size(dofs)), joint%kind(size(dofs)), stat=stat)
    info = merge(info_good, info_no_memory, stat == 0)
    if (stat /= 0) return
    joint%n = int(n)
    joint%dof(:) = int(dofs)
    joint%kind(:) = int(kinds)
  end subroutine set_terms

  !> Terms of a joint without cross terms, and where and how long is searched for it.
  subroutine set_search(by_rate, n, steps, held, least_gain, dofs, kinds, lower, upper, joint, limits, info)
    integer(ip), intent(in) :: by_rate, n, steps, held, dofs(:), kinds(:)
    real(c_double), intent(in) :: least_gain, lower(:), upper(:)
    type(diagonal_joint), intent(inout) :: joint
    type(search_limits), intent(inout) :: limits
    integer(ip), intent(out) :: info
    integer :: stat

    call set_terms(n, dofs, kinds, joint, info)
    if (info /= info_good) return
    joint%by_rate = by_rate == 1
    allocate (limits%lower(size(dofs)), limits%upper(size(dofs)), stat=stat)
    info = merge(info_good, info_no_memory, stat == 0)
    if (stat /= 0) return
    limits%steps = int(steps)
    limits%held = int(held)
    limits%least_gain = least_gain
    limits%lower(:) = lower
    limits%upper(:) = upper
  end subroutine set_search

  !> Normal equations of the parameters of any joint for quadratic forms of its compliance, as in jf_fit_diagonal_joint.
  !> With C the compliance, J is its derivative by the parameters, -f C E C of its upper triangle: each parameter adds a
  !> function of frequency f to one entry of K* = C^-1 and to its mirror image. Summed over the lines, in lanes whatever
  !> engine is chosen.
  !> n             number of joint DOFs, 1 to 100
  !> n_par         number of parameters, at least 1
  !> n_entries     n (n + 1)/2
  !> rows          row of the entry of each parameter, counted from 1, shape (n_par)
  !> columns       its column, shape (n_par)
  !> slopes        f, shape (n_par, n_freq)
  !> c_joint       C, the upper triangle row by row, shape (n_entries, n_freq), m/N
  !> information   W, shape (n_entries, n_entries, n_freq), (N/m)^2, Hermitian
  !> residual      weighted residual r = p - W (C - C0), shape (n_entries, n_freq), N/m
  !> normal        Re(J^H W J) summed over the lines, shape (n_par, n_par); NaN where a number is
  !> descent       Re(J^H r), shape (n_par)
  !> info          0, -i, -1000 as above
  subroutine jf_joint_normal_equations(trans, n, n_par, n_entries, n_freq, rows, columns, slopes, c_joint, &
                                       information, residual, normal, descent, info) &
    bind(C, name='jf_joint_normal_equations_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_par, n_entries, n_freq, rows(n_par), columns(n_par)
    complex(c_double_complex), target, intent(in) :: slopes(n_par, n_freq), c_joint(n_entries, n_freq)
    complex(c_double_complex), target, intent(in) :: information(n_entries, n_entries, n_freq)
    complex(c_double_complex), target, intent(in) :: residual(n_entries, n_freq)
    real(c_double), intent(out) :: normal(n_par, n_par), descent(n_par)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_joint_normal_equations(trans, n, n_par, n_entries, n_freq, rows, columns)
    if (info == info_good) then
      call joint_normal_equations(is_transposed(trans), int(n), rows, columns, slopes, c_joint, information, residual, &
                                  normal, descent, info)
    end if
    call release_traps(host)
  end subroutine jf_joint_normal_equations

  !> Weights for displacement and slope at a reference from points along a line. Eq. (2.59) for any spacing.
  !> m         number of points, at least 2
  !> offset    positions of the points from the reference, shape (m), no two equal, m
  !> weights   shape (2, m): first row displacement, second row slope, 1/m
  subroutine jf_difference_weights(m, offset, weights, info) bind(C, name='jf_difference_weights_')
    integer(ip), intent(in) :: m
    real(c_double), intent(in) :: offset(m)
    real(c_double), intent(out) :: weights(2, m)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_difference_weights(m, offset)
    if (info == info_good) then
      call difference_weights(offset, weights)
    end if
    call release_traps(host)
  end subroutine jf_difference_weights

  !> Displacement and rotation receptances at a reference from translational ones along a line. Eqs. (2.57)-(2.59).
  !> In memory of the caller: the weights by jf_difference_weights once, then jf_transform_work with them for T.
  !> m        number of points, at least 2
  !> offset   positions of the points from the reference, shape (m), no two equal, m
  !> h        measured receptance of the points, shape (m, m, n_freq), m/N
  !> h_new    shape (2, 2, n_freq): displacement, then slope du/ds
  subroutine jf_central_difference(trans, m, n_freq, offset, h, h_new, line_info, rcond, info) &
    bind(C, name='jf_central_difference_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: m, n_freq
    real(c_double), intent(in) :: offset(m)
    complex(c_double_complex), target, intent(in) :: h(m, m, n_freq)
    complex(c_double_complex), target, intent(out) :: h_new(2, 2, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_central_difference(trans, m, n_freq, offset)
    if (info == info_good) then
      call central_difference(is_transposed(trans), offset, h, h_new, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_central_difference

  !> H_new = T_out H T_in^T on every line. Eq. (2.57) for any number of points and DOFs.
  !> n_out, n_in   size of the result
  !> m_out, m_in   size of the measured matrix
  !> h             shape (m_out, m_in, n_freq), or (m_in, m_out, n_freq) with trans 'T'
  !> t_out         shape (n_out, m_out), or (m_out, n_out) with trans 'T'
  !> t_in          shape (n_in, m_in), or (m_in, n_in) with trans 'T'
  !> h_new         shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T'
  subroutine jf_transform(trans, n_out, n_in, m_out, m_in, n_freq, h, t_out, t_in, h_new, line_info, rcond, &
                          info) bind(C, name='jf_transform_')
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_out, n_in, m_out, m_in, n_freq
    complex(c_double_complex), target, intent(in) :: h(*)
    real(c_double), target, intent(in) :: t_out(*), t_in(*)
    complex(c_double_complex), target, intent(inout) :: h_new(*)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
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
      call transform_receptance(is_transposed(trans), h_lines, out_matrix, in_matrix, new_lines, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_transform

  !> Realisations of polluted FRFs, H + S e with noise numbers e. Realisation r of a seed is always the same: on any
  !> number of threads, with any engine, by either order of storage.
  !> kind         'C' circular complex normal, E|e|^2 = 1; 'P' the same with variance 1 of each part; 'N' real normal;
  !>              'U' real, uniform between -1 and 1; 'S' real, uniform with variance 1
  !> reference    S is level times 'E' the entry itself, 'L' the largest modulus of the line, 'S' that of the spectrum
  !> reciprocal   1: entries (p, q) and (q, p) get the same number, which takes n_out = n_in; 0: they do not
  !> block        size of square blocks whose entries share one number; 1 for none
  !> level        0.05 for 5 percent
  !> seed         shape (2), its lower and its upper 32 bits
  !> n_out, n_in  number of responses and of forces
  !> first        number of the first realisation, counted from 0
  !> count        number of realisations
  !> h            exact FRFs, shape (n_out, n_in, n_freq), or (n_in, n_out, n_freq) with trans 'T'
  !> polluted     shape (n_out, n_in, n_freq, count), or (n_in, n_out, n_freq, count) with trans 'T'
  !> info         as above; lines that hold NaN or Inf are polluted like any other and not counted
  subroutine jf_pollute(trans, kind, reference, reciprocal, block, level, seed, n_out, n_in, n_freq, first, count, h, &
                        polluted, info) bind(C, name='jf_pollute_')
    character(kind=c_char), intent(in) :: trans, kind, reference
    integer(ip), intent(in) :: reciprocal, block, seed(2), n_out, n_in, n_freq, first, count
    real(c_double), intent(in) :: level
    complex(c_double_complex), target, intent(in) :: h(*)
    complex(c_double_complex), target, intent(inout) :: polluted(*)
    integer(ip), intent(out) :: info
    complex(c_double_complex), pointer, contiguous :: exact(:, :, :), lines(:, :, :)
    type(host_state) :: host

    call hold_traps(host)
    info = check_pollute(trans, kind, reference, reciprocal, block, level, n_out, n_in, n_freq, first, count)
    if (info == info_good) then
      call as_lines(trans, n_out, n_in, n_freq, h, exact)
      call as_lines(trans, n_out, n_in, n_freq*count, polluted, lines)
      call pollute(is_transposed(trans), make_noise(kind, reference, reciprocal == 1, int(block), level, seed), &
                   first, count, exact, lines, info)
    end if
    call release_traps(host)
  end subroutine jf_pollute

  !> Mean and covariance of the joint identified from polluted FRFs, over realisations that are never stored: those that
  !> jf_pollute gives of gamma.
  !> method      'I' ISMM, K* = K0 - D_jk; 'S' inverse substructuring, K* = -(gamma^-1)_jk; 'C' joint compliance
  !> kind, reference, reciprocal, block, level, seed, first, count    as in jf_pollute
  !> n           number of joint DOFs
  !> alpha       calculated receptance of the assembly with K0 at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N; free of
  !>             noise; read by method 'I' only
  !> gamma       exact receptance of the assembly, same DOFs, shape (2 n, 2 n, n_freq), m/N
  !> k_initial   K0, shape (n, n, n_freq), N/m; read by method 'I' only
  !> good        number of realisations of each line that could be identified, shape (n_freq); the others are left out
  !> mean        shape (n, n, n_freq), N/m, or m/N for method 'C'
  !> covariance  Var Re, Var Im and Cov(Re, Im) of each entry, shape (3, n, n, n_freq), entries stored as in
  !>             `mean`; NaN where fewer than two realisations are good
  !> line_info   as above; a line is bad where no realisation is good, and says what was wrong with the first
  !> rcond       shape (n_freq), the smallest over the good realisations
  subroutine jf_monte_carlo(trans, method, kind, reference, reciprocal, block, level, seed, n, n_freq, first, count, &
                            alpha, gamma, k_initial, good, mean, covariance, line_info, rcond, info) &
    bind(C, name='jf_monte_carlo_')
    character(kind=c_char), intent(in) :: trans, method, kind, reference
    integer(ip), intent(in) :: reciprocal, block, seed(2), n, n_freq, first, count
    real(c_double), intent(in) :: level
    complex(c_double_complex), target, intent(in) :: alpha(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: gamma(2_long*n, 2_long*n, n_freq)
    complex(c_double_complex), target, intent(in) :: k_initial(n, n, n_freq)
    integer(ip), intent(out) :: good(n_freq)
    complex(c_double_complex), target, intent(inout) :: mean(n, n, n_freq)
    real(c_double), intent(out) :: covariance(3, n, n, n_freq)
    integer(ip), intent(out) :: line_info(n_freq)
    real(c_double), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_monte_carlo(trans, method, kind, reference, reciprocal, block, level, n, n_freq, first, count)
    if (info == info_good) then
      call monte_carlo(is_transposed(trans), method, &
                       make_noise(kind, reference, reciprocal == 1, int(block), level, seed), &
                       first, count, alpha, gamma, k_initial, good, mean, covariance, line_info, rcond, info)
    end if
    call release_traps(host)
  end subroutine jf_monte_carlo

  !> Stiffness and mass of eight-node bricks. Nodes 1 to 4 go round one face, counter-clockwise as seen from the
  !> opposite face; 5 to 8 lie there, 5 over 1. DOFs are x, y, z of node 1, then of node 2, ...
  !> formulation      'R' one strain and stiffness against hourglass patterns; 'I' incompatible modes; 'F' 2 x 2 x 2
  !>                  integration points, too stiff in bending
  !> n_elements       number of elements; 0 is allowed and does nothing
  !> coordinates      shape (3, 8, n_elements), m
  !> youngs_modulus   shape (n_elements), positive, N/m^2
  !> poisson          shape (n_elements), between -1 and 0.5
  !> density          shape (n_elements), positive, kg/m^3
  !> hourglass        stiffness of hourglass patterns as a share of the shear modulus, not negative; for 'R'
  !> lumped           1: the rows of the mass are summed into its diagonal; 0: the consistent mass
  !> stiffness        shape (24, 24, n_elements), symmetric, N/m
  !> mass             shape (24, 24, n_elements), symmetric, kg
  !> element_info     shape (n_elements): 0 good; -1 NaN or Inf in the coordinates; -2 the result overflows; > 0 the
  !>                  element is turned inside out or flat, first seen at the integration point nearest to that node, 1
  !>                  to 8. A bad element is filled with NaN.
  !> info             0 good; -i argument i is wrong and nothing was done; > 0 number of bad elements
  subroutine jf_brick_matrices(formulation, n_elements, coordinates, youngs_modulus, poisson, density, hourglass, &
                               lumped, stiffness, mass, element_info, info) bind(C, name='jf_brick_matrices_')
    character(kind=c_char), intent(in) :: formulation
    integer(ip), intent(in) :: n_elements, lumped
    real(c_double), intent(in) :: coordinates(3, 8, n_elements)
    real(c_double), intent(in) :: youngs_modulus(n_elements), poisson(n_elements), density(n_elements), hourglass
    real(c_double), intent(out) :: stiffness(24, 24, n_elements), mass(24, 24, n_elements)
    integer(ip), intent(out) :: element_info(n_elements)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_brick_matrices(formulation, n_elements, youngs_modulus, poisson, density, hourglass, lumped)
    if (info == info_good) then
      call brick_matrices(formulation, coordinates, youngs_modulus, poisson, density, hourglass, lumped == 1, &
                          stiffness, mass, element_info, info)
    end if
    call release_traps(host)
  end subroutine jf_brick_matrices

  !> How far eight-node bricks are from rectangular ones. Node order as in jf_brick_matrices.
  !> n_elements        number of elements; 0 is allowed and does nothing
  !> coordinates       shape (3, 8, n_elements), m
  !> scaled_jacobian   shape (n_elements): volume that the three edges of a corner span over the product of their
  !>                   lengths, the smallest of the eight; 1 where all angles are right, not positive in a bad element
  !> aspect_ratio      shape (n_elements): longest edge over shortest, Inf where an edge has no length
  !> info              0 good; -1 argument 1 is wrong; > 0 number of elements with NaN or Inf, whose results are NaN
  subroutine jf_brick_quality(n_elements, coordinates, scaled_jacobian, aspect_ratio, info) &
    bind(C, name='jf_brick_quality_')
    integer(ip), intent(in) :: n_elements
    real(c_double), intent(in) :: coordinates(3, 8, n_elements)
    real(c_double), intent(out) :: scaled_jacobian(n_elements), aspect_ratio(n_elements)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_brick_quality(n_elements)
    if (info == info_good) then
      call brick_quality(coordinates, scaled_jacobian, aspect_ratio, info)
    end if
    call release_traps(host)
  end subroutine jf_brick_quality

  !> Rational functions c_0 + sum c_k/(s - p_k) with given common poles through several FRFs, each fitted by weighted
  !> least squares; residues are complex.
  !> n_poles     number of poles, at most 10000
  !> n_entries   number of FRFs
  !> n_freq      as above
  !> s           i times the frequency of each line, in any unit, shape (n_freq)
  !> h           FRFs, shape (n_freq, n_entries), any unit
  !> weight      1/sqrt(E|e|^2) up to one factor, > 0, shape (n_freq, n_entries)
  !> poles       p_k in the unit of s, all different, shape (n_poles)
  !> smooth      the fit, shape (n_freq, n_entries)
  !> squares     weighted sum of squares of h - smooth
  !> loss        by how much that sum would grow without a pole, the others staying where they are, shape (n_poles)
  !> info        0, -i, -1000 as above; > 0 so many FRFs have singular equations, and smooth is 0 there
  subroutine jf_rational_fit(n_poles, n_entries, n_freq, s, h, weight, poles, smooth, squares, loss, info) &
    bind(C, name='jf_rational_fit_')
    integer(ip), intent(in) :: n_poles, n_entries, n_freq
    complex(c_double_complex), intent(in) :: s(n_freq), h(n_freq, n_entries), poles(n_poles)
    real(c_double), intent(in) :: weight(n_freq, n_entries)
    complex(c_double_complex), intent(out) :: smooth(n_freq, n_entries)
    real(c_double), intent(out) :: squares, loss(n_poles)
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_rational_fit(n_poles, n_entries, n_freq)
    if (info == info_good) call rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    call release_traps(host)
  end subroutine jf_rational_fit

  !> Better common poles of rational functions c_0 + sum c_k/(s - p_k) through several FRFs, by relaxed vector fitting,
  !> until the sum of squares of their fit stays.
  !> n_poles     number of poles, at most 10000
  !> n_entries   number of FRFs
  !> n_freq      as above
  !> iterations  most relocations; 0 gives the sum of squares of the poles as they are
  !> still       relative change of the sum of squares at which relocation ends, >= 0
  !> s           i times the frequency of each line, in any unit, shape (n_freq)
  !> h           FRFs, shape (n_freq, n_entries), any unit
  !> weight      1/sqrt(E|e|^2) up to one factor, > 0, shape (n_freq, n_entries)
  !> poles       in: poles to begin with, in the unit of s, all different; out: those with the least sum, shape
  !>             (n_poles)
  !> squares     that weighted sum of squares of h minus the fit
  !> info        0, -i, -1000 as above; > 0 so many FRFs had singular equations: poles are the last that had not
  subroutine jf_relocate_poles(n_poles, n_entries, n_freq, iterations, still, s, h, weight, poles, squares, info) &
    bind(C, name='jf_relocate_poles_')
    integer(ip), intent(in) :: n_poles, n_entries, n_freq, iterations
    real(c_double), intent(in) :: still
    complex(c_double_complex), intent(in) :: s(n_freq), h(n_freq, n_entries)
    real(c_double), intent(in) :: weight(n_freq, n_entries)
    complex(c_double_complex), intent(inout) :: poles(n_poles)
    real(c_double), intent(out) :: squares
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_relocate_poles(n_poles, n_entries, n_freq, iterations, still)
    if (info == info_good) call relocate_poles(int(iterations), still, s, h, weight, poles, squares, info)
    call release_traps(host)
  end subroutine jf_relocate_poles

  !> Smooth FRFs: rational functions c_0 + sum c_k/(i w - p_k) with common poles through several FRFs. Poles are added
  !> until the residual vanishes in the mean over neighbouring lines, relocated, and removed if they are not worth their
  !> parameters, by generalised cross-validation.
  !> n_entries   number of FRFs
  !> n_freq      as above
  !> max_poles   most poles, from 1 to 10000; no more than a third of the lines are used
  !> n_start     number of first poles, at most max_poles; 0 for poles at the peaks of the FRFs
  !> patience    orders in a row that may gain nothing before the search ends, 2 for example; 0 for no poles beside the
  !>             first ones, which are relocated
  !> inflation   number of neighbouring lines that carry the noise of one independent line, >= 1; 0 to find it from the
  !>             residual
  !> freq        frequency of each line, rising, >= 0, Hz, shape (n_freq)
  !> h           FRFs, shape (n_freq, n_entries), any unit
  !> variance    E|e|^2 of their noise up to one factor, > 0, shape (n_freq, n_entries)
  !> poles       in: first poles; out: the poles, rad/s, shape (max_poles)
  !> n_poles     number of poles found
  !> smooth      the smooth FRFs, shape (n_freq, n_entries)
  !> squares     sum of |h - smooth|^2/variance, without lines that single poles followed
  !> info        0, -i, -1000 as above; > 0 so many FRFs had singular equations, and smooth is 0 there
  subroutine jf_smooth_frfs(n_entries, n_freq, max_poles, n_start, patience, inflation, freq, h, variance, poles, &
                            n_poles, smooth, squares, info) bind(C, name='jf_smooth_frfs_')
    integer(ip), intent(in) :: n_entries, n_freq, max_poles, n_start, patience
    real(c_double), intent(in) :: inflation, freq(n_freq), variance(n_freq, n_entries)
    complex(c_double_complex), target, intent(in) :: h(n_freq, n_entries)
    complex(c_double_complex), intent(inout) :: poles(max_poles)
    integer(ip), intent(out) :: n_poles
    complex(c_double_complex), intent(out) :: smooth(n_freq, n_entries)
    real(c_double), intent(out) :: squares
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_smooth_frfs(n_entries, n_freq, max_poles, n_start, patience, inflation, freq, h, variance)
    if (info == info_good) then
      call smooth_frfs(freq, h, variance, inflation, int(patience), int(n_start), poles, n_poles, smooth, squares, info)
    end if
    call release_traps(host)
  end subroutine jf_smooth_frfs

  !> Noise of FRFs by the residual of smooth ones:
  !> E|e|^2 = line_level line_factor (parts(1)^2 |smooth|^2 + parts(2)^2 s + parts(3)^2 given), s = 1 for a floor that
  !> is constant in the unit of h, or s = floor_shape, whichever is more likely.
  !> n_entries        number of FRFs
  !> n_freq           as above
  !> n_pairs          number, or 0 for no pairs of FRFs that are the same but for noise, h_pq and h_qp for example
  !> robust           1: for weights of a further smoothing, as errors of smooth FRFs at peaks and antiresonances do not
  !>                  count; 0: the maximum of the likelihood
  !> floor_shape      dependence of a floor on frequency that may be more likely, > 0, shape (n_freq): (f_m/f)^4 for
  !>                  receptances whose accelerances have a constant floor, f_m the median line; 1 for no other floor
  !> h                measured FRFs, shape (n_freq, n_entries)
  !> smooth           smooth FRFs, from jf_smooth_frfs for example, shape (n_freq, n_entries)
  !> share            part of the noise power that each smooth FRF has taken up, its parameters over its data, >= 0,
  !>                  shape (n_entries)
  !> given            variance that is known up to a factor, by coherence for example, >= 0, shape (n_freq, n_entries);
  !>                  all 0 if none is
  !> first            one FRF of each pair, counted from 1, shape (n_pairs)
  !> second           the other, shape (n_pairs)
  !> inflation        number of neighbouring lines that carry the noise of one independent line, >= 1, as far as it is
  !>                  known; 1 if it is not
  !> parts            relative part, floor, and factor of the variance that is given, shape (n_entries, 3)
  !> variance         E|e|^2, shape (n_freq, n_entries)
  !> line_level       slow variation of the noise power over frequency, shape (n_freq); 1 if none is significant
  !> line_factor      by how much an outlying line exceeds the lines around, shape (n_freq); 1 for other lines
  !> is_shaped        1 if the floor follows floor_shape, 0 if it is constant
  !> found            inflation of this noise, by the differences of the pairs, without pairs by h - smooth
  !> info             0, -i, -1000 as above
  subroutine jf_estimate_noise(n_entries, n_freq, n_pairs, robust, floor_shape, h, smooth, share, given, first, &
                               second, inflation, parts, variance, line_level, line_factor, is_shaped, found, &
                               info) bind(C, name='jf_estimate_noise_')
    integer(ip), intent(in) :: n_entries, n_freq, n_pairs, robust
    real(c_double), intent(in) :: floor_shape(n_freq)
    complex(c_double_complex), intent(in) :: h(n_freq, n_entries), smooth(n_freq, n_entries)
    real(c_double), intent(in) :: share(n_entries), given(n_freq, n_entries)
    integer(ip), intent(in) :: first(n_pairs), second(n_pairs)
    real(c_double), intent(in) :: inflation
    real(c_double), intent(out) :: parts(n_entries, 3), variance(n_freq, n_entries), line_level(n_freq)
    real(c_double), intent(out) :: line_factor(n_freq)
    integer(ip), intent(out) :: is_shaped
    real(c_double), intent(out) :: found
    integer(ip), intent(out) :: info
    type(host_state) :: host

    call hold_traps(host)
    info = check_estimate_noise(n_entries, n_freq, n_pairs, robust, floor_shape, h, smooth, share, given, first, &
                                second, inflation)
    if (info == info_good) then
      call estimate_noise(robust == 1, floor_shape, h, smooth, share, given, first, second, &
                          inflation, parts, variance, line_level, line_factor, is_shaped, found, info)
    end if
    call release_traps(host)
  end subroutine jf_estimate_noise

  !> How many neighbouring lines carry the noise of one independent line: 1 + 2 sum of the autocorrelations up to the
  !> first that is not significant; at least 1.
  !> n_entries   number of FRFs
  !> n_freq      as above
  !> noise       noise of unit variance, shape (n_freq, n_entries); in: NaN if it is not to count; out: workspace
  !> share       part of the noise power that smoothing has taken up, >= 0, 0 if no smooth FRF was subtracted
  !> inflation   the number
  !> info        0, -i, -1000 as above
  subroutine jf_line_correlation(n_entries, n_freq, noise, share, inflation, info) &
    bind(C, name='jf_line_correlation_')
    integer(ip), intent(in) :: n_entries, n_freq
    complex(c_double_complex), intent(inout) :: noise(n_freq, n_entries)
    real(c_double), intent(in) :: share
    real(c_double), intent(out) :: inflation
    integer(ip), intent(out) :: info
    type(host_state) :: host
    real(c_double), allocatable :: known(:, :), sizes(:)
    integer :: stat

    call hold_traps(host)
    info = check_line_noise(n_entries, n_freq, share, 0.0_c_double, 0_ip)
    if (info == info_good) then
      allocate (known(n_freq, n_entries), sizes(n_freq), stat=stat)
      if (stat /= 0) info = info_no_memory
    end if
    if (info == info_good) call line_correlation(noise, share, known, sizes, inflation)
    call release_traps(host)
  end subroutine jf_line_correlation

  !> Slow variation of noise over frequency, and outlying lines, of all FRFs together: the mean square on each line is
  !> compared with its running median.
  !> n_entries    number of FRFs
  !> n_freq       as above
  !> noise        noise of unit variance, shape (n_freq, n_entries)
  !> inflation    number of neighbouring lines that carry the noise of one independent line, >= 1
  !> is_residual  1 for measured minus smooth FRFs, in which modes that are missed show, too: long runs of lines count
  !>              only if they jump from line to line; 0 if not
  !> line_level   slow variation, shape (n_freq); 1 if none is significant
  !> line_factor  by how much an outlying line exceeds the lines around, shape (n_freq); 1 for other lines
  !> info         0, -i, -1000 as above
  subroutine jf_line_levels(n_entries, n_freq, noise, inflation, is_residual, line_level, line_factor, info) &
    bind(C, name='jf_line_levels_')
    integer(ip), intent(in) :: n_entries, n_freq, is_residual
    complex(c_double_complex), intent(in) :: noise(n_freq, n_entries)
    real(c_double), intent(in) :: inflation
    real(c_double), intent(out) :: line_level(n_freq), line_factor(n_freq)
    integer(ip), intent(out) :: info
    type(host_state) :: host
    type(level_space) :: space
    integer :: stat

    call hold_traps(host)
    info = check_line_noise(n_entries, n_freq, inflation, 1.0_c_double, is_residual)
    if (info == info_good) then
      call prepare_levels(int(n_freq), space, stat)
      if (stat /= 0) info = info_no_memory
    end if
    if (info == info_good .and. size(noise) > 0) &
      call line_levels(noise, inflation, is_residual == 1, space, line_level, line_factor)
    call release_traps(host)
  end subroutine jf_line_levels

  !> Parts of the variance of noise, not negative: E|e|^2 = sum of parts times terms, of each FRF, by maximum likelihood
  !> for exponentially distributed squares.
  !> method      'L' maximum of the likelihood; 'R' of two terms robustly, by medians; 'C' of two terms, the second part
  !>             alike in all FRFs unless the squares clearly show that it differs
  !> n_terms     number of terms, at most 100
  !> n_entries   number of FRFs
  !> n_freq      as above
  !> squares     |e|^2, >= 0, shape (n_freq, n_entries)
  !> terms       shape (n_freq, n_entries, n_terms), >= 0; the first is |h|^2 or proportional to it
  !> parts       shape (n_entries, n_terms)
  !> info        0, -i, -1000 as above
  subroutine jf_noise_parts(method, n_terms, n_entries, n_freq, squares, terms, parts, info) &
    bind(C, name='jf_noise_parts_')
    character(kind=c_char), intent(in) :: method
    integer(ip), intent(in) :: n_terms, n_entries, n_freq
    real(c_double), intent(in) :: squares(n_freq, n_entries), terms(n_freq, n_entries, n_terms)
    real(c_double), intent(out) :: parts(n_entries, n_terms)
    integer(ip), intent(out) :: info
    type(host_state) :: host
    integer :: stat

    call hold_traps(host)
    info = check_noise_parts(method, n_terms, n_entries, n_freq)
    if (info == info_good .and. size(squares) > 0) then
      if (index('Cc', method) > 0) then
        call likely_parts(squares, terms, parts, stat)
      else
        call noise_parts(index('Rr', method) > 0, squares, terms, parts, stat)
      end if
      if (stat /= 0) info = info_no_memory
    end if
    call release_traps(host)
  end subroutine jf_noise_parts
end module jointfrf
