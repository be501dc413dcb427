C     The chain of Table 3-1 (thesis case 3.1) through the flat face,
C     from FORTRAN 77. tests/c/case.c does the same and reads alike.
C
C     ground-k1-m1-k2-m2 =joint= m3-k3-m4-k4-ground. A: m1, m2.
C     B: m3, m4. The joint lies between m2 and m3, 2000 N/m and
C     3 N s/m; the first estimate K0 is half of it.
C
C     Output, one value a line, blanks between: name, line (from 1),
C     real part, imaginary part, with 17 significant digits. Matrix
C     entries are name(out,in), counted from 1. Names: h_a, h_b
C     receptances; h_c, h_c0 assembly through K* and K0; k_ismm,
C     k_short, k_rr identified joint stiffness; c_joint joint
C     compliance. Exit status 1 if anything is wrong.
      PROGRAM CASE
      INTEGER NF
      PARAMETER (NF = 5)
      DOUBLE PRECISION FREQ(NF), OMEGA(NF), PI
      DOUBLE PRECISION KA(2,2), MA(2,2), CA(2,2)
      DOUBLE PRECISION KB(2,2), MB(2,2), CB(2,2)
      COMPLEX*16 HA(2,2,NF), HB(2,2,NF), HC(4,4,NF), HC0(4,4,NF)
      COMPLEX*16 KJ(NF), K0(NF), GAMMA(2,2,NF), ALPHA(2,2,NF), HRR(NF)
      COMPLEX*16 KISMM(NF), KSHORT(NF), KRR(NF), CJ(NF)
      INTEGER DOFS(2), LINFO(NF), INFO, I, M, N
      DOUBLE PRECISION RCOND(NF)
      DATA FREQ /1.0D0, 2.0D0, 4.0D0, 6.0D0, 8.0D0/
      DATA DOFS /1, 2/
C     K, M and C of A (grounded at m1) and of B (grounded at m4)
      DATA KA /6000.0D0, -3500.0D0, -3500.0D0, 3500.0D0/
      DATA MA /5.0D0, 0.0D0, 0.0D0, 3.0D0/
      DATA CA /7.0D0, -4.0D0, -4.0D0, 4.0D0/
      DATA KB /2000.0D0, -2000.0D0, -2000.0D0, 4500.0D0/
      DATA MB /4.0D0, 0.0D0, 0.0D0, 2.0D0/
      DATA CB /2.0D0, -2.0D0, -2.0D0, 3.0D0/

      PI = 4.0D0*ATAN(1.0D0)
      DO 10 I = 1, NF
        OMEGA(I) = 2.0D0*PI*FREQ(I)
        KJ(I) = DCMPLX(2000.0D0, 3.0D0*OMEGA(I))
        K0(I) = DCMPLX(1000.0D0, 1.5D0*OMEGA(I))
   10 CONTINUE

C     receptances of A and B
      CALL JF_RECEPTANCE('N', 2, NF, 2, 2, OMEGA, KA, MA, 2, CA, 0, CA,
     &  0.0D0, DOFS, DOFS, HA, LINFO, RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_RECEPTANCE('N', 2, NF, 2, 2, OMEGA, KB, MB, 2, CB, 0, CB,
     &  0.0D0, DOFS, DOFS, HB, LINFO, RCOND, INFO)
      CALL TEST(INFO)

C     the assembly through the joint and through the first estimate
      CALL JF_COUPLE('N', 2, 2, 1, NF, HA, HB, KJ, 2, 1, HC, LINFO,
     &  RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_COUPLE('N', 2, 2, 1, NF, HA, HB, K0, 2, 1, HC0, LINFO,
     &  RCOND, INFO)
      CALL TEST(INFO)

C     receptances at the joint (DOFs 2 and 3 of the assembly), and at m1
      DO 40 I = 1, NF
        DO 30 M = 1, 2
          DO 20 N = 1, 2
            GAMMA(M,N,I) = HC(M+1,N+1,I)
            ALPHA(M,N,I) = HC0(M+1,N+1,I)
   20     CONTINUE
   30   CONTINUE
        HRR(I) = HC(1,1,I)
   40 CONTINUE

C     the joint again, three ways, and its compliance
      CALL JF_ISMM('N', 1, NF, ALPHA, GAMMA, K0, KISMM, LINFO, RCOND,
     &  INFO)
      CALL TEST(INFO)
      CALL JF_INVERSE_SUBSTRUCTURING('N', 1, NF, GAMMA, KSHORT, LINFO,
     &  RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_DECOUPLE('rr', 'N', 2, 2, 1, NF, HA, HB, HRR, 2, 1, 1, 2,
     &  KRR, LINFO, RCOND, INFO)
      CALL TEST(INFO)
      CALL JF_JOINT_COMPLIANCE('N', 1, NF, GAMMA, CJ, LINFO, RCOND,
     &  INFO)
      CALL TEST(INFO)

      CALL PRINT('h_a', 2, NF, HA)
      CALL PRINT('h_b', 2, NF, HB)
      CALL PRINT('h_c', 4, NF, HC)
      CALL PRINT('h_c0', 4, NF, HC0)
      CALL PRINT('k_ismm', 1, NF, KISMM)
      CALL PRINT('k_short', 1, NF, KSHORT)
      CALL PRINT('k_rr', 1, NF, KRR)
      CALL PRINT('c_joint', 1, NF, CJ)

      DO 50 I = 1, NF
        CALL AGREE(KISMM(I), KJ(I))
        CALL AGREE(KSHORT(I), KJ(I))
        CALL AGREE(KRR(I), KJ(I))
        CALL AGREE(1.0D0/CJ(I), KJ(I))
   50 CONTINUE
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

C     Stop where a joint stiffness is not the one that was put in.
      SUBROUTINE AGREE(FOUND, EXACT)
      COMPLEX*16 FOUND, EXACT
      IF (.NOT. ABS(FOUND - EXACT) .LE. 1.0D-10*ABS(EXACT)) THEN
        WRITE (*, *) 'joint stiffness', FOUND, ' instead of', EXACT
        STOP 1
      END IF
      END

      SUBROUTINE PRINT(NAME, N, NF, H)
      CHARACTER*(*) NAME
      INTEGER N, NF, I, J, K
      COMPLEX*16 H(N,N,NF)
      DO 30 K = 1, NF
        DO 20 I = 1, N
          DO 10 J = 1, N
            WRITE (*, 100) NAME, I, J, K, DBLE(H(I,J,K)),
     &        DIMAG(H(I,J,K))
   10     CONTINUE
   20   CONTINUE
   30 CONTINUE
  100 FORMAT (A, '(', I1, ',', I1, ')', I2, 2(1X, 1PE25.16E3))
      END
