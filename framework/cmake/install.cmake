# What is installed beside libraries and headers, and the Debian packages that CPack makes (tools/package).
install(DIRECTORY pipelines schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT marrow-doc)

# A library changes when it is installed: its search path is set, its symbols are stripped. So its manifest is written
# then. Of single components it is not: describe_packages.cmake does this when all of them are there.
install(CODE "
  if(NOT CMAKE_INSTALL_COMPONENT)
    set(MARROW_ROOT \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\")
    set(MARROW_LIBRARIES ${CMAKE_INSTALL_LIBDIR})
    include(${CMAKE_CURRENT_LIST_DIR}/describe_installed.cmake)
  endif()")
include(debian)
