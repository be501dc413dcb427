!> The order in which a sparse system is eliminated down to the unknowns that are wanted, found once for all lines.
!>
!> A static condensation: unknown after unknown is eliminated with its own pivot until only the retained ones are left.
!> A plan holds no numbers, only where they come from and go to. It is made in four steps:
!>
!> 1. Retained unknowns and those that separate them (one-way dissection) split the structure, and `find_order` orders
!>    what lies between as the band does: from the outside towards the retained unknowns. No minimum degree is looked
!>    for, because models come with a numbering of small bandwidth.
!> 2. `find_structure` finds which unknowns are coupled with each pivot when its turn comes: symbolic elimination along
!>    the elimination tree (A. George, J. W. Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981,
!>    chapter 5; J. W. H. Liu, SIAM J. Matrix Anal. Appl. 11 (1990) 134-172).
!> 3. `assign_slots` gives places in a small square to what is being worked on. A slot is free again once its unknown is
!>    eliminated, as in a frontal solver (B. M. Irons, Int. J. Numer. Meth. Eng. 2 (1970) 5-32).
!> 4. `list_elements` says which elements of the square begin as zero or as an entry of the matrix, and when.
!>
!> With n unknowns, a reach b of the band and m unknowns coupled with a pivot (m <= 2 b + retained ones), the second and
!> third step cost O(n (b + m)), the fourth O(n m^2): in all in proportion to the multiplications of one line. Memory:
!> the lists, one item a number that is touched, and the square. Where there is not enough of it, `stat` is not 0.
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

  !> Unknowns coupled with the pivot of each step: unknown(last(s) + 1:last(s + 1)), eliminated later or retained.
  type :: elimination_structure
    integer, allocatable :: last(:)           !< shape (n_steps + 1)
    integer, allocatable :: unknown(:)
  end type elimination_structure

contains

  !> Plan for a matrix of order n.
  !> coupled     whether unknowns j and j + d are coupled, shape (reach, n) with d first
  !> retained    whether an unknown is not to be eliminated; on return also those that cut the structure in parts
  !> wanted      retained unknowns that shall have the last slots, in this order
  !> symmetric   whether the matrix is
  !> stat        not 0 where there is no memory
  subroutine make_plan(n, coupled, retained, wanted, symmetric, plan, stat)
    integer, intent(in) :: n, wanted(:)
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(inout) :: retained(n)
    logical, intent(in) :: symmetric
    type(elimination_plan), intent(out) :: plan
    integer, intent(out) :: stat
    type(elimination_structure) :: structure
    integer, allocatable :: order(:), slot_of(:), part(:), work(:)

    allocate (order(n), slot_of(n), part(n), work(4*n), stat=stat)
    if (stat /= 0) return
    slot_of = 0
    plan%symmetric = symmetric
    if (.not. all(retained)) call add_separators(n, coupled, retained, part, stat)
    if (stat == 0) call set_slots(wanted, retained, slot_of, plan, stat)
    if (stat /= 0) return
    call find_order(n, coupled, retained, part, work, order, plan%n_steps)
    call find_structure(n, coupled, order(:plan%n_steps), work(:n), work(n + 1:2*n), work(2*n + 1:3*n), &
                        work(3*n + 1:), structure, stat)
    if (stat == 0) call assign_slots(order(:plan%n_steps), structure, slot_of, work(:n), work(n + 1:2*n), plan, stat)
    if (stat == 0) call list_elements(coupled, order(:plan%n_steps), structure, slot_of, plan, stat)
    if (stat == 0) allocate (plan%coefficient(4, plan%last_entry(plan%n_steps + 2)), stat=stat)
    if (stat == 0) plan%coefficient = 0.0_dp
  end subroutine make_plan

  !> Symbolic elimination. A pivot is coupled with what the matrix couples it with, and with what those unknowns were
  !> coupled with that found it as their first neighbour to be eliminated: its children in the elimination tree.
  !> order   the unknowns to be eliminated, shape (n_steps)
  !> step_of, seen_by, first_child, next_child   workspace
  subroutine find_structure(n, coupled, order, step_of, seen_by, first_child, next_child, structure, stat)
    integer, intent(in) :: n, order(:)
    logical, contiguous, intent(in) :: coupled(:, :)
    integer, intent(out) :: step_of(n), seen_by(n), first_child(n), next_child(n)
    type(elimination_structure), intent(out) :: structure
    integer, intent(out) :: stat
    integer :: s, p, j, e, child, parent

    allocate (structure%last(size(order) + 1), structure%unknown(size(coupled)), stat=stat)
    if (stat /= 0) return
    structure%last = 0
    step_of = huge(1)                                     ! retained unknowns come after all others
    do s = 1, size(order)
      step_of(order(s)) = s
    end do
    seen_by = 0
    first_child = 0
    do s = 1, size(order)
      structure%last(s + 1) = structure%last(s)
      p = order(s)
      do j = max(1, p - size(coupled, 1)), min(n, p + size(coupled, 1))
        if (are_coupled(coupled, p, j)) call add(j)
      end do
      child = first_child(p)
      do while (child > 0)
        do e = structure%last(child) + 1, structure%last(child + 1)
          j = structure%unknown(e)                        ! the list may move while it grows
          call add(j)
        end do
        child = next_child(child)
      end do
      if (stat /= 0) return
      associate (near => structure%unknown(structure%last(s) + 1:structure%last(s + 1)))
        if (size(near) == 0) cycle
        parent = near(1)
        do e = 2, size(near)
          if (step_of(near(e)) < step_of(parent)) parent = near(e)
        end do
      end associate
      next_child(s) = first_child(parent)
      first_child(parent) = s
    end do

  contains

    !> One unknown more that is coupled with p, unless it is known or was eliminated.
    subroutine add(unknown)
      integer, intent(in) :: unknown

      if (seen_by(unknown) == s .or. step_of(unknown) <= s) return
      seen_by(unknown) = s
      call append(structure%unknown, structure%last(s + 1), unknown, stat)
    end subroutine add
  end subroutine find_structure

  !> Slots of the unknowns while they are worked on: the first that is free when an unknown is first needed. The
  !> unknowns of each step of the structure are put into the order of their slots.
  !> slot_of     the slot of each unknown, 0 where it has none yet
  !> in_slot     workspace: its unknown, 0 for a free slot
  !> needed_in   workspace: the last step that needs a slot
  subroutine assign_slots(order, structure, slot_of, in_slot, needed_in, plan, stat)
    integer, intent(in) :: order(:)
    type(elimination_structure), intent(inout) :: structure
    integer, intent(inout) :: slot_of(:)
    integer, intent(out) :: in_slot(:), needed_in(:)
    type(elimination_plan), intent(inout) :: plan
    integer, intent(out) :: stat
    integer :: s, e, m, slot

    in_slot = 0
    in_slot(:plan%n_retained) = plan%unknown
    needed_in = 0
    plan%n_slots = plan%n_retained
    allocate (plan%pivot(plan%n_steps), plan%last_near(plan%n_steps + 1), plan%near(structure%last(plan%n_steps + 1)), &
              stat=stat)
    if (stat /= 0) return
    do s = 1, plan%n_steps
      call take_slot(order(s))
      do e = structure%last(s) + 1, structure%last(s + 1)
        call take_slot(structure%unknown(e))
        needed_in(slot_of(structure%unknown(e))) = s
      end do
      e = structure%last(s)
      do slot = 1, plan%n_slots
        if (needed_in(slot) /= s) cycle
        e = e + 1
        structure%unknown(e) = in_slot(slot)
      end do
      plan%pivot(s) = slot_of(order(s))
      in_slot(plan%pivot(s)) = 0
      m = structure%last(s + 1) - structure%last(s)
      plan%products = plan%products + merge((m*(m + 1))/2, m*m, plan%symmetric)
    end do
    plan%last_near(:) = structure%last
    do e = 1, size(plan%near)
      plan%near(e) = slot_of(structure%unknown(e))
    end do

  contains

    subroutine take_slot(unknown)
      integer, intent(in) :: unknown

      if (slot_of(unknown) > 0) return
      slot_of(unknown) = findloc(in_slot, 0, dim=1)
      in_slot(slot_of(unknown)) = unknown
      plan%n_slots = max(plan%n_slots, slot_of(unknown))
    end subroutine take_slot
  end subroutine assign_slots

  !> What elements of the square begin with, in the step that needs them first; after the last step come those of
  !> retained unknowns that no step has touched.
  subroutine list_elements(coupled, order, structure, slot_of, plan, stat)
    logical, contiguous, intent(in) :: coupled(:, :)
    integer, intent(in) :: order(:), slot_of(:)
    type(elimination_structure), intent(in) :: structure
    type(elimination_plan), intent(inout) :: plan
    integer, intent(out) :: stat
    logical, allocatable :: begun(:, :)                   ! pairs of slots that hold a number
    integer :: s, i, j

    allocate (begun(plan%n_slots, plan%n_slots), plan%last_zero(plan%n_steps + 2), plan%last_entry(plan%n_steps + 2), &
              plan%zero(size(coupled)), plan%entry(size(coupled)), plan%row(size(coupled)), &
              plan%column(size(coupled)), stat=stat)
    if (stat /= 0) return
    begun = .false.
    plan%last_zero = 0
    plan%last_entry = 0
    do s = 1, plan%n_steps + 1
      plan%last_zero(s + 1) = plan%last_zero(s)
      plan%last_entry(s + 1) = plan%last_entry(s)
      if (s > plan%n_steps) exit
      call begin_with(order(s), order(s))
      associate (near => structure%unknown(structure%last(s) + 1:structure%last(s + 1)), &
                 slot => plan%near(structure%last(s) + 1:structure%last(s + 1)))
        do i = 1, size(near)
          call begin_with(near(i), order(s))
          do j = 1, i
            if (.not. begun(slot(j), slot(i))) call begin_with(near(j), near(i))
          end do
        end do
      end associate
      begun(:, plan%pivot(s)) = .false.
      begun(plan%pivot(s), :) = .false.
    end do
    do i = 1, plan%n_retained
      do j = 1, i
        call begin_with(plan%unknown(j), plan%unknown(i))
      end do
    end do

  contains

    !> A pair of unknowns is needed.
    subroutine begin_with(a, b)
      integer, intent(in) :: a, b
      integer :: first, second

      first = merge(a, b, slot_of(a) <= slot_of(b))
      second = merge(b, a, slot_of(a) <= slot_of(b))
      if (begun(slot_of(first), slot_of(second))) return
      begun(slot_of(first), slot_of(second)) = .true.
      begun(slot_of(second), slot_of(first)) = .true.
      call begin_one(first, second)
      if (first /= second .and. .not. plan%symmetric) call begin_one(second, first)
    end subroutine begin_with

    subroutine begin_one(row, column)
      integer, intent(in) :: row, column
      integer :: element, used

      element = (slot_of(row) - 1)*plan%n_slots + slot_of(column)
      if (row == column .or. are_coupled(coupled, row, column)) then
        used = plan%last_entry(s + 1)
        call append(plan%row, used, row, stat)
        used = plan%last_entry(s + 1)
        call append(plan%column, used, column, stat)
        call append(plan%entry, plan%last_entry(s + 1), element, stat)
      else
        call append(plan%zero, plan%last_zero(s + 1), element, stat)
      end if
    end subroutine begin_one
  end subroutine list_elements

  !> Whether the matrix couples two unknowns that differ.
  pure function are_coupled(coupled, a, b) result(yes)
    logical, contiguous, intent(in) :: coupled(:, :)
    integer, intent(in) :: a, b
    logical :: yes

    yes = .false.
    if (a /= b .and. abs(a - b) <= size(coupled, 1)) yes = coupled(abs(a - b), min(a, b))
  end function are_coupled

  !> Slots of the retained unknowns: the wanted ones last.
  subroutine set_slots(wanted, retained, slot_of, plan, stat)
    integer, intent(in) :: wanted(:)
    logical, intent(in) :: retained(:)
    integer, intent(inout) :: slot_of(:)
    type(elimination_plan), intent(inout) :: plan
    integer, intent(out) :: stat
    integer :: j, slot

    plan%n_retained = count(retained)
    allocate (plan%unknown(plan%n_retained), stat=stat)
    if (stat /= 0) return
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

  !> Append to a list of which `used` items are used; it grows. Nothing is done where there was no memory before.
  subroutine append(list, used, item, stat)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: used
    integer, intent(in) :: item
    integer, intent(inout) :: stat
    integer, allocatable :: longer(:)

    if (stat /= 0) return
    if (used == size(list)) then
      allocate (longer(2*size(list) + 16), stat=stat)
      if (stat /= 0) return
      longer(:used) = list
      call move_alloc(longer, list)
    end if
    used = used + 1
    list(used) = item
  end subroutine append

  !> Retain also unknowns that cut the structure in two beside each group of retained ones, so that what lies between
  !> two groups is coupled with these two groups only.
  !> part   workspace
  subroutine add_separators(n, coupled, retained, part, stat)
    integer, intent(in) :: n
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(inout) :: retained(n)
    integer, intent(out) :: part(n), stat
    logical, allocatable :: given(:)
    integer :: at, cut, best, fewest, more, j

    allocate (given(n), stat=stat)
    if (stat /= 0) return
    call find_parts(n, coupled, part)
    given(:) = retained
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
  !> part, last   workspace
  subroutine find_order(n, coupled, retained, part, last, order, n_steps)
    integer, intent(in) :: n
    logical, contiguous, intent(in) :: coupled(:, :)
    logical, intent(in) :: retained(n)
    integer, intent(out) :: part(n), last(n), order(n), n_steps
    integer :: j

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
