!> FRFs at a joint as the caller has them, measured and smooth, with their noise; lines of them as matrices.
module jointfrf_joint_frfs
  use jointfrf_kinds, only: dp
  implicit none
  private

  !> The numbers of a line are the matrix gamma in the caller's order, or packed: its entries that are read, row by row.
  !> Entries (p, q) and (q, p) of a reciprocal structure are one number, that of the upper triangle.
  type, public :: joint_frfs
    logical :: transposed = .false., reciprocal = .true.
    integer :: n_row = 0, n_column = 0                                   !< 2 n by 2 n, or the entries by 1
    real(dp), pointer, contiguous :: omega(:) => null()                  !< rad/s
    complex(dp), pointer, contiguous :: measured(:, :) => null()         !< at DOFs j, then k, (numbers, n_freq), m/N
    complex(dp), pointer, contiguous :: smooth(:, :) => null()           !< the same
    real(dp), pointer, contiguous :: inverse_std(:, :) => null()         !< weights, the same shape, N/m
    real(dp), pointer, contiguous :: whitening(:, :, :) => null()        !< see jointfrf_manifold; of size 0 for none
    integer, allocatable :: place(:, :)                                  !< the number that is entry (out, in)
  contains
    procedure :: n_dof, n_freq, is_first, set_places, load_line
  end type joint_frfs

contains

  !> Joint DOFs.
  pure integer function n_dof(self)
    class(joint_frfs), intent(in) :: self

    n_dof = size(self%place, 1)/2
  end function n_dof

  !> Frequency lines.
  pure integer function n_freq(self)
    class(joint_frfs), intent(in) :: self

    n_freq = size(self%smooth, 2)
  end function n_freq

  !> Whether an entry is the first that its number is.
  pure logical function is_first(self, i, j)
    class(joint_frfs), intent(in) :: self
    integer, intent(in) :: i, j

    is_first = i <= j .or. .not. self%reciprocal
  end function is_first

  !> Find the places of the entries for n joint DOFs.
  subroutine set_places(self, n, stat)
    class(joint_frfs), intent(inout) :: self
    integer, intent(in) :: n
    integer, intent(out) :: stat
    integer :: i, j, number

    allocate (self%place(2*n, 2*n), stat=stat)
    if (stat /= 0) return
    number = 0
    do i = 1, 2*n
      do j = 1, 2*n
        if (.not. self%is_first(i, j)) cycle
        number = number + 1
        if (self%n_column > 1) number = merge(j + (i - 1)*2*n, i + (j - 1)*2*n, self%transposed)
        self%place(i, j) = number
        if (self%reciprocal) self%place(j, i) = number
      end do
    end do
  end subroutine set_places

  !> Smooth FRFs of one line and the weights of their entries, (out, in). An entry that is not used need not be a
  !> number.
  pure subroutine load_line(self, line, gamma, weight)
    class(joint_frfs), intent(in) :: self
    integer, intent(in) :: line
    complex(dp), intent(out) :: gamma(:, :)
    real(dp), intent(out) :: weight(:, :)
    integer :: i, j

    do j = 1, size(gamma, 2)
      do i = 1, size(gamma, 1)
        gamma(i, j) = self%smooth(self%place(i, j), line)
        weight(i, j) = self%inverse_std(self%place(i, j), line)
        if (.not. weight(i, j) > 0.0_dp .and. .not. abs(gamma(i, j)) <= huge(1.0_dp)) gamma(i, j) = 0.0_dp
      end do
    end do
  end subroutine load_line
end module jointfrf_joint_frfs
