# marrow_add_kind(NAME [NODES node ...] [SOURCES file.cpp ...] [LINK library ...]
#   [MORE node ...] [MORE_LINK library ...] [SUITE file.cpp ...] [SUITE_LINK library ...])
#
# The shared library of a kind: kind.cpp, the nodes node.cpp and what else they need. Each node is one file that would
# be a plugin by itself. Here several are compiled together, each in a namespace of its name, because most of a node's
# time goes to headers and templates that all of them use. MORE: nodes of a second library, marrow_NAME_more.so, so that
# the first result does not wait for them. SUITE: the files of the kind's checks, which only `marrow conformance` needs,
# in marrow_NAME_suite.so. A node that brings a heavy library is a plugin of its own (marrow_add_plugin), so that only
# its users load that library.
set(MARROW_TOGETHER ${CMAKE_CURRENT_LIST_DIR}/nodes_together.cmake)
function(marrow_add_kind name)
  cmake_parse_arguments(PARSE_ARGV 1 kind "" "" "NODES;SOURCES;LINK;MORE;MORE_LINK;SUITE;SUITE_LINK")
  if(MARROW_LEFT_OUT)
    return()
  endif()
  marrow_add_nodes(${name} NODES kind ${kind_NODES} SOURCES ${kind_SOURCES} LINK ${kind_LINK})
  if(kind_MORE)
    marrow_add_nodes(${name}_more NODES ${kind_MORE} LINK ${kind_LINK} ${kind_MORE_LINK})
  endif()
  if(kind_SUITE)
    marrow_add_plugin(${name}_suite ${kind_SUITE} LINK ${kind_LINK} ${kind_SUITE_LINK})
    marrow_compile_together(plugin_${name}_suite 8)
    target_compile_options(plugin_${name}_suite PRIVATE $<$<CONFIG:Release>:-O1>)  # nobody feels the speed of checks
  endif()
  foreach(node ${kind_NODES})  # so that a node is asked for by its name, wherever it is
    add_custom_target(plugin_${name}_${node})
    add_dependencies(plugin_${name}_${node} plugin_${name})
  endforeach()
  foreach(node ${kind_MORE})
    add_custom_target(plugin_${name}_${node})
    add_dependencies(plugin_${name}_${node} plugin_${name}_more)
  endforeach()
endfunction()

# A plugin of nodes that are compiled together.
function(marrow_add_nodes name)
  cmake_parse_arguments(PARSE_ARGV 1 kind "" "" "NODES;SOURCES;LINK")
  set(count 1)
  if(MARROW_UNITY)
    set(count 8)
  endif()
  set(left ${kind_NODES})
  list(JOIN left "," all)
  set(sources "")
  while(left)
    list(SUBLIST left 0 ${count} nodes)
    list(REMOVE_ITEM left ${nodes})
    list(JOIN nodes "," together)
    list(TRANSFORM nodes PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    list(TRANSFORM nodes APPEND .cpp)
    list(LENGTH sources index)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}_nodes_${index}.cpp)
    add_custom_command(OUTPUT ${source} DEPENDS ${nodes} ${MARROW_TOGETHER} VERBATIM COMMENT ""
      COMMAND ${CMAKE_COMMAND} -DFOLDER=${CMAKE_CURRENT_SOURCE_DIR} -DNODES=${together} -DALL=${all} -DINDEX=${index}
        -DFILE=${source} -P ${MARROW_TOGETHER})
    list(APPEND sources ${source})
  endwhile()
  marrow_add_plugin(${name} ${sources} ${kind_SOURCES} LINK ${kind_LINK})
  marrow_compile_together(plugin_${name} 8)
  set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
