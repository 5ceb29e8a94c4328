# kschur_add_pf_test() builds a pFUnit test file and registers it with ctest: with an
# installed pFUnit 4 where there is one, else with the small driver in tests/driver.

set(KSCHUR_PFUNIT AUTO CACHE STRING "Build the tests with an installed pFUnit: AUTO, ON or OFF")
set_property(CACHE KSCHUR_PFUNIT PROPERTY STRINGS AUTO ON OFF)

find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(PFUNIT_FOUND FALSE)
if(KSCHUR_PFUNIT STREQUAL "AUTO")
  find_package(PFUNIT 4 QUIET)
elseif(KSCHUR_PFUNIT)
  find_package(PFUNIT 4 REQUIRED)
endif()

get_filename_component(KSCHUR_TEST_DRIVER "${CMAKE_CURRENT_LIST_DIR}/../tests/driver" ABSOLUTE)
if(PFUNIT_FOUND)
  message(STATUS "kschur tests: built with pFUnit ${PFUNIT_VERSION}")
else()
  message(STATUS "kschur tests: built with the driver in tests/driver, without pFUnit")
  set(KSCHUR_FUNIT_SOURCES funit.f90 funit_cases.f90 funit_conditions.f90 funit_core.f90
      funit_relations.F90 funit_runner.f90)
  list(TRANSFORM KSCHUR_FUNIT_SOURCES PREPEND "${KSCHUR_TEST_DRIVER}/")
  set(KSCHUR_FUNIT_MODULES "${CMAKE_CURRENT_BINARY_DIR}/mod/kschur_funit")
  add_library(kschur_funit STATIC EXCLUDE_FROM_ALL ${KSCHUR_FUNIT_SOURCES})
  set_target_properties(kschur_funit PROPERTIES Fortran_MODULE_DIRECTORY "${KSCHUR_FUNIT_MODULES}")
  target_include_directories(kschur_funit INTERFACE "${KSCHUR_FUNIT_MODULES}")
endif()

# kschur_add_pf_test(<name> <file.pf>
#                    [LINK_LIBRARIES ...] [OTHER_SOURCES ...] [LABELS ...])
#
# <name> is both the executable and the test. The file holds one module of the same name
# as the file.
function(kschur_add_pf_test name file)
  cmake_parse_arguments(PARSE_ARGV 2 PF "" "" "LINK_LIBRARIES;OTHER_SOURCES;LABELS")
  if(PF_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "kschur_add_pf_test(${name}): unknown ${PF_UNPARSED_ARGUMENTS}")
  endif()

  if(PFUNIT_FOUND)
    kschur_preprocess_pf(source ${name} ${file} .pf --pfunit)
    add_pfunit_ctest(${name} TEST_SOURCES "${source}" OTHER_SOURCES ${PF_OTHER_SOURCES}
                     LINK_LIBRARIES ${PF_LINK_LIBRARIES} LABELS ${PF_LABELS})
    kschur_allow_long_lines(${name})
    # As with the driver, a run of no test at all is a failure.
    set_property(TEST ${name} APPEND PROPERTY FAIL_REGULAR_EXPRESSION "\\(0 tests?\\)")
  else()
    kschur_add_driver_executable(${name} ${file} ${PF_OTHER_SOURCES})
    target_link_libraries(${name} PRIVATE ${PF_LINK_LIBRARIES})
    add_test(NAME ${name} COMMAND ${name})
    set_property(TEST ${name} PROPERTY LABELS ${PF_LABELS})
  endif()
endfunction()

# The driver's own tests; those of failing assertions need the driver's report.
function(kschur_add_driver_tests)
  foreach(test IN ITEMS test_driver_self driver/test_driver_fixture driver/test_driver_cases
                        driver/test_driver_parameters)
    get_filename_component(name ${test} NAME)
    kschur_add_pf_test(${name} "${KSCHUR_TEST_DRIVER}/../${test}.pf" LABELS driver)
  endforeach()

  if(NOT PFUNIT_FOUND)
    kschur_add_driver_executable(driver_failing "${KSCHUR_TEST_DRIVER}/failing.pf")
    kschur_add_driver_executable(driver_without_tests "${KSCHUR_TEST_DRIVER}/without_tests.pf")
    add_test(NAME test_driver_failures
             COMMAND Python3::Interpreter "${KSCHUR_TEST_DRIVER}/check_failures.py"
                     $<TARGET_FILE:driver_failing> $<TARGET_FILE:driver_without_tests>)
    set_property(TEST test_driver_failures PROPERTY LABELS driver)
  endif()
endfunction()

function(kschur_add_driver_executable name file)
  kschur_preprocess_pf(source ${name} ${file} .F90)
  add_executable(${name} "${source}" ${ARGN})
  target_link_libraries(${name} PRIVATE kschur_funit)
  target_include_directories(${name} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  set_target_properties(${name} PROPERTIES
                        Fortran_MODULE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/mod/${name}")
  kschur_allow_long_lines(${name})
endfunction()

function(kschur_preprocess_pf result name file extension)
  get_filename_component(input "${file}" ABSOLUTE)
  get_filename_component(stem "${file}" NAME_WE)
  set(output "${CMAKE_CURRENT_BINARY_DIR}/pf/${name}/${stem}${extension}")
  file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/pf/${name}")
  set(script "${KSCHUR_TEST_DRIVER}/pf_preprocess.py")
  add_custom_command(OUTPUT "${output}" DEPENDS "${input}" "${script}" VERBATIM
                     COMMAND Python3::Interpreter "${script}" ${ARGN} "${input}" "${output}")
  set(${result} "${output}" PARENT_SCOPE)
endfunction()

# An expanded directive is longer than its line in the .pf file; gfortran 12 warns falsely of
# descriptors where an unallocated array is assigned.
function(kschur_allow_long_lines target)
  target_compile_options(${target} PRIVATE
    "$<$<COMPILE_LANG_AND_ID:Fortran,GNU>:-ffree-line-length-none;-Wno-uninitialized;-Wno-maybe-uninitialized>")
endfunction()
