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
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_lanes, only: element_matrix, element_space, in_doubt, lane_kernels, lanes, largest_in_lanes, &
    largest_solved, padded
  use jointfrf_line_layout, only: all_finite
  use jointfrf_lines_lapack, only: product_block, room_to_solve, solve_line
  use jointfrf_status, only: info_good, info_no_memory, line_good, line_not_finite
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
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
    integer, allocatable :: place(:)             !< of S + T B H B^T in lanes
  contains
    procedure :: line => assemble_one
    procedure :: line_block => assemble_block
  end type assembly

  !> What a line works in.
  type :: line_work
    complex(dp), pointer, contiguous :: across(:, :), left(:, :), w(:, :), force(:, :), columns(:, :), rows(:, :)
    complex(dp), pointer, contiguous :: scale(:, :), inverse(:, :)
  end type line_work

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
    if (worth_a_plan(size(h, 2)) .and. whole%n_row >= 1 &
        .and. whole%n_row <= merge(largest_in_lanes, largest_solved, whole%n_in >= whole%n_row)) call plan_lanes(whole)
    call run_sweep(whole, size(h, 2, kind=ip), line_info, rcond, info)
  end subroutine couple_bodies

  subroutine plan_lanes(whole)
    type(assembly), intent(inout) :: whole
    type(element_space) :: room
    type(element_matrix) :: matrix
    integer :: before

    call room%system(whole%n_row, 0, before, matrix)
    call room%in_memory(.true., matrix, whole%place)
    call whole%lies_in(room, whole%n_row**2)
    whole%n_hint = padded(whole%n_row)
  end subroutine plan_lanes

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

  !> Take what a line works in; of a block also the inverses of its lines, and what their rows were scaled by.
  subroutine take_work(self, space, work)
    class(assembly), intent(in) :: self
    type(line_space), target, intent(inout) :: space
    type(line_work), intent(out) :: work

    associate (q => self%n_row, e => self%most_ends)
      call space%take(q, q, work%across)
      call space%take(q, q, work%left)
      call space%take(q, q, work%w)
      call space%take(self%n_in, q, work%force)
      call space%take(max(q, self%most_out), e, work%columns)
      call space%take(e, max(self%n_in, self%most_in), work%rows)
      call space%take(q, lanes, work%scale)
      if (self%n_element > 0) call space%take(q**2, lanes, work%inverse)
      call room_to_solve(q, space)
    end associate
  end subroutine take_work

  subroutine assemble_one(self, i, space, line_info, rcond)
    class(assembly), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    type(line_work) :: work
    integer :: m

    call take_work(self, space, work)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%h(:, i:i)) .and. all_finite(self%t(:, i:i)))) return
    call connections(self, self%n_row, i, work%across, work%left, work%scale(:, 1))
    if (self%n_in > 0 .and. self%n_in < self%n_row) then
      call free_motions(self, self%n_row, self%h(:, i), work%across)
      call by_connections(self, self%n_row, self%n_in, self%t(:, i), work%across, work%w)
      call scale_rows(work%scale(:, 1), work%w(:, :self%n_in))
      call solve_line(work%left, work%w(:, :self%n_in), space, line_info, rcond)
      if (line_info /= line_good) return
      work%force = transpose(work%w(:, :self%n_in))
    else
      work%across = 0
      do m = 1, self%n_row
        work%across(m, m) = work%scale(m, 1)
      end do
      call before_connections(self, self%n_row, self%t(:, i), work%across, work%w)
      call solve_line(work%left, work%w, space, line_info, rcond)
      if (line_info /= line_good) return
      call find_forces(self, i, work)
    end if
    call find_responses(self, i, work)
  end subroutine assemble_one

  !> The inverses of S + T B H B^T side by side; all else line by line.
  subroutine assemble_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(assembly), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp), pointer, contiguous :: pairs(:, :, :)
    real(dp) :: rcond_lanes(lanes)
    logical :: finite(n_lines)
    type(line_work) :: work
    integer :: i, l, q

    q = self%n_row
    space%used = 0
    call take_work(self, space, work)
    do l = 1, n_lines
      i = first + l - 1
      finite(l) = all_finite(self%h(:, i:i)) .and. all_finite(self%t(:, i:i))
      work%inverse(:, l) = 0
      if (finite(l)) call connections(self, q, i, work%across, work%inverse(:, l), work%scale(:, l))
    end do
    call c_f_pointer(c_loc(work%inverse), pairs, [2, q**2, lanes])
    call kernels%load(q**2, self%place, 1, n_lines, pairs, space%x)
    call kernels%invert(q, 0, space%x, space%hint, space%list, rcond_lanes, space%ahead)
    call kernels%store(q**2, space%list, 1, n_lines, space%x, pairs)
    rcond = rcond_lanes(:n_lines)
    call kernels%judge(n_lines, 0*rcond, line_info, rcond)
    do l = 1, n_lines
      if (line_info(l) == line_good .and. finite(l)) then
        i = first + l - 1
        call scale_columns(q, work%scale(:, l), work%inverse(:, l))
        call before_connections(self, q, self%t(:, i), work%inverse(:, l), work%w)
        finite(l) = all_finite(work%w)
      end if
      if (line_info(l) /= line_good .or. .not. finite(l)) then
        line_info(l) = in_doubt
        cycle
      end if
      call find_forces(self, i, work)
      call find_responses(self, i, work)
    end do
  end subroutine assemble_block

  !> S + T B H B^T; rows are scaled, as those of a constraint and of a stiffness are of different size.
  !> across   workspace
  !> scale    what the rows were multiplied by
  subroutine connections(self, q, i, across, left, scale)
    type(assembly), intent(in) :: self
    integer, intent(in) :: q, i
    complex(dp), contiguous, intent(inout) :: across(:, :)
    complex(dp), intent(inout) :: left(q, q), scale(q)
    integer :: b, j, k
    real(dp) :: largest(q)

    across = 0
    do b = 1, size(self%bodies)
      call add_across(self%bodies(b), self%h(:, i), across)
    end do
    call by_connections(self, q, q, self%t(:, i), across, left)
    largest = 0
    do j = 1, q
      left(j, j) = left(j, j) + self%flexible(j)
      do k = 1, q
        largest(k) = max(largest(k), abs(real(left(k, j), dp)) + abs(aimag(left(k, j))))
      end do
    end do
    scale = 1/merge(largest, 1.0_dp, largest > 0)
    call scale_rows(scale, left)
  end subroutine connections

  pure subroutine scale_rows(scale, x)
    complex(dp), intent(in) :: scale(:)
    complex(dp), intent(inout) :: x(:, :)
    integer :: j

    do j = 1, size(x, 2)
      x(:, j) = x(:, j)*real(scale, dp)
    end do
  end subroutine scale_rows

  pure subroutine scale_columns(q, scale, x)
    integer, intent(in) :: q
    complex(dp), intent(in) :: scale(q)
    complex(dp), intent(inout) :: x(q, q)
    integer :: j

    do j = 1, q
      x(:, j) = x(:, j)*real(scale(j), dp)
    end do
  end subroutine scale_columns

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

  !> T times a matrix of n columns.
  subroutine by_connections(self, q, n, t, x, product)
    type(assembly), intent(in) :: self
    integer, intent(in) :: q, n
    complex(dp), intent(in) :: t(*), x(q, *)
    complex(dp), intent(inout) :: product(q, *)
    integer :: c, first
    integer(long) :: at

    first = 1
    at = 1
    do c = 1, size(self%block_size)
      associate (m => self%block_size(c))
        call product_block(m, n, m, 1.0_dp, t(at), m, x(first, 1), q, 0.0_dp, product(first, 1), q)
        first = first + m
        at = at + int(m, long)**2
      end associate
    end do
  end subroutine by_connections

  !> A square matrix times T.
  subroutine before_connections(self, q, t, x, product)
    type(assembly), intent(in) :: self
    integer, intent(in) :: q
    complex(dp), intent(in) :: t(*), x(q, q)
    complex(dp), intent(inout) :: product(q, q)
    integer :: c, first
    integer(long) :: at

    first = 1
    at = 1
    do c = 1, size(self%block_size)
      associate (m => self%block_size(c))
        call product_block(q, m, m, 1.0_dp, x(1, first), q, t(at), m, 0.0_dp, product(1, first), q)
        first = first + m
        at = at + int(m, long)**2
      end associate
    end do
  end subroutine before_connections

  !> Motions across the connections by forces on bodies that are not connected: B H.
  pure subroutine free_motions(self, q, h, motion)
    type(assembly), intent(in) :: self
    integer, intent(in) :: q
    complex(dp), contiguous, intent(in) :: h(:)
    complex(dp), intent(inout) :: motion(q, *)
    integer :: b, j, k
    integer(long) :: column

    motion(:, :self%n_in) = 0
    do b = 1, size(self%bodies)
      associate (own => self%bodies(b))
        do j = 1, size(own%inputs)
          column = own%before + int(own%n, long)*(own%inputs(j) - 1)
          do k = 1, size(own%row)
            associate (one => motion(own%row(k), own%first_in + j - 1))
              one = one + own%sign(k)*h(column + own%dof(k))
            end associate
          end do
        end do
      end associate
    end do
  end subroutine free_motions

  subroutine find_forces(self, i, work)
    type(assembly), intent(in) :: self
    integer, intent(in) :: i
    type(line_work), intent(inout) :: work
    integer :: b

    do b = 1, size(self%bodies)
      call forces_of(self%bodies(b), self%n_row, self%n_in, self%h(:, i), work%w, work%columns, work%rows, work%force)
    end do
  end subroutine find_forces

  subroutine find_responses(self, i, work)
    type(assembly), intent(in) :: self
    integer, intent(in) :: i
    type(line_work), intent(inout) :: work
    integer :: b

    do b = 1, size(self%bodies)
      call responses_of(self%bodies(b), self%n_row, self%n_out, self%n_in, self%h(:, i), work%force, work%columns, &
                        work%rows, self%result(:, :, i))
    end do
  end subroutine find_responses

  !> Forces in the connections by forces on a body: (S + T B H B^T)^-1 T B H, a column each connection's row.
  subroutine forces_of(own, q, n_in, h, w, columns, rows, force)
    type(body), intent(in) :: own
    integer, intent(in) :: q, n_in
    complex(dp), intent(in) :: h(*), w(q, q)
    complex(dp), intent(inout) :: columns(q, size(own%row)), rows(size(own%inputs), size(own%row)), force(n_in, q)
    integer :: j, k, n
    integer(long) :: element

    n = size(own%inputs)
    if (n == 0) return
    do k = 1, size(own%row)
      columns(:, k) = w(:, own%row(k))
      do j = 1, n
        element = own%before + int(own%n, long)*(own%inputs(j) - 1) + own%dof(k)
        rows(j, k) = own%sign(k)*h(element)
      end do
    end do
    call product_block(n, q, size(own%row), 1.0_dp, rows, n, columns, q, 0.0_dp, force(own%first_in, 1), n_in, .true.)
  end subroutine forces_of

  !> Responses of a body: those to its own forces, less those to the forces in the connections.
  subroutine responses_of(own, q, n_out, n_in, h, force, columns, rows, y)
    type(body), intent(in) :: own
    integer, intent(in) :: q, n_out, n_in
    complex(dp), intent(in) :: h(*), force(n_in, q)
    complex(dp), intent(inout) :: columns(size(own%outputs), size(own%row)), rows(n_in, size(own%row)), y(n_out, n_in)
    integer :: j, k, n, last
    integer(long) :: column

    n = size(own%outputs)
    if (n == 0) return
    last = own%first_out + n - 1
    do k = 1, size(own%row)
      column = own%before + int(own%n, long)*(own%dof(k) - 1)
      columns(:, k) = own%sign(k)*h(column + own%outputs)
      rows(:, k) = force(:, own%row(k))
    end do
    call product_block(n, n_in, size(own%row), -1.0_dp, columns, n, rows, n_in, 0.0_dp, y(own%first_out, 1), n_out, &
                       .true.)
    do j = own%first_in, own%first_in + size(own%inputs) - 1
      column = own%before + int(own%n, long)*(own%inputs(j - own%first_in + 1) - 1)
      y(own%first_out:last, j) = y(own%first_out:last, j) + h(column + own%outputs)
    end do
  end subroutine responses_of

end module jointfrf_bodies
