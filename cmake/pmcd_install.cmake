# SPDX-License-Identifier: MIT
# The libraries for other programs: static libraries, their public headers under include/pmcd, and a CMake package, so
# that find_package(pmcd) gives pmcd::client, pmcd::codec and pmcd::proto. All of it is component "development".
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(PMCD_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/pmcd)

# pmcd_install_library(pmcd_<room> HEADERS ...): the headers, named from the room's folder, are those that others may
# include, as <pmcd/room/header.h>; between each other they keep the short form "room/header.h".
function(pmcd_install_library target)
  cmake_parse_arguments(arg "" "" "HEADERS" ${ARGN})
  string(REPLACE "pmcd_" "" room ${target})
  list(TRANSFORM arg_HEADERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_sources(${target} PUBLIC FILE_SET public_headers TYPE HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES
                                  ${arg_HEADERS})
  install(
    TARGETS ${target}
    EXPORT pmcd-targets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    FILE_SET public_headers DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pmcd COMPONENT development
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endfunction()

# pmcd_install_package(): the package files. After all pmcd_install_library().
function(pmcd_install_package)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/pmcd-config.cmake.in
                                ${PROJECT_BINARY_DIR}/pmcd-config.cmake INSTALL_DESTINATION ${PMCD_PACKAGE_DIR}
                                NO_SET_AND_CHECK_MACRO)
  # Before 1.0 every minor number may break what stands on it.
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/pmcd-config-version.cmake COMPATIBILITY SameMinorVersion)
  install(
    FILES ${PROJECT_BINARY_DIR}/pmcd-config.cmake ${PROJECT_BINARY_DIR}/pmcd-config-version.cmake
    DESTINATION ${PMCD_PACKAGE_DIR}
    COMPONENT development)
  install(
    EXPORT pmcd-targets
    NAMESPACE pmcd::
    DESTINATION ${PMCD_PACKAGE_DIR}
    COMPONENT development)
endfunction()
