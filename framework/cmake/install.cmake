# What is installed beside libraries and headers, and the Debian packages that CPack makes (tools/package).
install(DIRECTORY pipelines schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow PATTERN pipelines/networks EXCLUDE)
install(DIRECTORY pipelines/networks DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/pipelines COMPONENT marrow-networks)
install(DIRECTORY tools/templates/case tools/templates/network tools/templates/slicer
  DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/templates)
install(DIRECTORY tools/templates DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow COMPONENT marrow-dev
  USE_SOURCE_PERMISSIONS PATTERN case EXCLUDE PATTERN network EXCLUDE PATTERN slicer EXCLUDE)
install(FILES docs/example-kind/kind.cpp docs/example-kind/nodes.cpp
  DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/example-kind COMPONENT marrow-dev)

# What `marrow new node` starts from, for each kind that has it: a node of marrow's own, and a test. The program looks
# for all of this in share/marrow, in the build folder too.
set(share ${PROJECT_BINARY_DIR}/share/marrow)
file(MAKE_DIRECTORY ${share})
foreach(folder pipelines schemas tools/templates docs/example-kind)
  get_filename_component(name ${folder} NAME)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${share}/${name} SYMBOLIC)
endforeach()
file(GLOB templates CONFIGURE_DEPENDS plugins/*/template/template.yaml)
foreach(template ${templates})
  get_filename_component(folder ${template} DIRECTORY)
  get_filename_component(kind_folder ${folder} DIRECTORY)
  get_filename_component(kind ${kind_folder} NAME)
  file(STRINGS ${template} source REGEX "^source: ")
  string(REPLACE "source: " "" source ${source})
  file(MAKE_DIRECTORY ${share}/nodes/${kind})
  file(CREATE_LINK ${kind_folder}/${source} ${share}/nodes/${kind}/node.cpp SYMBOLIC)
  foreach(file template.yaml test.cpp)
    file(CREATE_LINK ${folder}/${file} ${share}/nodes/${kind}/${file} SYMBOLIC)
  endforeach()
  if(IS_DIRECTORY ${folder}/python)  # for kinds whose values Python can make
    file(CREATE_LINK ${folder}/python ${share}/nodes/${kind}/python SYMBOLIC)
    install(DIRECTORY ${folder}/python DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/nodes/${kind} COMPONENT marrow-dev)
  endif()
  if(IS_DIRECTORY ${folder}/files)  # instead of those of tools/templates
    file(CREATE_LINK ${folder}/files ${share}/nodes/${kind}/files SYMBOLIC)
    install(DIRECTORY ${folder}/files DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/nodes/${kind} COMPONENT marrow-dev)
  endif()
  install(FILES ${template} ${folder}/test.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/nodes/${kind}
    COMPONENT marrow-dev)
  install(FILES ${kind_folder}/${source} DESTINATION ${CMAKE_INSTALL_DATADIR}/marrow/nodes/${kind} RENAME node.cpp
    COMPONENT marrow-dev)
endforeach()
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT marrow-doc)
# The site, if tools/docs has built one here.
install(DIRECTORY ${PROJECT_BINARY_DIR}/docs/site/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/html COMPONENT marrow-doc
  OPTIONAL)

# A library changes when it is installed: its search path is set, its symbols are stripped. So its manifest is written
# then. Of single components it is not: describe_packages.cmake does this when all of them are there.
install(CODE "
  if(NOT CMAKE_INSTALL_COMPONENT)
    set(MARROW_ROOT \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\")
    set(MARROW_LIBRARIES ${CMAKE_INSTALL_LIBDIR})
    include(${CMAKE_CURRENT_LIST_DIR}/describe_installed.cmake)
  endif()")
include(debian)
