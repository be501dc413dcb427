C     FRAME - harmonic response of plane frames.
C
C     Members are straight and uniform, rigidly joined at the nodes: bar
C     and Euler-Bernoulli beam with consistent mass. A node moves in X,
C     Y and turns (directions 1, 2, 3). Time goes as EXP(+I W T).
C
C     Input on unit 5, a title, then cards of one form: A8, 3I8, 4F12.0
C       NODE     N                 X, Y                      (M)
C       SECTION  N                 E, A, I, RHO     (N/M2 .. KG/M3)
C       MEMBER   NODE, NODE, SECTION
C       SUPPORT  N, DIRECTION (0: ALL THREE)
C       LOAD     N, DIRECTION      FORCE OR MOMENT       (N, N M)
C       RESPONSE N, DIRECTION      TO BE PRINTED
C       POINT    N                 POINT RECEPTANCES, 3 BY 3
C       DAMPING                    LOSS FACTOR, K (1 + I ETA)
C       FREQ     LINES             FIRST, STEP              (HZ)
C       END
C     Output on unit 6, one value a line.
      PROGRAM FRAME
      CALL INPUT
      CALL PROFIL
      CALL ASSEM
      CALL RESPON
      END

      SUBROUTINE INPUT
      INCLUDE 'frame.inc'
      CHARACTER*8 KEY
      CHARACTER*80 TITLE
      DIMENSION R(4)

      NUMNP = 0
      NUMEL = 0
      NLOAD = 0
      NRESP = 0
      NPOINT = 0
      NF = 0
      ETA = 0.0D0
      DO 10 N = 1, MAXNP
        DO 10 I = 1, 3
   10 ID(I,N) = 0
      READ (5, 100, END = 90) TITLE
      WRITE (6, 110) TITLE
   20 READ (5, 120, END = 90, ERR = 90) KEY, I1, I2, I3, R
      IF (KEY .EQ. 'NODE') THEN
        CALL RANGE(I1, MAXNP)
        NUMNP = MAX(NUMNP, I1)
        X(I1) = R(1)
        Y(I1) = R(2)
      ELSE IF (KEY .EQ. 'SECTION') THEN
        CALL RANGE(I1, MAXSEC)
        E(I1) = R(1)
        AREA(I1) = R(2)
        XI(I1) = R(3)
        RHO(I1) = R(4)
      ELSE IF (KEY .EQ. 'MEMBER') THEN
        CALL RANGE(NUMEL + 1, MAXEL)
        CALL RANGE(I1, NUMNP)
        CALL RANGE(I2, NUMNP)
        CALL RANGE(I3, MAXSEC)
        NUMEL = NUMEL + 1
        NODE(1,NUMEL) = I1
        NODE(2,NUMEL) = I2
        NSEC(NUMEL) = I3
      ELSE IF (KEY .EQ. 'SUPPORT') THEN
        CALL RANGE(I1, NUMNP)
        CALL RANGE(I2 + 1, 4)
        DO 30 I = 1, 3
          IF (I2 .EQ. 0 .OR. I2 .EQ. I) ID(I,I1) = -1
   30   CONTINUE
      ELSE IF (KEY .EQ. 'LOAD') THEN
        CALL RANGE(NLOAD + 1, MAXLD)
        CALL RANGE(I1, NUMNP)
        CALL RANGE(I2, 3)
        NLOAD = NLOAD + 1
        LD(1,NLOAD) = I1
        LD(2,NLOAD) = I2
        P(NLOAD) = R(1)
      ELSE IF (KEY .EQ. 'RESPONSE') THEN
        CALL RANGE(NRESP + 1, MAXLD)
        CALL RANGE(I1, NUMNP)
        CALL RANGE(I2, 3)
        NRESP = NRESP + 1
        LR(1,NRESP) = I1
        LR(2,NRESP) = I2
      ELSE IF (KEY .EQ. 'POINT') THEN
        CALL RANGE(NPOINT + 1, MAXLD)
        NPOINT = NPOINT + 1
        LP(NPOINT) = I1
      ELSE IF (KEY .EQ. 'DAMPING') THEN
        ETA = R(1)
      ELSE IF (KEY .EQ. 'FREQ') THEN
        CALL RANGE(I1, MAXF)
        NF = I1
        DO 40 L = 1, NF
          FREQ(L) = R(1) + (L - 1)*R(2)
          OMEGA(L) = 8.0D0*ATAN(1.0D0)*FREQ(L)
   40   CONTINUE
      ELSE IF (KEY .NE. 'END') THEN
        WRITE (6, 130) KEY
        STOP 1
      END IF
      IF (KEY .NE. 'END') GO TO 20
      RETURN

   90 WRITE (6, 140)
      STOP 1
  100 FORMAT (A80)
  110 FORMAT ('FRAME    ', A80)
  120 FORMAT (A8, 3I8, 4F12.0)
  130 FORMAT ('CARD NOT KNOWN: ', A8)
  140 FORMAT ('CARD CANNOT BE READ, OR NO END CARD')
      END

C     Stop where a number on a card is not one of 1 to LIMIT.
      SUBROUTINE RANGE(N, LIMIT)
      IF (N .GE. 1 .AND. N .LE. LIMIT) RETURN
      WRITE (6, 100) N, LIMIT
      STOP 1
  100 FORMAT ('NUMBER ON A CARD: ', I8, ' IS NOT IN 1 TO ', I8)
      END

C     Number the equations; column heights and addresses of diagonals.
      SUBROUTINE PROFIL
      INCLUDE 'frame.inc'
      DIMENSION LM(6), MHT(MAXEQ)

      NEQ = 0
      DO 10 N = 1, NUMNP
        DO 10 I = 1, 3
          IF (ID(I,N) .LT. 0) THEN
            ID(I,N) = 0
          ELSE
            NEQ = NEQ + 1
            ID(I,N) = NEQ
            MHT(NEQ) = 0
          END IF
   10 CONTINUE
      DO 40 M = 1, NUMEL
        CALL LMVEC(M, LM)
        LOW = NEQ
        DO 20 I = 1, 6
          IF (LM(I) .GT. 0) LOW = MIN(LOW, LM(I))
   20   CONTINUE
        DO 30 I = 1, 6
          IF (LM(I) .GT. 0) MHT(LM(I)) = MAX(MHT(LM(I)), LM(I) - LOW)
   30   CONTINUE
   40 CONTINUE
      MAXA(1) = 1
      DO 50 N = 1, NEQ
        MAXA(N+1) = MAXA(N) + MHT(N) + 1
   50 CONTINUE
      NWK = MAXA(NEQ+1) - 1
      WRITE (6, 100) NUMNP, NUMEL, NEQ, NWK
      IF (NEQ .LT. 1 .OR. NWK .GT. MAXWK) STOP 1
  100 FORMAT ('SIZES    ', I8, ' NODES', I8, ' MEMBERS', I8,
     &  ' EQUATIONS', I8, ' WORDS OF SKYLINE')
      END

C     Equations of the six motions of member M.
      SUBROUTINE LMVEC(M, LM)
      INCLUDE 'frame.inc'
      DIMENSION LM(6)

      DO 10 I = 1, 3
        LM(I) = ID(I,NODE(1,M))
        LM(I+3) = ID(I,NODE(2,M))
   10 CONTINUE
      END

C     Assemble stiffness and mass.
      SUBROUTINE ASSEM
      INCLUDE 'frame.inc'
      DIMENSION LM(6), EK(6,6), EM(6,6)

      DO 10 I = 1, NWK
        SK(I) = 0.0D0
        SM(I) = 0.0D0
   10 CONTINUE
      DO 40 M = 1, NUMEL
        CALL MEMBER(M, EK, EM)
        CALL LMVEC(M, LM)
        DO 30 J = 1, 6
          DO 20 I = 1, 6
            IF (LM(I) .LT. 1 .OR. LM(I) .GT. LM(J)) GO TO 20
            K = MAXA(LM(J)) + LM(J) - LM(I)
            SK(K) = SK(K) + EK(I,J)
            SM(K) = SM(K) + EM(I,J)
   20     CONTINUE
   30   CONTINUE
   40 CONTINUE
      END

C     Stiffness and consistent mass of member M in X and Y.
      SUBROUTINE MEMBER(M, EK, EM)
      INCLUDE 'frame.inc'
      DIMENSION EK(6,6), EM(6,6), T(6,6), BK(6,6), BM(6,6)

      DX = X(NODE(2,M)) - X(NODE(1,M))
      DY = Y(NODE(2,M)) - Y(NODE(1,M))
      EL = SQRT(DX**2 + DY**2)
      IF (EL .LE. 0.0D0) STOP 1
      CX = DX/EL
      CY = DY/EL
      EA = E(NSEC(M))*AREA(NSEC(M))/EL
      EI = E(NSEC(M))*XI(NSEC(M))/EL**3
      W = RHO(NSEC(M))*AREA(NSEC(M))*EL/420.0D0
      DO 10 J = 1, 6
        DO 10 I = 1, 6
          BK(I,J) = 0.0D0
          BM(I,J) = 0.0D0
   10 T(I,J) = 0.0D0
C     along the member, across it, and turning; upper triangle
      BK(1,1) = EA
      BK(1,4) = -EA
      BK(4,4) = EA
      BK(2,2) = 12.0D0*EI
      BK(2,3) = 6.0D0*EL*EI
      BK(2,5) = -12.0D0*EI
      BK(2,6) = 6.0D0*EL*EI
      BK(3,3) = 4.0D0*EL**2*EI
      BK(3,5) = -6.0D0*EL*EI
      BK(3,6) = 2.0D0*EL**2*EI
      BK(5,5) = 12.0D0*EI
      BK(5,6) = -6.0D0*EL*EI
      BK(6,6) = 4.0D0*EL**2*EI
      BM(1,1) = 140.0D0*W
      BM(1,4) = 70.0D0*W
      BM(4,4) = 140.0D0*W
      BM(2,2) = 156.0D0*W
      BM(2,3) = 22.0D0*EL*W
      BM(2,5) = 54.0D0*W
      BM(2,6) = -13.0D0*EL*W
      BM(3,3) = 4.0D0*EL**2*W
      BM(3,5) = 13.0D0*EL*W
      BM(3,6) = -3.0D0*EL**2*W
      BM(5,5) = 156.0D0*W
      BM(5,6) = -22.0D0*EL*W
      BM(6,6) = 4.0D0*EL**2*W
      DO 20 I = 1, 4, 3
        T(I,I) = CX
        T(I,I+1) = CY
        T(I+1,I) = -CY
        T(I+1,I+1) = CX
        T(I+2,I+2) = 1.0D0
   20 CONTINUE
      DO 40 J = 1, 6
        DO 40 I = 1, 6
          EK(I,J) = 0.0D0
          EM(I,J) = 0.0D0
          DO 30 KJ = 1, 6
            DO 30 KI = 1, 6
              EK(I,J) = EK(I,J)
     &          + T(KI,I)*BK(MIN(KI,KJ),MAX(KI,KJ))*T(KJ,J)
              EM(I,J) = EM(I,J)
     &          + T(KI,I)*BM(MIN(KI,KJ),MAX(KI,KJ))*T(KJ,J)
   30     CONTINUE
   40 CONTINUE
      END

C     Responses to the loads, and point receptances, line by line.
      SUBROUTINE RESPON
      INCLUDE 'frame.inc'
      COMPLEX*16 H(3,3), U

      DO 50 L = 1, NF
        CALL DYNSTF(L)
        DO 10 N = 1, NEQ
          V(N) = 0.0D0
   10   CONTINUE
        DO 20 I = 1, NLOAD
          N = ID(LD(2,I),LD(1,I))
          IF (N .GT. 0) V(N) = V(N) + P(I)
   20   CONTINUE
        CALL SOLVE
        DO 30 I = 1, NRESP
          U = 0.0D0
          N = ID(LR(2,I),LR(1,I))
          IF (N .GT. 0) U = V(N)
          WRITE (6, 100) LR(1,I), LR(2,I), L, FREQ(L), U
   30   CONTINUE
        DO 40 I = 1, NPOINT
          CALL POINT(LP(I), H)
          CALL PRMAT('POINT   ', LP(I), L, 3, H)
   40   CONTINUE
   50 CONTINUE
  100 FORMAT ('RESPONSE', 3I6, F12.4, 2(1X, 1PE24.16E3))
      END

C     Receptances between the three motions of a node, at the line for
C     which DYNSTF was called last.
      SUBROUTINE POINT(NP, H)
      INCLUDE 'frame.inc'
      COMPLEX*16 H(3,3)

      CALL RANGE(NP, NUMNP)
      DO 30 J = 1, 3
        DO 10 N = 1, NEQ
          V(N) = 0.0D0
   10   CONTINUE
        IF (ID(J,NP) .GT. 0) V(ID(J,NP)) = 1.0D0
        CALL SOLVE
        DO 20 I = 1, 3
          H(I,J) = 0.0D0
          IF (ID(I,NP) .GT. 0) H(I,J) = V(ID(I,NP))
   20   CONTINUE
   30 CONTINUE
      END

C     Print the receptances H of line L.
      SUBROUTINE PRMAT(NAME, NP, L, N, H)
      INCLUDE 'frame.inc'
      CHARACTER*8 NAME
      COMPLEX*16 H(N,N)

      DO 10 I = 1, N
        DO 10 J = 1, N
          WRITE (6, 100) NAME, NP, I, J, L, FREQ(L), H(I,J)
   10 CONTINUE
  100 FORMAT (A8, 4I6, F12.4, 2(1X, 1PE24.16E3))
      END

C     Dynamic stiffness Z = (1 + I ETA) K - W**2 M of line L, factored
C     as L D L(transposed), column by column within the skyline.
      SUBROUTINE DYNSTF(L)
      INCLUDE 'frame.inc'
      COMPLEX*16 C, D

      DO 10 I = 1, NWK
        Z(I) = DCMPLX(1.0D0, ETA)*SK(I) - OMEGA(L)**2*SM(I)
   10 CONTINUE
      DO 50 N = 1, NEQ
        KN = MAXA(N)
        NH = MAXA(N+1) - KN - 1
C       reduce the column by those to its left, from its top down
        DO 30 K = N - NH + 1, N - 1
          KH = MIN(MAXA(K+1) - MAXA(K) - 1, K - N + NH)
          C = 0.0D0
          DO 20 I = 1, KH
            C = C + Z(MAXA(K)+I)*Z(KN+N-K+I)
   20     CONTINUE
          Z(KN+N-K) = Z(KN+N-K) - C
   30   CONTINUE
C       divide by the pivots; what is left is the next pivot
        D = 0.0D0
        DO 40 I = 1, NH
          C = Z(KN+I)/Z(MAXA(N-I))
          D = D + C*Z(KN+I)
          Z(KN+I) = C
   40   CONTINUE
        Z(KN) = Z(KN) - D
        IF (ABS(Z(KN)) .LE. 0.0D0) THEN
          WRITE (6, 100) N, FREQ(L)
          STOP 1
        END IF
   50 CONTINUE
  100 FORMAT ('SINGULAR IN EQUATION ', I8, ' AT ', F12.4, ' HZ')
      END

C     Displacements for the loads in V, which they replace.
      SUBROUTINE SOLVE
      INCLUDE 'frame.inc'

      DO 10 N = 1, NEQ
        DO 10 I = 1, MAXA(N+1) - MAXA(N) - 1
          V(N) = V(N) - Z(MAXA(N)+I)*V(N-I)
   10 CONTINUE
      DO 20 N = 1, NEQ
        V(N) = V(N)/Z(MAXA(N))
   20 CONTINUE
      DO 30 N = NEQ, 1, -1
        DO 30 I = 1, MAXA(N+1) - MAXA(N) - 1
          V(N-I) = V(N-I) - Z(MAXA(N)+I)*V(N)
   30 CONTINUE
      END
