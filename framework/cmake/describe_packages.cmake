# Run by CPack between installing the packages' files and packing them: writes the manifests. The node of marrow-cgal is
# described beside the program of the package marrow, by which it will be used.
set(packages ${CPACK_TEMPORARY_DIRECTORY})
set(MARROW_ROOT ${packages}/marrow/usr)
set(MARROW_LIBRARIES ${CPACK_MARROW_LIBRARIES})
set(plugins ${MARROW_LIBRARIES}/marrow)
file(GLOB programs ${packages}/*/usr/bin/marrow* ${MARROW_ROOT}/${MARROW_LIBRARIES}/libmarrow*.so.*.*.*
  ${MARROW_ROOT}/${plugins}/marrow-worker ${packages}/*/usr/${plugins}/*.so
  ${packages}/*/usr/lib/python3/dist-packages/marrow/*.so)
foreach(program IN LISTS programs)
  file(RPATH_REMOVE FILE ${program})  # the system's folders are searched anyway
endforeach()
file(GLOB guests ${packages}/marrow-cgal/usr/${plugins}/*.so)
file(COPY ${guests} DESTINATION ${MARROW_ROOT}/${plugins})
include(${CMAKE_CURRENT_LIST_DIR}/describe_installed.cmake)
foreach(guest IN LISTS guests)
  get_filename_component(name ${guest} NAME_WE)
  file(RENAME ${MARROW_ROOT}/${plugins}/${name}.json ${packages}/marrow-cgal/usr/${plugins}/${name}.json)
  file(REMOVE ${MARROW_ROOT}/${plugins}/${name}.so)
endforeach()
