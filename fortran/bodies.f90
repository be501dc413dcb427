!> Receptances of any number of bodies, connected all at once: dual assembly with flexible and rigid connections.
!>
!> Row m of the connections takes the motion u_m = x_plus - x_minus between two DOFs, of the same body or of two, or of
!> one DOF against the ground. Forces f in the connections follow S f = T u with S = 1 and T = K* where they give way,
!> S = 0 and T = 1 where they are rigid. With the free motions across them, u = u_free - B H B^T f, the assembly is
!>
!>     Y = H - H B^T (S + T B H B^T)^-1 T B H
!>
!> for loops of bodies, too. H is the diagonal of the bodies' receptances, so that all products are those of one body
!> with the rows it has a part in. The transpose of all matrices gives the transpose of Y.
module jointfrf_bodies
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_line_layout, only: all_finite
  use jointfrf_lines_lapack, only: product_block, room_to_solve, solve_line
  use jointfrf_status, only: info_good, info_no_memory, line_good, line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep
  implicit none
  private
  public :: couple_bodies

  !> One body: where its numbers lie, which rows of the connections it has a part in, which DOFs are wanted.
  type :: body
    integer :: n = 0                             !< DOFs
    integer(long) :: before = 0                  !< numbers of a line before its receptance
    integer, allocatable :: row(:), dof(:)       !< rows it has a part in, and its DOF there
    real(dp), allocatable :: sign(:)             !< of the DOF in the motion of the row
    integer :: first_out = 0, first_in = 0       !< its first wanted response and force among all
    integer, allocatable :: outputs(:), inputs(:)  !< its DOFs that are wanted
  end type body

  type, extends(line_operation) :: assembly
    integer :: n_row = 0, n_out = 0, n_in = 0
    integer :: most_ends = 0, most_out = 0, most_in = 0  !< largest of any body
    type(body), allocatable :: bodies(:)
    integer, allocatable :: block_size(:)        !< rows of each connection
    real(dp), allocatable :: flexible(:)         !< S
    complex(dp), pointer, contiguous :: h(:, :) => null(), t(:, :) => null()
  contains
    procedure :: line => assemble_one
  end type assembly

contains

  !> Receptances of the assembly between some DOFs.
  !> sizes      DOFs of each body
  !> ends       DOFs plus and minus of each row, counted through all bodies from 1; 0 for the ground; shape (2, n_row)
  !> connection number of the connection of each row; rows of one connection follow each other
  !> rigid      not 0 for a rigid row
  !> h          receptances of the bodies one after the other, shape (sum of sizes**2, n_freq), m/N
  !> t          T of the connections one after the other, shape (sum of squares of their rows, n_freq)
  !> outputs, inputs   wanted DOFs, those of a body together, bodies in their order
  !> h_c        shape (n_out, n_in, n_freq)
  subroutine couple_bodies(sizes, ends, connection, rigid, h, t, outputs, inputs, h_c, line_info, rcond, info)
    integer(ip), intent(in) :: sizes(:), ends(:, :), connection(:), rigid(:), outputs(:), inputs(:)
    complex(dp), contiguous, target, intent(in) :: h(:, :), t(:, :)
    complex(dp), contiguous, target, intent(out) :: h_c(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(assembly) :: whole
    integer :: b

    info = info_no_memory
    call plan_bodies(sizes, ends, outputs, inputs, whole, info)
    if (info /= info_good) return
    call plan_connections(connection, rigid, whole, info)
    if (info /= info_good) return
    whole%h => h
    whole%t => t
    whole%result => h_c
    do b = 1, size(whole%bodies)
      associate (own => whole%bodies(b), q => real(whole%n_row, dp), e => real(size(whole%bodies(b)%row), dp))
        whole%flops = whole%flops + 8.0_dp*e*(size(own%outputs)*real(whole%n_in, dp) + q*size(own%inputs))
      end associate
    end do
    whole%flops = whole%flops + 32.0_dp/3.0_dp*real(whole%n_row, dp)**3
    call run_sweep(whole, size(h, 2, kind=ip), line_info, rcond, info)
  end subroutine couple_bodies

  subroutine plan_bodies(sizes, ends, outputs, inputs, whole, info)
    integer(ip), intent(in) :: sizes(:), ends(:, :), outputs(:), inputs(:)
    type(assembly), intent(inout) :: whole
    integer(ip), intent(out) :: info
    integer(long) :: numbers
    integer :: b, first, stat

    info = info_no_memory
    allocate (whole%bodies(size(sizes)), stat=stat)
    if (stat /= 0) return
    whole%n_row = size(ends, 2)
    whole%n_out = size(outputs)
    whole%n_in = size(inputs)
    first = 0
    numbers = 0
    do b = 1, size(sizes)
      associate (own => whole%bodies(b))
        own%n = int(sizes(b))
        own%before = numbers
        call find_ends(own, first, ends, stat)
        if (stat == 0) call find_wanted(outputs, first, own%n, own%first_out, own%outputs, stat)
        if (stat == 0) call find_wanted(inputs, first, own%n, own%first_in, own%inputs, stat)
        if (stat /= 0) return
        whole%most_ends = max(whole%most_ends, size(own%row))
        whole%most_out = max(whole%most_out, size(own%outputs))
        whole%most_in = max(whole%most_in, size(own%inputs))
        first = first + own%n
        numbers = numbers + int(own%n, long)**2
      end associate
    end do
    info = info_good
  end subroutine plan_bodies

  !> The rows that a body has a part in; one that holds two of its DOFs is there twice.
  subroutine find_ends(own, first, ends, stat)
    type(body), intent(inout) :: own
    integer, intent(in) :: first
    integer(ip), intent(in) :: ends(:, :)
    integer, intent(out) :: stat
    integer :: m, side, used

    allocate (own%row(count(inside(ends))), own%dof(count(inside(ends))), own%sign(count(inside(ends))), stat=stat)
    if (stat /= 0) return
    used = 0
    do m = 1, size(ends, 2)
      do side = 1, 2
        if (.not. inside(ends(side, m))) cycle
        used = used + 1
        own%row(used) = m
        own%dof(used) = int(ends(side, m)) - first
        own%sign(used) = merge(1.0_dp, -1.0_dp, side == 1)
      end do
    end do

  contains

    elemental function inside(dof) result(yes)
      integer(ip), intent(in) :: dof
      logical :: yes

      yes = dof > first .and. dof <= first + own%n
    end function inside
  end subroutine find_ends

  !> The DOFs of a body among those that are wanted, and the place of the first.
  subroutine find_wanted(wanted, first, n, place, dofs, stat)
    integer(ip), intent(in) :: wanted(:)
    integer, intent(in) :: first, n
    integer, intent(out) :: place, stat
    integer, allocatable, intent(out) :: dofs(:)
    integer :: i, used

    allocate (dofs(count(wanted > first .and. wanted <= first + n)), stat=stat)
    if (stat /= 0) return
    place = count(wanted <= first) + 1
    used = 0
    do i = 1, size(wanted)
      if (wanted(i) <= first .or. wanted(i) > first + n) cycle
      used = used + 1
      dofs(used) = int(wanted(i)) - first
    end do
  end subroutine find_wanted

  subroutine plan_connections(connection, rigid, whole, info)
    integer(ip), intent(in) :: connection(:), rigid(:)
    type(assembly), intent(inout) :: whole
    integer(ip), intent(out) :: info
    integer :: m, stat, n_block

    info = info_no_memory
    n_block = 0
    if (size(connection) > 0) n_block = int(connection(size(connection)))
    allocate (whole%block_size(n_block), whole%flexible(size(rigid)), stat=stat)
    if (stat /= 0) return
    whole%block_size(:) = 0
    do m = 1, size(connection)
      whole%block_size(connection(m)) = whole%block_size(connection(m)) + 1
    end do
    whole%flexible(:) = merge(1.0_dp, 0.0_dp, rigid == 0)
    info = info_good
  end subroutine plan_connections

  subroutine assemble_one(self, i, space, line_info, rcond)
    class(assembly), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: across(:, :), left(:, :), w(:, :), force(:, :), columns(:, :), rows(:, :)
    integer :: b

    associate (q => self%n_row, e => self%most_ends)
      call space%take(q, q, across)
      call space%take(q, q, left)
      call space%take(q, q, w)
      call space%take(q, self%n_in, force)
      call space%take(max(q, self%most_out), e, columns)
      call space%take(e, max(self%n_in, self%most_in), rows)
      call room_to_solve(q, space)
    end associate
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%h(:, i:i)) .and. all_finite(self%t(:, i:i)))) return
    across = 0
    do b = 1, size(self%bodies)
      call add_across(self%bodies(b), self%h(:, i), across)
    end do
    call connections(self, self%n_row, self%t(:, i), across, left, w)
    call solve_line(left, w, space, line_info, rcond)
    if (line_info /= line_good) return
    do b = 1, size(self%bodies)
      call forces_of(self%bodies(b), self%n_row, self%h(:, i), w, columns, rows, force)
    end do
    do b = 1, size(self%bodies)
      call responses_of(self%bodies(b), self%n_row, self%n_out, self%n_in, self%h(:, i), force, columns, rows, &
                        self%result(:, :, i))
    end do
  end subroutine assemble_one

  !> Add the part of a body to B H B^T.
  pure subroutine add_across(own, h, across)
    type(body), intent(in) :: own
    complex(dp), contiguous, intent(in) :: h(:)
    complex(dp), contiguous, intent(inout) :: across(:, :)
    integer :: k, m
    integer(long) :: column

    do k = 1, size(own%row)
      column = own%before + int(own%n, long)*(own%dof(k) - 1)
      do m = 1, size(own%row)
        across(own%row(m), own%row(k)) = across(own%row(m), own%row(k)) + own%sign(m)*own%sign(k)*h(column + own%dof(m))
      end do
    end do
  end subroutine add_across

  !> S + T B H B^T and T; rows of either are scaled, as those of a constraint and of a stiffness are of different size.
  subroutine connections(self, q, t, across, left, right)
    type(assembly), intent(in) :: self
    integer, intent(in) :: q
    complex(dp), intent(in) :: t(*), across(q, q)
    complex(dp), intent(inout) :: left(q, q), right(q, q)
    integer :: c, first, k, n
    integer(long) :: at
    real(dp) :: largest

    right = 0
    first = 1
    at = 1
    do c = 1, size(self%block_size)
      n = self%block_size(c)
      call product_block(n, q, n, 1.0_dp, t(at), n, across(first, 1), q, 0.0_dp, left(first, 1), q)
      do k = 0, n - 1
        right(first:first + n - 1, first + k) = t(at + int(k, long)*n:at + int(k, long)*n + n - 1)
      end do
      first = first + n
      at = at + int(n, long)**2
    end do
    do k = 1, q
      left(k, k) = left(k, k) + self%flexible(k)
      largest = maxval(abs(real(left(k, :), dp)) + abs(aimag(left(k, :))))
      if (.not. largest > 0) cycle
      left(k, :) = left(k, :)/largest
      right(k, :) = right(k, :)/largest
    end do
  end subroutine connections

  !> Forces in the connections by forces on a body: (S + T B H B^T)^-1 T B H.
  subroutine forces_of(own, q, h, w, columns, rows, force)
    type(body), intent(in) :: own
    integer, intent(in) :: q
    complex(dp), intent(in) :: h(*), w(q, q)
    complex(dp), intent(inout) :: columns(q, size(own%row)), rows(size(own%row), *), force(q, *)
    integer :: j, k, n_end, n_in
    integer(long) :: column

    n_end = size(own%row)
    n_in = size(own%inputs)
    if (n_in == 0) return
    do k = 1, n_end
      columns(:, k) = w(:, own%row(k))
    end do
    do j = 1, n_in
      column = own%before + int(own%n, long)*(own%inputs(j) - 1)
      do k = 1, n_end
        rows(k, j) = own%sign(k)*h(column + own%dof(k))
      end do
    end do
    call product_block(q, n_in, n_end, 1.0_dp, columns, q, rows, max(n_end, 1), 0.0_dp, force(1, own%first_in), q)
  end subroutine forces_of

  !> Responses of a body: those to its own forces, less those to the forces in the connections.
  subroutine responses_of(own, q, n_out, n_in, h, force, columns, rows, y)
    type(body), intent(in) :: own
    integer, intent(in) :: q, n_out, n_in
    complex(dp), intent(in) :: h(*), force(q, n_in)
    complex(dp), intent(inout) :: columns(size(own%outputs), size(own%row)), rows(size(own%row), n_in), y(n_out, n_in)
    integer :: j, k, n_end, n, last
    integer(long) :: column

    n_end = size(own%row)
    n = size(own%outputs)
    if (n == 0) return
    last = own%first_out + n - 1
    do k = 1, n_end
      column = own%before + int(own%n, long)*(own%dof(k) - 1)
      columns(:, k) = own%sign(k)*h(column + own%outputs)
    end do
    do j = 1, n_in
      rows(:, j) = force(own%row, j)
      y(own%first_out:last, j) = 0
    end do
    do j = 1, size(own%inputs)
      column = own%before + int(own%n, long)*(own%inputs(j) - 1)
      y(own%first_out:last, own%first_in + j - 1) = h(column + own%outputs)
    end do
    call product_block(n, n_in, n_end, -1.0_dp, columns, n, rows, max(n_end, 1), 1.0_dp, y(own%first_out, 1), n_out)
  end subroutine responses_of

end module jointfrf_bodies
