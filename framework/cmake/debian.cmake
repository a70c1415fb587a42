# Debian packages by CPack: marrow (program, plugins, pipelines), marrow-workbench (the program behind `marrow open`),
# marrow-dev (headers, toolbox, CMake package), marrow-networks (the trained networks), marrow-cgal (the one node under
# the GPL), marrow-doc, python3-marrow. A package is a component of the installation.
set(MARROW_MAINTAINER "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
if(NOT DEFINED ENV{DEBEMAIL})
  set(MARROW_MAINTAINER "The marrow developers <marrow@marrow.invalid>")
endif()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME marrow)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${MARROW_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
  WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL marrow marrow-workbench marrow-dev marrow-networks marrow-cgal marrow-doc)
if(MARROW_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python3-marrow)
endif()
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/describe_packages.cmake)
set(CPACK_MARROW_LIBRARIES ${CMAKE_INSTALL_LIBDIR})

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS
  ${PROJECT_BINARY_DIR}/_CPack_Packages/Linux/DEB/marrow-${PROJECT_VERSION}-Linux/marrow/usr/${CMAKE_INSTALL_LIBDIR})

# marrow_debian_package(COMPONENT SECTION "summary" "description")
function(marrow_debian_package name section summary description)
  string(TOUPPER ${name} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  # What Debian's policy asks for in each package: the licence, and its own history.
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  set(folder ${PROJECT_BINARY_DIR}/debian/${name})
  file(WRITE ${folder}/changelog "${name} (${PROJECT_VERSION}) unstable; urgency=medium\n\n"
    "  * Version ${PROJECT_VERSION}. What is new: /usr/share/doc/marrow/CHANGELOG.md.\n\n"
    " -- ${MARROW_MAINTAINER}  ${date}\n")
  file(ARCHIVE_CREATE OUTPUT ${folder}/changelog.gz PATHS ${folder}/changelog FORMAT raw COMPRESSION GZip
    COMPRESSION_LEVEL 9)
  set(MARROW_LICENCE "Apache-2.0")
  set(MARROW_LICENCE_TEXT "/usr/share/common-licenses/Apache-2.0")
  if(name STREQUAL "marrow-cgal")
    set(MARROW_LICENCE "Apache-2.0 and GPL-3+")
    string(APPEND MARROW_LICENCE_TEXT
      " and, as it contains CGAL's surface mesher,\n in /usr/share/common-licenses/GPL-3")
  endif()
  file(CONFIGURE OUTPUT ${folder}/copyright @ONLY CONTENT [[
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: marrow

Files: *
Copyright: 2026 the marrow developers
License: @MARROW_LICENCE@
 The full text is in @MARROW_LICENCE_TEXT@.
]])
  install(FILES ${folder}/copyright ${folder}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    COMPONENT ${name} EXCLUDE_FROM_ALL)
endfunction()

marrow_debian_package(marrow science "finds the 3D pose of bones in X-ray images"
"marrow registers bone models from CT to fluoroscopic images (2D/3D
registration) for research in image-guided and robotic surgery. Every step
is a plugin, and a YAML file wires the plugins. Variants are compared side by
side.")
marrow_debian_package(marrow-workbench science "workbench of marrow in the browser"
"The program behind `marrow open`: cases are made, bones placed, pipelines
edited and results looked at in the browser.")
marrow_debian_package(marrow-dev libdevel "files to write plugins for marrow"
"Headers, the toolbox of static libraries, and the CMake package by which a
plugin of your own is built.")
marrow_debian_package(marrow-networks science "trained networks of marrow"
"Networks that find borders of bone, metal, and bone in the slices of a CT,
for the nodes of marrow that compute a network. They were trained on simulated
data. The card of each says what it is good for, and what not.")
marrow_debian_package(marrow-cgal science "node of marrow that is under the GPL"
"A node that makes surfaces by CGAL's mesher. CGAL is under the GPL, so this
node is not in the package marrow, which is under the Apache License.")
marrow_debian_package(marrow-doc doc "documentation of marrow"
"How pipelines, plugins, comparisons, cases and repetition work, the method, and
what was measured. If the site was built, it is in /usr/share/doc/marrow/html,
with a page for each node and command.")

if(MARROW_PYTHON)
  marrow_debian_package(python3-marrow python "finds the 3D pose of bones in X-ray images (Python 3)"
"The Python package of marrow: pipelines are run, and nodes are called, from
Python. Volumes, images and surfaces are numpy arrays.")
  set(CPACK_DEBIAN_PYTHON3-MARROW_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON3-MARROW_PACKAGE_DEPENDS "marrow (= ${PROJECT_VERSION}), ${MARROW_PYTHON_DEPENDS}")
  set(CPACK_DEBIAN_PYTHON3-MARROW_PACKAGE_SUGGESTS "python3-pandas, jupyter-notebook")
  # Python's compiled files are made when the package is installed, and go with it.
  foreach(step "postinst py3compile" "prerm py3clean")
    separate_arguments(step)
    list(GET step 0 script)
    list(GET step 1 program)
    set(script ${PROJECT_BINARY_DIR}/debian/python3-marrow/${script})
    file(WRITE ${script} "#!/bin/sh\nset -e\n"
      "if command -v ${program} >/dev/null; then ${program} -p python3-marrow; fi\n")
    file(CHMOD ${script} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
      WORLD_EXECUTE)
    list(APPEND CPACK_DEBIAN_PYTHON3-MARROW_PACKAGE_CONTROL_EXTRA ${script})
  endforeach()
endif()

set(CPACK_DEBIAN_MARROW_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(WRITE ${PROJECT_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_MARROW_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/debian/triggers)
# Plugins that only declare a kind use nothing of the C library.
file(WRITE ${PROJECT_BINARY_DIR}/debian/overrides/marrow
  "marrow: library-not-linked-against-libc [usr/lib/*/marrow/marrow_*.so]\n")
install(FILES ${PROJECT_BINARY_DIR}/debian/overrides/marrow DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides
  EXCLUDE_FROM_ALL)
set(CPACK_DEBIAN_MARROW-CGAL_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MARROW_PACKAGE_RECOMMENDS "marrow-networks, marrow-workbench, libjs-three")
set(CPACK_DEBIAN_MARROW_PACKAGE_SUGGESTS "pocl-opencl-icd | opencl-icd")  # a driver for OpenCL; the loader is linked
set(CPACK_DEBIAN_MARROW-WORKBENCH_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MARROW-WORKBENCH_PACKAGE_DEPENDS "marrow (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_MARROW-CGAL_PACKAGE_DEPENDS "marrow (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_MARROW-DEV_PACKAGE_DEPENDS
  "marrow (= ${PROJECT_VERSION}), g++, cmake, libeigen3-dev, libfmt-dev, libopencv-dev, libtbb-dev")
set(CPACK_DEBIAN_MARROW-DEV_PACKAGE_RECOMMENDS
  libcgal-dev libcharls-dev libdcmtk-dev libexpat1-dev libgtest-dev libhdf5-dev libinsighttoolkit5-dev libjpeg-dev
  libnlopt-cxx-dev libnlopt-dev libopenjp2-7-dev libpcl-dev libpng-dev libtiff-dev libvtk9-dev libyaml-cpp-dev
  nlohmann-json3-dev zlib1g-dev)
list(JOIN CPACK_DEBIAN_MARROW-DEV_PACKAGE_RECOMMENDS ", " CPACK_DEBIAN_MARROW-DEV_PACKAGE_RECOMMENDS)
set(CPACK_DEBIAN_MARROW-DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_MARROW-NETWORKS_PACKAGE_ARCHITECTURE all)
include(CPack)
