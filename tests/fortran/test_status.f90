!> Every code has its value and its text.
program test_status
  use testing, only: check, finish, ip
  use jointfrf_status, only: info_good, info_no_engine, info_no_memory, info_text, line_good, line_not_finite, &
    line_overflow, &
    line_text, text_length
  implicit none
  !> The modulus of the most negative number.
  character(len=*), parameter :: most = &
    trim(merge('9223372036854775808', '2147483648         ', storage_size(1_ip) == 64))
  integer(ip) :: code

  call check(info_good == 0 .and. line_good == 0, 'good is 0')
  call check(all([info_no_memory, info_no_engine, line_not_finite, line_overflow] == [-1000, -1001, -1, -2]), &
             'values as documented')

  call check(info_text(0_ip) == 'good', 'info 0')
  call check(info_text(-1000_ip) == 'the workspace could not be allocated', 'info -1000')
  call check(info_text(-1001_ip) == 'JOINTFRF_ENGINE names an engine that this machine does not have', 'info -1001')
  call check(info_text(-7_ip) == 'argument 7 is wrong', 'info -7')
  call check(info_text(12_ip) == 'number of bad lines: 12; see line_info', 'info 12')
  call check(line_text(0_ip) == 'good', 'line 0')
  call check(line_text(-1_ip) == 'the line holds NaN or Inf', 'line -1')
  call check(line_text(-2_ip) == 'the result of the line is not finite', 'line -2')
  call check(line_text(3_ip) == 'singular: pivot 3 is exactly zero', 'line 3')
  call check(line_text(-99_ip) == 'unknown line code -99', 'line -99')

  do code = -2, 2
    call check(len_trim(info_text(code)) < text_length .and. len_trim(line_text(code)) < text_length, 'a text is cut')
  end do
  call check(len_trim(info_text(huge(1_ip))) < text_length, 'the longest number')
  call check(info_text(-huge(1_ip) - 1_ip) == 'argument '//most//' is wrong', 'the most negative number')
  call check(line_text(-huge(1_ip) - 1_ip) == 'unknown line code -'//most, 'the most negative line code')
  call finish('status')
end program test_status
