!> What the flat API checks: each wrong argument is named by its place, and nothing is done.
module trials
  use, intrinsic :: iso_c_binding, only: c_char
  use testing, only: check, check_untouched, dp, infinity, ip, not_a_number, random_regular, untouched
  use jointfrf, only: jf_central_difference, jf_compliance_covariance, jf_compliance_factors, jf_couple, jf_decouple, &
    jf_difference_weights, jf_find_modification, jf_inverse_substructuring, jf_invert, jf_ismm, jf_joint_compliance, &
    jf_joint_forms, jf_modify, jf_project_on_joint, jf_receptance, jf_receptance_banded, jf_receptance_modal, &
    jf_solve, jf_transform
  use jointfrf_arguments, only: bad_offsets, is_transposed, lower, names, not_finite, out_of_range, repeated, &
    unknown_equation, unknown_order
  implicit none
  private
  public :: predicates, all_arguments

  !> Room for the largest case below; the routines see as much of it as their arguments say.
  integer, parameter :: room = 4, lines = 2
  complex(dp) :: h(room, room, lines), g(room, room, lines), small(room, room, lines), result(2*room, 2*room, lines)
  real(dp) :: matrix(room, room), omega(lines), rcond(lines), variance(room, room, lines), weights(2, room)
  real(dp) :: factor(room, room, lines)                !< a triangular one
  integer(ip) :: line_info(lines), info
  integer(ip), parameter :: both(2) = [1_ip, 2_ip], twice(2) = [2_ip, 2_ip], below(2) = [1_ip, 0_ip], &
    above(2) = [2_ip, 4_ip]

contains

  subroutine predicates()
    integer :: i
    character(kind=c_char) :: letter

    do i = 0, 127
      letter = achar(i, c_char)
      call check(unknown_order(letter) .neqv. any(letter == ['N', 'n', 'T', 't']), 'TRANS is one of N, n, T, t')
    end do
    call check(is_transposed('T') .and. is_transposed('t') .and. .not. (is_transposed('N') .or. is_transposed('n')), &
               'T is transposed')
    call check(.not. out_of_range([1_ip, 3_ip], 3_ip) .and. out_of_range([0_ip, 3_ip], 3_ip) &
               .and. out_of_range([1_ip, 4_ip], 3_ip), 'DOFs are 1..n')
    call check(.not. repeated([1_ip, 3_ip, 2_ip]) .and. repeated([1_ip, 3_ip, 1_ip]) .and. repeated([2_ip, 3_ip, &
               3_ip]) .and. .not. repeated([integer(ip) ::]), 'no DOF twice')
    call check(.not. not_finite(huge(1.0_dp)) .and. not_finite(not_a_number()) .and. not_finite(-infinity()), 'finite')
    call check(.not. bad_offsets([0.1_dp, -0.1_dp, 0.0_dp]), 'good offsets')
    call check(bad_offsets([0.1_dp, 0.2_dp, 0.1_dp]) .and. bad_offsets([0.0_dp, -0.0_dp]), 'equal offsets')
    call check(bad_offsets([0.1_dp, not_a_number()]) .and. bad_offsets([infinity(), 1.0_dp]), 'offsets not finite')
    call check(lower(['R', 's']) == 'rs' .and. lower(['S', 'R']) == 'sr' .and. lower(['X', 'r']) == 'Xr', 'lower')
    call check(unknown_equation(['r', 'k']) .and. .not. unknown_equation(['S', 'r']), 'equations')
    call check(names(['r', 'S'], 's') .and. .not. names(['r', 'r'], 's') .and. names(['S', 'R'], 'r'), 'points named')
  end subroutine predicates

  subroutine all_arguments()
    h = random_regular(room, lines)
    g = random_regular(room, lines)
    small = random_regular(room, lines)
    matrix = real(h(:, :, 1), dp)
    omega = [1.0_dp, 2.0_dp]
    variance = 1.0_dp
    factor = 1.0_dp
    call invert_arguments()
    call solve_arguments()
    call receptance_arguments()
    call banded_arguments()
    call modal_arguments()
    call couple_arguments()
    call modify_arguments()
    call pair_arguments()
    call decouple_arguments()
    call factor_arguments()
    call covariance_arguments()
    call project_arguments()
    call form_arguments()
    call difference_arguments()
    call transform_arguments()
  end subroutine all_arguments

  !> Before each call: outputs that show whether they were touched.
  subroutine prepare()
    result = untouched
    rcond = untouched
    weights = untouched
    line_info = int(untouched, ip)
    info = int(untouched, ip)
  end subroutine prepare

  !> A wrong argument is named and nothing is done; with info 0 expected, the lines are good.
  subroutine expect(expected, what)
    integer, intent(in) :: expected
    character(len=*), intent(in) :: what
    character(len=30) :: text

    write (text, '(a,i0,a,i0)') ': info ', info, ', not ', expected
    call check(info == expected, what//trim(text))
    if (expected == 0) then
      call check(all(line_info == 0), what//': good lines')
    else
      call check_untouched(result, what)
      call check_untouched(rcond, what)
      call check_untouched([weights], what)
      call check(all(line_info == int(untouched, ip)), what//': line_info touched')
    end if
  end subroutine expect

  subroutine invert_arguments()
    call try(0, 2, 2)
    call try(-1, -1, 2)
    call try(-2, 2, -1)
    call try(-1, -1, -1)

  contains

    subroutine try(expected, n, n_freq)
      integer, intent(in) :: expected, n, n_freq

      call prepare()
      call jf_invert(int(n, ip), int(n_freq, ip), h, result, line_info, rcond, info)
      call expect(expected, 'invert')
    end subroutine try
  end subroutine invert_arguments

  subroutine solve_arguments()
    call try(0, 'N', 2, 2, 2)
    call try(0, 't', 2, 2, 2)
    call try(-1, 'X', 2, 2, 2)
    call try(-2, 'N', -1, 2, 2)
    call try(-3, 'N', 2, -1, 2)
    call try(-4, 'N', 2, 2, -1)
    call try(-1, 'C', -1, -1, -1)

  contains

    subroutine try(expected, trans, n, n_rhs, n_freq)
      integer, intent(in) :: expected, n, n_rhs, n_freq
      character, intent(in) :: trans

      call prepare()
      call jf_solve(trans, int(n, ip), int(n_rhs, ip), int(n_freq, ip), h, g, result, line_info, rcond, info)
      call expect(expected, 'solve')
    end subroutine try
  end subroutine solve_arguments

  subroutine receptance_arguments()
    real(dp) :: bad

    call try(0, 'N', 3, 2, 2, 2, 3, 3, 0.0_dp, both, twice)
    call try(0, 'T', 3, 2, 2, 2, 0, 0, 0.1_dp, twice, both)
    call try(-1, '*', 3, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-2, 'N', -3, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-3, 'N', 3, -2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-4, 'N', 3, 2, -2, 2, 3, 3, 0.0_dp, both, both)
    call try(-5, 'N', 3, 2, 2, -2, 3, 3, 0.0_dp, both, both)
    call try(-9, 'N', 3, 2, 2, 2, 2, 3, 0.0_dp, both, both)
    call try(-9, 'N', 3, 2, 2, 2, -1, 3, 0.0_dp, both, both)
    call try(-11, 'N', 3, 2, 2, 2, 3, 4, 0.0_dp, both, both)
    bad = not_a_number()
    call try(-13, 'N', 3, 2, 2, 2, 3, 3, bad, both, both)
    bad = infinity()
    call try(-13, 'N', 3, 2, 2, 2, 3, 3, bad, both, both)
    call try(-14, 'N', 3, 2, 2, 2, 3, 3, 0.0_dp, below, both)
    call try(-14, 'N', 3, 2, 2, 2, 3, 3, 0.0_dp, above, both)
    call try(-15, 'N', 3, 2, 2, 2, 3, 3, 0.0_dp, both, below)
    call try(-15, 'N', 3, 2, 2, 2, 3, 3, 0.0_dp, both, above)
    call try(-9, 'N', 3, 2, 2, 2, 1, 1, bad, above, below)

  contains

    subroutine try(expected, trans, n, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, outputs, inputs)
      integer, intent(in) :: expected, n, n_freq, n_out, n_in, n_damping, n_structural
      character, intent(in) :: trans
      real(dp), intent(in) :: loss_factor
      integer(ip), intent(in) :: outputs(2), inputs(2)

      call prepare()
      call jf_receptance(trans, int(n, ip), int(n_freq, ip), int(n_out, ip), int(n_in, ip), omega, matrix, &
                         0.1_dp*matrix, int(n_damping, ip), matrix, int(n_structural, ip), matrix, loss_factor, &
                         outputs, inputs, result, line_info, rcond, info)
      call expect(expected, 'receptance')
    end subroutine try
  end subroutine receptance_arguments

  subroutine banded_arguments()
    real(dp) :: bad

    call try(0, 'n', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, both, twice)
    call try(0, 'T', 3, 0, 2, 2, 2, 2, 0, 0, 0.1_dp, both, twice)
    call try(-1, ' ', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-2, 'N', -3, 0, 0, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-3, 'N', 3, -1, 0, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-3, 'N', 3, 3, 0, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-4, 'N', 3, 1, -1, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-4, 'N', 3, 0, 3, 2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-5, 'N', 3, 1, 0, -2, 2, 2, 3, 3, 0.0_dp, both, both)
    call try(-6, 'N', 3, 1, 0, 2, -2, 2, 3, 3, 0.0_dp, both, both)
    call try(-7, 'N', 3, 1, 0, 2, 2, -2, 3, 3, 0.0_dp, both, both)
    call try(-11, 'N', 3, 1, 0, 2, 2, 2, 2, 3, 0.0_dp, both, both)
    call try(-13, 'N', 3, 1, 0, 2, 2, 2, 3, -3, 0.0_dp, both, both)
    bad = not_a_number()
    call try(-15, 'N', 3, 1, 0, 2, 2, 2, 3, 3, bad, both, both)
    bad = -infinity()
    call try(-15, 'N', 3, 1, 0, 2, 2, 2, 3, 3, bad, both, both)
    call try(-16, 'N', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, below, both)
    call try(-16, 'N', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, above, both)
    call try(-17, 'N', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, both, below)
    call try(-17, 'N', 3, 1, 0, 2, 2, 2, 3, 3, 0.0_dp, both, above)

  contains

    subroutine try(expected, trans, n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, outputs, &
                   inputs)
      integer, intent(in) :: expected, n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural
      character, intent(in) :: trans
      real(dp), intent(in) :: loss_factor
      integer(ip), intent(in) :: outputs(2), inputs(2)

      call prepare()
      call jf_receptance_banded(trans, int(n, ip), int(kl, ip), int(ku, ip), int(n_freq, ip), int(n_out, ip), &
                                int(n_in, ip), omega, matrix, 0.1_dp*matrix, int(n_damping, ip), matrix, &
                                int(n_structural, ip), matrix, loss_factor, outputs, inputs, result, line_info, &
                                rcond, info)
      call expect(expected, 'receptance_banded')
    end subroutine try
  end subroutine banded_arguments

  subroutine modal_arguments()
    call try(0, 'N', 3, 2, 2, 2)
    call try(0, 'T', 3, 2, 2, 2)
    call try(-1, 'H', 3, 2, 2, 2)
    call try(-2, 'N', -3, 2, 2, 2)
    call try(-3, 'N', 3, -2, 2, 2)
    call try(-4, 'N', 3, 2, -2, 2)
    call try(-5, 'N', 3, 2, 2, -2)

  contains

    subroutine try(expected, trans, n_modes, n_freq, n_out, n_in)
      integer, intent(in) :: expected, n_modes, n_freq, n_out, n_in
      character, intent(in) :: trans

      call prepare()
      call jf_receptance_modal(trans, int(n_modes, ip), int(n_freq, ip), int(n_out, ip), int(n_in, ip), omega, matrix, &
                               matrix, abs(matrix), matrix, matrix, result, line_info, rcond, info)
      call expect(expected, 'receptance_modal')
    end subroutine try
  end subroutine modal_arguments

  subroutine couple_arguments()
    call try(0, 'N', 3, 3, 2, 2, both, both)
    call try(0, 'T', 3, 2, 2, 2, [3_ip, 1_ip], [2_ip, 1_ip])
    call try(-1, 'R', 3, 3, 2, 2, both, both)
    call try(-2, 'N', -3, 3, 2, 2, both, both)
    call try(-3, 'N', 3, -3, 2, 2, both, both)
    call try(-4, 'N', 3, 3, -1, 2, both, both)
    call try(-4, 'N', 1, 3, 2, 2, both, both)
    call try(-4, 'N', 3, 1, 2, 2, both, both)
    call try(-5, 'N', 3, 3, 2, -2, both, both)
    call try(-9, 'N', 3, 3, 2, 2, below, both)
    call try(-9, 'N', 3, 3, 2, 2, above, both)
    call try(-9, 'N', 3, 3, 2, 2, twice, both)
    call try(-10, 'N', 3, 3, 2, 2, both, below)
    call try(-10, 'N', 3, 3, 2, 2, both, above)
    call try(-10, 'N', 3, 3, 2, 2, both, twice)
    call try(-9, 'N', 3, 3, 2, 2, twice, twice)

  contains

    subroutine try(expected, trans, n_a, n_b, n_j, n_freq, dofs_a, dofs_b)
      integer, intent(in) :: expected, n_a, n_b, n_j, n_freq
      character, intent(in) :: trans
      integer(ip), intent(in) :: dofs_a(2), dofs_b(2)

      call prepare()
      call jf_couple(trans, int(n_a, ip), int(n_b, ip), int(n_j, ip), int(n_freq, ip), h, g, small, dofs_a, dofs_b, &
                     result, line_info, rcond, info)
      call expect(expected, 'couple')
    end subroutine try
  end subroutine couple_arguments

  subroutine modify_arguments()
    call try(0, 'N', 3, 2, 2, both)
    call try(0, 'T', 2, 2, 2, both)
    call try(-1, 'c', 3, 2, 2, both)
    call try(-2, 'N', -3, 2, 2, both)
    call try(-3, 'N', 3, -2, 2, both)
    call try(-3, 'N', 1, 2, 2, both)
    call try(-4, 'N', 3, 2, -2, both)
    call try(-7, 'N', 3, 2, 2, below)
    call try(-7, 'N', 3, 2, 2, above)
    call try(-7, 'N', 3, 2, 2, twice)

  contains

    subroutine try(expected, trans, n, n_m, n_freq, dofs)
      integer, intent(in) :: expected, n, n_m, n_freq
      character, intent(in) :: trans
      integer(ip), intent(in) :: dofs(2)

      call prepare()
      call jf_modify(trans, int(n, ip), int(n_m, ip), int(n_freq, ip), h, small, dofs, result, line_info, rcond, info)
      call expect(expected, 'modify')
    end subroutine try
  end subroutine modify_arguments

  !> The routines that take TRANS, n, n_freq and nothing else that can be wrong.
  subroutine pair_arguments()
    integer :: which

    do which = 1, 4
      call try(0, which, 'N', 2, 2)
      call try(0, which, 'T', 2, 2)
      call try(-1, which, 'Z', 2, 2)
      call try(-2, which, 'N', -2, 2)
      call try(-3, which, 'N', 2, -2)
      call try(-2, which, 'N', -2, -2)
    end do

  contains

    subroutine try(expected, which, trans, n, n_freq)
      integer, intent(in) :: expected, which, n, n_freq
      character, intent(in) :: trans

      call prepare()
      select case (which)
      case (1)
        call jf_find_modification(trans, int(n, ip), int(n_freq, ip), h, g, result, line_info, rcond, info)
        call expect(expected, 'find_modification')
      case (2)
        call jf_ismm(trans, int(n, ip), int(n_freq, ip), h, g, small, result, line_info, rcond, info)
        call expect(expected, 'ismm')
      case (3)
        call jf_inverse_substructuring(trans, int(n, ip), int(n_freq, ip), h, result, line_info, rcond, info)
        call expect(expected, 'inverse_substructuring')
      case (4)
        call jf_joint_compliance(trans, int(n, ip), int(n_freq, ip), h, result, line_info, rcond, info)
        call expect(expected, 'joint_compliance')
      end select
    end subroutine try
  end subroutine pair_arguments

  subroutine decouple_arguments()
    call try(0, 'rr', 'N', 3, 3, 2, 2, both, both, both, above)
    call try(0, 'SS', 'T', 3, 3, 2, 2, both, both, twice, both)
    call try(-1, 'rk', 'N', 3, 3, 2, 2, both, both, both, both)
    call try(-1, '  ', 'N', 3, 3, 2, 2, both, both, both, both)
    call try(-2, 'rr', 'X', 3, 3, 2, 2, both, both, both, both)
    call try(-3, 'rr', 'N', -3, 3, 2, 2, both, both, both, both)
    call try(-4, 'rr', 'N', 3, -3, 2, 2, both, both, both, both)
    call try(-5, 'rr', 'N', 3, 3, -2, 2, both, both, both, both)
    call try(-5, 'rr', 'N', 1, 3, 2, 2, both, both, both, both)
    call try(-5, 'rr', 'N', 3, 1, 2, 2, both, both, both, both)
    call try(-6, 'rr', 'N', 3, 3, 2, -2, both, both, both, both)
    call try(-10, 'rs', 'N', 3, 3, 2, 2, above, both, both, both)
    call try(-10, 'rs', 'N', 3, 3, 2, 2, twice, both, both, both)
    call try(-11, 'rs', 'N', 3, 3, 2, 2, both, below, both, both)
    call try(-11, 'rs', 'N', 3, 3, 2, 2, both, twice, both, both)
    call try(-12, 'rr', 'N', 3, 3, 2, 2, both, both, below, both)
    call try(-12, 'rs', 'N', 3, 3, 2, 2, both, both, above, both)
    call try(-12, 'sr', 'N', 3, 3, 2, 2, both, both, twice, both)
    call try(-13, 'ss', 'N', 3, 3, 2, 2, both, both, both, below)
    call try(-13, 'rs', 'N', 3, 3, 2, 2, both, both, both, above)
    call try(-13, 'Sr', 'N', 3, 3, 2, 2, both, both, both, twice)

  contains

    subroutine try(expected, equation, trans, n_a, n_b, n, n_freq, dofs_j, dofs_k, dofs_r, dofs_s)
      integer, intent(in) :: expected, n_a, n_b, n, n_freq
      character(len=2), intent(in) :: equation
      character, intent(in) :: trans
      integer(ip), intent(in) :: dofs_j(2), dofs_k(2), dofs_r(2), dofs_s(2)

      call prepare()
      call jf_decouple([equation(1:1), equation(2:2)], trans, int(n_a, ip), int(n_b, ip), int(n, ip), int(n_freq, &
                       ip), h, g, small, dofs_j, dofs_k, dofs_r, dofs_s, result, line_info, rcond, info)
      call expect(expected, 'decouple '//equation)
    end subroutine try
  end subroutine decouple_arguments

  subroutine factor_arguments()
    call try(0, 'N', 1, 3, 2)
    call try(0, 'T', 2, 3, 2)
    call try(-1, 'X', 1, 3, 2)
    call try(-2, 'N', -1, 3, 2)
    call try(-3, 'N', 1, -3, 2)
    call try(-4, 'N', 1, 3, -2)

  contains

    subroutine try(expected, trans, n, m, n_freq)
      integer, intent(in) :: expected, n, m, n_freq
      character, intent(in) :: trans

      call prepare()
      call jf_compliance_factors(trans, int(n, ip), int(m, ip), int(n_freq, ip), h, matrix, result, line_info, rcond, &
                                 info)
      call expect(expected, 'compliance_factors')
    end subroutine try
  end subroutine factor_arguments

  subroutine covariance_arguments()
    call try(0, 'N', 1, 1, 3, 2)
    call try(0, 'T', 0, 2, 3, 2)
    call try(-1, 'X', 1, 1, 3, 2)
    call try(-2, 'N', 2, 1, 3, 2)
    call try(-2, 'N', -1, 1, 3, 2)
    call try(-3, 'N', 1, -1, 3, 2)
    call try(-4, 'N', 1, 1, -3, 2)
    call try(-5, 'N', 1, 1, 3, -2)

  contains

    subroutine try(expected, trans, reciprocal, n, m, n_freq)
      integer, intent(in) :: expected, reciprocal, n, m, n_freq
      character, intent(in) :: trans

      call prepare()
      call jf_compliance_covariance(trans, int(reciprocal, ip), int(n, ip), int(m, ip), int(n_freq, ip), h, matrix, &
                                    variance, result, line_info, rcond, info)
      call expect(expected, 'compliance_covariance')
    end subroutine try
  end subroutine covariance_arguments

  subroutine project_arguments()
    call try(0, 'N', 1, 2, 0, 2, 3, 0.1_dp)
    call try(0, 'T', 0, 2, 0, 2, 0, 0.0_dp)
    call try(0, 'N', 1, 1, 3, 2, 3, 0.1_dp)
    call try(0, 't', 0, 1, 4, 2, 3, 0.1_dp)
    call try(-1, 'X', 1, 2, 0, 2, 3, 0.1_dp)
    call try(-2, 'N', 2, 2, 0, 2, 3, 0.1_dp)
    call try(-2, 'N', -1, 2, 0, 2, 3, 0.1_dp)
    call try(-3, 'N', 1, 0, 0, 2, 3, 0.1_dp)
    call try(-3, 'N', 1, -2, 0, 2, 3, 0.1_dp)
    call try(-4, 'N', 1, 1, 4, 2, 3, 0.1_dp)
    call try(-4, 'N', 0, 1, 3, 2, 3, 0.1_dp)
    call try(-4, 'N', 1, 1, -1, 2, 3, 0.1_dp)
    call try(-5, 'N', 1, 1, 0, -2, 3, 0.1_dp)
    call try(-6, 'N', 1, 1, 0, 2, -3, 0.1_dp)
    call try(-7, 'N', 1, 1, 0, 2, 3, -0.1_dp)
    call try(-7, 'N', 1, 1, 0, 2, 3, infinity())
    call try(-7, 'N', 1, 1, 0, 2, 3, not_a_number())

  contains

    subroutine try(expected, trans, reciprocal, n, n_correlated, n_freq, steps, least_gain)
      integer, intent(in) :: expected, reciprocal, n, n_correlated, n_freq, steps
      character, intent(in) :: trans
      real(dp), intent(in) :: least_gain
      complex(dp) :: free(room, room, lines)

      call prepare()
      if (expected == 0) result = small(1, 1, 1)
      free = result(:room, :room, :)
      call jf_project_on_joint(trans, int(reciprocal, ip), int(n, ip), int(n_correlated, ip), int(n_freq, ip), &
                               int(steps, ip), least_gain, h, variance, factor, small, result, free, rcond, &
                               line_info, info)
      call expect(expected, 'project_on_joint')
      if (expected < 0) call check_untouched(free, 'project_on_joint')
    end subroutine try
  end subroutine project_arguments

  subroutine form_arguments()
    call try(0, 'N', 1, 2, 3, 0, 2, 1)
    call try(0, 'T', 0, 2, 4, 0, 2, 1)
    call try(0, 'N', 1, 1, 1, 3, 2, 1)
    call try(-1, 'X', 1, 2, 3, 0, 2, 1)
    call try(-2, 'N', 2, 2, 3, 0, 2, 1)
    call try(-3, 'N', 1, 0, 0, 0, 2, 1)
    call try(-3, 'N', 1, -1, 0, 0, 2, 1)
    call try(-4, 'N', 1, 2, 4, 0, 2, 1)
    call try(-4, 'N', 0, 2, 3, 0, 2, 1)
    call try(-5, 'N', 1, 1, 1, 4, 2, 1)
    call try(-6, 'N', 1, 1, 1, 0, -2, 1)
    call try(-7, 'N', 1, 1, 1, 0, 2, 0)

  contains

    subroutine try(expected, trans, reciprocal, n, n_free, n_correlated, n_freq, n_target)
      integer, intent(in) :: expected, reciprocal, n, n_free, n_correlated, n_freq, n_target
      character, intent(in) :: trans
      complex(dp) :: gradient(room, room, 1)

      call prepare()
      gradient = untouched
      call jf_joint_forms(trans, int(reciprocal, ip), int(n, ip), int(n_free, ip), int(n_correlated, ip), &
                          int(n_freq, ip), int(n_target, ip), h, variance, factor, small, g, g, result, gradient, &
                          rcond, line_info, info)
      call expect(expected, 'joint_forms')
      if (expected < 0) call check_untouched(gradient, 'joint_forms')
    end subroutine try
  end subroutine form_arguments

  subroutine difference_arguments()
    real(dp) :: offset(3)

    offset = [-0.1_dp, 0.0_dp, 0.2_dp]
    call try(0, 'N', 3, 2)
    call try(0, 'T', 2, 2)
    call try(-1, 'U', 3, 2)
    call try(-2, 'N', 1, 2)
    call try(-2, 'N', -3, 2)
    call try(-3, 'N', 3, -2)
    offset(3) = offset(1)
    call try(-4, 'N', 3, 2)
    offset(3) = not_a_number()
    call try(-4, 'N', 3, 2)

  contains

    subroutine try(expected, trans, m, n_freq)
      integer, intent(in) :: expected, m, n_freq
      character, intent(in) :: trans

      call prepare()
      call jf_central_difference(trans, int(m, ip), int(n_freq, ip), offset, h, result, line_info, rcond, info)
      call expect(expected, 'central_difference')

      ! the weights alone know neither TRANS (argument 1) nor n_freq (argument 3)
      if (expected == -1 .or. expected == -3) return
      call prepare()
      line_info = 0
      call jf_difference_weights(int(m, ip), offset, weights, info)
      if (expected /= 0) line_info = int(untouched, ip)
      call expect(merge(-1, merge(-2, 0, expected == -4), expected == -2), 'difference_weights')
    end subroutine try
  end subroutine difference_arguments

  subroutine transform_arguments()
    call try(0, 'N', 2, 3, 4, 2, 2)
    call try(0, 'T', 2, 3, 4, 2, 2)
    call try(-1, 'Q', 2, 3, 4, 2, 2)
    call try(-2, 'N', -2, 3, 4, 2, 2)
    call try(-3, 'N', 2, -3, 4, 2, 2)
    call try(-4, 'N', 2, 3, -4, 2, 2)
    call try(-5, 'N', 2, 3, 4, -2, 2)
    call try(-6, 'N', 2, 3, 4, 2, -2)

  contains

    subroutine try(expected, trans, n_out, n_in, m_out, m_in, n_freq)
      integer, intent(in) :: expected, n_out, n_in, m_out, m_in, n_freq
      character, intent(in) :: trans

      call prepare()
      call jf_transform(trans, int(n_out, ip), int(n_in, ip), int(m_out, ip), int(m_in, ip), int(n_freq, ip), h, &
                        matrix, matrix, result, line_info, rcond, info)
      call expect(expected, 'transform')
    end subroutine try
  end subroutine transform_arguments
end module trials

program test_arguments
  use testing, only: finish, seed
  use trials, only: all_arguments, predicates
  implicit none

  call seed(12)
  call predicates()
  call all_arguments()
  call finish('arguments')
end program test_arguments
