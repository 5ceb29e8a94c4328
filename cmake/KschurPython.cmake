# The Python package beside its modules: libraries in its folder, programs in bin below it, and scripts for the PATH that start
# these. A wheel has no symbolic links: a library goes by the name that the others look for.

foreach(script kschur-picture kschur-campbell kschur-convert)
  set(KSCHUR_PYTHON_OF_BUILD "${KSCHUR_PYTHON}")
  set(KSCHUR_PYTHON "/usr/bin/env python3")
  set(KSCHUR_PICTURE_PACKAGE "../..")
  set(KSCHUR_PICTURE_LIBRARY "../libkschur_capi.so")
  configure_file("${CMAKE_CURRENT_LIST_DIR}/../app/${script}.in" "${CMAKE_CURRENT_BINARY_DIR}/python/${script}" @ONLY)
  set(KSCHUR_PYTHON "${KSCHUR_PYTHON_OF_BUILD}")
  install(PROGRAMS "${CMAKE_CURRENT_BINARY_DIR}/python/${script}" DESTINATION kschur/bin COMPONENT python EXCLUDE_FROM_ALL)
endforeach()
install(PROGRAMS $<TARGET_FILE:kschur> DESTINATION kschur RENAME $<TARGET_SONAME_FILE_NAME:kschur>
        COMPONENT python EXCLUDE_FROM_ALL)
install(PROGRAMS $<TARGET_FILE:kschur_capi> DESTINATION kschur RENAME libkschur_capi.so COMPONENT python EXCLUDE_FROM_ALL)
install(PROGRAMS $<TARGET_FILE:kschur_program> DESTINATION kschur/bin COMPONENT python EXCLUDE_FROM_ALL)
set(KSCHUR_SCRIPTS_DIR scripts)
if(SKBUILD)
  set(KSCHUR_SCRIPTS_DIR "${SKBUILD_SCRIPTS_DIR}")
endif()
foreach(name kschur kschur-campbell)
  install(PROGRAMS "${CMAKE_CURRENT_LIST_DIR}/../python/start.py" DESTINATION "${KSCHUR_SCRIPTS_DIR}" RENAME ${name}
          COMPONENT python EXCLUDE_FROM_ALL)
endforeach()
