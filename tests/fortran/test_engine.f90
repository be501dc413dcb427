!> The choice of the engine: by the environment at first, then by call; what is not there is refused.
!>
!> The environment is read once, so the program runs once for each word of JOINTFRF_ENGINE that is to be tried.
program test_engine
  use testing, only: check, check_close, dp, finish, inverse, ip, random_regular, seed
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, engine_v2, engine_v3, engine_v4, &
    find_kernels, get_engine, set_engine
  use jointfrf_lanes, only: lane_kernels
  use jointfrf_linear_algebra, only: invert
  use jointfrf_status, only: info_good, info_no_engine
  implicit none
  integer, parameter :: lines = 9
  character(len=40) :: word
  integer(ip) :: engine, info, widest
  logical :: wrong

  call seed(23)
  call get_environment_variable('JOINTFRF_ENGINE', word)
  call check(all([engine_automatic, engine_lapack, engine_plain, engine_v2, engine_v3, engine_v4] == &
                 [0, 1, 2, 3, 4, 5]), 'codes as documented')
  wrong = word /= '' .and. all(word /= [character(len=40) :: 'auto', 'lapack', 'plain', &
    'x86-64-v2', 'x86-64-v3', 'x86-64-v4'])
  if (wrong) call refused()
  call get_engine(engine, info)
  call check(info == merge(info_no_engine, info_good, wrong), 'whether the word is known: '//trim(word))
  widest = widest_there_is()
  if (word == 'lapack') call check(engine == engine_lapack, 'lapack by the environment')
  if (word == 'plain') call check(engine == engine_plain, 'plain by the environment')
  if (word == 'auto' .or. word == '') call check(engine == widest, 'automatic is the widest there is')
  call every_engine()
  call finish('engine')

contains

  !> With a word that is not known nothing is done, until an engine is chosen by call.
  subroutine refused()
    complex(dp) :: a(2, 2, lines), a_inverse(2, 2, lines)
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines)
    integer :: k

    a = random_regular(2, lines)
    a_inverse = 4711
    do k = 1, 2
      call invert(a, a_inverse, line_info, rcond, info)
      call check(info == info_no_engine, 'no sweep by an engine that is not known')
      call check(all(abs(a_inverse - 4711) <= 0.0_dp), 'nothing is written')
    end do
  end subroutine refused

  !> By trial; leaves the choice at it.
  function widest_there_is() result(engine)
    integer(ip) :: engine, info

    do engine = engine_v4, engine_lapack, -1_ip
      call set_engine(engine, info)
      if (info == info_good) return
    end do
  end function widest_there_is

  !> What can be chosen is used, and inverts; what cannot leaves the choice as it is.
  subroutine every_engine()
    complex(dp) :: a(5, 5, lines), a_inverse(5, 5, lines), expected(5, 5, lines)
    integer(ip) :: line_info(lines), info, engine, now, before
    real(dp) :: rcond(lines)
    type(lane_kernels) :: kernels
    logical :: found

    a = random_regular(5, lines)
    expected = inverse(a)
    do engine = -2, 7
      call get_engine(before, info)
      call set_engine(engine, info)
      call check(info == 0 .or. info == -1, 'there or not')
      if (engine >= engine_automatic .and. engine <= engine_plain) call check(info == 0, 'there on every machine')
      if (engine < engine_automatic .or. engine > engine_v4) call check(info == -1, 'there on no machine')
      if (info == 0) before = merge(widest, engine, engine == engine_automatic)
      call get_engine(now, info)
      call check(info == 0 .and. now == before, 'the engine that was chosen')
      call find_kernels(kernels, found, info)
      call check(found .neqv. now == engine_lapack, 'only LAPACK works line by line')
      call check(associated(kernels%invert) .and. associated(kernels%pollute_flat), 'kernels with every engine')
      call invert(a, a_inverse, line_info, rcond, info)
      call check(info == 0, 'invert: good')
      call check_close(a_inverse, expected, 1.0e-13_dp, 'invert')
    end do
  end subroutine every_engine
end program test_engine
