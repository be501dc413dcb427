C     The joint of two beams (thesis case 3.3) from noisy FRFs at it,
C     with standard errors, from FORTRAN 77. The same program, alike
C     line by line: tests/fortran/identify.f90, tests/c/identify.c,
C     tests/python/support/identify_joint.py.
C
C     A is clamped, 300 elements of 1 mm; B is free, 225 elements; the
C     elements are linear with shear and lumped mass. A joint in
C     deflection and rotation connects them. Its stiffness and damping
C     come from FRFs at both sides of it, 15 to 800 Hz, to which 5 %
C     noise was added.
C
C     Output, 6 significant digits: each parameter, its value and its
C     standard error. Exit status 1 if anything is wrong.
      PROGRAM IDENT
      INTEGER NA, NB, NJ, NP, NF, NNEAR
      PARAMETER (NA = 600, NB = 452, NJ = 2, NP = 4, NF = 786)
      PARAMETER (NNEAR = 2)
      DOUBLE PRECISION LEVEL, PI
      PARAMETER (LEVEL = 0.05D0)
      CHARACTER*8 NAMES(NP)
      INTEGER TIPA(NJ), TIPB(NJ), JDOFS(NJ), DOFS(NP), KINDS(NP)
      INTEGER SEED(2), LINFO(NF), USED(NF), ITER, CONV, INFO
      INTEGER I, J, K, L, FIRST, LAST
      DOUBLE PRECISION OMEGA(NF), RCOND(NF), DIST(NF), SQUARE(NF)
      DOUBLE PRECISION WEIGHT(2*NJ,2*NJ,NF), S, WHITE(1)
      COMPLEX*16 HA(NJ,NJ,NF), HB(NJ,NJ,NF), KJ(NJ,NJ,NF)
      COMPLEX*16 FREEH(NJ,NJ,NF), FREEQ(NJ,NJ,NF), W(NJ,NJ,NF)
      COMPLEX*16 GAMMA(2*NJ,2*NJ,NF), MEAS(2*NJ,2*NJ,NF)
      COMPLEX*16 CJ(NJ,NF), GRAD(NJ,NF)
      DOUBLE PRECISION SPRING(NJ), X(NP), VALUE(NP), COV(NP,NP)
      DOUBLE PRECISION NORMAL(NP,NP), DESC(NP), LDESC(NP,NF)
      DOUBLE PRECISION COST, EQUAT
C     the joint's DOFs on A, on B; the DOF of each parameter, and its
C     kind: 0 stiffness, 2 viscous damping
      DATA TIPA /599, 600/, TIPB /1, 2/, JDOFS /1, 2/
      DATA DOFS /1, 2, 1, 2/, KINDS /0, 0, 2, 2/, SEED /1, 0/
      DATA NAMES /'k_Fy', 'k_Mtheta', 'c_Fy', 'c_Mtheta'/

      PI = 4.0D0*ATAN(1.0D0)
      DO 10 L = 1, NF
        OMEGA(L) = 2.0D0*PI*(15.0D0 + L - 1.0D0)
   10 CONTINUE

C     FRFs at the joint, coupled through it, and noise on them
      CALL BEAM(0.300D0, NA, 300, 2, NF, OMEGA, TIPA, HA)
      CALL BEAM(0.225D0, NB, 225, 0, NF, OMEGA, TIPB, HB)
      DO 20 L = 1, NF
        KJ(1,1,L) = DCMPLX(6.0D5, 20.0D0*OMEGA(L))
        KJ(2,2,L) = DCMPLX(5.0D3, 1.5D0*OMEGA(L))
        KJ(1,2,L) = 0.0D0
        KJ(2,1,L) = 0.0D0
   20 CONTINUE
      CALL JF_COUPLE('N', NJ, NJ, NJ, NF, HA, HB, KJ, JDOFS, JDOFS,
     &  GAMMA, LINFO, RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_POLLUTE('N', 'C', 'E', 0, 1, LEVEL, SEED, 2*NJ, 2*NJ,
     &  NF, 0, 1, GAMMA, MEAS, INFO)
      CALL TEST(INFO)

C     the mean of both directions, and one over the standard deviation
C     of its noise, by the mean over neighbouring lines
      DO 50 L = 1, NF
        DO 40 J = 1, 2*NJ
          DO 30 I = 1, 2*NJ
            GAMMA(I,J,L) = 0.5D0*(MEAS(I,J,L) + MEAS(J,I,L))
   30     CONTINUE
   40   CONTINUE
   50 CONTINUE
      DO 90 L = 1, NF
        FIRST = MAX(L - NNEAR, 1)
        LAST = MIN(L + NNEAR, NF)
        DO 80 J = 1, 2*NJ
          DO 70 I = 1, 2*NJ
            S = 0.0D0
            DO 60 K = FIRST, LAST
              S = S + DBLE(GAMMA(I,J,K))**2 + DIMAG(GAMMA(I,J,K))**2
   60       CONTINUE
            WEIGHT(I,J,L) = SQRT((LAST - FIRST + 1)/S)/LEVEL
            IF (I .NE. J) WEIGHT(I,J,L) = WEIGHT(I,J,L)*SQRT(2.0D0)
   70     CONTINUE
   80   CONTINUE
   90 CONTINUE

C     the joint
      CALL JF_FIT_JOINT('N', 1, NJ, NP, 2*NJ, 2*NJ, 0, NF, 0, 8, 0,
     &  0.0D0, DOFS, KINDS, OMEGA, GAMMA, GAMMA, WEIGHT, WHITE,
     &  SPRING, X, FREEH, FREEQ, VALUE, COV, NORMAL, DESC, COST,
     &  EQUAT, LDESC, DIST, USED, CJ, W, GRAD, SQUARE, ITER, CONV,
     &  LINFO, INFO)
      CALL TEST(INFO)
      IF (CONV .NE. 1) STOP 1
      DO 100 I = 1, NP
        WRITE (*, 900) NAMES(I), VALUE(I), SQRT(COV(I,I))
  100 CONTINUE
  900 FORMAT (A, 2(1X, 1PE13.5E2))
      END

C     Receptance at two DOFs of a beam of N DOFs, deflection and
C     rotation of each node. The first NFIX are held. K and M are band
C     matrices with three diagonals on each side: entry (P,Q) at
C     (4 + P - Q, Q).
      SUBROUTINE BEAM(LENGTH, N, NEL, NFIX, NF, OMEGA, TIP, H)
      INTEGER NMAX
      PARAMETER (NMAX = 600)
      INTEGER N, NEL, NFIX, NF, TIP(2), E, I, J, P, Q, INFO, LINFO(786)
      DOUBLE PRECISION LENGTH, OMEGA(NF), RCOND(786)
      COMPLEX*16 H(2,2,NF)
      DOUBLE PRECISION YOUNG, POISS, RHO, WIDTH, HEIGHT, LOSS
      PARAMETER (YOUNG = 67.0D9, POISS = 0.33D0, RHO = 2700.0D0)
      PARAMETER (WIDTH = 0.025D0, HEIGHT = 0.006D0, LOSS = 0.01D0)
      DOUBLE PRECISION K(7,NMAX), M(7,NMAX), A, BEND, SHEAR
      DOUBLE PRECISION TURN(4), ANGLE(4), MASS(4)
      SAVE K, M

      A = LENGTH/NEL
      BEND = YOUNG*(WIDTH*HEIGHT*HEIGHT*HEIGHT/12.0D0)
      SHEAR = 0.85D0*YOUNG/(2.0D0*(1.0D0 + POISS))*(WIDTH*HEIGHT)
     &  /(1.0D0 + 0.25D0*A*A/(HEIGHT*HEIGHT))
      TURN(1) = 0.0D0
      TURN(2) = -1.0D0/A
      TURN(3) = 0.0D0
      TURN(4) = 1.0D0/A
      ANGLE(1) = -1.0D0/A
      ANGLE(2) = -0.5D0
      ANGLE(3) = 1.0D0/A
      ANGLE(4) = -0.5D0
      MASS(1) = 0.5D0*A*RHO*(WIDTH*HEIGHT)
      MASS(2) = 0.5D0*A*RHO*(WIDTH*HEIGHT*HEIGHT*HEIGHT/12.0D0)
      MASS(3) = MASS(1)
      MASS(4) = MASS(2)
      DO 20 J = 1, N
        DO 10 I = 1, 7
          K(I,J) = 0.0D0
          M(I,J) = 0.0D0
   10   CONTINUE
   20 CONTINUE
      DO 50 E = 1, NEL
        DO 40 I = 1, 4
          DO 30 J = 1, 4
            P = 2*(E - 1) + I - NFIX
            Q = 2*(E - 1) + J - NFIX
            IF (P .LT. 1 .OR. Q .LT. 1) GO TO 30
            K(4+P-Q,Q) = K(4+P-Q,Q) + A*(BEND*TURN(I)*TURN(J) +
     &        SHEAR*ANGLE(I)*ANGLE(J))
            IF (I .EQ. J) M(4,Q) = M(4,Q) + MASS(I)
   30     CONTINUE
   40   CONTINUE
   50 CONTINUE
      CALL JF_RECEPTANCE_BANDED('N', N, 3, 3, NF, 2, 2, OMEGA, K, M, 0,
     &  K, 0, K, LOSS, TIP, TIP, H, LINFO, RCOND, INFO)
      CALL TEST(INFO)
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
