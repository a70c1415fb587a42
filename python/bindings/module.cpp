// SPDX-License-Identifier: Apache-2.0
// The extension module marrow._core. The package's Python files give it the shape that users see.
#include <pybind11/pybind11.h>

#include "pipelines.hpp"
#include "values.hpp"

PYBIND11_MODULE(_core, module) {
  namespace python = marrow::python;
  namespace py = pybind11;
  module.attr("_version") = MARROW_VERSION;
  module.doc() = "What the package marrow needs of marrow's framework.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const marrow::Error& error) {
      const py::object type = py::module_::import("marrow.errors").attr("Error");
      PyErr_SetString(type.ptr(), error.what());
    }
  });
  python::bind_buffer(module);
  python::bind_images(module);
  python::bind_geometry(module);
  python::bind_findings(module);
  python::bind_values(module);
  python::bind_files(module);
  python::bind_functions(module);
  python::bind_asked(module);
  python::bind_catalogue(module);
  python::bind_pipelines(module);
  python::bind_runs(module);
  python::bind_worker(module);
}
