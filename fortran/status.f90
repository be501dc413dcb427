!> Every status code of the kernel and its text, once.
!>
!> `info` (one a call):      0 good; -i argument i is wrong; > 0 that many lines are bad, see `line_info`;
!>                           `info_no_memory` the workspace could not be allocated; `info_no_engine` the environment
!>                           variable JOINTFRF_ENGINE names an engine that this machine does not have.
!> `line_info` (one a line): 0 good; i > 0 LAPACK found pivot i to be exactly zero; `line_not_finite` the line holds NaN
!>                           or Inf; `line_overflow` the line is finite but its result is not. A bad line is filled with
!>                           NaN and the sweep goes on.
module jointfrf_status
  use jointfrf_kinds, only: ip
  implicit none
  private

  integer(ip), parameter, public :: info_good = 0
  integer(ip), parameter, public :: info_no_memory = -1000
  integer(ip), parameter, public :: info_no_engine = -1001
  integer(ip), parameter, public :: line_good = 0
  integer(ip), parameter, public :: line_not_finite = -1
  integer(ip), parameter, public :: line_overflow = -2

  integer, parameter, public :: text_length = 80
  public :: info_text, line_text

contains

  !> What an `info` means, in words.
  pure function info_text(info) result(text)
    integer(ip), intent(in) :: info
    character(len=text_length) :: text
    character(len=20) :: digits

    write (digits, '(i0)') info
    if (info < 0) digits = digits(2:)
    if (info == info_good) then
      text = 'good'
    else if (info == info_no_memory) then
      text = 'the workspace could not be allocated'
    else if (info == info_no_engine) then
      text = 'JOINTFRF_ENGINE names an engine that this machine does not have'
    else if (info < 0) then
      text = 'argument '//trim(digits)//' is wrong'
    else
      text = 'number of bad lines: '//trim(digits)//'; see line_info'
    end if
  end function info_text

  !> What a `line_info` means, in words.
  pure function line_text(info) result(text)
    integer(ip), intent(in) :: info
    character(len=text_length) :: text
    character(len=20) :: digits

    write (digits, '(i0)') info
    if (info < 0) digits = digits(2:)
    if (info == line_good) then
      text = 'good'
    else if (info == line_not_finite) then
      text = 'the line holds NaN or Inf'
    else if (info == line_overflow) then
      text = 'the result of the line is not finite'
    else if (info < 0) then
      text = 'unknown line code -'//trim(digits)
    else
      text = 'singular: pivot '//trim(digits)//' is exactly zero'
    end if
  end function line_text
end module jointfrf_status
