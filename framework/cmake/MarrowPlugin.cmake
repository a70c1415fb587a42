# marrow_add_plugin(NAME source.cpp [...] [LINK library ...] [FOLDER folder] [ONLY_WITH option])
#
# Builds the shared library marrow_NAME.so and, by running it, its manifest marrow_NAME.json beside it. Symbols are
# hidden, so that two plugins with a same-named function or static never meet. ONLY_WITH: NAME is kind_node, and the
# library is left out where this option of CMake is off; marrow then says so of the node (not_built.json).
function(marrow_add_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 plugin "" "FOLDER;PACKAGE;ONLY_WITH" "LINK")
  set(target plugin_${name})
  if(MARROW_LEFT_OUT AND NOT plugin_FOLDER)
    return()
  endif()
  if(plugin_ONLY_WITH)
    if(NOT ${plugin_ONLY_WITH})
      string(REGEX REPLACE "^([a-z]+)_(.*)$" "\\1.\\2" node ${name})
      set_property(GLOBAL APPEND PROPERTY MARROW_NOT_BUILT "\"${node}\": \"${plugin_ONLY_WITH}\"")
      return()
    endif()
  endif()
  add_library(${target} MODULE ${plugin_UNPARSED_ARGUMENTS})
  target_link_libraries(${target} PRIVATE marrow::marrow ${plugin_LINK})
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_compile_options(${target} PRIVATE -Wall -Wextra)
  target_link_options(${target} PRIVATE -Wl,--as-needed)  # of a topic's libraries only what the node uses
  if(plugin_FOLDER)
    set(folder ${plugin_FOLDER})
  elseif(PROJECT_NAME STREQUAL "marrow")
    set(folder ${PROJECT_BINARY_DIR}/lib/marrow)
  else()
    set(folder ${CMAKE_CURRENT_BINARY_DIR})
  endif()
  set_target_properties(${target} PROPERTIES
    PREFIX "" OUTPUT_NAME marrow_${name} LIBRARY_OUTPUT_DIRECTORY ${folder}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  if(TARGET plugin_headers)
    target_precompile_headers(${target} REUSE_FROM plugin_headers)
  endif()
  # The command line lists and checks from manifests without loading a library, so each build writes a fresh one.
  if(TARGET marrow_cli)
    add_dependencies(${target} marrow_cli marrow_worker)
    set(describe $<TARGET_FILE:marrow_cli>)
  else()
    set(describe $<TARGET_FILE:marrow::marrow_cli>)
  endif()
  add_custom_command(TARGET ${target} POST_BUILD
    COMMAND ${describe} describe $<TARGET_FILE:${target}> --write
    COMMENT "Describing ${name}" VERBATIM)
  if(PROJECT_NAME STREQUAL "marrow" AND NOT plugin_FOLDER)
    include(GNUInstallDirs)
    set_property(GLOBAL APPEND PROPERTY MARROW_SHIPPED ${target})
    if(NOT plugin_PACKAGE)
      set(plugin_PACKAGE marrow)
    endif()
    install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/marrow COMPONENT ${plugin_PACKAGE})
  endif()
endfunction()

# marrow_write_not_built(FILE): the nodes that ONLY_WITH has left out so far, each with its option, as JSON. No file
# where there are none. `marrow doctor` and `marrow check` tell them.
function(marrow_write_not_built file)
  get_property(nodes GLOBAL PROPERTY MARROW_NOT_BUILT)
  file(REMOVE ${file})
  if(nodes)
    list(JOIN nodes ", " nodes)
    file(WRITE ${file} "{${nodes}}\n")
  endif()
endfunction()

# marrow_test_plugin(NAME file.cpp ... NODES node or kind ...)
#
# Builds test_NAME, a GoogleTest program, and tells ctest of it and of the checks of each node's kind
# (`marrow conformance NODE`). The tests call the plugins of this folder by the names of their nodes, see
# marrow/testing/node.hpp. Call enable_testing() before it.
function(marrow_test_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 test "" "" "NODES")
  find_package(GTest REQUIRED)
  add_executable(test_${name} ${test_UNPARSED_ARGUMENTS})
  target_link_libraries(test_${name} PRIVATE marrow::marrow GTest::gtest_main)
  target_compile_features(test_${name} PRIVATE cxx_std_20)
  add_test(NAME ${name} COMMAND test_${name})
  set(tests ${name})
  foreach(node ${test_NODES})
    add_test(NAME conformance_${node} COMMAND marrow::marrow_cli conformance ${node})
    list(APPEND tests conformance_${node})
  endforeach()
  set_tests_properties(${tests} PROPERTIES ENVIRONMENT MARROW_PLUGIN_PATH=${CMAKE_CURRENT_BINARY_DIR})
endfunction()
