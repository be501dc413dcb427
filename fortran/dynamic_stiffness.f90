!> Receptance of a model from its matrices (2.28)-(2.29): by solving, dense or banded.
module jointfrf_dynamic_stiffness
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lapack, only: zgbcon, zgbtrf, zgbtrs
  use jointfrf_line_layout, only: all_finite, store
  use jointfrf_lines_lapack, only: inverse_work, one_norm, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: receptance_dense, receptance_banded

  integer(c_size_t), parameter :: one_char = 1_c_size_t

  !> What both ways share: Z = (1 + i eta) K + i H + i w C - w^2 M at chosen DOFs.
  !> `damping` and `structural` may be empty.
  type, abstract, extends(line_operation) :: dynamic_stiffness
    logical :: transposed, has_damping, has_structural
    integer :: n
    real(dp) :: loss_factor
    real(dp), pointer, contiguous :: omega(:)
    real(dp), pointer, contiguous :: stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    integer(ip), pointer, contiguous :: outputs(:), inputs(:)
  contains
  end type dynamic_stiffness

  type, extends(dynamic_stiffness) :: dense_stiffness
  contains
    procedure :: line => dense_one
  end type dense_stiffness

  type, extends(dynamic_stiffness) :: banded_stiffness
    integer :: kl, ku
  contains
    procedure :: line => banded_one
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
                              h, line_info, rcond, info)
    logical, intent(in) :: transposed
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    real(dp), intent(in) :: loss_factor
    integer(ip), contiguous, target, intent(in) :: outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(out) :: h(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(dense_stiffness) :: operation
    integer :: n, n_in

    n = size(stiffness, 1)
    n_in = size(inputs)
    call set_model(operation, transposed, n, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                   inputs, h)
    operation%n_complex = n*n + n*n_in + size(outputs)*n_in + inverse_work(n)
    operation%n_real = 2*n
    operation%n_pivot = n
    operation%flops = 8.0_dp*real(n, dp)**2*(n/3.0_dp + n_in)
    call run_sweep(operation, size(omega, kind=ip), line_info, rcond, info)
  end subroutine receptance_dense

  !> The same for matrices in LAPACK band storage, entry (i, j) at (ku + 1 + i - j, j), with zgbtrf and zgbtrs (zgbsv).
  !> kl, ku        number of diagonals below and above the main one
  !> stiffness     K, shape (kl + ku + 1, n); mass alike; damping and structural alike or (0, 0)
  !> the rest      as in `receptance_dense`; TRANS concerns h only
  subroutine receptance_banded(transposed, kl, ku, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                               inputs, h, line_info, rcond, info)
    logical, intent(in) :: transposed
    integer, intent(in) :: kl, ku
    real(dp), contiguous, target, intent(in) :: omega(:), stiffness(:, :), mass(:, :), damping(:, :), structural(:, :)
    real(dp), intent(in) :: loss_factor
    integer(ip), contiguous, target, intent(in) :: outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(out) :: h(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(banded_stiffness) :: operation
    integer :: n, n_in

    n = size(stiffness, 2)
    n_in = size(inputs)
    call set_model(operation, transposed, n, omega, stiffness, mass, damping, structural, loss_factor, outputs, &
                   inputs, h)
    operation%kl = kl
    operation%ku = ku
    operation%n_complex = (2*kl + ku + 1)*n + n*n_in + size(outputs)*n_in + 2*n
    operation%n_real = n
    operation%n_pivot = n
    operation%flops = 8.0_dp*real(n, dp)*(real(kl, dp)*(kl + ku + 1) + real(n_in, dp)*(2*kl + ku + 1))
    call run_sweep(operation, size(omega, kind=ip), line_info, rcond, info)
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

    z => space%matrix(self%n, self%n)
    x => space%matrix(self%n, size(self%inputs))
    h => space%matrix(size(self%outputs), size(self%inputs))
    call fill(self, self%omega(i), z)
    line_info = line_not_finite
    rcond = 0.0_dp
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
    real(dp) :: norm
    integer(ip) :: n, kl, ku, ld, ignored

    n = int(self%n, ip)
    kl = int(self%kl, ip)
    ku = int(self%ku, ip)
    ld = 2*kl + ku + 1
    band => space%matrix(int(ld), self%n)
    x => space%matrix(self%n, size(self%inputs))
    h => space%matrix(size(self%outputs), size(self%inputs))
    work => space%matrix(2*self%n, 1)
    line_info = line_good
    rcond = 1.0_dp
    if (n == 0) return
    call fill_band(self, self%omega(i), band)
    norm = one_norm(band)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (.not. all_finite(band)) return
    line_info = line_good
    rcond = 1.0_dp
    if (size(self%inputs) == 0) return
    call zgbtrf(n, n, kl, ku, band, ld, space%pivot, line_info)
    if (line_info /= line_good) return
    call unit_forces(self%inputs, x)
    call zgbtrs('N', n, kl, ku, size(self%inputs, kind=ip), band, ld, space%pivot, x, n, ignored, one_char)
    call zgbcon('1', n, kl, ku, band, ld, space%pivot, norm, rcond, work, space%r, ignored, one_char)
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
