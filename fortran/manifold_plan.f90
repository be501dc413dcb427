!> Where the numbers lie with which FRFs of a joint are written, for the manifold kernels.
!>
!> gamma_jj = H, gamma_jk = H F, gamma_kj = F' H, gamma_kk = F' H F + R A with F = T A, F' = A' T', A = 1 - Q R,
!> A' = 1 - R Q, T = 1 - Z R, T' = 1 - R Z. R = (K* + Z)^-1 is the compliance of the joint in parallel with reference
!> springs Z, which are given; H and Q are free. Without springs Z = 0, T = 1, and R is the compliance of the joint.
!> Entries of gamma that are used are counted jk row by row, kj column by column, kk and jj row by row: of a reciprocal
!> structure without kj and what is below the diagonals. Free entries of H, Q and R are the upper triangle row by row,
!> or all.
!>
!> A column of derivatives has an element for each entry of gamma. Many of its elements are zero; `groups` are the runs
!> of entries that have the same columns not zero, so that products of columns leave the zeros out.
module jointfrf_manifold_plan
  use jointfrf_kinds, only: dp
  implicit none
  private
  public :: make_manifold_plan

  !> Entries of R by which columns are asked for: none, those of its diagonal, all that are free.
  integer, parameter, public :: by_none = 0, by_diagonal = 1, by_all = 2

  !> Entries first + 1 .. first + n, and the columns that are not zero there, ascending.
  type, public :: entry_group
    integer :: first = 0, n = 0
    integer, allocatable :: column(:)
  end type entry_group

  type, public :: manifold_plan
    logical :: reciprocal = .true.
    integer :: n = 0                       !< joint DOFs
    integer :: n_free = 0                  !< free entries of H, of Q and of R
    integer :: n_entry = 0                 !< entries of gamma
    integer :: n_joint = 0                 !< entries of R by which columns are asked for
    integer :: n_column = 0                !< columns: by H, by Q, by those entries of R, then residuals
    integer :: n_target = 1                !< residuals
    logical :: correlated = .false.        !< whether columns are whitened by a triangular factor
    integer :: n_element = 0               !< elements that all this takes
    real(dp), allocatable :: spring(:)     !< Z, N/m
    logical :: has_springs = .false.       !< whether one of them is not zero
    !> The element before each matrix, which lies row by row.
    integer :: r = 0, h = 0, q = 0         !< at the point that is looked at
    integer :: best_h = 0, best_q = 0      !< at the best point so far
    integer :: right = 0, left = 0         !< F and F'
    integer :: jk = 0, kj = 0, kk = 0      !< blocks of gamma
    !> Products with T and T'; without springs these are the factors themselves.
    integer :: t = 0, t_left = 0           !< T and T'; without springs none
    integer :: a = 0, a_left = 0           !< A and A'
    integer :: h_t = 0, t_h = 0            !< H T and T' H
    integer :: kj_t = 0, t_jk = 0          !< gamma_kj T and T' gamma_jk
    integer :: kj_r = 0, jk_r = 0          !< the same, plus R
    integer :: of_r(4) = 0                 !< what columns by R are made of
    integer :: target = 0                  !< entries of the FRFs, one run of entries a target
    integer :: columns = 0                 !< columns, one run of entries each
    integer :: whitened = 0                !< the same whitened; where that changes nothing, the same place
    integer :: normal = 0                  !< products of columns, row by row; n_column elements a row
    integer :: result = 0                  !< n_joint by n_joint, row by row
    integer :: unused = 0                  !< elements that nobody reads
    integer, allocatable :: row(:), column(:)        !< of each free entry
    integer, allocatable :: joint(:)       !< the free entry that each of R is by which there is a column
    integer, allocatable :: gamma_row(:), gamma_column(:)      !< of each entry of gamma
    integer, allocatable :: gamma(:)       !< the element where each entry of gamma is computed
    integer, allocatable :: in_rows(:)     !< the entry that is number i of the matrix gamma row by row
    integer, allocatable :: kk_first(:)    !< the entry before the first one of each row of kk
    type(entry_group), allocatable :: groups(:)      !< of the columns by H and Q and one residual
    type(entry_group) :: joint_groups(1)             !< of the columns by R and all residuals
  end type manifold_plan

contains

  !> Plan for n joint DOFs.
  !> by_r        by which entries of R there are columns
  !> n_target    FRFs whose residuals are wanted
  !> correlated  whether columns are whitened by a triangular factor
  !> spring      Z, shape (n), N/m; of size 0 where there are none
  subroutine make_manifold_plan(reciprocal, n, by_r, n_target, correlated, plan, stat, spring)
    logical, intent(in) :: reciprocal, correlated
    integer, intent(in) :: n, by_r, n_target
    type(manifold_plan), intent(out) :: plan
    integer, intent(out) :: stat
    real(dp), intent(in) :: spring(:)
    integer :: k, d

    plan%reciprocal = reciprocal
    plan%n = n
    plan%n_target = n_target
    plan%correlated = correlated
    plan%n_free = merge((n*(n + 1))/2, n*n, reciprocal)
    plan%n_entry = merge(n*(2*n + 1), 4*n*n, reciprocal)
    if (by_r == by_diagonal) plan%n_joint = n
    if (by_r == by_all) plan%n_joint = plan%n_free
    plan%n_column = 2*plan%n_free + plan%n_joint + n_target
    plan%has_springs = any(spring > 0.0_dp)
    allocate (plan%spring(n), plan%row(plan%n_free), plan%column(plan%n_free), plan%gamma_row(plan%n_entry), &
              plan%gamma_column(plan%n_entry), plan%gamma(plan%n_entry), plan%in_rows(plan%n_entry), plan%kk_first(n), &
              plan%groups(number_of_groups(plan)), plan%joint(plan%n_joint), stat=stat)
    if (stat /= 0) return
    plan%spring(:) = 0.0_dp
    if (plan%has_springs) plan%spring(:) = spring
    call list_triangle(reciprocal, n, plan%row, plan%column)
    d = 0
    do k = 1, plan%n_free
      if (by_r == by_none .or. (by_r == by_diagonal .and. plan%row(k) /= plan%column(k))) cycle
      d = d + 1
      plan%joint(d) = k
    end do
    call place_elements(plan)
    call list_entries(plan, stat)
    if (stat == 0) call list_groups(plan, stat)
    if (stat == 0) call set_group(0, plan%n_entry, plan%n_column - 2*plan%n_free, plan%joint_groups(1), stat)
    if (stat == 0) call count_up(2*plan%n_free + 1, plan%joint_groups(1)%column)
  end subroutine make_manifold_plan

  !> Rows and columns of the upper triangle row by row, or of all entries.
  pure subroutine list_triangle(upper, n, row, column)
    logical, intent(in) :: upper
    integer, intent(in) :: n
    integer, intent(out) :: row(:), column(:)
    integer :: i, j, k

    k = 0
    do i = 1, n
      do j = merge(i, 1, upper), n
        k = k + 1
        row(k) = i
        column(k) = j
      end do
    end do
  end subroutine list_triangle

  subroutine place_elements(plan)
    type(manifold_plan), intent(inout) :: plan
    integer :: n2, i

    n2 = plan%n*plan%n
    plan%r = run(n2)
    plan%h = run(n2)
    plan%q = run(n2)
    plan%best_h = run(n2)
    plan%best_q = run(n2)
    plan%right = run(n2)
    plan%left = run(n2)
    plan%jk = run(n2)
    plan%kj = run(n2)
    plan%kk = run(n2)
    plan%kj_r = run(n2)
    plan%jk_r = run(n2)
    plan%a = plan%right
    plan%a_left = plan%left
    plan%h_t = plan%h
    plan%t_h = plan%h
    plan%kj_t = plan%kj
    plan%t_jk = plan%jk
    if (plan%has_springs) then
      plan%t = run(n2)
      plan%t_left = run(n2)
      plan%a = run(n2)
      plan%a_left = run(n2)
      plan%h_t = run(n2)
      plan%t_h = run(n2)
      plan%kj_t = run(n2)
      plan%t_jk = run(n2)
    end if
    plan%target = run(plan%n_entry*plan%n_target)
    plan%columns = run(plan%n_entry*plan%n_column)
    plan%whitened = plan%columns
    if (plan%correlated) plan%whitened = run(plan%n_entry*plan%n_column)
    plan%normal = run(plan%n_column**2)
    if (plan%n_joint > 0) then
      plan%result = run(plan%n_joint**2)
      do i = 1, size(plan%of_r)
        plan%of_r(i) = run(n2)
      end do
    end if
    plan%unused = run(4)

  contains

    !> The next n elements: the element before them.
    integer function run(n)
      integer, intent(in) :: n

      run = plan%n_element
      plan%n_element = plan%n_element + n
    end function run
  end subroutine place_elements

  !> The entries of gamma in their order.
  subroutine list_entries(plan, stat)
    type(manifold_plan), intent(inout) :: plan
    integer, intent(out) :: stat
    integer, allocatable :: number(:, :)
    integer :: n, i, j, e

    n = plan%n
    e = 0
    allocate (number(2*n, 2*n), stat=stat)
    if (stat /= 0) return
    number = 0
    do i = 1, n
      do j = 1, n
        call add(i, n + j, plan%jk + (i - 1)*n + j)
      end do
    end do
    if (.not. plan%reciprocal) then
      do j = 1, n
        do i = 1, n
          call add(n + i, j, plan%kj + (i - 1)*n + j)
        end do
      end do
    end if
    do i = 1, n
      plan%kk_first(i) = e
      do j = merge(i, 1, plan%reciprocal), n
        call add(n + i, n + j, plan%kk + (i - 1)*n + j)
      end do
    end do
    do i = 1, n
      do j = merge(i, 1, plan%reciprocal), n
        call add(i, j, plan%h + (i - 1)*n + j)
      end do
    end do
    e = 0
    do i = 1, 2*n
      do j = 1, 2*n
        if (number(i, j) == 0) cycle
        e = e + 1
        plan%in_rows(e) = number(i, j)
      end do
    end do

  contains

    subroutine add(row, column, element)
      integer, intent(in) :: row, column, element

      e = e + 1
      plan%gamma_row(e) = row
      plan%gamma_column(e) = column
      plan%gamma(e) = element
      number(row, column) = e
    end subroutine add
  end subroutine list_entries

  !> Groups of the columns by H and Q and one residual.
  pure function number_of_groups(plan) result(groups)
    type(manifold_plan), intent(in) :: plan
    integer :: groups

    groups = 1
    if (.not. plan%correlated) groups = plan%n + merge(0, plan%n, plan%reciprocal) + 1 + plan%n_free
  end function number_of_groups

  !> Columns by H are zero in most rows of jk, in most columns of kj, and but for one entry in jj; those by Q in jj.
  subroutine list_groups(plan, stat)
    type(manifold_plan), intent(inout) :: plan
    integer, intent(out) :: stat
    integer :: n, u, k, i, g

    n = plan%n
    u = plan%n_free
    if (plan%correlated) then
      call set_group(0, plan%n_entry, 2*u + 1, plan%groups(1), stat)
      if (stat == 0) call count_up(1, plan%groups(1)%column)
      return
    end if
    stat = 0
    do i = 1, n
      call add_group((i - 1)*n, plan%row == i .or. (plan%reciprocal .and. plan%column == i), plan%groups(i))
    end do
    g = n
    if (.not. plan%reciprocal) then
      do i = 1, n
        call add_group(n*n + (i - 1)*n, plan%column == i, plan%groups(n + i))
      end do
      g = 2*n
    end if
    g = g + 1
    if (stat == 0) call set_group(plan%kk_first(1), u, 2*u + 1, plan%groups(g), stat)
    if (stat == 0) call count_up(1, plan%groups(g)%column)
    do k = 1, u
      if (stat == 0) call set_group(plan%n_entry - u + k - 1, 1, 2, plan%groups(g + k), stat)
      if (stat == 0) plan%groups(g + k)%column(:) = [k, 2*u + 1]
    end do

  contains

    !> n entries with some columns by H, and those by Q.
    subroutine add_group(first, by_h, group)
      integer, intent(in) :: first
      logical, intent(in) :: by_h(:)
      type(entry_group), intent(inout) :: group
      integer :: at

      if (stat == 0) call set_group(first, n, count(by_h) + u + 1, group, stat)
      if (stat /= 0) return
      at = 0
      do k = 1, u
        if (.not. by_h(k)) cycle
        at = at + 1
        group%column(at) = k
      end do
      call count_up(u + 1, group%column(at + 1:))
    end subroutine add_group
  end subroutine list_groups

  !> A group with room for its columns.
  subroutine set_group(first, n, n_column, group, stat)
    integer, intent(in) :: first, n, n_column
    type(entry_group), intent(inout) :: group
    integer, intent(out) :: stat

    group%first = first
    group%n = n
    ! allow(C181): the caller looks at it
    allocate (group%column(n_column), stat=stat)
  end subroutine set_group

  pure subroutine count_up(first, list)
    integer, intent(in) :: first
    integer, intent(out) :: list(:)
    integer :: i

    do i = 1, size(list)
      list(i) = first + i - 1
    end do
  end subroutine count_up
end module jointfrf_manifold_plan
