# The HTML page of reports, without data, becomes a part of the program.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(report_page ${CMAKE_CURRENT_BINARY_DIR}/report_page.html)
file(GLOB report_parts CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tools/report/page/*)
add_custom_command(OUTPUT ${report_page} DEPENDS ${report_parts}
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/tools/report/page/assemble.py --page ${report_page})
set_source_files_properties(${PROJECT_SOURCE_DIR}/tools/report/page.cpp PROPERTIES OBJECT_DEPENDS ${report_page}
  COMPILE_DEFINITIONS MARROW_REPORT_PAGE="${report_page}" SKIP_UNITY_BUILD_INCLUSION ON)
