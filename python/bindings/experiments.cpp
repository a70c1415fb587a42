// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment.hpp"
#include "pipelines.hpp"

namespace marrow::python {
namespace {

/// Reads an experiment. Returns its name, its faults and all of them as one text.
py::tuple read_experiment(const std::string& file) {
  const auto known = catalogue();
  Diagnostics diagnostics;
  std::string name;
  {
    const py::gil_scoped_release release;  // it reads the pipeline of each variant
    name = compare::read_experiment(file, *known, diagnostics).name;
  }
  return py::make_tuple(name, list_of(diagnostics), diagnostics.text());
}

}  // namespace

void bind_experiments(py::module_& module) { module.def("read_experiment", &read_experiment, py::arg("file")); }

}  // namespace marrow::python
