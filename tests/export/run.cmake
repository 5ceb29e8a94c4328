# Installs into a fresh prefix, then builds and runs the consumer twice: by
# find_package(kschur) and by pkg-config.

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV} failed:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

function(check_answer)
  run(${ARGV})
  if(NOT output MATCHES "1\\.591549")
    message(FATAL_ERROR "${ARGV} printed ${output}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}")

run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/build" -G "${GENERATOR}"
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_Fortran_COMPILER=${FC} -DCMAKE_Fortran_FLAGS=${FLAGS})
run("${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
check_answer("${WORK_DIR}/build/consumer")

file(GLOB_RECURSE pc "${prefix}/*/kschur.pc")
get_filename_component(pc_dir "${pc}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} "${pc_dir}")
run(pkg-config --define-variable=prefix=${prefix} --cflags --libs kschur)
separate_arguments(flags UNIX_COMMAND "${output}")
get_filename_component(lib_dir "${pc_dir}" DIRECTORY)
run("${FC}" ${FLAGS} "${SOURCE_DIR}/consumer.f90" ${flags} -Wl,-rpath,${lib_dir} -o "${WORK_DIR}/consumer_by_pkg_config")
check_answer("${WORK_DIR}/consumer_by_pkg_config")

run("${prefix}/bin/kschur" --version)
