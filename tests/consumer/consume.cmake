# SPDX-License-Identifier: BSD-3-Clause
# Installs the package into a folder of its own, builds somebody else's programs against it and runs
# them. Called with -DBUILD= -DSOURCE= -DWORK= -DGENERATOR= -DCC=.
# What ran printed is in `printed`.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
                  ERROR_VARIABLE output WORKING_DIRECTORY "${WORK}")
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}: ${result}\n${output}")
  endif()
  set(printed "${output}" PARENT_SCOPE)
endfunction()

function(consume project)
  run("${CMAKE_COMMAND}" -S "${SOURCE}/${project}" -B "${WORK}/build-${project}" -G "${GENERATOR}"
      "-DCMAKE_PREFIX_PATH=${WORK}/prefix" -DCMAKE_BUILD_TYPE=Release)
  run("${CMAKE_COMMAND}" --build "${WORK}/build-${project}")
endfunction()

file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}")
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${WORK}/prefix")

consume(tests/consumer/project)
foreach(language IN ITEMS c cpp)
  run("${WORK}/build-tests/consumer/project/${language}_solver")
  run("${WORK}/build-tests/consumer/project/reader" "${WORK}/${language}.cdb")
  run("${WORK}/prefix/bin/vestige-explorer" check "${WORK}/${language}.cdb")
endforeach()

consume(examples/minimal)
run("${WORK}/build-examples/minimal/minimal")
run("${WORK}/build-tests/consumer/project/reader" "${WORK}/heat.cdb")

# The guide opens with the very program that was built.
file(READ "${SOURCE}/docs/for-simulation-developers.md" guide)
file(READ "${SOURCE}/examples/minimal/minimal.c" program)
string(FIND "${guide}" "${program}" position)
if(position EQUAL -1)
  message(FATAL_ERROR "docs/for-simulation-developers.md does not hold examples/minimal/minimal.c")
endif()

# The lines of docs/building.md, without CMake: one component, a compiler, pkg-config.
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${WORK}/only" --component adaptor)
if(EXISTS "${WORK}/only/bin" OR EXISTS "${WORK}/only/include/vestige")
  message(FATAL_ERROR "--component adaptor installs more than the adaptor")
endif()
file(REMOVE_RECURSE "${WORK}/heat.cdb")
run("${CC}" "${SOURCE}/examples/minimal/minimal.c" -o by_hand "-I${WORK}/only/include"
    "-L${WORK}/only/lib" "-Wl,-rpath,${WORK}/only/lib" -lvestige_adaptor)
run("${WORK}/by_hand")
find_program(PKG_CONFIG pkg-config)
if(PKG_CONFIG)
  set(ENV{PKG_CONFIG_PATH} "${WORK}/only/lib/pkgconfig")
  execute_process(COMMAND "${PKG_CONFIG}" --cflags --libs vestige OUTPUT_VARIABLE flags
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  run("${CC}" "${SOURCE}/examples/minimal/minimal.c" -o by_pkg_config ${flags})
endif()

# A build of nothing installs nothing, says what is missing, and is not found; BUILD_SHARED_LIBS
# chooses the library.
foreach(kind IN ITEMS so a)
  string(COMPARE EQUAL ${kind} so shared)
  run("${CMAKE_COMMAND}" -S "${SOURCE}" -B "${WORK}/unbuilt" -G "${GENERATOR}" -DVESTIGE_TESTS=OFF
      -DVESTIGE_VTK=OFF "-DBUILD_SHARED_LIBS=${shared}")
  run("${CMAKE_COMMAND}" --install "${WORK}/unbuilt" --prefix "${WORK}/nothing")
  if(NOT printed MATCHES "Not built, so not installed: libvestige_adaptor.${kind}")
    message(FATAL_ERROR "a build of nothing installs: ${printed}")
  endif()
endforeach()
execute_process(COMMAND "${CMAKE_COMMAND}" -S "${SOURCE}/examples/minimal" -B "${WORK}/unfound"
                        "-DCMAKE_PREFIX_PATH=${WORK}/nothing"
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "libvestige_adaptor[ \n]+is[ \n]+not[ \n]+installed")
  message(FATAL_ERROR "what is not installed is found: ${output}")
endif()
