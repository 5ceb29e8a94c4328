!> Modes of damped, constrained, possibly unsymmetric structures.
!>
!> The problem is (lambda^2 M + lambda R + K) phi + Cq^T xi = 0, Cq phi = 0:
!> mass M, damping R, stiffness K of order n, constraint Jacobian Cq, m x n,
!> sparse and real. In five lines:
!>
!>     call new_csr_from_triplets(mass, n, n, rows, columns, values, error)   ! likewise K, R, Cq
!>     call new_modal_problem(problem, mass, stiffness, error, damping, constraints)
!>     call solve_modes(problem, modal_options_type(modes=12), result, error)
!>     print *, result%frequency_hz, result%damping_ratio
!>     call write_hdf5_result(result, "modes.h5", error)
!>
!> All modes from 10 to 50 Hz instead of the nearest ones:
!>
!>     call solve_band(problem, 10.0_wp, 50.0_wp, modal_options_type(), result, error)
!>
!> Eigenvalues of a pencil of the paper's Table 1 without a modal problem's
!> choices, the largest ones, say:
!>
!>     call new_pencil(pencil, problem, formulation_damped, factors, unit, error)
!>     call new_direct_operator(operator, pencil, solver, error)   ! or new_shift_invert
!>     call krylov_schur(operator, named_selection_type(6, largest_magnitude), krylov_options_type(), &
!>        values, vectors, statistics, error)
!>
!> Linear solvers and operators of one's own extend the abstract types: docs/extending.md.
!>
!> An error is allocatable: allocated means failed, with a code and a
!> sentence. The library never stops and never prints. Not converging is not
!> an error: `result%reason` tells.
module kschur
   use kschur_asymmetry, only: asymmetry_type
   use kschur_band, only: solve_band
   use kschur_bands, only: solve_bands
   use kschur_build, only: built_with
   use kschur_direct_operator, only: direct_operator_type, new_direct_operator
   use kschur_error, only: error_type, new_error, add_context, error_usage, error_input, error_file, &
      error_memory, error_singular, error_library, error_convergence, error_cancelled
   use kschur_frequency_response, only: frequency_response
   use kschur_formulation, only: choose_formulation
   use kschur_hdf5_problem, only: read_hdf5_problem, write_hdf5_problem
   use kschur_hdf5_response, only: write_hdf5_response
   use kschur_hdf5_result, only: is_hdf5_result, read_hdf5_result, write_hdf5_result
   use kschur_hdf5_sweep, only: is_hdf5_sweep, read_hdf5_sweep, read_hdf5_sweep_point, write_hdf5_sweep
   use kschur_inertia_solver, only: inertia_real_type
   use kschur_solver_choice, only: inner_solvers_type
   use kschur_kept_result, only: kept_result_type
   use kschur_kinds, only: wp, long
   use kschur_krylov_complex, only: krylov_schur
   use kschur_krylov_options, only: krylov_options_type, krylov_statistics_type
   use kschur_krylov_real, only: krylov_schur
   use kschur_linear_solver, only: real_linear_solver_type, complex_linear_solver_type, matrix_structure_type
   use kschur_loss, only: loss_factor_of
   use kschur_mac, only: modal_assurance
   use kschur_modal_solver, only: modal_solver_type, new_modal_solver
   use kschur_modal_properties, only: find_modal_properties
   use kschur_matrix_market, only: read_matrix_market, write_matrix_market
   use kschur_matrix_market_problem, only: read_matrix_market_problem, read_matrix_market_files, write_matrix_market_problem
   use kschur_triplet_files, only: read_triplet_files
   use kschur_memory_estimate, only: estimate_memory, memory_estimate_type
   use kschur_mesh, only: join_nodes, mesh_type, rigid_motion_names, settle_mesh, vtk_hexahedron, vtk_line, &
      vtk_quadratic_tetrahedron, vtk_quadrilateral, vtk_tetrahedron, vtk_vertex
   use kschur_monitor, only: monitor_type
   use kschur_mumps_complex, only: mumps_complex_type
   use kschur_mumps_real, only: mumps_real_type
   use kschur_operator, only: real_operator_type, complex_operator_type
   use kschur_options, only: modal_options_type, index_of_name, arpack_fair, arpack_names, arpack_plain, method_arpack, &
      method_krylov_schur, method_names, formulation_names, formulation_auto, &
      formulation_undamped, formulation_undamped_negative, formulation_undamped_constrained, &
      formulation_undamped_constrained_zero, formulation_damped, formulation_damped_constrained, &
      formulation_damped_constrained_zero, formulation_quadratic, formulation_symmetric, formulation_proportional, &
      formulation_dense, formulation_low_rank, &
      normalisation_displacement, normalisation_length, normalisation_mass, normalisation_names, &
      scaling_names, scaling_none, scaling_scalar, scaling_row, inner_names, inner_auto, inner_mumps, inner_ldl, inner_iterative
   use kschur_pencil, only: pencil_type, new_pencil
   use kschur_presolve, only: presolve_type, presolve
   use kschur_local_forces, only: description_of
   use kschur_problem, only: modal_problem_type, new_modal_problem, damping_names, damping_none, &
      damping_proportional, damping_general
   use kschur_problem_family, only: problem_family_type
   use kschur_properties, only: modal_properties_type
   use kschur_release, only: kschur_version
   use kschur_effort, only: phase_names, purpose_names
   use kschur_result, only: modal_result_type, history_type, timings_type, kind_names, kind_rigid, kind_undamped, &
      kind_underdamped, kind_overdamped, kind_unstable, kind_real, certified_names, certified_unknown, &
      certified_yes, certified_no, reason_names, reason_converged, &
      reason_max_restarts, reason_fewer_modes, reason_cancelled, reason_inaccurate, reason_interrupted, &
      inaccurate_above, note_length
   use kschur_selection, only: selection_type, named_selection_type, nearest_target, largest_magnitude, &
      smallest_magnitude, largest_real, smallest_real, largest_imaginary, smallest_imaginary
   use kschur_sensitivity, only: problem_rate_type, eigenvalue_rates, rate_between
   use kschur_shift_invert, only: shift_invert_type, new_shift_invert
   use kschur_shared_problem, only: shared_problem_type
   use kschur_shared_reading, only: read_hdf5_shared_problem
   use kschur_solver, only: solve_modes
   use kschur_sparse, only: csr_matrix_type, complex_csr_matrix_type, new_csr_matrix, new_csr_from_triplets, &
      empty_csr_matrix
   use kschur_suspicions, only: asymmetry_of
   use kschur_symmetric_storage, only: symmetric_check, symmetric_lower, symmetric_names, symmetric_no, symmetric_upper
   use kschur_sweep, only: sweep_type, sweep_event_type, sweep_onset_type, new_sweep, event_names, event_crossing, event_veering, &
      event_unsure
   use kschur_targets, only: solve_targets
   use kschur_suggestion, only: did_you_mean
   use kschur_text, only: text
   use kschur_view, only: write_view
   use kschur_vtu, only: write_vtu
   implicit none
   public
end module kschur
