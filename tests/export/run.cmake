# Installs by DESTDIR, moves the tree to another folder, with a blank in its name, then builds and runs consumers in C, C++
# and Fortran twice: by find_package(kschur) and by pkg-config, each as somebody would who knows nothing but where kschur is.
#
# With OPTIONS, kschur is configured with them and built first, without optimisation. LIB_DIR is the folder of the
# libraries where the options say so; what is installed stays where it is then. REFERENCE are the folders, `:` between them, of
# the reference BLAS and LAPACK where these are to be loaded: OpenBLAS may have their names elsewhere.

include("${CMAKE_CURRENT_LIST_DIR}/commands.cmake")

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
  run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/${name}" -G "${GENERATOR}" ${package}
      "-DLANGUAGES=${languages}" ${arguments})
  run("${CMAKE_COMMAND}" --build "${WORK_DIR}/${name}")
endfunction()

# Each consumer in a project of its language alone: none knows the others' compilers.
function(build_projects)
  build_project(c C)
  check_answer("${WORK_DIR}/c/consumer_c")
  build_project(fortran Fortran)
  check_answer("${WORK_DIR}/fortran/consumer_fortran")
  build_project(cxx CXX)
  check_answer("${WORK_DIR}/cxx/consumer_cxx")
endfunction()

# A consumer built without CMake. At run time the loader is told where the library is.
function(build_by_pkg_config package compiler source)
  run(pkg-config --cflags --libs ${STATIC} ${package})
  separate_arguments(flags UNIX_COMMAND "${output}")
  run("${compiler}" ${FLAGS} "${SOURCE_DIR}/${source}" ${flags} -o "${WORK_DIR}/by_pkg_config")
  check_answer("${CMAKE_COMMAND}" -E env "LD_LIBRARY_PATH=${lib_dir}:${REFERENCE}" "${WORK_DIR}/by_pkg_config")
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
get_filename_component(top "${SOURCE_DIR}/../.." ABSOLUTE)
set(ENV{LD_LIBRARY_PATH} "${REFERENCE}")
if(OPTIONS)
  separate_arguments(OPTIONS UNIX_COMMAND "${OPTIONS}")
  set(BUILD_DIR "${WORK_DIR}/build")
  run("${CMAKE_COMMAND}" -S "${top}" -B "${BUILD_DIR}" -G "${GENERATOR}" -DCMAKE_C_COMPILER=${C_COMPILER}
      -DCMAKE_Fortran_COMPILER=${Fortran_COMPILER} -DCMAKE_Fortran_FLAGS_RELEASE=-O0 -DKSCHUR_BUILD_TESTS=OFF
      "-DCMAKE_INSTALL_PREFIX=${WORK_DIR}/the prefix" ${OPTIONS})
  run("${CMAKE_COMMAND}" --build "${BUILD_DIR}")
endif()
set(prefix "${WORK_DIR}/the prefix")
if(LIB_DIR)
  run("${CMAKE_COMMAND}" --install "${BUILD_DIR}")
  set(package "-Dkschur_DIR=${LIB_DIR}/cmake/kschur")
else()
  run("${CMAKE_COMMAND}" -E env "DESTDIR=${WORK_DIR}/staging" "${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix /first/place)
  file(RENAME "${WORK_DIR}/staging/first/place" "${prefix}")
  set(package "-DCMAKE_PREFIX_PATH=${prefix}")
endif()
build_projects()

file(GLOB_RECURSE pc "${WORK_DIR}/kschur.pc")
list(FILTER pc EXCLUDE REGEX "^${WORK_DIR}/build/")
get_filename_component(pc_dir "${pc}" DIRECTORY)
get_filename_component(lib_dir "${pc_dir}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} "${pc_dir}")
build_by_pkg_config(kschur_capi "${C_COMPILER}" consumer.c)
build_by_pkg_config(kschur_capi "${CXX_COMPILER}" consumer.cpp)
build_by_pkg_config(kschur "${Fortran_COMPILER}" consumer.f90)

if(EXISTS "${prefix}/bin/kschur")
  run("${prefix}/bin/kschur" --version)
  foreach(file man/man1/kschur.1 man/man1/kschur-solve.1 bash-completion/completions/kschur zsh/site-functions/_kschur
          fish/vendor_completions.d/kschur.fish)
    if(NOT EXISTS "${prefix}/share/${file}")
      message(FATAL_ERROR "share/${file} is not installed")
    endif()
  endforeach()
  run("${prefix}/bin/kschur" scene grid --cells 2x1 --output "${WORK_DIR}/grid")
  run("${prefix}/bin/kschur" solve "${WORK_DIR}/grid")
  run(ldd "${prefix}/bin/kschur")
  if(REFERENCE AND output MATCHES "openblas")
    message(FATAL_ERROR "OpenBLAS in the place of the reference BLAS:\n${output}")
  endif()
endif()
# What is left out says so.
foreach(part HDF5 ARPACK)
  if(OPTIONS MATCHES "KSCHUR_WITH_${part}=OFF")
    set(words --output "${WORK_DIR}/r.h5")
    if(part STREQUAL "ARPACK")
      set(words --method arpack)
    endif()
    execute_process(COMMAND "${prefix}/bin/kschur" solve "${WORK_DIR}/grid" ${words} RESULT_VARIABLE status
                    OUTPUT_QUIET ERROR_VARIABLE output)
    if(status EQUAL 0 OR NOT output MATCHES "built without ${part}")
      message(FATAL_ERROR "without ${part}: ${status}, ${output}")
    endif()
  endif()
endforeach()
# A build with all run-time checks names its lines.
if(RELEASE OR OPTIONS)
  set(fixed)
  if(LIB_DIR)
    set(fixed "${prefix}" "${LIB_DIR}")
  endif()
  run("${PYTHON}" "${SOURCE_DIR}/check_tree.py" "${prefix}" "${top}" "${NM}" ${fixed})
endif()
