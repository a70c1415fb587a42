# Writes marrow/runtime/node/headers_digest.hpp: a digest of the headers by which a plugin and the framework talk, which
# are those that were made public so far. The toolbox's are not among them, because its libraries become a part of the
# plugin.
get_target_property(headers marrow HEADER_SET)
list(SORT headers)
set(texts "")
foreach(header ${headers})
  file(SHA256 ${header} digest)
  file(RELATIVE_PATH name ${PROJECT_SOURCE_DIR}/framework ${header})
  string(APPEND texts "${name} ${digest}\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
endforeach()
string(SHA256 headers_digest "${texts}")
string(SUBSTRING ${headers_digest} 0 16 headers_digest)
configure_file(${CMAKE_CURRENT_LIST_DIR}/headers_digest.hpp.in
  ${PROJECT_BINARY_DIR}/include/marrow/runtime/node/headers_digest.hpp @ONLY)
