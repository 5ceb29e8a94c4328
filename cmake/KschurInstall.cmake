# Libraries, modules, headers, programs, documents, CMake package and pkg-config files.

include(CMakePackageConfigHelpers)

install(TARGETS kschur EXPORT ${KSCHUR_PACKAGE}-targets)
install(DIRECTORY "${CMAKE_Fortran_MODULE_DIRECTORY}/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/${KSCHUR_PACKAGE}"
        FILES_MATCHING PATTERN "kschur.mod" PATTERN "kschur_*.mod" PATTERN "kschur_scenes.mod" EXCLUDE
        PATTERN "app" EXCLUDE PATTERN "capi" EXCLUDE PATTERN "kschur_funit" EXCLUDE)
# As they stand in the sources, so that links lead to them.
install(FILES LICENSE README.md CHANGELOG.md CITATION.cff CONTRIBUTING.md TYPE DOC)
install(DIRECTORY docs TYPE DOC
        FILES_MATCHING PATTERN "ford.md" EXCLUDE PATTERN "offline.py" EXCLUDE PATTERN "*.md" PATTERN "*.png" PATTERN "*.svg" PATTERN "*.py")
install(DIRECTORY examples TYPE DOC FILES_MATCHING PATTERN "*.f90" PATTERN "*.f" PATTERN "*.c" PATTERN "*.py")
if(KSCHUR_BUILD_CAPI AND KSCHUR_BUILD_PROGRAM AND BUILD_SHARED_LIBS AND NOT KSCHUR_MPI AND PROJECT_IS_TOP_LEVEL)
  include("${CMAKE_CURRENT_LIST_DIR}/KschurPython.cmake")
endif()
set(KSCHUR_PACKAGES kschur)
if(KSCHUR_BUILD_CAPI)
  install(TARGETS kschur_capi EXPORT ${KSCHUR_PACKAGE}-targets)
  install(DIRECTORY capi/include/ TYPE INCLUDE)
  list(APPEND KSCHUR_PACKAGES kschur_capi)
endif()
if(KSCHUR_BUILD_PROGRAM)
  install(TARGETS kschur_program)
endif()
if(KSCHUR_BUILD_PROGRAM AND KSCHUR_BUILD_CAPI AND BUILD_SHARED_LIBS)
  set(KSCHUR_PICTURE_PACKAGE "../${CMAKE_INSTALL_DATADIR}/kschur/python")
  set(KSCHUR_PICTURE_LIBRARY "../${CMAKE_INSTALL_LIBDIR}/libkschur_capi.so.${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
  if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
    set(KSCHUR_PICTURE_LIBRARY "${CMAKE_INSTALL_LIBDIR}/libkschur_capi.so.${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
  endif()
  foreach(script kschur-picture kschur-campbell kschur-convert)
    configure_file("${PROJECT_SOURCE_DIR}/app/${script}.in" "${PROJECT_BINARY_DIR}/${script}" @ONLY)
    install(PROGRAMS "${PROJECT_BINARY_DIR}/${script}" DESTINATION "${CMAKE_INSTALL_BINDIR}")
  endforeach()
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/python/kschur" DESTINATION "${CMAKE_INSTALL_DATADIR}/kschur/python"
          FILES_MATCHING PATTERN "*.py" PATTERN "py.typed" PATTERN "web/*" PATTERN "__pycache__" EXCLUDE)
endif()
if(KSCHUR_BUILD_BENCHMARKS)
  set(KSCHUR_REPORT_FOLDER "../${CMAKE_INSTALL_DATADIR}/kschur")
  configure_file("${PROJECT_SOURCE_DIR}/benchmarks/kschur-report.in" "${PROJECT_BINARY_DIR}/kschur-report" @ONLY)
  install(PROGRAMS "${PROJECT_BINARY_DIR}/kschur-report" DESTINATION "${CMAKE_INSTALL_BINDIR}")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/benchmarks/kschur_report" "${PROJECT_SOURCE_DIR}/benchmarks/peers"
          DESTINATION "${CMAKE_INSTALL_DATADIR}/kschur" FILES_MATCHING PATTERN "*.py")
endif()

# The CMake package.
install(EXPORT ${KSCHUR_PACKAGE}-targets NAMESPACE ${KSCHUR_PACKAGE}:: DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/${KSCHUR_PACKAGE}")
configure_package_config_file(cmake/kschur-config.cmake.in "${PROJECT_BINARY_DIR}/${KSCHUR_PACKAGE}-config.cmake"
  INSTALL_DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/${KSCHUR_PACKAGE}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/${KSCHUR_PACKAGE}-config-version.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/${KSCHUR_PACKAGE}-config.cmake" "${PROJECT_BINARY_DIR}/${KSCHUR_PACKAGE}-config-version.cmake"
        cmake/FindKschurLibraries.cmake
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/${KSCHUR_PACKAGE}")

# The pkg-config files find their folders from where they are, unless a folder was given as an absolute path.
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(KSCHUR_PC_PREFIX "${CMAKE_INSTALL_PREFIX}")
else()
  file(RELATIVE_PATH KSCHUR_PC_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  string(REGEX REPLACE "/$" "" KSCHUR_PC_PREFIX "\${pcfiledir}/${KSCHUR_PC_PREFIX}")
endif()
foreach(folder LIBDIR INCLUDEDIR)
  set(KSCHUR_PC_${folder} "${CMAKE_INSTALL_${folder}}")
  if(NOT IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    string(PREPEND KSCHUR_PC_${folder} "\${prefix}/")
  endif()
endforeach()
foreach(folder PREFIX LIBDIR INCLUDEDIR)
  string(REPLACE " " "\\ " KSCHUR_PC_${folder} "${KSCHUR_PC_${folder}}")
endforeach()
# A library in a folder that the linker knows goes by its name.
set(KSCHUR_PC_LIBRARIES)
foreach(library IN LISTS KschurLibraries_FOUND_LIBRARIES)
  get_filename_component(folder "${library}" DIRECTORY)
  get_filename_component(name "${library}" NAME_WE)
  if(folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES)
    string(REGEX REPLACE "^lib" "-l" library "${name}")
  endif()
  string(APPEND KSCHUR_PC_LIBRARIES "${library} ")
endforeach()
string(APPEND KSCHUR_PC_LIBRARIES "${KSCHUR_OPENMP_LIBRARY} -lpthread -lgfortran -lm")
foreach(name IN LISTS KSCHUR_PACKAGES)
  string(REGEX REPLACE "^kschur" "${KSCHUR_PACKAGE}" file "${name}.pc")
  configure_file(cmake/${name}.pc.in "${PROJECT_BINARY_DIR}/${file}" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/${file}" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
endforeach()
