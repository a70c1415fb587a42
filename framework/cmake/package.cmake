# The CMake package by which plugins outside this tree find marrow, from the build folder or installed.
include(CMakePackageConfigHelpers)
install(EXPORT marrowTargets NAMESPACE marrow:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow
  COMPONENT marrow-dev)
export(EXPORT marrowTargets NAMESPACE marrow:: FILE ${PROJECT_BINARY_DIR}/marrowTargets.cmake)
if(NOT MARROW_KINDS)
  install(EXPORT marrowToolboxTargets NAMESPACE marrow:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow
    COMPONENT marrow-dev)
  export(EXPORT marrowToolboxTargets NAMESPACE marrow:: FILE ${PROJECT_BINARY_DIR}/marrowToolboxTargets.cmake)
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/marrowConfig.cmake.in ${PROJECT_BINARY_DIR}/marrowConfig.cmake @ONLY)
configure_file(${CMAKE_CURRENT_LIST_DIR}/MarrowPlugin.cmake ${PROJECT_BINARY_DIR}/MarrowPlugin.cmake COPYONLY)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/marrowConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/marrowConfig.cmake ${PROJECT_BINARY_DIR}/MarrowPlugin.cmake
  ${PROJECT_BINARY_DIR}/marrowConfigVersion.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow COMPONENT marrow-dev)
