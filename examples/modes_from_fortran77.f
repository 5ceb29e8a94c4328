C     Modes from a Fortran 77 program, through the C interface: a chain
C     of ten masses of 1 kg between walls, joined by springs of 100 N/m.
C     Closed form: omega = 20 sin(j pi/22).
C
C     How it is called:
C     - A handle is an INTEGER*8, an opaque address. _create, _destroy
C       and all arrays take their argument as Fortran passes it, by
C       reference; everything else of the interface goes by value:
C       %VAL(HANDLE), %VAL(N8), %VAL(1.0D0), which gfortran, ifx, flang
C       and nvfortran know.
C     - int64_t is INTEGER*8, int and int32_t are INTEGER, double is
C       DOUBLE PRECISION, a pair of doubles is DOUBLE COMPLEX.
C     - A text ends in CHAR(0).
C     - Indices count from 1: the index base is 1.
C     - The file is compiled so that names get no underscore: gfortran
C       -fno-underscoring, ifx -assume nounderscore.
      PROGRAM MODES
      INTEGER N, NMODES, NMASS, NSTIFF
      PARAMETER (N = 10, NMODES = 3, NMASS = 1, NSTIFF = 2)
      INTEGER*8 PROBLM, OPTION, RESULT, N8, M8, L8
      INTEGER ROW(3*N), COLUMN(3*N), MATRIX, STATUS, I, J, L
      DOUBLE PRECISION VALUE(3*N), FREQ(NMODES), DIAG(2), OFF(2)
      CHARACTER*200 TEXT
      INTEGER kschur_problem_create, kschur_problem_set_triplets
      INTEGER kschur_problem_destroy, kschur_options_create
      INTEGER kschur_options_set_modes, kschur_options_set_inner
      INTEGER kschur_options_destroy, kschur_result_create
      INTEGER kschur_result_get_frequencies_hz
      INTEGER kschur_result_get_message
      INTEGER kschur_result_destroy, kschur_solve
      EXTERNAL kschur_problem_create, kschur_problem_set_triplets
      EXTERNAL kschur_problem_destroy, kschur_options_create
      EXTERNAL kschur_options_set_modes, kschur_options_set_inner
      EXTERNAL kschur_options_destroy, kschur_result_create
      EXTERNAL kschur_result_get_frequencies_hz
      EXTERNAL kschur_result_get_message
      EXTERNAL kschur_result_destroy, kschur_solve
      DATA DIAG /1.0D0, 200.0D0/, OFF /0.0D0, -100.0D0/
C
      N8 = N
      M8 = NMODES
      STATUS = kschur_problem_create(PROBLM)
C     Both matrices are tridiagonal; KSCHUR_MASS is 0, KSCHUR_STIFFNESS
C     is 1.
      DO 30 MATRIX = NMASS, NSTIFF
         L = 0
         DO 20 I = 1, N
            DO 10 J = MAX(1, I - 1), MIN(N, I + 1)
               L = L + 1
               ROW(L) = I
               COLUMN(L) = J
               VALUE(L) = OFF(MATRIX)
               IF (I .EQ. J) VALUE(L) = DIAG(MATRIX)
   10       CONTINUE
   20    CONTINUE
         L8 = L
         IF (STATUS .EQ. 0) STATUS = kschur_problem_set_triplets(
     &      %VAL(PROBLM), %VAL(MATRIX - 1), %VAL(N8), %VAL(N8),
     &      %VAL(L8), %VAL(1), ROW, COLUMN, VALUE)
   30 CONTINUE
      IF (STATUS .EQ. 0) STATUS = kschur_options_create(OPTION)
      IF (STATUS .EQ. 0) STATUS = kschur_options_set_modes(
     &   %VAL(OPTION), %VAL(M8))
      IF (STATUS .EQ. 0) STATUS = kschur_options_set_inner(
     &   %VAL(OPTION), 'auto'//CHAR(0))
      IF (STATUS .EQ. 0) STATUS = kschur_result_create(RESULT)
      IF (STATUS .NE. 0) STOP 'THE PROBLEM COULD NOT BE SET UP'
C
      STATUS = kschur_solve(%VAL(PROBLM), %VAL(OPTION), %VAL(RESULT))
      IF (STATUS .EQ. 0) STATUS = kschur_result_get_frequencies_hz(
     &   %VAL(RESULT), FREQ, %VAL(M8))
      IF (STATUS .EQ. 0) THEN
         PRINT '(A, 3F12.6)', 'frequencies (Hz)', FREQ
      ELSE
         L8 = LEN(TEXT)
         I = kschur_result_get_message(%VAL(RESULT), TEXT, %VAL(L8))
         PRINT '(A)', TEXT(:INDEX(TEXT, CHAR(0)) - 1)
      END IF
      STATUS = kschur_result_destroy(RESULT)
      STATUS = kschur_options_destroy(OPTION)
      STATUS = kschur_problem_destroy(PROBLM)
      END
