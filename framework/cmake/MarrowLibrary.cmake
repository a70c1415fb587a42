# marrow_add_library(NAME FOLDER folder SOURCES file.cpp ... HEADERS file.hpp ... [LINK library that its headers need
# ...] [NEEDS other library ...] [OBJECTS object library ...] [APART file.cpp ...])
#
# A static library for nodes, installed as marrow::NAME: a topic of the toolbox, or what only one kind needs. HEADERS
# are the public ones; FOLDER says how they are included: marrow/FOLDER/file.hpp. Without sources it is a library of
# headers. The files after APART are sources that are compiled by themselves: a node that calls none of them does not
# load the libraries that they need.
function(marrow_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 library "" "FOLDER" "SOURCES;HEADERS;LINK;NEEDS;OBJECTS;APART")
  set(target library_${name})
  set(here ${CMAKE_CURRENT_SOURCE_DIR})
  if(NOT CMAKE_CURRENT_SOURCE_DIR MATCHES "/toolbox$")
    string(APPEND here /library)  # a kind's
  elseif(library_FOLDER MATCHES "/(.*)")
    string(APPEND here /${CMAKE_MATCH_1})
  endif()
  list(TRANSFORM library_APART PREPEND ${here}/)
  set_source_files_properties(${library_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  list(TRANSFORM library_SOURCES PREPEND ${here}/)
  list(APPEND library_SOURCES ${library_APART})
  list(TRANSFORM library_HEADERS PREPEND ${here}/)
  foreach(object ${library_OBJECTS})
    list(APPEND library_SOURCES $<TARGET_OBJECTS:${object}>)
  endforeach()
  if(library_SOURCES)
    add_library(${target} STATIC EXCLUDE_FROM_ALL ${library_SOURCES})
    target_link_libraries(${target} PUBLIC marrow::marrow ${library_LINK} PRIVATE ${library_NEEDS})
    target_compile_options(${target} PRIVATE -Wall -Wextra)
    set_target_properties(${target} PROPERTIES OUTPUT_NAME marrow-${name}
      ARCHIVE_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib POSITION_INDEPENDENT_CODE ON
      CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
    target_precompile_headers(${target} REUSE_FROM plugin_headers)
    marrow_compile_together(${target} 20)
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${here} FILES ${library_HEADERS})
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE marrow::marrow ${library_LINK})
    target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS ${here} FILES ${library_HEADERS})
  endif()
  add_library(marrow::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY MARROW_LIBRARIES ${target})
  if(NOT MARROW_KINDS)
    install(TARGETS ${target} EXPORT marrowToolboxTargets
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/marrow COMPONENT marrow-dev
      FILE_SET HEADERS DESTINATION include/marrow/${library_FOLDER} COMPONENT marrow-dev)
  endif()
  # In the build folder, headers are included by the same names as installed.
  get_filename_component(folder ${PROJECT_BINARY_DIR}/include/marrow/${library_FOLDER} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  file(CREATE_LINK ${here} ${PROJECT_BINARY_DIR}/include/marrow/${library_FOLDER} SYMBOLIC)
endfunction()

# marrow_add_heavy(NAME file.cpp ... [LINK library ...] [INCLUDE folder ...]): files that include long headers or need
# flags of their own. They are added to a library as objects.
function(marrow_add_heavy name)
  cmake_parse_arguments(PARSE_ARGV 1 heavy "" "" "LINK;INCLUDE")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${heavy_UNPARSED_ARGUMENTS})
  target_include_directories(${name} SYSTEM PRIVATE ${heavy_INCLUDE})
  target_link_libraries(${name} PRIVATE marrow::marrow ${heavy_LINK})
  target_compile_options(${name} PRIVATE -Wall -Wextra)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
endfunction()
