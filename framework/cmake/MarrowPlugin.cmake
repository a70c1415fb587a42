# marrow_add_plugin(NAME source.cpp [...] [LINK library ...] [FOLDER folder])
#
# Builds the shared library marrow_NAME.so and, by running it, its manifest marrow_NAME.json beside it. Symbols are
# hidden, so that two plugins with a same-named function or static never meet.
function(marrow_add_plugin name)
  cmake_parse_arguments(PARSE_ARGV 1 plugin "" "FOLDER;PACKAGE" "LINK")
  set(target plugin_${name})
  if(MARROW_LEFT_OUT AND NOT plugin_FOLDER)
    return()
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
