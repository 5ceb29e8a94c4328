!> What a user must know of a problem and of its modes, in sentences.
module kschur_notes
   use kschur_eigenpairs, only: near
   use kschur_error, only: error_type, error_library, new_error
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   use kschur_left, only: condition_number, merges
   use kschur_options, only: formulation_low_rank, method_arpack
   use kschur_penalties, only: damping_penalties, stiffness_penalties
   use kschur_problem, only: modal_problem_type, damping_proportional
   use kschur_redundancy, only: dependence_type
   use kschur_result, only: modal_result_type, append_note, certified_unknown, kind_rigid, inaccurate_above, note_length, &
      reason_converged, reason_max_restarts
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude, text
   use kschur_tolerances, only: cancelled, noted_above, noted_below, same_frequency
   implicit none
   private
   ! What lies within one per cent is one crowd.
   real(wp), parameter :: same_within = 0.01_wp
   public :: named, note_dependence, note_inaccurate, note_modes, note_penalties, note_problem

contains

   !> What presolve left of the problem: constraints that follow from the others, and unknowns without mass.
   subroutine note_problem(work, constraints, redundant, notes)
      type(modal_problem_type), intent(in) :: work
      !> Of the problem as given; how many of them follow from the others.
      integer, intent(in) :: constraints, redundant
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      integer :: massless

      if (redundant > 0) call append_note(notes, text(redundant)//" of "//text(constraints)// &
         " constraints "//either(redundant == 1, "follows", "follow")//" from the others")
      massless = count(.not. work%mass%row_maxima() > 0)
      if (massless > 0) call append_note(notes, "the mass matrix is singular: "//text(massless)// &
         either(massless == 1, " unknown has", " unknowns have")//" no mass")
   end subroutine note_problem

   !> Penalties in the matrices as given.
   subroutine note_penalties(problem, notes)
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)

      call note(count(damping_penalties(problem%damping, problem%stiffness, problem%mass)), "damping matrix R")
      call note(count(stiffness_penalties(problem%stiffness, problem%mass)), "stiffness matrix K")

   contains

      subroutine note(penalties, name)
         integer, intent(in) :: penalties
         character(len=*), intent(in) :: name

         if (penalties > 0) call append_note(notes, "the "//name//" has "//text(penalties)//either(penalties == 1, &
            " penalty", " penalties")//", a million times above its other rows: backward errors and bounds are those without "// &
            either(penalties == 1, "it", "them")//"; a constraint holds an unknown exactly")
      end subroutine note
   end subroutine note_penalties

   !> Which constraints nearly follow from others.
   subroutine note_dependence(problem, dependence, rows, notes)
      type(modal_problem_type), intent(in) :: problem
      !> Of those of what is iterated, of which constraint i is number rows(i) of the problem as given.
      type(dependence_type), intent(in) :: dependence
      integer, intent(in) :: rows(:)
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      integer, parameter :: most = 3
      logical :: others(problem%multipliers())
      integer :: i, noted

      noted = 0
      do i = 1, size(dependence%near)
         if (dependence%distance(i) >= noted_below) cycle
         noted = noted + 1
         if (noted > most) cycle
         others = .false.
         associate (y => dependence%combinations)
            others(rows(y%column(y%row_start(i):y%row_start(i + 1) - 1))) = .true.
         end associate
         others(rows(dependence%near(i))) = .false.
         call append_note(notes, "constraint "//text(rows(dependence%near(i)) + problem%index_base - 1)// &
            " nearly follows from "//trim(named("constraint", others, problem%index_base))//": beside these "// &
            magnitude(dependence%distance(i))//" of it is left, which costs as many digits; the error bounds say what is known")
      end do
      if (noted > most) call append_note(notes, text(noted - most)//" more constraints nearly follow from others")
   end subroutine note_dependence

   !> Double zeros, eigenvalues that nearly have no eigenvectors of their own or accumulate, and copies that may be missing.
   subroutine note_modes(problem, coasting, result, error)
      type(modal_problem_type), intent(in) :: problem
      !> So many rigid motions at most are undamped.
      integer, intent(in) :: coasting
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      integer :: free

      call count_undamped(problem, result, free, error)
      if (allocated(error)) return
      free = min(free, coasting)
      if (free > 0) call result%add_note(text(free)//either(free == 1, &
         " rigid motion is a double zero (Jordan block): nothing damps it", &
         " rigid motions are double zeros (Jordan blocks): nothing damps them"))
      call note_joints(problem, result)
      call note_defective(problem, result)
      call note_accumulation(problem, result)
      if (result%options%method == method_arpack .and. result%certified == certified_unknown) call result%add_note( &
         "ARPACK looks for no further copies of multiple eigenvalues, and nothing was counted: a mode may be missing")
      if (result%formulation == formulation_low_rank .and. result%reason == reason_converged .and. &
         result%certified == certified_unknown) call result%add_note("all undamped modes this near were counted, and the modes "// &
         "come from them; that the local forces make no further ones is not proved by that: certify does")
   end subroutine note_modes

   ! A rigid motion that turns a joint under load, as a pendulum's, has a stiffness, d(Cq^T xi)/dq, which codes often leave out of K.
   ! Whether a joint is loaded the matrices do not say. What is looked at is whether motions without any stiffness move what
   ! constraints tie: Cq phi = 0 with terms that are not zero. What floats, as its mesh tells, carries no weight.
   subroutine note_joints(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      integer :: i, turning

      turning = 0
      do i = 1, size(result%kind)
         if (result%kind(i) == kind_rigid) then
            if (moves_joints(problem%constraints, real(result%eigenvectors(:, i), wp))) turning = turning + 1
         end if
      end do
      if (turning == 0) return
      if (floats(problem)) return
      call result%add_note(text(turning)//either(turning == 1, " rigid motion moves", " rigid motions move")// &
         " joints: where these carry load, as the weight of a pendulum, K must hold the stiffness of their reactions, "// &
         "d(Cq^T xi)/dq, which many codes leave out")
   end subroutine note_joints

   ! Whether neither stiffness nor constraints hold any translation of the whole. Not known without a mesh.
   logical function floats(problem)
      type(modal_problem_type), intent(in) :: problem
      real(wp), allocatable :: motions(:, :), forces(:, :), gaps(:, :)

      floats = .false.
      if (.not. allocated(problem%mesh)) return
      call problem%mesh%rigid_motions(motions)
      allocate (forces(problem%unknowns(), 3), gaps(problem%multipliers(), 3), source=0.0_wp)
      call problem%stiffness%add_product(1.0_wp, motions(:, :3), forces)
      call problem%constraints%add_product(1.0_wp, motions(:, :3), gaps)
      floats = .not. (any(abs(forces) > cancelled*problem%stiffness%infinity_norm()) .or. &
         any(abs(gaps) > cancelled*problem%constraints%infinity_norm()))
   end function floats

   pure logical function moves_joints(constraints, motion)
      type(csr_matrix_type), intent(in) :: constraints
      real(wp), intent(in) :: motion(:)
      integer :: row

      moves_joints = .false.
      do row = 1, constraints%rows
         associate (first => constraints%row_start(row), last => constraints%row_start(row + 1) - 1)
            associate (row_of => constraints%value(first:last), moved => motion(constraints%column(first:last)))
               moves_joints = maxval(abs(row_of*moved)) > cancelled*maxval(abs(row_of))*norm2(motion)
            end associate
         end associate
         if (moves_joints) return
      end do
   end function moves_joints

   ! Where damping is proportional to stiffness the slower root of each stiff motion is next to -K/R: far too many to be told
   ! apart, and nearer than what is missing once the modes reach as far.
   subroutine note_accumulation(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      real(wp), parameter :: about = 0.5_wp
      real(wp) :: place
      integer :: sure

      if (result%reason /= reason_max_restarts .or. size(result%eigenvalues) == 0) return
      place = place_of_crowd(problem)
      if (.not. place < 0) return
      associate (distances => abs(result%eigenvalues - result%target), edge => abs(place - result%target))
         if (maxval(distances) < about*edge) return
         sure = count(distances < (1 - same_within)*edge)
      end associate
      call result%add_note("stiff motions, overdamped, crowd at "//magnitude(place)//" 1/s, as damping is proportional to "// &
         "stiffness: "//text(sure)//" of the modes listed "//either(sure == 1, "is", "are")//" nearer, the others some of the "// &
         "crowd; a band or a frequency has what oscillates beyond it")
   end subroutine note_accumulation

   ! -K/R (1/s) of most unknowns; zero where they do not agree.
   pure real(wp) function place_of_crowd(problem) result(place)
      type(modal_problem_type), intent(in) :: problem
      real(wp), dimension(problem%unknowns()) :: stiffness, damping

      place = 0
      if (problem%damping_kind == damping_proportional) then
         if (problem%beta > 0) place = -1/problem%beta
         return
      end if
      stiffness = problem%stiffness%diagonal()
      damping = problem%damping%diagonal()
      if (.not. sum(damping, damping > 0) > 0) return
      place = -sum(stiffness, damping > 0)/sum(damping, damping > 0)
      if (2*count(damping > 0 .and. abs(stiffness + place*damping) <= same_within*stiffness) < size(damping)) place = 0
   end function place_of_crowd

   ! How many of the rigid motions that are listed meet no damping: n - rank R N.
   subroutine count_undamped(problem, result, free, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      integer, intent(out) :: free
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: motions(:, :), forces(:, :), force(:), work(:)
      real(wp) :: no_u(1, 1), no_vt(1, 1)
      integer, allocatable :: rigid(:)
      integer :: n, k, i, info

      n = problem%unknowns()
      allocate (rigid, source=pack([(i, i=1, size(result%kind))], result%kind == kind_rigid))
      k = size(rigid)
      free = 0
      if (k == 0) return
      allocate (motions(n, k), source=real(result%eigenvectors(:, rigid), wp))
      ! OpenBLAS reads a few entries beyond the end.
      allocate (forces(n, k + 1), source=0.0_wp)
      call problem%damping%add_product(1.0_wp, motions, forces(:, :k))
      allocate (force(min(n, k)), work(10*k + n))
      call dgesvd("N", "N", n, k, forces, n, force, no_u, 1, no_vt, 1, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgesvd did not converge")
      free = k - count(force > cancelled*problem%damping%infinity_norm())
   end subroutine count_undamped

   ! One note for each group of modes that nearly share eigenvalue and shape.
   subroutine note_defective(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      logical, allocatable :: pending(:), group(:)
      real(wp) :: worst
      integer :: i, j

      allocate (pending(size(result%kind)), source=result%kind /= kind_rigid)
      do j = 1, size(pending)
         if (.not. pending(j)) cycle
         pending(j) = .false.
         if (.not. merges(result%eigenvalues, result%eigenvectors, j, same_frequency*abs(result%eigenvalues(j)))) cycle
         allocate (group(size(pending)), source=pending .and. near(result%eigenvalues, j, same_frequency))
         group(j) = .true.
         worst = 0
         do i = 1, size(group)
            if (.not. group(i)) cycle
            group(i) = merges(result%eigenvalues, result%eigenvectors, i, &
               same_frequency*abs(result%eigenvalues(j)))
            if (group(i)) worst = max(worst, condition_of(problem, result, i))
         end do
         pending = pending .and. .not. group
         call result%add_note(trim(named("mode", group, problem%index_base))//either(count(group) == 1, " is", " are")// &
            " nearly defective"//trim(in_words(worst)))
         deallocate (group)
      end do
   end subroutine note_defective

   pure function in_words(kappa) result(words)
      real(wp), intent(in) :: kappa
      character(len=40) :: words

      words = ""
      if (kappa > 0) words = ": condition number "//either(kappa > huge(kappa), "infinite", magnitude(kappa))
   end function in_words

   ! Zero where it is not known: of an unsymmetric problem without left vectors.
   real(wp) function condition_of(problem, result, j) result(kappa)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      integer, intent(in) :: j

      kappa = 0
      if (allocated(result%condition)) then
         if (result%condition(j) >= 0) kappa = result%condition(j)
      else if (problem%symmetric) then
         kappa = condition_number(problem, result%eigenvalues(j), result%eigenvectors(:, j), result%multipliers(:, j), &
            result%eigenvectors(:, j), result%multipliers(:, j))
      end if
   end function condition_of

   !> Modes that refinement left with a large backward error, and pairs that were too inaccurate to be listed.
   subroutine note_inaccurate(problem, dropped, result)
      type(modal_problem_type), intent(in) :: problem
      !> The number of such pairs.
      integer, intent(in) :: dropped
      type(modal_result_type), intent(inout) :: result
      logical, allocatable :: noted(:)

      allocate (noted(size(result%backward_error)), source=result%backward_error > noted_above)
      if (any(noted)) call result%add_note(trim(named("mode", noted, problem%index_base))//": the backward error is "// &
         magnitude(maxval(result%backward_error))//either(any(result%backward_error > inaccurate_above), &
         ", too large to count as converged", ""))
      if (dropped > 0) call result%add_note(text(dropped)//either(dropped == 1, " eigenpair was", " eigenpairs were")// &
         " found too inaccurately to be listed; another shift may help")
   end subroutine note_inaccurate

   !> "modes 1, 2 and 5"; of many the first ones.
   pure function named(noun, chosen, base) result(names)
      !> "mode"
      character(len=*), intent(in) :: noun
      !> Which of them.
      logical, intent(in) :: chosen(:)
      !> What they are counted from; it is said where that is not 1.
      integer, intent(in) :: base
      character(len=note_length) :: names
      character(len=:), allocatable :: list
      integer, parameter :: most = 12
      integer :: i, done

      list = noun//either(count(chosen) == 1, " ", "s ")
      done = 0
      do i = 1, size(chosen)
         if (.not. chosen(i)) cycle
         if (done > 0) list = list//either(done + 1 == count(chosen) .or. done == most, " and ", ", ")
         done = done + 1
         if (done > most) then
            list = list//text(count(chosen) - most)//" more"
            exit
         end if
         list = list//text(i + base - 1)
      end do
      if (base /= 1) list = list//" (counted from "//text(base)//")"
      names = list
   end function named

   pure function either(condition, yes, no) result(words)
      logical, intent(in) :: condition
      character(len=*), intent(in) :: yes, no
      character(len=merge(len(yes), len(no), condition)) :: words

      words = no
      if (condition) words = yes
   end function either
end module kschur_notes
