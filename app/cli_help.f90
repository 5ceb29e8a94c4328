!> Help texts.
module cli_help
   use cli_system, only: print_line
   use kschur, only: did_you_mean, error_type, error_usage, kschur_version, new_error
   use kschur_scenes, only: scene_help, scene_names, unknown_scene
   use kschur, only: built_with
   implicit none
   private
   public :: print_help, print_version

   !> What the program does, in the order of its help.
   character(len=*), parameter, public :: command_names(11) = [character(len=12) :: &
      "solve", "compare", "convert", "mac", "sensitivity", "response", "sweep", "scene", "info", "view", "help"]

contains

   !> Prints the name and the version of the program, and what it was built with.
   subroutine print_version()
      call print_line("kschur "//kschur_version)
      call print_line("built with "//trim(built_with()))
   end subroutine print_version

   !> Prints the help on a command, or on the program where `topic` is empty.
   subroutine print_help(topic, scene, error)
      character(len=*), intent(in) :: topic
      !> For the topic scene: name of a scene; empty: all.
      character(len=*), intent(in) :: scene
      type(error_type), allocatable, intent(out) :: error

      select case (topic)
      case ("", "help")
         call print_overview()
      case ("solve")
         call print_solve_help()
      case ("compare")
         call print_compare_help()
      case ("convert")
         call print_convert_help()
      case ("mac")
         call print_mac_help()
      case ("sensitivity")
         call print_sensitivity_help()
      case ("response")
         call print_response_help()
      case ("sweep")
         call print_sweep_help()
      case ("scene")
         call print_scene_help(scene, error)
      case ("info")
         call print_info_help()
      case ("view")
         call print_view_help()
      case default
         call new_error(error, error_usage, "there is no help on '"//topic// &
            "', only on solve, compare, convert, mac, sensitivity, response, sweep, scene, info and view"// &
            did_you_mean(topic, command_names))
      end select
   end subroutine print_help

   subroutine print_overview()
      call print_lines([character(len=90) :: &
         "kschur: vibration modes of constrained, damped structures, the solutions of", &
         "(lambda^2 M + lambda R + K) phi + Cq^T xi = 0, Cq phi = 0.", &
         "", &
         "  kschur solve PROBLEM [options]               compute modes", &
         "  kschur compare PROBLEM [options]             the same problem by each method", &
         "  kschur convert IN OUT.h5                     matrices of other codes as a problem", &
         "  kschur mac RESULT RESULT                     how alike the shapes of two results are", &
         "  kschur sensitivity PROBLEM CHANGED           how modes change with a parameter", &
         "  kschur response PROBLEM --frequencies A:B:N  what a harmonic force does", &
         "  kschur sweep SCENE --vary OPTION=A:B:N       modes over a parameter of scenes or files", &
         "  kschur scene NAME [options] --output FILE    write a problem of a model structure", &
         "  kschur info PROBLEM | RESULT                 what a problem is; the modes of a result", &
         "  kschur view RESULT --output FOLDER           its shapes for ParaView, or as a picture", &
         "  kschur help COMMAND                          more on one of them", &
         "  kschur help scene NAME                       what a scene is, and its options", &
         "  kschur --version, kschur -V", &
         "", &
         "Beside it: kschur-report, speed against accuracy on your problem, beside ARPACK, SLEPc and", &
         "SciPy; kschur-campbell, diagrams of a sweep; kschur-mpi, the same on several processes,", &
         "as mpirun -np 4 kschur-mpi solve PROBLEM (docs/distributed.md; Open MPI wants", &
         "--allow-run-as-root of root, and --oversubscribe for more processes than cores).", &
         "", &
         "PROBLEM is an HDF5 file with the groups /mass, /stiffness and, where there is", &
         "any, /damping, /constraints and /loss, or a folder of Matrix Market files M.mtx, K.mtx", &
         "and, where there is any, R.mtx, Cq.mtx and L.mtx (the loss matrix H).", &
         "", &
         "Exit status: 0 all is well, 1 wrong usage, 2 bad input, 3 fewer modes than asked or some", &
         "missing (what was found is printed and written), 4 a singular problem, no memory, a", &
         "library that failed, or an output that cannot be written. Whether --output can be written", &
         "is looked at before the work. An interrupt (Ctrl-C) ends a command with what it", &
         "has by then, as the modes that have converged, status 3."])
   end subroutine print_overview

   subroutine print_solve_help()
      call print_lines([character(len=90) :: &
         "kschur solve PROBLEM [options]", &
         "kschur solve --mass FILE --stiffness FILE [--damping FILE] [--constraints FILE] [options]", &
         "", &
         "A file named - is standard input; a file may be a pipe.", &
         "", &
         "  --mass FILE            M, in the form of Matrix Market", &
         "  --stiffness FILE       K", &
         "  --damping FILE         R", &
         "  --constraints FILE     Cq", &
         "  --loss FILE            the loss matrix H of structural damping", &
         "  --loss-factor G        H = G K, of any problem", &
         "  --triplets             the files named have no header: row, column, value a line, from 1", &
         "  --symmetric NAME       check, no, lower, upper (check): M, R, K and H hold one half,", &
         "                         lower or upper; no: as they are; check: the same, but what looks", &
         "                         like a half is an error", &
         "  -m, --modes N          how many; a complex-conjugate pair is one (10)", &
         "  --target RE[,IM]       the modes nearest to this lambda, in 1/s (0)", &
         "  --frequency HZ         the same as --target 0,(2 pi HZ)", &
         "  -b, --band F1,F2       all modes whose natural frequency is in this band, in Hz", &
         "  --shift RE[,IM]        where to factor, in 1/s (chosen near the target)", &
         "  --method NAME          auto, krylov-schur, arpack (auto)", &
         "  --arpack NAME          fair, plain (fair): in the place of Krylov-Schur, or as the", &
         "                         paper compares with it", &
         "  --formulation NAME     auto, undamped, undamped-negative, undamped-constrained,", &
         "                         undamped-constrained-zero, damped, damped-constrained,", &
         "                         damped-constrained-zero, quadratic, symmetric,", &
         "                         proportional, low-rank, dense (auto)", &
         "  --inner NAME           auto, mumps, ldl, iterative (auto); iterative: factors in", &
         "                         single precision, and refined solutions", &
         "  --presolve on|off      eliminate clamped and tied unknowns first (on)", &
         "  --block B              vectors that the Krylov space grows by at a time, or auto:", &
         "                         as many as cost least (auto)", &
         "  --subspace M           largest dimension of the Krylov space (chosen)", &
         "  --tolerance T          relative residual of a converged mode (1e-12)", &
         "  --max-restarts K       (200)", &
         "  --constraint-scaling NAME  row, scalar, none (row)", &
         "  --normalise NAME       length, mass, displacement (length): the unit that shapes have", &
         "  --properties           generalised mass, damping, stiffness and modal a of each mode", &
         "                         and, where the file has /coordinates, participation factors and", &
         "                         effective masses along x, y, z and about them (rx, ry, rz)", &
         "  --directions FILE      the same along motions of one's own, of all unknowns: columns of", &
         "                         a Matrix Market file", &
         "  --left                 left eigenvectors and condition numbers as well", &
         "  --certify              count the eigenvalues, for a proof that no mode is missing", &
         "  --certify off          leave out the factorisation that counts where there would be one", &
         "  -o, --output RESULT.h5 write values, vectors and multipliers", &
         "  --checkpoint FILE      write the state of the iteration now and then", &
         "  --resume FILE          go on from there: the same problem, options and digits", &
         "  -f, --format NAME      table, json, csv (table)", &
         "  -v, --verbose          more at the end of the table", &
         "  -q, --quiet            no progress on the terminal", &
         "  -t, --threads N        threads (as many as there are cores); any number gives the same", &
         "                         digits but for what MUMPS factors", &
         "  --memory LIMIT         take factors in single precision where those in double are", &
         "                         estimated to take more bytes, as 800M or 4G; refuse what takes", &
         "                         more even so, before anything is factored (kschur info tells", &
         "                         both estimates)", &
         "  --distribute ROWS      kschur-mpi: so many rows and more are factored by all its", &
         "                         processes (20000)", &
         "  --groups N             kschur-mpi: so many groups of processes share the parts of a", &
         "                         band or of 500 modes and more near zero (each process is one,", &
         "                         or as many as half of the machines' memory holds)"])
   end subroutine print_solve_help

   subroutine print_compare_help()
      call print_lines([character(len=90) :: &
         "kschur compare PROBLEM [options]", &
         "", &
         "The same modes by each method, in one table: ours (auto), ours in the structured", &
         "form (quadratic) and on the paper's pencil (pencil), ARPACK as the paper compares", &
         "with it (arpack-plain) and in the place of Krylov-Schur (arpack-fair). Modes are", &
         "missed or spurious against the set that is certified, or else has the smallest", &
         "backward error. A method that fails is a line of the table; where auto fails, its", &
         "error is that of the command.", &
         "", &
         "  --modes N, --target RE[,IM], --frequency HZ, --shift RE[,IM], --inner NAME,", &
         "  --presolve on|off, --block B, --subspace M, --tolerance T, --max-restarts K,", &
         "  --constraint-scaling NAME, --mass FILE, --stiffness FILE, --damping FILE,", &
         "  --constraints FILE, --loss FILE, --loss-factor G, --triplets, --symmetric NAME,", &
         "  --quiet, --threads N, --memory LIMIT, --distribute ROWS, --groups N", &
         "                                               as for kschur solve", &
         "  -f, --format NAME      table, json (table)"])
   end subroutine print_compare_help

   subroutine print_convert_help()
      call print_lines([character(len=90) :: &
         "kschur convert IN [IN ...] OUT.h5 [options]", &
         "", &
         "A problem out of matrices of other codes: CalculiX (.sti, .mas), Abaqus (.mtx), Nastran", &
         "(.op4, .pch, .dmig), MATLAB (.mat), NumPy (.npz), Harwell-Boeing (.hb, .rua, .rsa) and", &
         "PETSc (.petsc), by Python with NumPy, SciPy and h5py; Nastran's with pyyeti or pyNastran", &
         "too. Halves of symmetric matrices are completed (docs/convert.md).", &
         "", &
         "Which matrix is which, where the names are not the usual ones; a file that holds one", &
         "matrix names it by its own name:", &
         "", &
         "  --mass MATRIX          M", &
         "  --stiffness MATRIX     K", &
         "  --damping MATRIX       R", &
         "  --constraints MATRIX   Cq"])
   end subroutine print_convert_help

   subroutine print_mac_help()
      call print_lines([character(len=90) :: &
         "kschur mac RESULT.h5 OTHER.h5 [options]", &
         "", &
         "The modal assurance criterion |phi_i^* phi_j|^2/(|phi_i|^2 |phi_j|^2) of the modes i of", &
         "a result and j of another one, which kschur solve --output wrote: 1 where the shapes", &
         "are the same, 0 where they are orthogonal.", &
         "", &
         "  -f, --format NAME      table, json, csv (table)"])
   end subroutine print_mac_help

   subroutine print_sensitivity_help()
      call print_lines([character(len=90) :: &
         "kschur sensitivity PROBLEM CHANGED [options]", &
         "", &
         "The rates at which eigenvalues, natural frequencies and damping ratios of a problem", &
         "change with a parameter p. CHANGED is the same problem where p is larger by H (1): the", &
         "rates are exact where the matrices are linear in p. Modes of a multiple eigenvalue get", &
         "the rates of what it splits into, in no order; - where there is none, as of a rigid", &
         "motion that nothing damps.", &
         "", &
         "  --step H               the change of p (1)", &
         "  --modes N, --target RE[,IM], --frequency HZ, --shift RE[,IM], --inner NAME,", &
         "  --presolve on|off, --block B, --subspace M, --tolerance T, --max-restarts K,", &
         "  --constraint-scaling NAME, --symmetric NAME, --quiet, --threads N, --memory LIMIT,", &
         "  --distribute ROWS, --groups N", &
         "                                                      as for kschur solve", &
         "  -f, --format NAME      table, json, csv (table)"])
   end subroutine print_sensitivity_help

   subroutine print_response_help()
      call print_lines([character(len=90) :: &
         "kschur response PROBLEM --frequencies FIRST:LAST:POINTS --input FORCE [options]", &
         "", &
         "The response x of (lambda^2 M + lambda R + K) x + Cq^T xi = f, Cq x = 0, to a harmonic", &
         "force f at lambda = 2 pi i frequency: its amplitude, and its phase against the force. An", &
         "error where a mode without damping has one of the frequencies.", &
         "", &
         "  --frequencies LIST     FIRST:LAST:POINTS or F1,F2,..., in Hz", &
         "  --input FORCE          one of: an unknown, by its number from 1, for a force of 1 there;", &
         "                         x, y, z, rx, ry, rz, for a ground that shakes so with an", &
         "                         acceleration of 1, -M d, x being relative to it (the file has", &
         "                         /coordinates); a Matrix Market file with one column, for f", &
         "  --at N1,N2,...         the unknowns that are printed (where the force is largest)", &
         "  -o, --output FILE.h5   write the response of all unknowns and the multipliers", &
         "  --html FILE.html       a page for a browser: Bode and Nyquist plots, and the deformed", &
         "                         structure at each frequency, where the file has /coordinates", &
         "  -f, --format NAME      table, json, csv (table): amplitude and phase; of json and csv", &
         "                         real and imaginary part", &
         "  --mass FILE, --stiffness FILE, --damping FILE, --constraints FILE, --loss FILE,", &
         "  --loss-factor G, --triplets, --symmetric NAME, --quiet     as for kschur solve"])
   end subroutine print_response_help

   subroutine print_sweep_help()
      call print_lines([character(len=90) :: &
         "kschur sweep SCENE --vary OPTION=FIRST:LAST:POINTS [options of the scene] [options]", &
         "kschur sweep PROBLEM PROBLEM ... [--values V1,V2,...] [options]", &
         "", &
         "The modes nearest to a target at each point, followed from point to point: a branch", &
         "keeps its number. Each mode is written as a sum of those at the point before, by left", &
         "and right vectors; modes of equal eigenvalues are one space. Where it is not clear", &
         "which is which, where two cross and where one becomes unstable, there are solves between", &
         "the points: of the scene, or of matrices as if they were linear in the parameter.", &
         "Crossings, veerings and what stays unsure are said below the table, and from where on a", &
         "branch is unstable, known to 0.1 %. kschur-campbell draws the Campbell diagram and the", &
         "roots.", &
         "", &
         "  --vary OPTION=A:B:N    an option of the scene, at N values from A to B", &
         "  --values V1,V2,...     the parameter at each problem (1, 2, ...)", &
         "  --loss-factor A:B:N    of one problem: H = g K at N values of g", &
         "  --unit UNIT            that of the parameter, for tables and diagrams: rpm, Hz, ...", &
         "  --left                 left vectors of unsymmetric problems, in place of shapes", &
         "  -o, --output SWEEP.h5  write values, branches, shares, events and onsets", &
         "  --shapes               in it the modes of each point, with shapes and geometry, for", &
         "                         kschur view --point", &
         "  --html FILE.html       a page for a browser: Campbell diagram and root locus, and shapes", &
         "                         where problems say where they stand", &
         "  --orders N1,N2,...     lines in it at multiples of the speed, whose unit is rpm, 1/min,", &
         "                         Hz, 1/s or rad/s", &
         "  -f, --format NAME      table, json, csv (table): damped frequencies in Hz; of json and", &
         "                         csv all of them", &
         "  --modes N, --target RE[,IM], --frequency HZ, --shift RE[,IM], --inner NAME,", &
         "  --presolve on|off, --block B, --subspace M, --tolerance T, --max-restarts K,", &
         "  --constraint-scaling NAME, --quiet, --threads N, --memory LIMIT, --distribute ROWS,", &
         "  --groups N, --symmetric NAME (not of a scene)       as for kschur solve"])
   end subroutine print_sweep_help

   subroutine print_scene_help(scene, error)
      character(len=*), intent(in) :: scene
      type(error_type), allocatable, intent(out) :: error
      integer :: i

      if (scene /= "" .and. all(scene_names /= scene)) then
         call new_error(error, error_usage, unknown_scene(scene))
         return
      else if (scene /= "") then
         call print_line(scene_help(scene))
         return
      end if
      call print_lines([character(len=90) :: &
         "kschur scene NAME [options of the scene] --output PROBLEM", &
         "", &
         "  -o, --output PROBLEM   where to write", &
         "", &
         "Writes an HDF5 file where PROBLEM ends in .h5 or .hdf5, else a folder of Matrix", &
         "Market files. kschur help scene NAME is about one of them. All, with options and defaults:"])
      do i = 1, size(scene_names)
         call print_line("")
         call print_line(scene_help(scene_names(i)))
      end do
   end subroutine print_scene_help

   subroutine print_info_help()
      call print_lines([character(len=90) :: &
         "kschur info PROBLEM [options]", &
         "kschur info RESULT.h5 [options]", &
         "", &
         "What a problem is: its size, symmetry, damping, matrices, the formulation that auto", &
         "takes, and about how much memory kschur solve takes; or the modes of a result that", &
         "kschur solve --output wrote.", &
         "", &
         "  --modes N, --formulation NAME, --inner NAME     of a solve whose memory is estimated", &
         "  --mass FILE, --stiffness FILE, --damping FILE, --constraints FILE, --loss FILE,", &
         "  --loss-factor G, --triplets, --symmetric NAME   as for kschur solve", &
         "  -f, --format NAME      table, json, csv (table); csv: of a result only", &
         "  -v, --verbose          more at the end of the table of a result"])
   end subroutine print_info_help

   subroutine print_view_help()
      call print_lines([character(len=90) :: &
         "kschur view RESULT.h5 [--html FILE.html] [--picture FILE.png] [--output FOLDER] [options]", &
         "", &
         "A page, a picture, or files for ParaView, of a result of kschur solve --output, of a", &
         "problem whose file says where it is: /coordinates, nodes x 3, and of each unknown", &
         "/unknown_node, from 0, and /unknown_component, 0 to 5 (docs/view.md). Those of kschur", &
         "scene do. With --point it is a sweep of kschur sweep --shapes --output.", &
         "", &
         "  -o, --output FOLDER    files for ParaView, which are:", &
         "", &
         "  modes.pvd              the modes one after the other", &
         "  mode_3.vtu             one of them: mode_3_real and mode_3_imaginary on the mesh at rest", &
         "  mode_3.pvd             one period of its motion, as mode_3_1.vtu, mode_3_2.vtu, ...", &
         "", &
         "  --html FILE.html       a page for a browser: a list of modes, and the model in motion", &
         "  --problem FILE.h5      whose result it is: the page shows energies and constraints", &
         "  --picture FILE.png     the modes side by side; .pdf and .svg as well", &
         "  -m, --modes 1,3,7      which modes (all)", &
         "  --point K              those at the K-th point of a sweep, from 1", &
         "  --frames N             pictures of a period; 0: no motion (12)", &
         "  --amplitude A          largest displacement in it, relative to the structure (0.1)"])
   end subroutine print_view_help

   subroutine print_lines(lines)
      character(len=*), intent(in) :: lines(:)
      integer :: i

      do i = 1, size(lines)
         call print_line(trim(lines(i)))
      end do
   end subroutine print_lines
end module cli_help
