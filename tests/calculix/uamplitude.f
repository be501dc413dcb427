!     A user subroutine of CalculiX that calls jointfrf.
!
!     A machine A stands on a structure B through a joint. The model of
!     CalculiX is B; A is known by its measured accelerance. The load of
!     B is the force that passes the joint for a force of 1 on A, in a
!     step *STEADY STATE DYNAMICS, where TIME is the frequency in Hz:
!
!       *AMPLITUDE, NAME=JOINT_RE, USER
!       *AMPLITUDE, NAME=JOINT_IM, USER
!       ...
!       *CLOAD, AMPLITUDE=JOINT_RE
!       9, 1, 1.
!       *CLOAD, AMPLITUDE=JOINT_IM, LOAD CASE=2
!       9, 1, 1.
!
!     joint.txt: number of lines N, stiffness (N/m), viscous damping
!     (N s/m) and loss factor of the joint; then N lines of frequency
!     (Hz) and real and imaginary part of the accelerances of A and B
!     at the joint (1/kg), in increasing frequency.
!
      SUBROUTINE UAMPLITUDE(TIME, NAME, AMPLITUDE)
      IMPLICIT NONE
      CHARACTER*80 NAME
      REAL*8 TIME, AMPLITUDE
      COMPLEX*16 FORCE
!
      CALL JOINTF(TIME, FORCE)
      IF (NAME(1:9).EQ.'JOINT_RE ') THEN
        AMPLITUDE = DBLE(FORCE)
      ELSE IF (NAME(1:9).EQ.'JOINT_IM ') THEN
        AMPLITUDE = DIMAG(FORCE)
      ELSE
        WRITE(*,*) '*ERROR in uamplitude: unknown amplitude'
        CALL EXIT(201)
      ENDIF
      END
!
!     Force that passes the joint at a frequency for a force of 1 on A
!
      SUBROUTINE JOINTF(FREQ, FORCE)
      IMPLICIT NONE
      INCLUDE 'jointfrf.inc'
      INTEGER MAXF, LWORK, LIWORK
      PARAMETER (MAXF = 10000, LWORK = 400, LIWORK = 100)
      REAL*8 FREQ, OMEGA, RCOND(1), F(MAXF), K, C, ETA
      REAL*8 RA, QA, RB, QB
      COMPLEX*16 FORCE, A(MAXF), B(MAXF), HA(1,1,1), HB(1,1,1)
      COMPLEX*16 KJ(1,1,1), HC(2,2,1), WORK(LWORK), BETWEEN
      INTEGER N, I, IA(1), IB(1), LINFO(1), IWORK(LIWORK), INFO
      SAVE F, A, B, N, K, C, ETA
      DATA N /0/, IA /1/, IB /1/
!
      IF (N.EQ.0) THEN
        OPEN(77, FILE='joint.txt', STATUS='OLD', ERR=90)
        READ(77, *, ERR=90, END=90) N, K, C, ETA
        IF (N.LT.2 .OR. N.GT.MAXF) GOTO 90
        DO 10 I = 1, N
          READ(77, *, ERR=90, END=90) F(I), RA, QA, RB, QB
          A(I) = DCMPLX(RA, QA)
          B(I) = DCMPLX(RB, QB)
   10   CONTINUE
        CLOSE(77)
      ENDIF
      IF (FREQ.LT.F(1) .OR. FREQ.GT.F(N)) THEN
        WRITE(*,*) '*ERROR in uamplitude: no FRF at ', FREQ, ' Hz'
        CALL EXIT(201)
      ENDIF
!
      OMEGA = 8.0D0*DATAN(1.0D0)*FREQ
      HA(1,1,1) = -BETWEEN(FREQ, N, F, A)/OMEGA**2
      HB(1,1,1) = -BETWEEN(FREQ, N, F, B)/OMEGA**2
      KJ(1,1,1) = DCMPLX(K, ETA*K + OMEGA*C)
      CALL JF_COUPLE_WORK('N', 1, 1, 1, 1, HA, HB, KJ, IA, IB, HC,
     &                    LINFO, RCOND, WORK, LWORK, IWORK, LIWORK,
     &                    INFO)
      IF (INFO.NE.JF_INFO_GOOD) THEN
        WRITE(*,*) '*ERROR in uamplitude: jf_couple_work, INFO ', INFO
        CALL EXIT(201)
      ENDIF
      FORCE = KJ(1,1,1)*(HC(1,1,1) - HC(2,1,1))
      RETURN
   90 WRITE(*,*) '*ERROR in uamplitude: joint.txt is missing or wrong'
      CALL EXIT(201)
      END
!
!     Straight line between two lines of an accelerance
!
      COMPLEX*16 FUNCTION BETWEEN(FREQ, N, F, H)
      IMPLICIT NONE
      INTEGER N, I
      REAL*8 FREQ, F(N), SHARE
      COMPLEX*16 H(N)
!
      I = 1
   10 IF (I.LT.N - 1 .AND. F(I+1).LT.FREQ) THEN
        I = I + 1
        GOTO 10
      ENDIF
      SHARE = (FREQ - F(I))/(F(I+1) - F(I))
      BETWEEN = H(I) + SHARE*(H(I+1) - H(I))
      END
