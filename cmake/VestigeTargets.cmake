# SPDX-License-Identifier: BSD-3-Clause
# What every target of the project shares: the language, warnings, sanitizers, visibility and where
# binaries go; and vestige_embed(), which turns shader files into C++ strings.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib")
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

include(GNUInstallDirs)

add_library(vestige_flags INTERFACE)
target_include_directories(vestige_flags INTERFACE "${PROJECT_SOURCE_DIR}")
target_compile_options(vestige_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow
                                               $<$<BOOL:${VESTIGE_WERROR}>:-Werror>)
if(VESTIGE_SANITIZE)
  target_compile_options(vestige_flags INTERFACE -fsanitize=${VESTIGE_SANITIZE}
                                                 -fno-omit-frame-pointer
                                                 -fno-sanitize-recover=all)
  target_link_options(vestige_flags INTERFACE -fsanitize=${VESTIGE_SANITIZE})
endif()

# vestige_embed(TARGET FILE...): each FILE (relative to the current source directory) becomes
# `extern const std::string_view vestige::embedded::NAME;` declared in the generated header
# "NAME.embed.h", where NAME is the file's name with every character outside [A-Za-z0-9] as '_'.
function(vestige_embed target)
  foreach(file IN LISTS ARGN)
    get_filename_component(base "${file}" NAME)
    string(REGEX REPLACE "[^A-Za-z0-9]" "_" name "${base}")
    set(stem "${CMAKE_CURRENT_BINARY_DIR}/embed/${name}.embed")
    add_custom_command(
      OUTPUT "${stem}.cpp" "${stem}.h"
      COMMAND "${CMAKE_COMMAND}" "-DINPUT=${CMAKE_CURRENT_SOURCE_DIR}/${file}" "-DNAME=${name}"
              "-DSTEM=${stem}" -P "${PROJECT_SOURCE_DIR}/cmake/embed.cmake"
      DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${file}" "${PROJECT_SOURCE_DIR}/cmake/embed.cmake"
      COMMENT "Embedding ${file}")
    target_sources(${target} PRIVATE "${stem}.cpp" "${stem}.h")
  endforeach()
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/embed")
endfunction()
