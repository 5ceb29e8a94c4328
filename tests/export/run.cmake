# Installs into a fresh prefix, then builds and runs consumers in C, C++ and Fortran twice: by
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

# A project in some languages.
function(build_project name)
  set(arguments)
  foreach(language ${ARGN})
    list(APPEND arguments -DCMAKE_${language}_COMPILER=${${language}_COMPILER} "-DCMAKE_${language}_FLAGS=${FLAGS}")
  endforeach()
  list(JOIN ARGN "\\;" languages)
  run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/${name}" -G "${GENERATOR}" -DCMAKE_PREFIX_PATH=${prefix}
      "-DLANGUAGES=${languages}" ${arguments})
  run("${CMAKE_COMMAND}" --build "${WORK_DIR}/${name}")
endfunction()

# A consumer built without CMake.
function(build_by_pkg_config package compiler source)
  run(pkg-config --define-variable=prefix=${prefix} --cflags --libs ${package})
  separate_arguments(flags UNIX_COMMAND "${output}")
  run("${compiler}" ${FLAGS} "${SOURCE_DIR}/${source}" ${flags} -Wl,-rpath,${lib_dir} -o "${WORK_DIR}/by_pkg_config")
  check_answer("${WORK_DIR}/by_pkg_config")
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}")

# Neither project knows the other's compiler.
build_project(c C CXX)
build_project(fortran Fortran)
check_answer("${WORK_DIR}/c/consumer_c")
check_answer("${WORK_DIR}/c/consumer_cxx")
check_answer("${WORK_DIR}/fortran/consumer_fortran")

file(GLOB_RECURSE pc "${prefix}/*/kschur.pc")
get_filename_component(pc_dir "${pc}" DIRECTORY)
get_filename_component(lib_dir "${pc_dir}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} "${pc_dir}")
build_by_pkg_config(kschur_capi "${C_COMPILER}" consumer.c)
build_by_pkg_config(kschur_capi "${CXX_COMPILER}" consumer.cpp)
build_by_pkg_config(kschur "${Fortran_COMPILER}" consumer.f90)

run("${prefix}/bin/kschur" --version)
