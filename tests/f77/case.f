C     Two beams and a joint (thesis case 3.2), from FORTRAN 77. The same
C     case, alike line by line: tests/fortran/case.f90, tests/c/case.c,
C     tests/python/support/case.py.
C
C     A is clamped, two Euler-Bernoulli elements; B is free, one element.
C     They are joined in deflection and rotation. The assembly through
C     the actual joint K* stands for a measurement, the one through a
C     first estimate K0 for a model. The joint comes back by ISMM and
C     by inverse substructuring, as means over sensitive bands.
C
C     Output, 17 significant digits: name(out,in), line, real part,
C     imaginary part of gamma, k_ismm, k_short on all lines; then the
C     means, method by method: k_Fy, k_Mtheta, c_Fy, c_Mtheta.
C     Exit status 1 if anything is wrong.
      PROGRAM CASE
      INTEGER N, NJ, NF
      PARAMETER (N = 4, NJ = 2, NF = 178)
      DOUBLE PRECISION LOSS
      PARAMETER (LOSS = 0.01D0)
      DOUBLE PRECISION PI, FREQ(NF), OMEGA(NF), RCOND(NF)
      DOUBLE PRECISION KA(N,N), MA(N,N), KB(N,N), MB(N,N)
      COMPLEX*16 HA(N,N,NF), HB(N,N,NF)
      COMPLEX*16 HC(2*N,2*N,NF), HC0(2*N,2*N,NF)
      COMPLEX*16 KJ(NJ,NJ,NF), K0(NJ,NJ,NF)
      COMPLEX*16 GAMMA(2*NJ,2*NJ,NF), ALPHA(2*NJ,2*NJ,NF)
      COMPLEX*16 KISMM(NJ,NJ,NF), KSHORT(NJ,NJ,NF)
      INTEGER ALL(N), DOFSA(NJ), DOFSB(NJ), DOFSC(2*NJ)
      INTEGER LINFO(NF), INFO, I, J, L
C     all DOFs of a beam; the joint's on A, on B, in the assembly
      DATA ALL /1, 2, 3, 4/
      DATA DOFSA /3, 4/, DOFSB /1, 2/, DOFSC /3, 4, 5, 6/

      PI = 4.0D0*ATAN(1.0D0)
      DO 10 L = 1, NF
        FREQ(L) = 15.0D0 + 5.0D0*(L - 1)
        OMEGA(L) = 2.0D0*PI*FREQ(L)
   10 CONTINUE

C     the joint: stiffness N/m, N m/rad; damping N s/m, N m s/rad
      CALL JOINT(6.0D6, 5.0D3, 50.0D0, 15.0D0, NF, OMEGA, KJ)
      CALL JOINT(1.0D6, 1.0D3, 25.0D0, 5.0D0, NF, OMEGA, K0)

C     receptances of A and B
      CALL BEAM(0.300D0, 2, 2, N, KA, MA)
      CALL BEAM(0.225D0, 1, 0, N, KB, MB)
      CALL JF_RECEPTANCE('N', N, NF, N, N, OMEGA, KA, MA, 0, KA, 0, KA,
     &  LOSS, ALL, ALL, HA, LINFO, RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_RECEPTANCE('N', N, NF, N, N, OMEGA, KB, MB, 0, KB, 0, KB,
     &  LOSS, ALL, ALL, HB, LINFO, RCOND, INFO)
      CALL TEST(INFO)

C     the assembly through the joint and through the first estimate
      CALL JF_COUPLE('N', N, N, NJ, NF, HA, HB, KJ, DOFSA, DOFSB, HC,
     &  LINFO, RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_COUPLE('N', N, N, NJ, NF, HA, HB, K0, DOFSA, DOFSB, HC0,
     &  LINFO, RCOND, INFO)
      CALL TEST(INFO)

C     its receptances at the joint
      DO 40 L = 1, NF
        DO 30 I = 1, 2*NJ
          DO 20 J = 1, 2*NJ
            GAMMA(I,J,L) = HC(DOFSC(I),DOFSC(J),L)
            ALPHA(I,J,L) = HC0(DOFSC(I),DOFSC(J),L)
   20     CONTINUE
   30   CONTINUE
   40 CONTINUE

C     the joint again, two ways
      CALL JF_ISMM('N', NJ, NF, ALPHA, GAMMA, K0, KISMM, LINFO, RCOND,
     &  INFO)
      CALL TEST(INFO)
      CALL JF_INVERSE_SUBSTRUCTURING('N', NJ, NF, GAMMA, KSHORT, LINFO,
     &  RCOND, INFO)
      CALL TEST(INFO)

      CALL PRINT('gamma', 2*NJ, NF, GAMMA)
      CALL PRINT('k_ismm', NJ, NF, KISMM)
      CALL PRINT('k_short', NJ, NF, KSHORT)
      CALL MEANS(NF, FREQ, OMEGA, KISMM)
      CALL MEANS(NF, FREQ, OMEGA, KSHORT)
      END

C     Stiffness and consistent mass of a beam, N/m and kg. The first
C     NFIX of its DOFs (deflection and rotation of each node) are held.
      SUBROUTINE BEAM(LENGTH, NEL, NFIX, N, K, M)
      INTEGER NEL, NFIX, N, E, I, J, P, Q
      DOUBLE PRECISION LENGTH, K(N,N), M(N,N)
      DOUBLE PRECISION YOUNG, RHO, WIDTH, HEIGHT
      PARAMETER (YOUNG = 67.0D9, RHO = 2700.0D0)
      PARAMETER (WIDTH = 0.025D0, HEIGHT = 0.006D0)
      DOUBLE PRECISION A, S, W, TK(4,4), TM(4,4), U(4)
      DATA TK /12, 6, -12, 6,  6, 4, -6, 2,
     &  -12, -6, 12, -6,  6, 2, -6, 4/
      DATA TM /156, 22, 54, -13,  22, 4, 13, -3,
     &  54, 13, 156, -22,  -13, -3, -22, 4/

      A = LENGTH/NEL
      S = YOUNG*(WIDTH*HEIGHT*HEIGHT*HEIGHT/12.0D0)/(A*A*A)
      W = RHO*(WIDTH*HEIGHT)*A/420.0D0
      U(1) = 1.0D0
      U(2) = A
      U(3) = 1.0D0
      U(4) = A
      DO 20 I = 1, N
        DO 10 J = 1, N
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
            K(P,Q) = K(P,Q) + S*TK(I,J)*U(I)*U(J)
            M(P,Q) = M(P,Q) + W*TM(I,J)*U(I)*U(J)
   30     CONTINUE
   40   CONTINUE
   50 CONTINUE
      END

C     K* = k + i w c of a joint in deflection and rotation.
      SUBROUTINE JOINT(KY, KT, CY, CT, NF, OMEGA, K)
      INTEGER NF, L
      DOUBLE PRECISION KY, KT, CY, CT, OMEGA(NF)
      COMPLEX*16 K(2,2,NF)

      DO 10 L = 1, NF
        K(1,1,L) = DCMPLX(KY, OMEGA(L)*CY)
        K(2,2,L) = DCMPLX(KT, OMEGA(L)*CT)
        K(1,2,L) = 0.0D0
        K(2,1,L) = 0.0D0
   10 CONTINUE
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

      SUBROUTINE PRINT(NAME, N, NF, H)
      CHARACTER*(*) NAME
      INTEGER N, NF, I, J, L
      COMPLEX*16 H(N,N,NF)

      DO 30 L = 1, NF
        DO 20 I = 1, N
          DO 10 J = 1, N
            WRITE (*, 100) NAME, I, J, L, DBLE(H(I,J,L)),
     &        DIMAG(H(I,J,L))
   10     CONTINUE
   20   CONTINUE
   30 CONTINUE
  100 FORMAT (A, '(', I1, ',', I1, ')', I4, 2(1X, 1PE24.16E2))
      END

C     Print means of k and c over the sensitive bands: 200 to 900 Hz for
C     deflection, 15 to 200 Hz for rotation.
      SUBROUTINE MEANS(NF, FREQ, OMEGA, K)
      INTEGER NF, COUNT, J, L
      DOUBLE PRECISION FREQ(NF), OMEGA(NF), LOW(2), HIGH(2)
      DOUBLE PRECISION SK(2), SC(2)
      COMPLEX*16 K(2,2,NF)
      DATA LOW /200.0D0, 15.0D0/, HIGH /900.0D0, 200.0D0/

      DO 20 J = 1, 2
        SK(J) = 0.0D0
        SC(J) = 0.0D0
        COUNT = 0
        DO 10 L = 1, NF
          IF (FREQ(L) .LT. LOW(J) .OR. FREQ(L) .GT. HIGH(J)) GO TO 10
          SK(J) = SK(J) + DBLE(K(J,J,L))
          SC(J) = SC(J) + DIMAG(K(J,J,L))/OMEGA(L)
          COUNT = COUNT + 1
   10   CONTINUE
        SK(J) = SK(J)/COUNT
        SC(J) = SC(J)/COUNT
   20 CONTINUE
      WRITE (*, 100) 'k_Fy', SK(1), 'k_Mtheta', SK(2)
      WRITE (*, 100) 'c_Fy', SC(1), 'c_Mtheta', SC(2)
  100 FORMAT (A, 1X, 1PE24.16E2)
      END
