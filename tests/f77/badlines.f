C     A program that ends with STOP after calls with bad lines: every
C     third line is singular, every fourth overflows, every fifth holds
C     NaN. Output: engine, info and the codes of the first 12 lines.
C     STOP would print a note if a call left exceptions raised.
      PROGRAM BAD
      INTEGER N, NJ, NF
      PARAMETER (N = 2, NJ = 1, NF = 24)
      COMPLEX*16 A(N,N,NF), X(N,N,NF), K(NJ,NJ,NF), WORK(1000)
      DOUBLE PRECISION RCOND(NF), NAN
      INTEGER LINFO(NF), IWORK(100), INFO, E, L, I
      CHARACTER*3 TEXT
      DATA TEXT /'NaN'/

      READ (TEXT, *) NAN
      DO 10 L = 1, NF
        A(1,1,L) = (2.0D0, 1.0D0)
        A(1,2,L) = (1.0D0, 0.0D0)
        A(2,1,L) = (1.0D0, 0.5D0)
        A(2,2,L) = (3.0D0, 0.0D0)
        IF (MOD(L, 3) .EQ. 0) THEN
          A(1,1,L) = (1.0D0, 0.0D0)
          A(2,1,L) = (1.0D0, 0.0D0)
          A(2,2,L) = (1.0D0, 0.0D0)
        ELSE IF (MOD(L, 4) .EQ. 0) THEN
          A(1,1,L) = (1.0D-310, 0.0D0)
          A(1,2,L) = (0.0D0, 0.0D0)
          A(2,1,L) = (0.0D0, 0.0D0)
          A(2,2,L) = (1.0D-310, 0.0D0)
        ELSE IF (MOD(L, 5) .EQ. 0) THEN
          A(1,2,L) = DCMPLX(NAN, 0.0D0)
        END IF
   10 CONTINUE

      DO 20 E = 1, 5
        CALL JF_SET_ENGINE(E, INFO)
        IF (INFO .EQ. 0) THEN
          CALL JF_INVERT(N, NF, A, X, LINFO, RCOND, INFO)
          WRITE (*, 100) E, INFO, (LINFO(I), I = 1, 12)
          CALL JF_INVERSE_SUBSTRUCTURING('N', NJ, NF, A, K, LINFO,
     &      RCOND, INFO)
          WRITE (*, 100) E, INFO, (LINFO(I), I = 1, 12)
        END IF
   20 CONTINUE
      CALL JF_INVERT_WORK(N, NF, A, X, LINFO, RCOND, WORK, 1000, IWORK,
     &  100, INFO)
      WRITE (*, 100) 0, INFO, (LINFO(I), I = 1, 12)
C     DIVIDE
      STOP
  100 FORMAT (14I4)
      END
