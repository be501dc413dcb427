!> Which argument of a routine is wrong, before anything is done: info = -i for the first one, 0 where all can be. The
!> forms with and without memory of the caller share them. Sizes come before the arrays whose lengths they are: an array
!> is read only where they are good.
module jointfrf_checks
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_double_complex
  use jointfrf_arguments, only: bad_offsets, bad_size, names, not_finite, out_of_range, repeated, unknown_equation, &
    unknown_order
  use jointfrf_brick, only: is_formulation
  use jointfrf_diagonal_joint, only: most_dofs
  use jointfrf_joint_derivatives, only: most_coupled_dofs, most_coupled_parameters
  use jointfrf_kinds, only: ip, long
  use jointfrf_line_layout, only: all_finite
  use jointfrf_monte_carlo, only: is_method
  use jointfrf_noise, only: is_kind, is_reference
  use jointfrf_rational_fit, only: most_poles
  use jointfrf_status, only: info_good
  implicit none
  private
  public :: check_invert, check_solve, check_receptance, check_receptance_banded, check_receptance_modal
  public :: check_couple, check_couple_bodies, check_modify, check_matrices, check_decouple, check_compliance_factors
  public :: check_compliance_covariance, check_expect_on_joint, check_fit_diagonal_joint, check_fit_joint, &
    check_joint_forms, check_start_joint, check_terms
  public :: check_joint_normal_equations
  public :: check_project_on_joint, check_springs
  public :: check_difference_weights, check_central_difference, check_transform, check_pollute, check_monte_carlo
  public :: check_brick_matrices, check_brick_quality, check_rational_fit, check_relocate_poles, check_smooth_frfs
  public :: check_estimate_noise, check_line_noise, check_noise_parts

contains

  pure function check_invert(n, n_freq) result(info)
    integer(ip), intent(in) :: n, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -2
    if (bad_size(n)) info = -1
  end function check_invert

  pure function check_solve(trans, n, n_rhs, n_freq) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_rhs, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -4
    if (bad_size(n_rhs)) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_solve

  pure function check_receptance(trans, n, n_freq, n_out, n_in, n_damping, n_structural, loss_factor, outputs, &
                                 inputs) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq, n_out, n_in, n_damping, n_structural, outputs(:), inputs(:)
    real(c_double), intent(in) :: loss_factor
    integer(ip) :: info

    info = info_good
    if (not_finite(loss_factor)) info = -13
    if (n_structural /= 0 .and. n_structural /= n) info = -11
    if (n_damping /= 0 .and. n_damping /= n) info = -9
    if (bad_size(n_in)) info = -5
    if (bad_size(n_out)) info = -4
    if (bad_size(n_freq)) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (out_of_range(inputs, n)) info = -15
    if (out_of_range(outputs, n)) info = -14
  end function check_receptance

  pure function check_receptance_banded(trans, n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural, &
                                        loss_factor, outputs, inputs) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, kl, ku, n_freq, n_out, n_in, n_damping, n_structural, outputs(:), inputs(:)
    real(c_double), intent(in) :: loss_factor
    integer(ip) :: info

    info = info_good
    if (not_finite(loss_factor)) info = -15
    if (n_structural /= 0 .and. n_structural /= n) info = -13
    if (n_damping /= 0 .and. n_damping /= n) info = -11
    if (bad_size(n_in)) info = -7
    if (bad_size(n_out)) info = -6
    if (bad_size(n_freq)) info = -5
    if (ku < 0 .or. (ku > 0 .and. ku >= n)) info = -4
    if (kl < 0 .or. (kl > 0 .and. kl >= n)) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (out_of_range(inputs, n)) info = -17
    if (out_of_range(outputs, n)) info = -16
  end function check_receptance_banded

  pure function check_receptance_modal(trans, n_modes, n_freq, n_out, n_in) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_modes, n_freq, n_out, n_in
    integer(ip) :: info

    info = info_good
    if (bad_size(n_in)) info = -5
    if (bad_size(n_out)) info = -4
    if (bad_size(n_freq)) info = -3
    if (bad_size(n_modes)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_receptance_modal

  pure function check_couple(trans, n_a, n_b, n_j, n_freq, dofs_a, dofs_b) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_a, n_b, n_j, n_freq, dofs_a(:), dofs_b(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -5
    if (bad_size(n_j) .or. n_j > min(n_a, n_b)) info = -4
    if (bad_size(n_b)) info = -3
    if (bad_size(n_a)) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (out_of_range(dofs_b, n_b) .or. repeated(dofs_b)) info = -10
    if (out_of_range(dofs_a, n_a) .or. repeated(dofs_a)) info = -9
  end function check_couple

  pure function check_couple_bodies(trans, n_body, n_row, n_h, n_t, n_out, n_in, n_freq, sizes, ends, connection, &
                                    rigid, outputs, inputs) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_body, n_row, n_h, n_t, n_out, n_in, n_freq
    integer(ip), intent(in) :: sizes(:), ends(:, :), connection(:), rigid(:), outputs(:), inputs(:)
    integer(ip) :: info
    integer(long) :: n

    info = info_good
    if (bad_size(n_freq)) info = -8
    if (bad_size(n_in)) info = -7
    if (bad_size(n_out)) info = -6
    if (bad_size(n_t)) info = -5
    if (bad_size(n_h)) info = -4
    if (bad_size(n_row)) info = -3
    if (bad_size(n_body) .or. n_body < 1) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    n = sum(int(sizes, long))
    if (bad_wanted(inputs)) info = -16
    if (bad_wanted(outputs)) info = -15
    if (any(rigid < 0 .or. rigid > 1)) info = -12
    if (bad_connections()) info = -11
    if (any(ends < 0 .or. ends > n) .or. any(ends(1, :) < 1)) info = -10
    if (any(sizes < 1 .or. sizes > n_h)) info = -9
    if (info /= info_good) return
    if (squares(connection) /= n_t) info = -5
    if (sum(int(sizes, long)**2) /= n_h) info = -4

  contains

    !> Whether wanted DOFs do not exist, are there twice, or are not in the order of the bodies.
    pure function bad_wanted(dofs) result(bad)
      integer(ip), intent(in) :: dofs(:)
      logical :: bad
      integer :: b, i
      integer(long) :: last

      bad = any(dofs < 1 .or. dofs > n)
      if (bad) return
      bad = repeated(dofs)
      b = 1
      last = sizes(1)
      do i = 1, size(dofs)
        do while (dofs(i) > last)
          b = b + 1
          last = last + sizes(b)
        end do
        bad = bad .or. dofs(i) <= last - sizes(b)
      end do
    end function bad_wanted

    !> Whether connections are not numbered from 1 on, row after row.
    pure function bad_connections() result(bad)
      logical :: bad
      integer :: m
      integer(ip) :: before

      bad = .false.
      before = 0
      do m = 1, size(connection)
        bad = bad .or. connection(m) < before .or. connection(m) > before + 1 .or. connection(m) < 1
        before = connection(m)
      end do
    end function bad_connections

    !> Sum of the squares of how many rows connections have.
    pure function squares(of) result(total)
      integer(ip), intent(in) :: of(:)
      integer(long) :: total, rows
      integer :: m

      total = 0
      rows = 0
      do m = 1, size(of)
        rows = rows + 1
        if (m < size(of)) then
          if (of(m + 1) == of(m)) cycle
        end if
        total = total + rows**2
        rows = 0
      end do
    end function squares
  end function check_couple_bodies

  pure function check_modify(trans, n, n_m, n_freq, dofs) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_m, n_freq, dofs(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -4
    if (bad_size(n_m) .or. n_m > n) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (out_of_range(dofs, n) .or. repeated(dofs)) info = -7
  end function check_modify

  !> Of the routines that take nothing but lines of matrices whose order is n or 2 n.
  pure function check_matrices(trans, n, n_freq) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_matrices

  pure function check_decouple(equation, trans, n_a, n_b, n, n_freq, dofs_j, dofs_k, dofs_r, dofs_s) result(info)
    character(kind=c_char), intent(in) :: equation(2), trans
    integer(ip), intent(in) :: n_a, n_b, n, n_freq, dofs_j(:), dofs_k(:), dofs_r(:), dofs_s(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -6
    if (bad_size(n) .or. n > min(n_a, n_b)) info = -5
    if (bad_size(n_b)) info = -4
    if (bad_size(n_a)) info = -3
    if (unknown_order(trans)) info = -2
    if (unknown_equation(equation)) info = -1
    if (info /= info_good) return
    if (names(equation, 's') .and. (out_of_range(dofs_s, n_b) .or. repeated(dofs_s))) info = -13
    if (names(equation, 'r') .and. (out_of_range(dofs_r, n_a) .or. repeated(dofs_r))) info = -12
    if (out_of_range(dofs_k, n_b) .or. repeated(dofs_k)) info = -11
    if (out_of_range(dofs_j, n_a) .or. repeated(dofs_j)) info = -10
  end function check_decouple

  pure function check_compliance_factors(trans, n, m, n_freq) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, m, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -4
    if (bad_size(m)) info = -3
    if (bad_size(n)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_compliance_factors

  pure function check_compliance_covariance(trans, reciprocal, n, m, n_freq) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, m, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -5
    if (bad_size(m)) info = -4
    if (bad_size(n)) info = -3
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -2
    if (unknown_order(trans)) info = -1
  end function check_compliance_covariance

  pure function check_project_on_joint(trans, reciprocal, n, n_correlated, n_freq, steps, least_gain) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq, steps
    real(c_double), intent(in) :: least_gain
    integer(ip) :: info

    info = info_good
    if (not_finite(least_gain) .or. least_gain < 0.0_c_double) info = -7
    if (bad_size(steps)) info = -6
    if (bad_size(n_freq)) info = -5
    if (n_correlated /= 0 .and. n_correlated /= entries_of_square(reciprocal, 2_ip, n)) info = -4
    if (n < 1 .or. bad_size(n)) info = -3
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -2
    if (unknown_order(trans)) info = -1
  end function check_project_on_joint

  !> Reference springs; `wrong` is the code of their argument.
  pure function check_springs(spring, wrong) result(info)
    real(c_double), intent(in) :: spring(:)
    integer(ip), intent(in) :: wrong
    integer(ip) :: info

    info = merge(info_good, wrong, all(spring >= 0.0_c_double .and. spring <= huge(spring)))
  end function check_springs

  pure function check_expect_on_joint(trans, reciprocal, n, n_correlated, n_freq, share, spread_m) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_correlated, n_freq
    real(c_double), intent(in) :: share, spread_m(:, :, :)
    integer(ip) :: info

    info = check_project_on_joint(trans, reciprocal, n, n_correlated, n_freq, 0_ip, 0.0_c_double)
    if (info /= info_good) return
    if (.not. all(spread_m > 0.0_c_double .and. spread_m <= huge(spread_m))) info = -7
    if (not_finite(share) .or. .not. share > 0.0_c_double) info = -6
  end function check_expect_on_joint

  pure function check_joint_forms(trans, reciprocal, n, n_free, n_correlated, n_freq, n_target) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_free, n_correlated, n_freq, n_target
    integer(ip) :: info

    info = info_good
    if (n_target < 1 .or. bad_size(n_target)) info = -7
    if (bad_size(n_freq)) info = -6
    if (n_correlated /= 0 .and. n_correlated /= entries_of_square(reciprocal, 2_ip, n)) info = -5
    if (n_free /= entries_of_square(reciprocal, 1_ip, n)) info = -4
    if (n < 1 .or. bad_size(n)) info = -3
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -2
    if (unknown_order(trans)) info = -1
  end function check_joint_forms

  pure function check_fit_diagonal_joint(trans, by_rate, n, n_par, n_freq, steps, held, least_gain, dofs, kinds, &
                                         lower, upper) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: by_rate, n, n_par, n_freq, steps, held, dofs(:), kinds(:)
    real(c_double), intent(in) :: least_gain, lower(:), upper(:)
    integer(ip) :: info

    info = info_good
    if (not_finite(least_gain) .or. least_gain < 0.0_c_double) info = -8
    if (held < 0 .or. held > n_par) info = -7
    if (bad_size(steps)) info = -6
    if (bad_size(n_freq)) info = -5
    if (n_par < n .or. n_par > 3*int(max(n, 0_ip), long)) info = -4
    if (n < 1 .or. n > most_dofs) info = -3
    if (by_rate /= 0 .and. by_rate /= 1) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (any(.not. lower <= upper)) info = -12
    if (any(kinds < 0 .or. kinds > 2) .or. count(kinds == 0) /= n) info = -10
    if (out_of_range(dofs, n)) info = -9
    if (info == -9 .or. info == -10) return
    if (repeated(3*dofs + kinds)) info = -10
  end function check_fit_diagonal_joint

  !> Matrices of order 2 n, or their entries, packed; rows and columns are arguments 5 and 6.
  pure subroutine check_storage(reciprocal, n, n_row, n_column, info)
    integer(ip), intent(in) :: reciprocal, n, n_row, n_column
    integer(ip), intent(inout) :: info
    logical :: packed

    packed = n_row == entries_of_square(reciprocal, 2_ip, n)
    if (n_column /= merge(1_long, 2*int(n, long), packed)) info = -6
    if (.not. packed .and. n_row /= 2*int(n, long)) info = -5
  end subroutine check_storage

  !> A joint without cross terms whose compliances come first, DOF by DOF; `wrong_dofs` and `wrong_kinds` are codes.
  pure function check_terms(n, dofs, kinds, wrong_dofs, wrong_kinds) result(info)
    integer(ip), intent(in) :: n, dofs(:), kinds(:), wrong_dofs, wrong_kinds
    integer(ip) :: info
    integer :: i

    info = info_good
    if (any(kinds < 0 .or. kinds > 2) .or. any(kinds(:n) /= 0) .or. any(kinds(n + 1:) == 0)) info = wrong_kinds
    if (out_of_range(dofs, n)) info = wrong_dofs
    if (info /= info_good) return
    do i = 1, int(n)
      if (dofs(i) /= i) info = wrong_dofs
    end do
    if (info == info_good .and. repeated(3*dofs + kinds)) info = wrong_kinds
  end function check_terms

  pure function check_fit_joint(trans, reciprocal, n, n_par, n_row, n_column, n_correlated, n_freq, start, patience, &
                                flexible, farthest, dofs, kinds, omega, spring, x) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_par, n_row, n_column, n_correlated, n_freq, start, patience, flexible
    integer(ip), intent(in) :: dofs(:), kinds(:)
    real(c_double), intent(in) :: farthest, omega(:), spring(:), x(:)
    integer(ip) :: info

    info = info_good
    if (not_finite(farthest) .or. farthest < 0.0_c_double) info = -12
    if (flexible /= 0 .and. flexible /= 1) info = -11
    if (bad_size(patience)) info = -10
    if (start < 0 .or. start > 2) info = -9
    if (bad_size(n_freq)) info = -8
    if (n_correlated /= 0 .and. n_correlated /= entries_of_square(reciprocal, 2_ip, n)) info = -7
    call check_storage(reciprocal, n, n_row, n_column, info)
    if (n_par < n .or. n_par > 3*int(max(n, 0_ip), long)) info = -4
    if (n < 1 .or. n > most_dofs) info = -3
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -2
    if (unknown_order(trans)) info = -1
    if (info == info_good) info = check_terms(n, dofs, kinds, -13_ip, -14_ip)
    if (info /= info_good) return
    if (start > 0 .and. .not. all(abs(x) <= huge(x))) info = -21
    if (start > 0 .and. .not. all(spring > 0.0_c_double .and. spring <= huge(spring))) info = -20
    if (.not. all(abs(omega) <= huge(omega))) info = -15
  end function check_fit_joint

  pure function check_start_joint(trans, reciprocal, n, n_par, n_row, n_column, n_freq, dofs, kinds, omega, spring) &
    result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: reciprocal, n, n_par, n_row, n_column, n_freq, dofs(:), kinds(:)
    real(c_double), intent(in) :: omega(:), spring(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -7
    call check_storage(reciprocal, n, n_row, n_column, info)
    if (n_par < n .or. n_par > 3*int(max(n, 0_ip), long)) info = -4
    if (n < 1 .or. n > most_dofs) info = -3
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -2
    if (unknown_order(trans)) info = -1
    if (info == info_good) info = check_terms(n, dofs, kinds, -8_ip, -9_ip)
    if (info /= info_good) return
    if (check_springs(spring, -11_ip) /= info_good) info = -11
    if (.not. all(abs(omega) <= huge(omega))) info = -10
  end function check_start_joint

  pure function check_joint_normal_equations(trans, n, n_par, n_entries, n_freq, rows, columns) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n, n_par, n_entries, n_freq, rows(:), columns(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -5
    if (n_entries /= entries_of_square(1_ip, 1_ip, n)) info = -4
    if (n_par < 1 .or. n_par > most_coupled_parameters) info = -3
    if (n < 1 .or. n > most_coupled_dofs) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (out_of_range(columns, n)) info = -7
    if (out_of_range(rows, n)) info = -6
  end function check_joint_normal_equations

  !> The number of entries of a matrix of order blocks*n, or of its upper triangle; of an n that is refused anyway, any.
  pure function entries_of_square(reciprocal, blocks, n) result(entries)
    integer(ip), intent(in) :: reciprocal, blocks, n
    integer(long) :: entries, order

    order = blocks*int(min(max(n, 0_ip), 2_ip**30), long)
    entries = order*order
    if (reciprocal == 1) entries = (entries + order)/2
  end function entries_of_square

  pure function check_difference_weights(m, offset) result(info)
    integer(ip), intent(in) :: m
    real(c_double), intent(in) :: offset(:)
    integer(ip) :: info

    info = info_good
    if (m < 2 .or. bad_size(m)) info = -1
    if (info /= info_good) return
    if (bad_offsets(offset)) info = -2
  end function check_difference_weights

  pure function check_central_difference(trans, m, n_freq, offset) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: m, n_freq
    real(c_double), intent(in) :: offset(:)
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -3
    if (m < 2 .or. bad_size(m)) info = -2
    if (unknown_order(trans)) info = -1
    if (info /= info_good) return
    if (bad_offsets(offset)) info = -4
  end function check_central_difference

  pure function check_transform(trans, n_out, n_in, m_out, m_in, n_freq) result(info)
    character(kind=c_char), intent(in) :: trans
    integer(ip), intent(in) :: n_out, n_in, m_out, m_in, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -6
    if (bad_size(m_in)) info = -5
    if (bad_size(m_out)) info = -4
    if (bad_size(n_in)) info = -3
    if (bad_size(n_out)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_transform

  pure function check_pollute(trans, kind, reference, reciprocal, block, level, n_out, n_in, n_freq, first, &
                              count) result(info)
    character(kind=c_char), intent(in) :: trans, kind, reference
    integer(ip), intent(in) :: reciprocal, block, n_out, n_in, n_freq, first, count
    real(c_double), intent(in) :: level
    integer(ip) :: info

    info = info_good
    if (bad_size(count)) info = -12
    if (count > 0) then
      if (n_freq > huge(0)/count .or. first > huge(0) - count) info = -12
    end if
    if (bad_size(first)) info = -11
    if (bad_size(n_freq)) info = -10
    if (bad_size(n_in)) info = -9
    if (bad_size(n_out)) info = -8
    if (not_finite(level) .or. level < 0.0_c_double) info = -6
    if (block < 1 .or. bad_size(block)) then
      info = -5
    else if (mod(n_out, block) /= 0 .or. mod(n_in, block) /= 0) then
      info = -5
    end if
    if (reciprocal /= 0 .and. .not. (reciprocal == 1 .and. n_out == n_in)) info = -4
    if (.not. is_reference(reference)) info = -3
    if (.not. is_kind(kind)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_pollute

  pure function check_monte_carlo(trans, method, kind, reference, reciprocal, block, level, n, n_freq, first, &
                                  count) result(info)
    character(kind=c_char), intent(in) :: trans, method, kind, reference
    integer(ip), intent(in) :: reciprocal, block, n, n_freq, first, count
    real(c_double), intent(in) :: level
    integer(ip) :: info

    info = info_good
    if (count < 1 .or. bad_size(count)) then
      info = -12
    else if (first > huge(0) - count) then
      info = -12
    end if
    if (bad_size(first)) info = -11
    if (bad_size(n_freq)) info = -10
    if (n < 1 .or. bad_size(n)) info = -9
    if (not_finite(level) .or. level < 0.0_c_double) info = -7
    if (block < 1 .or. bad_size(block)) then
      info = -6
    else if (mod(2_long*n, int(block, long)) /= 0) then
      info = -6
    end if
    if (reciprocal /= 0 .and. reciprocal /= 1) info = -5
    if (.not. is_reference(reference)) info = -4
    if (.not. is_kind(kind)) info = -3
    if (.not. is_method(method)) info = -2
    if (unknown_order(trans)) info = -1
  end function check_monte_carlo

  pure function check_brick_matrices(formulation, n_elements, youngs_modulus, poisson, density, hourglass, &
                                     lumped) result(info)
    character(kind=c_char), intent(in) :: formulation
    integer(ip), intent(in) :: n_elements, lumped
    real(c_double), intent(in) :: youngs_modulus(:), poisson(:), density(:), hourglass
    integer(ip) :: info

    info = info_good
    if (bad_size(n_elements)) info = -2
    if (.not. is_formulation(formulation)) info = -1
    if (info /= info_good) return
    if (lumped /= 0 .and. lumped /= 1) info = -8
    if (not_finite(hourglass) .or. hourglass < 0.0_c_double) info = -7
    if (.not. all(density > 0.0_c_double .and. density <= huge(density))) info = -6
    if (.not. all(poisson > -1.0_c_double .and. poisson < 0.5_c_double)) info = -5
    if (.not. all(youngs_modulus > 0.0_c_double .and. youngs_modulus <= huge(youngs_modulus))) info = -4
  end function check_brick_matrices

  pure function check_brick_quality(n_elements) result(info)
    integer(ip), intent(in) :: n_elements
    integer(ip) :: info

    info = info_good
    if (bad_size(n_elements)) info = -1
  end function check_brick_quality

  pure function check_relocate_poles(n_poles, n_entries, n_freq, iterations, still) result(info)
    integer(ip), intent(in) :: n_poles, n_entries, n_freq, iterations
    real(c_double), intent(in) :: still
    integer(ip) :: info

    info = check_rational_fit(n_poles, n_entries, n_freq)
    if (info /= info_good) return
    if (not_finite(still) .or. still < 0.0_c_double) info = -5
    if (bad_size(iterations)) info = -4
  end function check_relocate_poles

  pure function check_rational_fit(n_poles, n_entries, n_freq) result(info)
    integer(ip), intent(in) :: n_poles, n_entries, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -3
    if (bad_size(n_entries) .or. 4*int(n_entries, long) > huge(0)) info = -2
    if (bad_size(n_poles) .or. n_poles > most_poles) info = -1
  end function check_rational_fit

  pure function check_smooth_frfs(n_entries, n_freq, max_poles, n_start, patience, inflation, freq, h, variance) &
    result(info)
    integer(ip), intent(in) :: n_entries, n_freq, max_poles, n_start, patience
    real(c_double), intent(in) :: inflation, freq(:), variance(:, :)
    complex(c_double_complex), contiguous, intent(in) :: h(:, :)
    integer(ip) :: info

    info = info_good
    if (bad_size(patience)) info = -5
    if (not_finite(inflation) .or. (inflation < 1.0_c_double .and. abs(inflation) > 0.0_c_double)) info = -6
    if (bad_size(n_start) .or. n_start > max_poles) info = -4
    if (bad_size(max_poles) .or. max_poles < 1 .or. max_poles > most_poles) info = -3
    if (bad_size(n_freq)) info = -2
    if (bad_size(n_entries) .or. 4*int(n_entries, long) > huge(0)) info = -1
    if (info /= info_good .or. size(h) == 0) return
    if (.not. all(variance > 0.0_c_double .and. variance <= huge(variance))) info = -9
    if (.not. all_finite(h)) info = -8
    if (.not. is_rising(freq)) info = -7
  end function check_smooth_frfs

  !> Of `jf_line_correlation` and `jf_line_levels`, whose third argument is the noise.
  !> is_flag   of jf_line_levels; 0 of the other
  pure function check_line_noise(n_entries, n_freq, number, least, is_flag) result(info)
    integer(ip), intent(in) :: n_entries, n_freq, is_flag
    real(c_double), intent(in) :: number, least
    integer(ip) :: info

    info = info_good
    if (is_flag /= 0 .and. is_flag /= 1) info = -5
    if (not_finite(number) .or. number < least) info = -4
    if (bad_size(n_freq)) info = -2
    if (bad_size(n_entries)) info = -1
  end function check_line_noise

  pure function check_noise_parts(method, n_terms, n_entries, n_freq) result(info)
    character(kind=c_char), intent(in) :: method
    integer(ip), intent(in) :: n_terms, n_entries, n_freq
    integer(ip) :: info

    info = info_good
    if (bad_size(n_freq)) info = -4
    if (bad_size(n_entries)) info = -3
    if (n_terms < 1 .or. n_terms > 100 .or. (index('Cc', method) > 0 .and. n_terms /= 2)) info = -2
    if (index('LlRrCc', method) == 0) info = -1
  end function check_noise_parts

  pure function check_estimate_noise(n_entries, n_freq, n_pairs, robust, floor_shape, h, smooth, share, given, first, &
                                     second, inflation) result(info)
    integer(ip), intent(in) :: n_entries, n_freq, n_pairs, robust, first(:), second(:)
    real(c_double), intent(in) :: floor_shape(:), share(:), given(:, :), inflation
    complex(c_double_complex), contiguous, intent(in) :: h(:, :), smooth(:, :)
    integer(ip) :: info

    info = info_good
    if (robust /= 0 .and. robust /= 1) info = -4
    if (bad_size(n_pairs)) info = -3
    if (bad_size(n_freq)) info = -2
    if (bad_size(n_entries)) info = -1
    if (info /= info_good .or. size(h) == 0) return
    if (not_finite(inflation) .or. inflation < 1.0_c_double) info = -12
    if (out_of_range(second, n_entries)) info = -11
    if (out_of_range(first, n_entries)) info = -10
    if (.not. all(given >= 0.0_c_double .and. given <= huge(given))) info = -9
    if (.not. all(share >= 0.0_c_double .and. share <= huge(share))) info = -8
    if (.not. all_finite(smooth)) info = -7
    if (.not. all_finite(h)) info = -6
    if (.not. all(floor_shape > 0.0_c_double .and. floor_shape <= huge(floor_shape))) info = -5
  end function check_estimate_noise

  !> Whether frequencies are finite, not negative, and each is larger than the one before.
  pure function is_rising(freq) result(rising)
    real(c_double), intent(in) :: freq(:)
    logical :: rising
    integer :: k, n

    n = size(freq)
    rising = freq(1) >= 0.0_c_double .and. freq(n) > 0.0_c_double .and. freq(n) <= huge(freq)
    do k = 2, n
      rising = rising .and. freq(k) > freq(k - 1)
    end do
  end function is_rising
end module jointfrf_checks
