# SPDX-License-Identifier: BSD-3-Clause
# What goes with the programs: manual pages, made of their --help by help2man where that is installed,
# and completion in bash, which asks the programs themselves.

find_program(VESTIGE_HELP2MAN help2man)
mark_as_advanced(VESTIGE_HELP2MAN)

function(vestige_pages program purpose)
  install(FILES "${PROJECT_SOURCE_DIR}/cmake/completion.bash"
          DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" RENAME ${program}
          COMPONENT programs)
  if(NOT VESTIGE_HELP2MAN OR VESTIGE_SANITIZE)
    return()
  endif()
  set(page "${PROJECT_BINARY_DIR}/man/${program}.1")
  file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/man")
  add_custom_command(OUTPUT "${page}"
    COMMAND "${VESTIGE_HELP2MAN}" --no-info --name=${purpose} --output=${page}
            $<TARGET_FILE:${program}>
    DEPENDS ${program} COMMENT "Making the manual page of ${program}" VERBATIM)
  add_custom_target(${program}-man ALL DEPENDS "${page}")
  install(FILES "${page}" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT programs OPTIONAL)
endfunction()

if(VESTIGE_EXPLORER)
  vestige_pages(vestige-explorer "look at archives of Vestige")
endif()
if(VESTIGE_MINI_SIM)
  vestige_pages(vestige-mini-sim "a plume that Vestige watches")
  if(VESTIGE_VTK)
    vestige_pages(vestige-replay "put files, or a recorded run, through Vestige")
  endif()
endif()
