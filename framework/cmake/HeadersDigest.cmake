# Writes marrow/runtime/headers_digest.hpp: a digest of the headers by which a plugin and the framework talk. The
# toolbox's are not among them, because its libraries become a part of the plugin.
set(folder ${PROJECT_SOURCE_DIR}/framework/include/marrow)
file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${folder} ${folder}/*.hpp ${folder}/domain/*.hpp ${folder}/runtime/*.hpp)
list(SORT headers)
set(texts "")
foreach(header ${headers})
  file(SHA256 ${folder}/${header} digest)
  string(APPEND texts "${header} ${digest}\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${folder}/${header})
endforeach()
string(SHA256 headers_digest "${texts}")
string(SUBSTRING ${headers_digest} 0 16 headers_digest)
configure_file(${CMAKE_CURRENT_LIST_DIR}/headers_digest.hpp.in
  ${PROJECT_BINARY_DIR}/include/marrow/runtime/headers_digest.hpp @ONLY)
