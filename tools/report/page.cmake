# The HTML page of reports, without data, becomes a part of the program.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
find_program(ESBUILD esbuild REQUIRED)  # bundle.py calls it
set(report_page ${CMAKE_CURRENT_BINARY_DIR}/report_page.html)
file(GLOB report_parts CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tools/report/page/*)
list(APPEND report_parts ${PROJECT_SOURCE_DIR}/docs/glossary.md)
add_custom_command(OUTPUT ${report_page} DEPENDS ${report_parts}
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/tools/report/page/bundle.py
    ${PROJECT_SOURCE_DIR}/tools/report/page/report.html ${report_page})
set_source_files_properties(${PROJECT_SOURCE_DIR}/tools/report/page.cpp PROPERTIES OBJECT_DEPENDS ${report_page}
  COMPILE_DEFINITIONS MARROW_REPORT_PAGE="${report_page}" SKIP_UNITY_BUILD_INCLUSION ON)
