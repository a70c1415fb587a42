# Writes the manifests of the plugins below MARROW_ROOT/MARROW_LIBRARIES/marrow, by the program that is installed there.
file(GLOB described ${MARROW_ROOT}/${MARROW_LIBRARIES}/marrow/marrow_*.so)
list(LENGTH described count)
message(STATUS "Describing ${count} plugins")
foreach(plugin IN LISTS described)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${MARROW_ROOT}/${MARROW_LIBRARIES}
    ${MARROW_ROOT}/bin/marrow describe ${plugin} --write OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()
