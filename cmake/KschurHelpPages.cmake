# Pages for man and completion for bash, zsh and fish, made of what the program says with `kschur help` when it is built. Where it
# cannot be run, or there is no Python, there are none.

if(NOT EXISTS "${KSCHUR_PYTHON}" OR (CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR))
  message(STATUS "kschur: without pages for man and completion, which take Python, and a program that runs here")
  return()
endif()

set(KSCHUR_HELP_DIR "${PROJECT_BINARY_DIR}/help")
set(scripts)
foreach(script kschur-report kschur-campbell)
  if(EXISTS "${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/${script}")
    list(APPEND scripts "${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/${script}")
  endif()
endforeach()
set(tools "${CMAKE_CURRENT_LIST_DIR}/help_texts.py" "${CMAKE_CURRENT_LIST_DIR}/make_manual.py" "${CMAKE_CURRENT_LIST_DIR}/make_completion.py")
add_custom_command(OUTPUT "${KSCHUR_HELP_DIR}/made" VERBATIM
  COMMAND "${KSCHUR_PYTHON}" -B "${CMAKE_CURRENT_LIST_DIR}/make_manual.py" $<TARGET_FILE:kschur_program> "${KSCHUR_HELP_DIR}/man1" ${scripts}
  COMMAND "${KSCHUR_PYTHON}" -B "${CMAKE_CURRENT_LIST_DIR}/make_completion.py" $<TARGET_FILE:kschur_program> "${KSCHUR_HELP_DIR}/completion"
  COMMAND "${CMAKE_COMMAND}" -E touch "${KSCHUR_HELP_DIR}/made"
  DEPENDS kschur_program ${tools} ${scripts})
add_custom_target(kschur_help_pages ALL DEPENDS "${KSCHUR_HELP_DIR}/made")

# Nothing where the program was not built, as in somebody's project that takes the library only.
install(DIRECTORY "${KSCHUR_HELP_DIR}/man1" DESTINATION "${CMAKE_INSTALL_MANDIR}" OPTIONAL)
install(FILES "${KSCHUR_HELP_DIR}/completion/kschur.bash" RENAME kschur
        DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" OPTIONAL)
install(FILES "${KSCHUR_HELP_DIR}/completion/_kschur" DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/site-functions" OPTIONAL)
install(FILES "${KSCHUR_HELP_DIR}/completion/kschur.fish" DESTINATION "${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d" OPTIONAL)
