!> The order in which a sparse system is eliminated down to the unknowns that are wanted, found once for all lines.
!>
!> A static condensation: unknown after unknown is eliminated with its own pivot until only the retained ones are left.
!> What is being worked on lies in a small square of `slots`; a slot is free again once its unknown is eliminated. A
!> plan holds no numbers, only where they come from and go to.
module jointfrf_elimination_plan
  use jointfrf_kinds, only: dp
  implicit none
  private
  public :: make_plan

  type, public :: elimination_plan
    integer :: n_slots = 0                    !< the square has n_slots**2 elements, (i, j) at (i - 1) n_slots + j
    integer :: n_retained = 0                 !< retained unknowns, in slots 1..n_retained
    integer :: n_steps = 0                    !< unknowns eliminated
    integer :: products = 0                   !< multiplications of a line
    logical :: symmetric = .false.            !< only (i, j) with i <= j is kept
    integer, allocatable :: pivot(:)          !< slot of the unknown eliminated in each step, shape (n_steps)
    integer, allocatable :: last_near(:)      !< slots coupled with it: near(last_near(s) + 1:last_near(s + 1))
    integer, allocatable :: near(:)           !< ascending
    integer, allocatable :: last_zero(:)      !< elements that begin as zero, before step s; alike, shape (n_steps + 2)
    integer, allocatable :: zero(:)
    integer, allocatable :: last_entry(:)     !< elements that begin as entries of the matrix; alike
    integer, allocatable :: entry(:)
    integer, allocatable :: row(:), column(:) !< which entries
    integer, allocatable :: unknown(:)        !< the retained unknown in each slot
    real(dp), allocatable :: coefficient(:, :)  !< their numbers, shape (4, entries); set by the user of the plan
  end type elimination_plan

contains

  !> Plan for a matrix of order n.
  !> coupled     whether unknowns j and j + d are coupled, shape (reach, n) with d first
  !> retained    whether an unknown is not to be eliminated; on return also those that cut the structure in parts
  !> wanted      retained unknowns that shall have the last slots, in this order
  !> symmetric   whether the matrix is
  subroutine make_plan(n, coupled, retained, wanted, symmetric, plan)
    integer, intent(in) :: n, wanted(:)
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(inout) :: retained(n)
    logical, intent(in) :: symmetric
    type(elimination_plan), intent(out) :: plan
    integer, allocatable :: order(:), slot_of(:), in_slot(:), near(:)
    logical, allocatable :: known(:, :)
    integer :: n_bound, reach, s, p, i, j, m

    reach = size(coupled, 1)
    plan%symmetric = symmetric
    allocate (slot_of(n), source=0)
    allocate (order(n))
    call add_separators(n, coupled, retained)
    call set_slots(wanted, retained, slot_of, plan)
    call find_order(n, coupled, retained, order, plan%n_steps)
    n_bound = plan%n_retained + 2*reach + 2
    allocate (known(n_bound, n_bound), source=.false.)     ! pairs of slots that hold a number
    allocate (in_slot(n_bound), source=0)
    in_slot(:plan%n_retained) = plan%unknown
    plan%n_slots = plan%n_retained
    allocate (plan%pivot(plan%n_steps), plan%last_near(plan%n_steps + 1), plan%last_zero(plan%n_steps + 2), &
              plan%last_entry(plan%n_steps + 2))
    plan%last_near = 0
    plan%last_zero = 0
    plan%last_entry = 0
    allocate (near(n_bound))
    call allocate_lists(plan, n*(reach + 1))
    do s = 1, plan%n_steps
      p = order(s)
      call take_slot(p)
      do j = max(1, p - reach), min(n, p + reach)
        if (j == p) cycle
        if (slot_of(j) < 0) cycle                          ! eliminated
        if (coupled(abs(j - p), min(j, p))) call take_slot(j)
      end do
      plan%pivot(s) = slot_of(p)
      m = 0
      do i = 1, plan%n_slots
        if (in_slot(i) == 0 .or. in_slot(i) == p) cycle
        if (.not. (known(i, slot_of(p)) .or. is_coupled(in_slot(i), p))) cycle
        m = m + 1
        near(m) = i
      end do
      call begin_with(slot_of(p), slot_of(p))
      do i = 1, m
        call begin_with(near(i), slot_of(p))
        do j = 1, i
          call begin_with(near(j), near(i))
        end do
      end do
      do i = 1, m
        call append(plan%near, plan%last_near(s + 1), near(i))
      end do
      plan%products = plan%products + merge((m*(m + 1))/2, m*m, symmetric)
      known(:, slot_of(p)) = .false.
      known(slot_of(p), :) = .false.
      in_slot(slot_of(p)) = 0
      slot_of(p) = -1
      if (s < plan%n_steps) plan%last_near(s + 2) = plan%last_near(s + 1)
      plan%last_zero(s + 2) = plan%last_zero(s + 1)
      plan%last_entry(s + 2) = plan%last_entry(s + 1)
    end do
    s = plan%n_steps + 1
    do i = 1, plan%n_retained
      do j = 1, i
        call begin_with(j, i)
      end do
    end do
    call close_lists(plan, n_bound)

  contains

    !> A free slot for an unknown that has none.
    subroutine take_slot(unknown)
      integer, intent(in) :: unknown

      if (slot_of(unknown) > 0) return
      slot_of(unknown) = findloc(in_slot, 0, dim=1)
      in_slot(slot_of(unknown)) = unknown
      plan%n_slots = max(plan%n_slots, slot_of(unknown))
    end subroutine take_slot

    function is_coupled(a, b) result(yes)
      integer, intent(in) :: a, b
      logical :: yes

      yes = a == b
      if (a == b .or. abs(a - b) > reach) return
      yes = coupled(abs(a - b), min(a, b))
    end function is_coupled

    !> What a pair of slots holds before step s.
    subroutine begin_with(a, b)
      integer, intent(in) :: a, b
      integer :: low, high

      low = min(a, b)
      high = max(a, b)
      if (known(low, high)) return
      known(low, high) = .true.
      known(high, low) = .true.
      call begin_one(low, high)
      if (low /= high .and. .not. symmetric) call begin_one(high, low)
    end subroutine begin_with

    subroutine begin_one(a, b)
      integer, intent(in) :: a, b
      integer :: e

      if (is_coupled(in_slot(a), in_slot(b))) then
        e = plan%last_entry(s + 1)
        call append(plan%row, e, in_slot(a))
        e = plan%last_entry(s + 1)
        call append(plan%column, e, in_slot(b))
        call append(plan%entry, plan%last_entry(s + 1), (a - 1)*n_bound + b)
      else
        call append(plan%zero, plan%last_zero(s + 1), (a - 1)*n_bound + b)
      end if
    end subroutine begin_one
  end subroutine make_plan

  !> Slots of the retained unknowns: the wanted ones last.
  subroutine set_slots(wanted, retained, slot_of, plan)
    integer, intent(in) :: wanted(:)
    logical, intent(in) :: retained(:)
    integer, intent(inout) :: slot_of(:)
    type(elimination_plan), intent(inout) :: plan
    integer :: j, slot

    plan%n_retained = count(retained)
    allocate (plan%unknown(plan%n_retained))
    slot = plan%n_retained - size(wanted)
    do j = 1, size(wanted)
      slot_of(wanted(j)) = slot + j
    end do
    slot = 0
    do j = 1, size(retained)
      if (.not. retained(j)) cycle
      if (slot_of(j) == 0) then
        slot = slot + 1
        slot_of(j) = slot
      end if
      plan%unknown(slot_of(j)) = j
    end do
  end subroutine set_slots

  !> Room for the lists.
  subroutine allocate_lists(plan, room)
    type(elimination_plan), intent(inout) :: plan
    integer, intent(in) :: room

    allocate (plan%near(room), plan%zero(room), plan%entry(room), plan%row(room), plan%column(room))
  end subroutine allocate_lists

  !> Count elements in the square as it turned out.
  subroutine close_lists(plan, n_bound)
    type(elimination_plan), intent(inout) :: plan
    integer, intent(in) :: n_bound
    integer :: e

    do e = 1, plan%last_entry(plan%n_steps + 2)
      plan%entry(e) = moved(plan%entry(e))
    end do
    do e = 1, plan%last_zero(plan%n_steps + 2)
      plan%zero(e) = moved(plan%zero(e))
    end do
    allocate (plan%coefficient(4, plan%last_entry(plan%n_steps + 2)), source=0.0_dp)

  contains

    function moved(element) result(new)
      integer, intent(in) :: element
      integer :: new

      new = ((element - 1)/n_bound)*plan%n_slots + mod(element - 1, n_bound) + 1
    end function moved
  end subroutine close_lists

  !> Append to a list of which `used` items are used; it grows.
  subroutine append(list, used, item)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: used
    integer, intent(in) :: item
    integer, allocatable :: longer(:)

    if (used == size(list)) then
      allocate (longer(2*size(list) + 16))
      longer(:used) = list
      call move_alloc(longer, list)
    end if
    used = used + 1
    list(used) = item
  end subroutine append

  !> Retain also unknowns that cut the structure in two beside each group of retained ones, so that what lies between
  !> two groups is coupled with these two groups only.
  subroutine add_separators(n, coupled, retained)
    integer, intent(in) :: n
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(inout) :: retained(n)
    logical :: given(n)
    integer, allocatable :: part(:)
    integer :: at, cut, best, fewest, more, j

    if (all(retained)) return
    allocate (part(n))
    call find_parts(n, coupled, part)
    given = retained
    do at = 1, n
      if (.not. given(at)) cycle
      fewest = huge(1)
      best = at
      do cut = at, min(n, at + size(coupled, 1))
        if (crosses(at, cut) .or. .not. any_crosses(cut)) then
          more = 0
          do j = max(1, cut - size(coupled, 1) + 1), cut
            if (crosses(j, cut) .and. .not. retained(j)) more = more + 1
          end do
          if (more < fewest) best = cut
          fewest = min(fewest, more)
        end if
      end do
      if (fewest == huge(1)) cycle
      do j = max(1, best - size(coupled, 1) + 1), best
        if (crosses(j, best)) retained(j) = .true.
      end do
    end do

  contains

    !> Whether unknown j is coupled with one beyond the cut, in the part of the structure that `at` belongs to.
    function crosses(j, cut) result(yes)
      integer, intent(in) :: j, cut
      logical :: yes

      yes = .false.
      if (part(j) == part(at)) yes = any(coupled(cut - j + 1:min(size(coupled, 1), n - j), j))
    end function crosses

    function any_crosses(cut) result(yes)
      integer, intent(in) :: cut
      logical :: yes
      integer :: j

      yes = .true.
      do j = max(1, cut - size(coupled, 1) + 1), cut
        if (crosses(j, cut)) return
      end do
      yes = .false.
    end function any_crosses
  end subroutine add_separators

  !> Number of the part each unknown belongs to; parts are not coupled with each other.
  subroutine find_parts(n, coupled, part)
    integer, intent(in) :: n
    logical, contiguous, intent(in) :: coupled(:, :)
    integer, intent(out) :: part(n)
    integer :: j, d, a, b

    do j = 1, n
      part(j) = j
    end do
    do j = 1, n
      do d = 1, min(size(coupled, 1), n - j)
        if (.not. coupled(d, j)) cycle
        a = root(j)
        b = root(j + d)
        part(max(a, b)) = min(a, b)
      end do
    end do
    do j = 1, n
      part(j) = root(j)
    end do

  contains

    function root(unknown) result(at)
      integer, intent(in) :: unknown
      integer :: at

      at = unknown
      do while (part(at) /= at)
        part(at) = part(part(at))
        at = part(at)
      end do
    end function root
  end subroutine find_parts

  !> Unknowns to eliminate: ascending up to the last retained one of their part, then the others descending.
  subroutine find_order(n, coupled, retained, order, n_steps)
    integer, intent(in) :: n
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(in) :: retained(n)
    integer, intent(out) :: order(n), n_steps
    integer :: part(n), last(n), j

    call find_parts(n, coupled, part)
    last = 0
    do j = 1, n
      if (retained(j)) last(part(j)) = j
    end do
    order = 0
    n_steps = 0
    do j = 1, n
      if (retained(j) .or. is_beyond(j)) cycle
      n_steps = n_steps + 1
      order(n_steps) = j
    end do
    do j = n, 1, -1
      if (retained(j) .or. .not. is_beyond(j)) cycle
      n_steps = n_steps + 1
      order(n_steps) = j
    end do

  contains

    !> Whether an unknown lies beyond the last retained one of its part.
    function is_beyond(unknown) result(yes)
      integer, intent(in) :: unknown
      logical :: yes

      yes = last(part(unknown)) > 0 .and. unknown > last(part(unknown))
    end function is_beyond
  end subroutine find_order
end module jointfrf_elimination_plan
