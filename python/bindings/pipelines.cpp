// SPDX-License-Identifier: Apache-2.0
#include "pipelines.hpp"

#include <pybind11/stl.h>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/run_folder.hpp"
#include "runtime/one_node.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

using Texts = std::vector<std::pair<std::string, std::string>>;

/// Returns the pipeline, its faults and all of them as one text.
py::tuple with_faults(std::shared_ptr<ReadPipeline> read, const Diagnostics& diagnostics,
                      const NodeInfo* called = nullptr) {
  return py::make_tuple(diagnostics.empty() ? py::cast(std::move(read)) : py::none(), list_of(diagnostics, called),
                        diagnostics.text());
}

py::tuple read(const std::string& file, const Texts& inputs, const Texts& changes, bool inputs_required) {
  auto made = std::make_shared<ReadPipeline>();
  made->known = catalogue();
  for (const auto& [name, value] : inputs) made->arguments.inputs.push_back({name, value});
  // A place that names the call. It has no slash, so relative paths start at the working folder.
  for (const auto& [key, value] : changes) made->arguments.overrides.push_back({key, value, {"set(" + key + ")"}});
  Diagnostics diagnostics;
  {
    const py::gil_scoped_release release;
    made->pipeline = read_pipeline(file, made->arguments, *made->known, diagnostics, inputs_required);
  }
  return with_faults(std::move(made), diagnostics);
}

const PortInfo* port_of(const NodeInfo& info, const std::string& name) {
  for (const PortInfo& port : info.inputs)
    if (port.name == name) return &port;
  return nullptr;
}

py::tuple read_node(const std::string& name, const py::dict& inputs, const Texts& options) {
  auto made = std::make_shared<ReadPipeline>();
  made->known = catalogue();
  const NodeInfo* info = made->known->find(name);
  Diagnostics diagnostics;
  std::vector<std::pair<std::string, Value>> values;
  for (const auto& [key, object] : inputs) {
    const std::string port = py::str(key);
    const PortInfo* known = info ? port_of(*info, port) : nullptr;
    try {
      values.emplace_back(port, value_of(object, known ? known->type : TypeInfo{}, known ? known->axis : "", port));
    } catch (const Error& error) {
      diagnostics.add({name + "(" + port + ")"}, error.what());
    }
  }
  if (!diagnostics.empty()) return with_faults(nullptr, diagnostics, info);
  OneNode one = pipeline_of_node(name, values, options, *made->known, diagnostics);
  made->pipeline = std::move(one.pipeline);
  made->given = std::move(one.given);
  return with_faults(made, diagnostics, info);
}

/// Leaves only these outputs. Throws Error for a name that the pipeline does not have.
std::shared_ptr<ReadPipeline> with_only(const ReadPipeline& read, const std::vector<std::string>& names) {
  auto made = std::make_shared<ReadPipeline>(read);
  std::vector<std::string> known;
  for (const PipelineOutput& output : read.pipeline.outputs) known.push_back(output.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error("the pipeline has no output '" + name + "'; " + suggestion(name, known));
  std::erase_if(made->pipeline.outputs, [&](const PipelineOutput& output) {
    return std::find(names.begin(), names.end(), output.name) == names.end();
  });
  return made;
}

py::list nodes_of(const ReadPipeline& read) {
  py::list nodes;
  for (const PipelineNode& node : read.pipeline.nodes) nodes.append(py::make_tuple(node.id, node.info.name));
  return nodes;
}

}  // namespace

void bind_pipelines(py::module_& module) {
  py::class_<ReadPipeline, std::shared_ptr<ReadPipeline>>(module, "ReadPipeline")
      .def_property_readonly("name", [](const ReadPipeline& self) { return self.pipeline.name; })
      .def_property_readonly("help", [](const ReadPipeline& self) { return self.pipeline.help; })
      .def_property_readonly("notes", [](const ReadPipeline& self) { return self.pipeline.notes; })
      .def_property_readonly("nodes", &nodes_of)
      .def_property_readonly("outputs",
                             [](const ReadPipeline& self) {
                               std::vector<std::string> names;
                               for (const PipelineOutput& output : self.pipeline.outputs) names.push_back(output.name);
                               return names;
                             })
      .def("with_only", &with_only)
      .def("resolved_yaml", [](const ReadPipeline& self) { return resolved_yaml(self.pipeline); });
  module.def("read", &read, py::arg("file"), py::arg("inputs"), py::arg("changes"), py::arg("inputs_required"));
  module.def("read_node", &read_node, py::arg("name"), py::arg("inputs"), py::arg("options"));
}

}  // namespace marrow::python
