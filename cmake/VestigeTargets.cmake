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

# vestige_hot(FILE...): touch every sample, pixel or segment, so they are optimised in every build
# type, if less under sanitizers, where -O3 takes the compiler ten times as long.
function(vestige_hot)
  set(level -O3)
  if(VESTIGE_SANITIZE)
    set(level -O1)
  endif()
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS ${level}
                                                 SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# vestige_unity(TARGET): with VESTIGE_UNITY, the sources of each folder are compiled as one, which
# halves the time that a build from nothing takes.
option(VESTIGE_UNITY "Compile each folder of sources as one" OFF)
function(vestige_unity target)
  if(NOT VESTIGE_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    get_filename_component(folder "${source}" DIRECTORY)
    string(MAKE_C_IDENTIFIER "in_${folder}" group)
    set_property(SOURCE "${source}" PROPERTY UNITY_GROUP ${group})
  endforeach()
endfunction()

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
