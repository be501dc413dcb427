C     One frequency line at a time in workspace of the program's own,
C     from FORTRAN 77: nothing is allocated in the loop.
C
C     A is a wall, k, m, k, m; B the same. A spring and a dashpot join
C     the last mass of A with the last one of B. Line by line: both
C     receptances, the assembly, and from it the joint again.
C
C     Output, 17 significant digits: Hz, real and imaginary part of the
C     receptance of the assembly at the joint on A, N/m and N s/m of the
C     joint.
C     Exit status 1 if anything is wrong.
      PROGRAM LOOP
      INTEGER N, NJ, NF, MAXWRK, MAXINT
      PARAMETER (N = 2, NJ = 1, NF = 50, MAXWRK = 500, MAXINT = 50)
      DOUBLE PRECISION PI, FREQ, OMEGA, RCOND, LOSS
      DOUBLE PRECISION K(N,N), M(N,N)
      COMPLEX*16 HA(N,N), HB(N,N), HC(2*N,2*N), KJ(NJ,NJ)
      COMPLEX*16 GAMMA(2*NJ,2*NJ), C(NJ,NJ), KFOUND
      INTEGER ALL(N), DOFS(NJ), DOFSC(2*NJ), LINFO, INFO, I, J, L
      COMPLEX*16 WORK(MAXWRK)
      INTEGER IWORK(MAXINT), LWORK, LIWORK
      COMMON /ARENA/ WORK, IWORK
      DATA K /2000.0D0, -1000.0D0, -1000.0D0, 1000.0D0/
      DATA M /2.0D0, 0.0D0, 0.0D0, 2.0D0/
      DATA ALL /1, 2/, DOFS /2/, DOFSC /2, 4/, LOSS /0.01D0/

      PI = 4.0D0*ATAN(1.0D0)
      OMEGA = 0.0D0
      KJ(1,1) = 0.0D0

C     once: how much the largest of the three takes
      LWORK = 0
      LIWORK = 0
      CALL JF_RECEPTANCE_WORK('N', N, 1, N, N, OMEGA, K, M, 0, K, 0, K,
     &  LOSS, ALL, ALL, HA, LINFO, RCOND, WORK, -1, IWORK, -1, INFO)
      CALL ATMOST(LWORK, LIWORK, WORK, IWORK, INFO)
      CALL JF_COUPLE_WORK('N', N, N, NJ, 1, HA, HB, KJ, DOFS, DOFS, HC,
     &  LINFO, RCOND, WORK, -1, IWORK, -1, INFO)
      CALL ATMOST(LWORK, LIWORK, WORK, IWORK, INFO)
      CALL JF_JOINT_COMPLIANCE_WORK('N', NJ, 1, GAMMA, C, LINFO, RCOND,
     &  WORK, -1, IWORK, -1, INFO)
      CALL ATMOST(LWORK, LIWORK, WORK, IWORK, INFO)
      IF (LWORK .GT. MAXWRK .OR. LIWORK .GT. MAXINT) STOP 1

      DO 30 L = 1, NF
        FREQ = 0.2D0*L
        OMEGA = 2.0D0*PI*FREQ
        KJ(1,1) = DCMPLX(500.0D0, 3.0D0*OMEGA)
        CALL JF_RECEPTANCE_WORK('N', N, 1, N, N, OMEGA, K, M, 0, K, 0,
     &    K, LOSS, ALL, ALL, HA, LINFO, RCOND, WORK, LWORK, IWORK,
     &    LIWORK, INFO)
        CALL TEST(INFO)
        CALL JF_RECEPTANCE_WORK('N', N, 1, N, N, OMEGA, K, M, 0, K, 0,
     &    K, LOSS, ALL, ALL, HB, LINFO, RCOND, WORK, LWORK, IWORK,
     &    LIWORK, INFO)
        CALL TEST(INFO)
        CALL JF_COUPLE_WORK('N', N, N, NJ, 1, HA, HB, KJ, DOFS, DOFS,
     &    HC, LINFO, RCOND, WORK, LWORK, IWORK, LIWORK, INFO)
        CALL TEST(INFO)
        DO 20 I = 1, 2*NJ
          DO 10 J = 1, 2*NJ
            GAMMA(I,J) = HC(DOFSC(I),DOFSC(J))
   10     CONTINUE
   20   CONTINUE
        CALL JF_JOINT_COMPLIANCE_WORK('N', NJ, 1, GAMMA, C, LINFO,
     &    RCOND, WORK, LWORK, IWORK, LIWORK, INFO)
        CALL TEST(INFO)
        KFOUND = 1.0D0/C(1,1)
        WRITE (*, 100) FREQ, DBLE(GAMMA(1,1)), DIMAG(GAMMA(1,1)),
     &    DBLE(KFOUND), DIMAG(KFOUND)/OMEGA
   30 CONTINUE
  100 FORMAT (1P, 5E25.16E2)
      END

C     The larger of two needs, after a query.
      SUBROUTINE ATMOST(LWORK, LIWORK, WORK, IWORK, INFO)
      INTEGER LWORK, LIWORK, IWORK(1), INFO
      COMPLEX*16 WORK(1)

      CALL TEST(INFO)
      LWORK = MAX(LWORK, NINT(DBLE(WORK(1))))
      LIWORK = MAX(LIWORK, IWORK(1))
      END

C     Stop where a call did not go well, and say in words what it was.
      SUBROUTINE TEST(INFO)
      INTEGER INFO
      CHARACTER*80 TEXT

      IF (INFO .NE. 0) THEN
        CALL JF_INFO_TEXT(INFO, 80, TEXT)
        WRITE (*, '(A)') TEXT
        STOP 1
      END IF
      END
