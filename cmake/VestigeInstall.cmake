# SPDX-License-Identifier: BSD-3-Clause
# The installed package: find_package(vestige COMPONENTS adaptor|proxy|explorer), and vestige.pc for
# whoever links the adaptor without CMake. A solver that links the shared vestige::adaptor needs
# nothing but that library and its header; the static one brings ours and asks for theirs.
# What has not been built is named and left out.
include(CMakePackageConfigHelpers)
set(VESTIGE_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/vestige")

function(vestige_install component)
  foreach(target IN LISTS ARGN)
    if(component STREQUAL "programs")
      set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
      install(TARGETS ${target} OPTIONAL COMPONENT programs)
    else()
      install(TARGETS ${target} EXPORT vestige-${component} OPTIONAL COMPONENT ${component})
    endif()
    install(CODE "if(NOT EXISTS \"$<TARGET_FILE:${target}>\")
      message(STATUS \"Not built, so not installed: $<TARGET_FILE_NAME:${target}>\")
    endif()" COMPONENT ${component})
  endforeach()
endfunction()

get_target_property(type vestige_adaptor TYPE)
if(type STREQUAL "STATIC_LIBRARY")
  set(VESTIGE_STATIC ON)
  vestige_install(adaptor vestige_adaptor vestige_adaptor_core vestige_march)
  set(VESTIGE_PC_REQUIRES "OpenEXR libpng zlib fmt")
  set(VESTIGE_PC_LIBS "-lvestige_adaptor -lvestige_adaptor_core -lvestige_march -lvestige_proxy \
-lvestige_gl -lvestige_base -lzfp -lstdc++ -lm -ldl -pthread")
else()
  set(VESTIGE_STATIC OFF)
  vestige_install(adaptor vestige_adaptor)
  set(VESTIGE_PC_REQUIRES "")
  set(VESTIGE_PC_LIBS "-lvestige_adaptor")
endif()
vestige_install(proxy vestige_base vestige_proxy vestige_gl)
set(VESTIGE_COMPONENTS adaptor proxy)
if(VESTIGE_EXPLORER)
  vestige_install(explorer vestige_explorer)
  list(APPEND VESTIGE_COMPONENTS explorer)
endif()
foreach(component IN LISTS VESTIGE_COMPONENTS)
  install(EXPORT vestige-${component} NAMESPACE vestige:: DESTINATION "${VESTIGE_PACKAGE_DIR}"
          COMPONENT ${component})
endforeach()
foreach(program IN ITEMS vestige-explorer vestige-mini-sim vestige-replay)
  if(TARGET ${program})
    vestige_install(programs ${program})
  endif()
endforeach()

# What others may include; tests/consumer compiles each of them alone.
install(FILES adaptor/include/vestige.h adaptor/include/vestige.hpp adaptor/include/vestige_vtk.h
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT adaptor)
set(VESTIGE_PROXY_HEADERS
  proxy/archive/archive.h
  proxy/base/error.h
  proxy/camera/box.h
  proxy/camera/camera.h
  proxy/camera/raster.h
  proxy/classifier/classifier.h
  proxy/customization/customization.h
  proxy/customization/natural_neighbours.h
  proxy/format/exr/exr_file.h
  proxy/format/image/feature_origin.h
  proxy/format/image/field_grid.h
  proxy/format/image/learned_origin.h
  proxy/format/image/proxy_image.h
  proxy/format/layout/feature_layout.h
  proxy/format/layout/sliced_stack.h
  proxy/gl/device.h
  proxy/transfer/colormap.h
  proxy/transfer/interval_partition.h
  proxy/transfer/statistics.h
  proxy/transfer/transfer_function.h)
set(VESTIGE_EXPLORER_HEADERS
  explorer/picture/look.h
  explorer/picture/picture.h
  explorer/picture/trust.h
  explorer/renderer/renderer.h)
function(vestige_install_headers component)
  foreach(header IN LISTS ARGN)
    get_filename_component(folder "${header}" DIRECTORY)
    install(FILES "${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/vestige/${folder}"
            COMPONENT ${component})
  endforeach()
endfunction()
vestige_install_headers(proxy ${VESTIGE_PROXY_HEADERS})
if(VESTIGE_EXPLORER)
  vestige_install_headers(explorer ${VESTIGE_EXPLORER_HEADERS})
endif()
install(FILES "${PROJECT_BINARY_DIR}/generated/proxy/version.h"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/vestige/proxy" COMPONENT proxy)

configure_package_config_file(cmake/vestigeConfig.cmake.in
  "${PROJECT_BINARY_DIR}/vestigeConfig.cmake" INSTALL_DESTINATION "${VESTIGE_PACKAGE_DIR}"
  PATH_VARS CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/vestigeConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH VESTIGE_PC_PREFIX "/p/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/p")
configure_file(cmake/vestige.pc.in "${PROJECT_BINARY_DIR}/vestige.pc" @ONLY)
# A part of every component: whichever is installed can be found.
foreach(component IN LISTS VESTIGE_COMPONENTS)
  install(FILES "${PROJECT_BINARY_DIR}/vestigeConfig.cmake"
                "${PROJECT_BINARY_DIR}/vestigeConfigVersion.cmake"
          DESTINATION "${VESTIGE_PACKAGE_DIR}" COMPONENT ${component})
endforeach()
install(FILES "${PROJECT_BINARY_DIR}/vestige.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT adaptor)
install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT adaptor)

# cpack makes a .tar.gz, and a Debian package where dpkg is.
set(CPACK_PACKAGE_NAME vestige)
set(CPACK_PACKAGE_VENDOR "the Vestige developers")
set(CPACK_PACKAGE_CONTACT "the Vestige developers")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_GENERATOR TGZ)
find_program(VESTIGE_DPKG dpkg-shlibdeps)
mark_as_advanced(VESTIGE_DPKG)
if(VESTIGE_DPKG)
  list(APPEND CPACK_GENERATOR DEB)
endif()
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/lib")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libosmesa6 | libegl1, ffmpeg, fonts-dejavu-core")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
include(CPack)
