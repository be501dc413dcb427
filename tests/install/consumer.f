C     A program that knows jointfrf only as installed: the inverse of 2,
C     and a line that is singular. FORTRAN 77, constants in fixed form.
      PROGRAM CONSUM
      INCLUDE 'jointfrf.inc'
      COMPLEX*16 A(2), AINV(2)
      DOUBLE PRECISION RCOND(2)
      INTEGER LINFO(2), INFO
      DATA A /(2.0D0, 0.0D0), (0.0D0, 0.0D0)/

      CALL JF_SET_ENGINE(JF_ENGINE_LAPACK, INFO)
      IF (INFO .NE. JF_INFO_GOOD) STOP 1
      CALL JF_INVERT(1, 2, A, AINV, LINFO, RCOND, INFO)
      IF (INFO .NE. 1) STOP 2
      IF (LINFO(1) .NE. JF_LINE_GOOD .OR. LINFO(2) .NE. 1) STOP 3
      IF (AINV(1) .NE. (0.5D0, 0.0D0)) STOP 4
      END
