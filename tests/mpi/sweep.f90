!> A sweep shared by the processes of MPI: lines scattered, coupled by each process on its own lines, gathered.
!>
!>   mpirun -n 4 sweep [LINES [JOINT-DOFS [REPEATS]]]
!>
!> Prints one line of names and values: processes, lines, order, seconds (least of the repeats, from scatter to gather),
!> seconds_couple (of these, the slowest process in jf_couple), and different, the numbers of the gathered result that
!> are not, bit by bit, those of one process alone. Exit status 1 where there are any, or where a call fails.
!>
!> Every process gets whole blocks of lines: lines in one block share their pivot rows, so that the last bits of a line
!> depend on its neighbours in the block, and only then are they the same on any number of processes.
program sweep
  use, intrinsic :: iso_fortran_env, only: dp => real64, int64, output_unit, error_unit
  use mpi_f08, only: mpi_abort, mpi_allreduce, mpi_barrier, mpi_comm_rank, mpi_comm_size, mpi_finalize, mpi_gatherv, &
    mpi_init, mpi_scatterv, mpi_wtime, mpi_comm_world, mpi_double_complex, mpi_double_precision, mpi_integer, mpi_max, &
    mpi_sum
  use jointfrf, only: jf_couple
  implicit none

  !> Lines of a block. The kernel cuts a sweep into shares of lines that are multiples of the vector registers; this is
  !> a multiple of the longest of them.
  integer, parameter :: block = 512

  complex(dp), allocatable :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :), h_c(:, :, :)
  complex(dp), allocatable :: own_a(:, :, :), own_b(:, :, :), own_k(:, :, :), own_c(:, :, :), alone(:, :, :)
  integer, allocatable :: lines_of(:), first_of(:), line_info(:), dofs(:)
  real(dp), allocatable :: rcond(:)
  real(dp) :: start, seconds, seconds_couple, least, least_couple
  integer :: rank, processes, n_freq, n, repeats, repeat, mine, info, total, different, i

  call mpi_init()
  call mpi_comm_rank(mpi_comm_world, rank)
  call mpi_comm_size(mpi_comm_world, processes)
  n_freq = argument(1, 4096)
  n = argument(2, 6)
  repeats = argument(3, 3)

  lines_of = shares(n_freq, processes)
  first_of = [(sum(lines_of(:i)), i=0, processes - 1)]
  mine = lines_of(rank + 1)
  dofs = [(i, i=1, n)]
  allocate (own_a(n, n, mine), own_b(n, n, mine), own_k(n, n, mine), own_c(2*n, 2*n, mine))
  allocate (line_info(n_freq), rcond(n_freq))
  if (rank == 0) then
    call make_sweep(n, n_freq, h_a, h_b, k_joint)
    allocate (h_c(2*n, 2*n, n_freq))
  else
    allocate (h_a(n, n, 0), h_b(n, n, 0), k_joint(n, n, 0), h_c(2*n, 2*n, 0))
  end if

  least = huge(least)
  least_couple = huge(least)
  do repeat = 1, repeats
    call mpi_barrier(mpi_comm_world)
    start = mpi_wtime()
    call scatter(h_a, own_a)
    call scatter(h_b, own_b)
    call scatter(k_joint, own_k)
    seconds_couple = mpi_wtime()
    call jf_couple('N', n, n, n, mine, own_a, own_b, own_k, dofs, dofs, own_c, line_info, rcond, info)
    seconds_couple = mpi_wtime() - seconds_couple
    call gather(own_c, h_c)
    seconds = mpi_wtime() - start
    call mpi_allreduce(abs(info), total, 1, mpi_integer, mpi_sum, mpi_comm_world)
    if (total /= 0) call fail('jf_couple: a process has lines that could not be coupled')
    least = min(least, maximum(seconds))
    least_couple = min(least_couple, maximum(seconds_couple))
  end do

  different = 0
  if (rank == 0) then
    allocate (alone(2*n, 2*n, n_freq))
    call jf_couple('N', n, n, n, n_freq, h_a, h_b, k_joint, dofs, dofs, alone, line_info, rcond, info)
    different = count(bits(real(h_c, dp)) /= bits(real(alone, dp)) .or. bits(aimag(h_c)) /= bits(aimag(alone)))
    write (output_unit, '(3(a, i0), 2(a, es12.5), a, i0)') 'processes ', processes, ' lines ', n_freq, ' order ', n, &
      ' seconds ', least, ' seconds_couple ', least_couple, ' different ', different
    if (different /= 0) call fail('the result depends on the number of processes')
  end if
  call mpi_finalize()

contains

  !> A number of the command line, or its default.
  integer function argument(place, default)
    integer, intent(in) :: place, default
    character(len=16) :: word
    integer :: status

    argument = default
    if (command_argument_count() < place) return
    call get_command_argument(place, word)
    read (word, *, iostat=status) argument
    if (status /= 0 .or. argument < 1) call fail('arguments are numbers from 1 on: LINES JOINT-DOFS REPEATS')
  end function argument

  !> Lines of each process: whole blocks, as even as they go; the last one that has any also has what is left over.
  pure function shares(lines, among) result(share)
    integer, intent(in) :: lines, among
    integer :: share(among), blocks, i, first

    blocks = (lines + block - 1)/block
    first = 0
    do i = 1, among
      share(i) = min(lines, ((blocks*i)/among)*block) - first
      first = first + share(i)
    end do
  end function shares

  !> Receptances of two structures of n DOFs with n modes each, and a joint of springs and dashpots.
  subroutine make_sweep(n, n_freq, h_a, h_b, k_joint)
    integer, intent(in) :: n, n_freq
    complex(dp), allocatable, intent(out) :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    real(dp) :: shapes(n, n, 2), natural(n, 2), omega
    complex(dp) :: own(n, n)
    integer :: f, i, body, mode
    real(dp), parameter :: two_pi = 8*atan(1.0_dp)

    allocate (h_a(n, n, n_freq), h_b(n, n, n_freq), k_joint(n, n, n_freq))
    do body = 1, 2
      do mode = 1, n
        natural(mode, body) = two_pi*(20.0_dp + 37*mode + 11*body)
        shapes(:, mode, body) = [(cos(0.7_dp*i*mode + body), i=1, n)]
      end do
    end do
    k_joint = 0
    do f = 1, n_freq
      omega = two_pi*(5 + 595*real(f, dp)/n_freq)
      do body = 1, 2
        own = 0
        do mode = 1, n
          own = own + spread(shapes(:, mode, body), 2, n)*spread(shapes(:, mode, body), 1, n)/ &
                cmplx(natural(mode, body)**2 - omega**2, 0.01_dp*natural(mode, body)**2, dp)
        end do
        if (body == 1) h_a(:, :, f) = own
        if (body == 2) h_b(:, :, f) = own
      end do
      do i = 1, n
        k_joint(i, i, f) = cmplx(1e5_dp*i, 10*omega, dp)
      end do
    end do
  end subroutine make_sweep

  !> Lines of the first process to all of them.
  subroutine scatter(all, own)
    complex(dp), contiguous, intent(in) :: all(:, :, :)
    complex(dp), contiguous, intent(out) :: own(:, :, :)
    integer :: a_line

    a_line = size(own, 1)*size(own, 2)
    call mpi_scatterv(all, a_line*lines_of, a_line*first_of, mpi_double_complex, own, a_line*mine, mpi_double_complex, &
                      0, mpi_comm_world)
  end subroutine scatter

  !> Lines of all processes to the first one.
  subroutine gather(own, all)
    complex(dp), contiguous, intent(in) :: own(:, :, :)
    complex(dp), contiguous, intent(inout) :: all(:, :, :)
    integer :: a_line

    a_line = size(own, 1)*size(own, 2)
    call mpi_gatherv(own, a_line*mine, mpi_double_complex, all, a_line*lines_of, a_line*first_of, mpi_double_complex, &
                     0, mpi_comm_world)
  end subroutine gather

  !> The largest of the numbers of all processes.
  real(dp) function maximum(value)
    real(dp), intent(in) :: value

    call mpi_allreduce(value, maximum, 1, mpi_double_precision, mpi_max, mpi_comm_world)
  end function maximum

  elemental integer(int64) function bits(value)
    real(dp), intent(in) :: value

    bits = transfer(value, bits)
  end function bits

  subroutine fail(message)
    character(len=*), intent(in) :: message

    write (error_unit, '(a)') message
    call mpi_abort(mpi_comm_world, 1)
  end subroutine fail

end program sweep
