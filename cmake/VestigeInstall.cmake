# SPDX-License-Identifier: BSD-3-Clause
# The installed package: find_package(vestige COMPONENTS adaptor|proxy|explorer). A solver that
# links vestige::adaptor needs nothing but the one shared library and its header.
include(CMakePackageConfigHelpers)
set(VESTIGE_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/vestige")

install(TARGETS vestige_adaptor EXPORT vestigeAdaptorTargets)
install(TARGETS vestige_proxy vestige_gl EXPORT vestigeProxyTargets)
install(TARGETS vestige_explorer EXPORT vestigeExplorerTargets)
foreach(component IN ITEMS Adaptor Proxy Explorer)
  install(EXPORT vestige${component}Targets NAMESPACE vestige:: DESTINATION "${VESTIGE_PACKAGE_DIR}")
endforeach()

foreach(program IN ITEMS vestige-explorer vestige-mini-sim vestige-replay)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
    install(TARGETS ${program})
  endif()
endforeach()

install(FILES adaptor/vestige.h adaptor/vestige.hpp adaptor/vestige_vtk.h
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
foreach(folder IN ITEMS proxy explorer)
  install(DIRECTORY ${folder}/ DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/vestige/${folder}"
          FILES_MATCHING PATTERN "*.h" PATTERN "shaders" EXCLUDE PATTERN "web" EXCLUDE)
endforeach()
install(FILES "${PROJECT_BINARY_DIR}/generated/proxy/version.h"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/vestige/proxy")

configure_package_config_file(cmake/vestigeConfig.cmake.in
  "${PROJECT_BINARY_DIR}/vestigeConfig.cmake" INSTALL_DESTINATION "${VESTIGE_PACKAGE_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/vestigeConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/vestigeConfig.cmake"
              "${PROJECT_BINARY_DIR}/vestigeConfigVersion.cmake"
        DESTINATION "${VESTIGE_PACKAGE_DIR}")
