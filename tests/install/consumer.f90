! A program that knows jointfrf only as installed: the inverse of 2, and a line that is singular. The constants of the
! module are those of the include file, here in free form.
program consumer
  use, intrinsic :: iso_c_binding, only: c_double, c_double_complex
  use jointfrf, only: jf_engine_automatic, jf_engine_lapack, jf_engine_plain, jf_engine_x86_64_v2, &
    jf_engine_x86_64_v3, jf_engine_x86_64_v4, jf_info_good, jf_info_no_engine, jf_info_no_memory, jf_invert, &
    jf_line_good, jf_line_not_finite, jf_line_overflow, jf_set_engine
  implicit none
  complex(c_double_complex) :: a(1, 1, 2), a_inverse(1, 1, 2)
  real(c_double) :: rcond(2)
  integer :: line_info(2), info

  if (any(included() /= [jf_info_good, jf_info_no_memory, jf_info_no_engine, jf_line_good, jf_line_not_finite, &
                         jf_line_overflow, jf_engine_automatic, jf_engine_lapack, jf_engine_plain, &
                         jf_engine_x86_64_v2, jf_engine_x86_64_v3, jf_engine_x86_64_v4])) error stop 1
  call jf_set_engine(jf_engine_lapack, info)
  if (info /= jf_info_good) error stop 2
  a(1, 1, :) = [2.0_c_double, 0.0_c_double]
  call jf_invert(1, 2, a, a_inverse, line_info, rcond, info)
  if (info /= 1 .or. line_info(1) /= jf_line_good .or. line_info(2) /= 1) error stop 3
  if (a_inverse(1, 1, 1) /= (0.5_c_double, 0.0_c_double)) error stop 4

contains

  function included() result(codes)
    include 'jointfrf.inc'
    integer :: codes(12)

    codes = [jf_info_good, jf_info_no_memory, jf_info_no_engine, jf_line_good, jf_line_not_finite, jf_line_overflow, &
             jf_engine_automatic, jf_engine_lapack, jf_engine_plain, jf_engine_x86_64_v2, jf_engine_x86_64_v3, &
             jf_engine_x86_64_v4]
  end function included
end program consumer
