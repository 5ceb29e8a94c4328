!> Notes to the user on a problem and its modes, as sentences.
module kschur_notes
   use kschur_eigenpairs, only: near
   use kschur_error, only: error_type, error_library, new_error
   use kschur_kinds, only: wp
   use kschur_lapack, only: dgesvd
   use kschur_left, only: condition_number, is_nearly_defective
   use kschur_options, only: formulation_low_rank, method_arpack
   use kschur_penalties, only: damping_penalties, row_sizes, row_sizes_type, stiffness_penalties
   use kschur_problem, only: modal_problem_type, damping_proportional
   use kschur_redundancy, only: dependence_type
   use kschur_result, only: modal_result_type, append_note, certified_unknown, kind_rigid, inaccurate_above, note_length, &
      reason_converged, reason_max_restarts
   use kschur_sparse, only: csr_matrix_type
   use kschur_text, only: magnitude, text
   use kschur_tolerances, only: cancelled, noted_above, noted_below, same_frequency
   implicit none
   private
   ! Eigenvalues within this relative distance of the accumulation point belong to it.
   real(wp), parameter :: accumulation_width = 0.01_wp
   public :: named, note_accumulation, note_dependence, note_inaccurate, note_modes, note_penalties, note_problem

contains

   !> Notes redundant constraints of the problem as given, and unknowns of the reduced problem without mass.
   subroutine note_problem(work, constraints, redundant, notes)
      !> The reduced problem.
      type(modal_problem_type), intent(in) :: work
      !> Number of constraints of the problem as given, and of those that depend on others.
      integer, intent(in) :: constraints, redundant
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      integer :: massless

      if (redundant > 0) call append_note(notes, text(redundant)//" of "//text(constraints)// &
         " constraints "//either(redundant == 1, "follows", "follow")//" from the others")
      massless = count(.not. work%mass%row_maxima() > 0)
      if (massless > 0) call append_note(notes, "the mass matrix is singular: "//text(massless)// &
         either(massless == 1, " unknown has", " unknowns have")//" no mass")
   end subroutine note_problem

   !> Notes penalties, rows with a far larger diagonal entry, in the matrices as given.
   subroutine note_penalties(problem, notes)
      type(modal_problem_type), intent(in) :: problem
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      type(row_sizes_type) :: mass, stiffness

      mass = row_sizes(problem%mass)
      stiffness = row_sizes(problem%stiffness)
      call note(count(damping_penalties(row_sizes(problem%damping), stiffness, mass)), "damping matrix R")
      call note(count(stiffness_penalties(stiffness, mass)), "stiffness matrix K")

   contains

      ! Notes a number of penalties of a matrix, if there are any.
      subroutine note(penalties, name)
         integer, intent(in) :: penalties
         character(len=*), intent(in) :: name

         if (penalties > 0) call append_note(notes, "the "//name//" has "//text(penalties)//either(penalties == 1, &
            " penalty", " penalties")//", a million times above its other rows: backward errors and bounds are those without "// &
            either(penalties == 1, "it", "them")//"; a constraint holds an unknown exactly")
      end subroutine note
   end subroutine note_penalties

   !> Notes constraints that nearly depend on others, as they cost digits.
   subroutine note_dependence(problem, dependence, rows, notes)
      type(modal_problem_type), intent(in) :: problem
      !> Dependence of the constraints of the reduced problem; its constraint i is number rows(i) of the problem as given.
      type(dependence_type), intent(in) :: dependence
      integer, intent(in) :: rows(:)
      character(len=note_length), allocatable, intent(inout) :: notes(:)
      ! What the sentence leaves for the others, with a number of ten digits in it.
      integer, parameter :: most = 3, room = 55
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
            " nearly follows from "//trim(named("constraint", others, problem%index_base, room))//": beside these "// &
            magnitude(dependence%distance(i))//" of it is left, which costs as many digits; the error bounds say what is known")
      end do
      if (noted > most) call append_note(notes, text(noted - most)//" more constraints nearly follow from others")
   end subroutine note_dependence

   !> Notes on modes: undamped rigid motions (double zeros), rigid motions of loaded joints, nearly defective eigenvalues, and what
   !> ARPACK or `low-rank` may have missed if nothing was counted.
   subroutine note_modes(problem, max_undamped, result, error)
      type(modal_problem_type), intent(in) :: problem
      !> Upper bound of the number of undamped rigid motions.
      integer, intent(in) :: max_undamped
      type(modal_result_type), intent(inout) :: result
      type(error_type), allocatable, intent(out) :: error
      integer :: undamped

      call count_undamped(problem, result, undamped, error)
      if (allocated(error)) return
      undamped = min(undamped, max_undamped)
      if (undamped > 0) call result%add_note(text(undamped)//either(undamped == 1, &
         " rigid motion is a double zero (Jordan block): nothing damps it", &
         " rigid motions are double zeros (Jordan blocks): nothing damps them"))
      call note_joints(problem, result)
      call note_defective(problem, result)
      if (result%options%method == method_arpack .and. result%certified == certified_unknown) call result%add_note( &
         "ARPACK looks for no further copies of multiple eigenvalues, and nothing was counted: a mode may be missing")
      if (result%formulation == formulation_low_rank .and. result%reason == reason_converged .and. &
         result%certified == certified_unknown) call result%add_note("all undamped modes this near are known, and the modes "// &
         "come from them; that the local forces make no further ones is not proved by that: certify does")
   end subroutine note_modes

   ! Notes the number of rigid motions that move joints. A joint under load, as that of a pendulum, has a stiffness d(Cq^T xi)/dq,
   ! which many codes leave out of K. The matrices do not tell whether a joint is loaded: counts every rigid motion that moves the
   ! unknowns of a constraint, Cq phi = 0 with nonzero terms, and notes none if the mesh shows that the structure is unsupported, so
   ! that no joint carries its weight.
   subroutine note_joints(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      integer :: i, moving

      moving = 0
      do i = 1, size(result%kind)
         if (result%kind(i) == kind_rigid) then
            if (moves_joints(problem%constraints, real(result%eigenvectors(:, i), wp))) moving = moving + 1
         end if
      end do
      if (moving == 0) return
      if (is_unsupported(problem)) return
      call result%add_note(text(moving)//either(moving == 1, " rigid motion moves", " rigid motions move")// &
         " joints: where these carry load, as the weight of a pendulum, K must hold the stiffness of their reactions, "// &
         "d(Cq^T xi)/dq, which many codes leave out")
   end subroutine note_joints

   ! Whether the whole structure is unsupported: no translation of its mesh meets a force or violates a constraint. False without a
   ! mesh.
   logical function is_unsupported(problem)
      type(modal_problem_type), intent(in) :: problem
      real(wp), allocatable :: motions(:, :), forces(:, :), gaps(:, :)

      is_unsupported = .false.
      if (.not. allocated(problem%mesh)) return
      call problem%mesh%rigid_motions(motions)
      allocate (forces(problem%unknowns(), 3), gaps(problem%multipliers(), 3), source=0.0_wp)
      call problem%stiffness%add_product(1.0_wp, motions(:, :3), forces)
      call problem%constraints%add_product(1.0_wp, motions(:, :3), gaps)
      is_unsupported = .not. (any(abs(forces) > cancelled*problem%stiffness%infinity_norm()) .or. &
         any(abs(gaps) > cancelled*problem%constraints%infinity_norm()))
   end function is_unsupported

   ! Whether a motion moves the unknowns of a constraint: some term of Cq phi is not zero.
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

   !> Notes an accumulation point of eigenvalues after a search that did not converge, with modes or without: if damping is
   !> proportional to stiffness the slower roots of all stiff motions accumulate at -K/R, too many to be resolved, and nearer to the
   !> target than other modes.
   subroutine note_accumulation(problem, result)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(inout) :: result
      real(wp), parameter :: reached_part = 0.5_wp
      real(wp) :: point
      integer :: nearer

      if (result%reason /= reason_max_restarts) return
      point = accumulation_point(problem)
      if (.not. point < 0) return
      associate (distances => abs(result%eigenvalues - result%target), edge => abs(point - result%target))
         ! Where no mode is listed, the crowd may be the reason.
         if (size(distances) > 0 .and. maxval(distances) < reached_part*edge) return
         nearer = count(distances < (1 - accumulation_width)*edge)
      end associate
      call result%add_note("stiff motions, overdamped, crowd at "//magnitude(point)//" 1/s, as damping is proportional to "// &
         "stiffness: "//either(size(result%eigenvalues) == 0, "none of them is told from the others", &
         text(nearer)//" of the modes listed "//either(nearer == 1, "is", "are")//" nearer, the others some of the crowd")// &
         "; a band or a frequency has what oscillates beyond it")
   end subroutine note_accumulation

   ! The accumulation point -K/R (1/s), if it is the same for at least half of the unknowns; otherwise 0.
   pure real(wp) function accumulation_point(problem) result(point)
      type(modal_problem_type), intent(in) :: problem
      real(wp), dimension(problem%unknowns()) :: stiffness, damping

      point = 0
      if (problem%damping_kind == damping_proportional) then
         if (problem%beta > 0) point = -1/problem%beta
         return
      end if
      stiffness = problem%stiffness%diagonal()
      damping = problem%damping%diagonal()
      if (.not. sum(damping, damping > 0) > 0) return
      point = -sum(stiffness, damping > 0)/sum(damping, damping > 0)
      if (2*count(damping > 0 .and. abs(stiffness + point*damping) <= accumulation_width*stiffness) < size(damping)) point = 0
   end function accumulation_point

   ! Counts the undamped rigid motions N that are listed: their number less the rank of R N, by singular values.
   subroutine count_undamped(problem, result, undamped, error)
      type(modal_problem_type), intent(in) :: problem
      type(modal_result_type), intent(in) :: result
      integer, intent(out) :: undamped
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: motions(:, :), forces(:, :), singular(:), work(:)
      real(wp) :: no_u(1, 1), no_vt(1, 1)
      integer, allocatable :: rigid(:)
      integer :: n, k, i, info

      n = problem%unknowns()
      allocate (rigid, source=pack([(i, i=1, size(result%kind))], result%kind == kind_rigid))
      k = size(rigid)
      undamped = 0
      if (k == 0) return
      allocate (motions(n, k), source=real(result%eigenvectors(:, rigid), wp))
      ! OpenBLAS reads a few entries beyond the end.
      allocate (forces(n, k + 1), source=0.0_wp)
      call problem%damping%add_product(1.0_wp, motions, forces(:, :k))
      allocate (singular(min(n, k)), work(10*k + n))
      call dgesvd("N", "N", n, k, forces, n, singular, no_u, 1, no_vt, 1, work, size(work), info)
      if (info /= 0) call new_error(error, error_library, "LAPACK's dgesvd did not converge")
      undamped = k - count(singular > cancelled*problem%damping%infinity_norm())
   end subroutine count_undamped

   ! Notes each group of modes that nearly share eigenvalue and shape as nearly defective, with the largest condition number.
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
         if (.not. is_nearly_defective(result%eigenvalues, result%eigenvectors, j, same_frequency*abs(result%eigenvalues(j)))) cycle
         allocate (group(size(pending)), source=pending .and. near(result%eigenvalues, j, same_frequency))
         group(j) = .true.
         worst = 0
         do i = 1, size(group)
            if (.not. group(i)) cycle
            group(i) = is_nearly_defective(result%eigenvalues, result%eigenvectors, i, &
               same_frequency*abs(result%eigenvalues(j)))
            if (group(i)) worst = max(worst, condition_of(problem, result, i))
         end do
         pending = pending .and. .not. group
         call result%add_note(trim(named("mode", group, problem%index_base))//either(count(group) == 1, " is", " are")// &
            " nearly defective"//trim(in_words(worst)))
         deallocate (group)
      end do
   end subroutine note_defective

   ! ": condition number 1e9", or nothing if it is not known.
   pure function in_words(kappa) result(words)
      real(wp), intent(in) :: kappa
      character(len=40) :: words

      words = ""
      if (kappa > 0) words = ": condition number "//either(kappa > huge(kappa), "infinite", magnitude(kappa))
   end function in_words

   ! The condition number of mode j; 0 if it is not known, of an unsymmetric problem without left vectors.
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

   !> Notes modes with a large backward error, and the number of pairs that were too inaccurate to be listed.
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

   !> Lists chosen items in words, as "modes 1, 2 and 5"; of many the first ones, as many as fit, and how many more.
   pure function named(noun, chosen, base, room) result(names)
      !> The noun in the singular, as "mode".
      character(len=*), intent(in) :: noun
      !> Which items are listed.
      logical, intent(in) :: chosen(:)
      !> Number of the first item; the list says so if it is not 1.
      integer, intent(in) :: base
      !> Characters that the sentence has for the list; absent: those of a note.
      integer, intent(in), optional :: room
      character(len=note_length) :: names
      character(len=:), allocatable :: list
      integer, parameter :: at_most = 12
      integer :: longest, most

      longest = note_length
      if (present(room)) longest = room
      do most = at_most, 1, -1
         call list_first(noun, chosen, base, most, list)
         if (len(list) <= longest) exit
      end do
      names = list
   end function named

   ! Lists the first `most` of the chosen items in words, and how many more there are.
   pure subroutine list_first(noun, chosen, base, most, list)
      character(len=*), intent(in) :: noun
      logical, intent(in) :: chosen(:)
      integer, intent(in) :: base, most
      character(len=:), allocatable, intent(out) :: list
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
   end subroutine list_first

   ! One of two texts, without padding.
   pure function either(condition, yes, no) result(words)
      logical, intent(in) :: condition
      character(len=*), intent(in) :: yes, no
      character(len=merge(len(yes), len(no), condition)) :: words

      words = no
      if (condition) words = yes
   end function either
end module kschur_notes
