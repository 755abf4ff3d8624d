# SPDX-License-Identifier: BSD-3-Clause
# Installs the package into a folder of its own, builds somebody else's programs against it and runs
# them. Called with -DBUILD= -DSOURCE= -DWORK= -DGENERATOR=.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
                  ERROR_VARIABLE output WORKING_DIRECTORY "${WORK}")
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}: ${result}\n${output}")
  endif()
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
