# Libraries, modules, header, programs, CMake package and pkg-config files.

include(CMakePackageConfigHelpers)

install(TARGETS kschur kschur_capi EXPORT kschur-targets)
install(FILES capi/include/kschur.h TYPE INCLUDE)
install(TARGETS kschur_program)
install(DIRECTORY "${CMAKE_Fortran_MODULE_DIRECTORY}/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/kschur"
        FILES_MATCHING PATTERN "kschur.mod" PATTERN "kschur_*.mod" PATTERN "kschur_scenes.mod" EXCLUDE
        PATTERN "app" EXCLUDE PATTERN "capi" EXCLUDE PATTERN "kschur_funit" EXCLUDE)
set(KSCHUR_REPORT_FOLDER "../${CMAKE_INSTALL_DATADIR}/kschur")
configure_file("${PROJECT_SOURCE_DIR}/benchmarks/kschur-report.in" "${PROJECT_BINARY_DIR}/kschur-report" @ONLY)
install(PROGRAMS "${PROJECT_BINARY_DIR}/kschur-report" DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/benchmarks/kschur_report" "${PROJECT_SOURCE_DIR}/benchmarks/peers"
        DESTINATION "${CMAKE_INSTALL_DATADIR}/kschur" FILES_MATCHING PATTERN "*.py")
install(EXPORT kschur-targets NAMESPACE kschur:: DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/kschur")
configure_package_config_file(cmake/kschur-config.cmake.in "${PROJECT_BINARY_DIR}/kschur-config.cmake"
  INSTALL_DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/kschur")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/kschur-config-version.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/kschur-config.cmake" "${PROJECT_BINARY_DIR}/kschur-config-version.cmake"
        cmake/FindKschurLibraries.cmake
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/kschur")
foreach(name kschur kschur_capi)
  configure_file(cmake/${name}.pc.in "${PROJECT_BINARY_DIR}/${name}.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/${name}.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
endforeach()
