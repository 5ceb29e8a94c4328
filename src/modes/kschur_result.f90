!> The result of a solve: modes, their accuracy, and how they were found.
module kschur_result
   use kschur_effort, only: effort_type, timings_type
   use kschur_kinds, only: wp, long
   use kschur_mesh, only: mesh_type
   use kschur_outcome, only: history_type, certified_names, certified_no, certified_unknown, certified_yes, inaccurate_above, &
      reason_names, reason_converged, reason_max_restarts, reason_fewer_modes, reason_cancelled, &
      reason_inaccurate, reason_interrupted
   use kschur_options, only: modal_options_type, formulation_auto
   use kschur_properties, only: modal_properties_type
   implicit none
   private
   public :: append_note, modal_result_type, history_type, timings_type
   public :: certified_names, certified_no, certified_unknown, certified_yes
   public :: reason_names, reason_converged, reason_max_restarts, reason_fewer_modes, reason_cancelled, &
      reason_inaccurate, reason_interrupted, inaccurate_above

   !> A zero eigenvalue: a motion without strain.
   integer, parameter, public :: kind_rigid = 0
   !> An oscillation without decay.
   integer, parameter, public :: kind_undamped = 1
   !> A decaying oscillation.
   integer, parameter, public :: kind_underdamped = 2
   !> One of the two decaying exponentials of an oscillator damped beyond critical.
   integer, parameter, public :: kind_overdamped = 3
   !> An eigenvalue in the right half-plane.
   integer, parameter, public :: kind_unstable = 4
   !> Another decaying exponential.
   integer, parameter, public :: kind_real = 5
   !> The names of the kinds, in this order from `kind_rigid` on.
   character(len=*), parameter, public :: kind_names(0:5) = [character(len=11) :: &
      "rigid", "undamped", "underdamped", "overdamped", "unstable", "real"]

   !> Largest length of a note.
   integer, parameter, public :: note_length = 200

   !> The modes, sorted by distance from the target or, of a band, by frequency, with their accuracy and the effort of the solve.
   type, extends(effort_type) :: modal_result_type
      !> Eigenvalues lambda (1/s), Im >= 0: a conjugate pair stands once.
      complex(wp), allocatable :: eigenvalues(:)
      !> Mode shapes phi, n x modes, largest entry real and positive: that is the phase also of the complex shapes of damped
      !> modes. Of unit Euclidean norm, or as `options%normalisation` says.
      complex(wp), allocatable :: eigenvectors(:, :)
      !> Lagrange multipliers xi, m x modes, of the constraints as given.
      complex(wp), allocatable :: multipliers(:, :)
      !> Natural frequency |lambda| / 2 pi (Hz), eq. (26).
      real(wp), allocatable :: frequency_hz(:)
      !> Damped frequency |Im lambda| / 2 pi (Hz), eq. (27).
      real(wp), allocatable :: damped_frequency_hz(:)
      !> Damping ratio, eq. (28); NaN where undefined, as for a rigid-body mode.
      real(wp), allocatable :: damping_ratio(:)
      !> Loss factor, of `loss_factor_of`; not allocated where the problem has no loss matrix.
      real(wp), allocatable :: loss_factor(:)
      !> Backward error: the larger of the normwise residual of the problem as
      !> given and of the violation of its constraints.
      real(wp), allocatable :: backward_error(:)
      !> Bound of the error of each eigenvalue (1/s): backward error times condition number; NaN where not known.
      real(wp), allocatable :: error_bound(:)
      !> One of `kind_*`.
      integer, allocatable :: kind(:)
      !> Left vectors psi, n x modes, psi^* P(lambda) + eta^* Cq = 0, of unit Euclidean norm, largest entry real and
      !> positive; psi_i^* ((lambda_i + lambda_j) M + R) phi_j = 0 for i /= j, except between rigid-body modes. NaN
      !> where none was found; this and the next two are not allocated unless asked for.
      complex(wp), allocatable :: left_eigenvectors(:, :)
      !> Multipliers eta, m x modes, of the left vectors.
      complex(wp), allocatable :: left_multipliers(:, :)
      !> Condition number kappa of each eigenvalue (Tisseur 2000): M, R and K changed by eps relative to their
      !> infinity norms move it by no more than kappa eps |lambda|. Of a multiple eigenvalue that of the vectors as
      !> they are. Infinite for a zero and for a defective eigenvalue, NaN without a left vector.
      real(wp), allocatable :: condition(:)
      !> Generalised and effective masses; not allocated until `find_modal_properties` computes them.
      type(modal_properties_type), allocatable :: properties

      !> The options as given.
      type(modal_options_type) :: options
      !> One of `reason_*`: why the iteration ended.
      integer :: reason = reason_converged
      !> One of `certified_*`: whether it is proved that the modes are the nearest to the target, or all of
      !> the band, none missing.
      integer :: certified = certified_unknown
      !> How many eigenvalues nearer to the target than the furthest mode are missing, both of a conjugate pair
      !> counted; -1 where not known. Known where they were counted.
      integer :: missing = -1
      !> Number of modes that were asked for; of a band how many it holds, as far as that is known.
      integer :: modes_asked = 0
      !> The band of natural frequencies (Hz) whose modes these are; not allocated where no band was asked for.
      real(wp), allocatable :: band(:)
      !> Notes to the user beyond the reason, as sentences.
      character(len=note_length), allocatable :: notes(:)
      !> Number of constraints that depend linearly on others.
      integer :: redundant_constraints = 0
      !> Properties of the problem: n, m, symmetry, kind of damping (`damping_*`).
      integer :: unknowns = 0, constraints = 0, damping_kind = 0
      logical :: symmetric = .false.
      !> The method that found the modes: "krylov-schur", "arpack-plain", "arpack-fair".
      character(len=:), allocatable :: method
      !> One of `formulation_*`: the one that was used.
      integer :: formulation = formulation_auto
      !> Why it was chosen, in words.
      character(len=:), allocatable :: decision
      !> Which solver factored the matrix, and why this one: "ldl: symmetric definite, 19 entries a column".
      character(len=:), allocatable :: inner
      !> Block size of the iteration.
      integer :: block = 1
      !> The target and the shift that were used (1/s).
      complex(wp) :: target = (0.0_wp, 0.0_wp), shift = (0.0_wp, 0.0_wp)

      !> Order of the factored matrix and number of entries of its factors.
      integer :: factored_order = 0
      integer(long) :: factor_entries = 0
      !> Peak memory (bytes) of the factorization, with the factors, in the process that needs most; -1 where not known.
      integer(long) :: factor_bytes = -1
      !> Root of the sum of squares of the couplings dropped by locking, relative to the norm of the operator.
      real(wp) :: locking_error = 0
      !> Peak memory (bytes) of the program that solved the problem; -1 where not known.
      integer(long) :: peak_memory_bytes = -1
      type(history_type) :: history
      !> The mesh of the problem; not allocated where it has none.
      type(mesh_type), allocatable :: mesh
   contains
      !> Appends a sentence to the notes.
      procedure :: add_note
      !> Keeps some of the modes alone, in a given order.
      procedure :: take
      !> Whether shape and multipliers of a mode are real numbers.
      procedure :: is_real
   end type modal_result_type

contains

   !> Appends a sentence to the notes.
   pure subroutine add_note(self, sentence)
      class(modal_result_type), intent(inout) :: self
      character(len=*), intent(in) :: sentence

      call append_note(self%notes, sentence)
   end subroutine add_note

   !> Keeps some of the modes alone, in a given order; drops the modal properties.
   pure subroutine take(self, modes)
      class(modal_result_type), intent(inout) :: self
      !> Numbers of the modes to keep.
      integer, intent(in) :: modes(:)

      self%eigenvalues = self%eigenvalues(modes)
      self%eigenvectors = self%eigenvectors(:, modes)
      self%multipliers = self%multipliers(:, modes)
      self%frequency_hz = self%frequency_hz(modes)
      self%damped_frequency_hz = self%damped_frequency_hz(modes)
      self%damping_ratio = self%damping_ratio(modes)
      if (allocated(self%loss_factor)) self%loss_factor = self%loss_factor(modes)
      self%backward_error = self%backward_error(modes)
      self%error_bound = self%error_bound(modes)
      self%kind = self%kind(modes)
      if (allocated(self%condition)) self%condition = self%condition(modes)
      if (allocated(self%left_eigenvectors)) self%left_eigenvectors = self%left_eigenvectors(:, modes)
      if (allocated(self%left_multipliers)) self%left_multipliers = self%left_multipliers(:, modes)
      if (allocated(self%properties)) deallocate (self%properties)
   end subroutine take

   !> Whether shape and multipliers of a mode are real numbers.
   pure logical function is_real(self, mode)
      class(modal_result_type), intent(in) :: self
      integer, intent(in) :: mode

      is_real = .not. (any(abs(aimag(self%eigenvectors(:, mode))) > 0) .or. any(abs(aimag(self%multipliers(:, mode))) > 0))
   end function is_real

   !> Appends a sentence to notes, which need not be allocated.
   pure subroutine append_note(notes, sentence)
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      character(len=*), intent(in) :: sentence
      character(len=note_length), allocatable :: longer(:)
      integer :: before

      before = 0
      if (allocated(notes)) before = size(notes)
      allocate (longer(before + 1))
      if (before > 0) longer(:before) = notes
      longer(before + 1) = sentence
      call move_alloc(longer, notes)
   end subroutine append_note
end module kschur_result
