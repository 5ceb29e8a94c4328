# Configures kschur without each part that can be left out, and without all of them: the part is then among neither the targets
# nor the libraries of kschur.pc.

# Each option, and what it leaves out.
set(parts KSCHUR_BUILD_PROGRAM:kschur_program KSCHUR_BUILD_CAPI:kschur_capi KSCHUR_BUILD_EXAMPLES:example_grid
  KSCHUR_BUILD_BENCHMARKS:benchmark_inner KSCHUR_WITH_HDF5:-lhdf5|hdf5_serial KSCHUR_WITH_ARPACK:-larpack|libarpack KSCHUR_OPENMP:gomp)

include("${CMAKE_CURRENT_LIST_DIR}/commands.cmake")

# Configures without some parts; says in `contents` what there is.
function(configure name)
  set(folder "${WORK_DIR}/${name}")
  list(TRANSFORM ARGN REPLACE "^(.*):.*" "-D\\1=OFF" OUTPUT_VARIABLE options)
  run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${folder}" -G "${GENERATOR}" ${options})
  load_cache("${folder}" READ_WITH_PREFIX cached_ CMAKE_BUILD_TYPE)
  if(NOT cached_CMAKE_BUILD_TYPE STREQUAL "Release")
    message(FATAL_ERROR "the build type is '${cached_CMAKE_BUILD_TYPE}'")
  endif()
  run("${CMAKE_COMMAND}" --build "${folder}" --target help)
  file(READ "${folder}/kschur.pc" libraries)
  set(contents "${output} ${libraries}" PARENT_SCOPE)
endfunction()

function(check_left_out name part)
  string(REGEX REPLACE ".*:" "" words "${part}")
  if(contents MATCHES "${words}")
    message(SEND_ERROR "${name}: ${part} was not left out")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
configure(whole)
foreach(part IN LISTS parts)
  string(REGEX REPLACE ".*:" "" words "${part}")
  if(NOT contents MATCHES "${words}")
    message(SEND_ERROR "there is no ${part}")
  endif()
endforeach()
foreach(part IN LISTS parts)
  string(REGEX REPLACE ":.*" "" option "${part}")
  configure(${option} ${part})
  check_left_out(${option} ${part})
endforeach()
configure(none ${parts})
foreach(part IN LISTS parts)
  check_left_out(none ${part})
endforeach()
