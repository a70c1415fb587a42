# marrow_public_headers(TARGET ROOM header.hpp ...): public headers of a room of the framework.
function(marrow_public_headers target room)
  list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/framework/marrow/${room}/)
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/framework FILES ${ARGN})
endfunction()
