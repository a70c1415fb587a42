// SPDX-License-Identifier: Apache-2.0
#include "pipelines.hpp"

#include <pybind11/stl.h>
#include <yaml-cpp/yaml.h>
#include <fstream>
#include <sstream>
#include <tuple>

#include "marrow/compare/experiment.hpp"
#include "marrow/runtime/run/run_folder.hpp"
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
      values.emplace_back(
          port, value_of(object, known ? known->type : TypeInfo{}, known ? known->axis : "", "input '" + port + "'"));
    } catch (const Error& error) {
      diagnostics.add({name + "(" + port + ")"}, error.what());
    }
  }
  if (!diagnostics.empty()) return with_faults(nullptr, diagnostics, info);
  OneNode one = pipeline_of_node(name, values, options, *made->known, diagnostics);
  made->pipeline = std::move(one.pipeline);
  made->is_one_node = true;
  made->given = std::move(one.given);
  return with_faults(made, diagnostics, info);
}

/// Leaves only these outputs, and the verdicts on their poses. Throws Error for a name that the pipeline does not have.
std::shared_ptr<ReadPipeline> with_only(const ReadPipeline& read, const std::vector<std::string>& names) {
  auto made = std::make_shared<ReadPipeline>(read);
  keep_outputs(made->pipeline, names);
  return made;
}

std::vector<std::string> axes_of(const Value& value) {
  std::vector<std::string> axes;
  for (const Value* one = &value; one->is_list(); one = &one->items[0]) axes.push_back(one->axis);
  return axes;
}

std::string text_of(const std::vector<std::string>& axes) {
  std::string text;
  for (const std::string& axis : axes) text += (text.empty() ? "a list over " : " and ") + axis;
  return text.empty() ? "one item" : text;
}

/// An object as an output of a node. Throws Error if it has another type or other axes.
Value output_value(const Pipeline& pipeline, std::size_t node, std::size_t output, const py::handle& object) {
  const PortInfo& port = pipeline.nodes[node].info.outputs[output];
  const std::string what = "given '" + pipeline.nodes[node].id + "." + port.name + "'";
  Value absent;
  absent.type = port.type;
  if (object.is_none()) return absent;
  const std::vector<std::string> axes = pipeline.axes_of({"", {}, int(node), int(output), {}});
  const Value value = value_of(object, port.type, axes.empty() ? "" : axes[0], what);
  if (value.type != port.type) throw Error(what + ": expected " + port.type.id + ", got " + value.type.id);
  if (axes_of(value) != axes) throw Error(what + ": expected " + text_of(axes) + ", got " + text_of(axes_of(value)));
  return value;
}

/// The same pipeline with values in the place of nodes. `given` is by node: a value, or for a node with several outputs
/// a dictionary or a named tuple of them. Throws Error for what the pipeline does not have.
std::shared_ptr<ReadPipeline> with_given(const ReadPipeline& read, const py::dict& given) {
  auto made = std::make_shared<ReadPipeline>(read);
  const std::vector<PipelineNode>& nodes = made->pipeline.nodes;
  std::vector<std::string> ids;
  for (const PipelineNode& node : nodes) ids.push_back(node.id);
  for (const auto& [key, object] : given) {
    const std::string id = py::str(key);
    const auto index = std::size_t(std::find(ids.begin(), ids.end(), id) - ids.begin());
    if (index == ids.size()) throw Error("given: the pipeline has no node '" + id + "'; " + suggestion(id, ids));
    const std::vector<PortInfo>& outputs = nodes[index].info.outputs;
    std::vector<Value>& values = made->given[id];
    if (outputs.size() == 1) {
      values = {output_value(made->pipeline, index, 0, object)};
      continue;
    }
    py::object parts = py::reinterpret_borrow<py::object>(object);
    if (py::hasattr(parts, "_asdict")) parts = parts.attr("_asdict")();
    if (!py::isinstance<py::dict>(parts))
      throw Error("given '" + id + "': the node has several outputs; give a dictionary of them");
    std::vector<std::string> names;
    for (const PortInfo& port : outputs) names.push_back(port.name);
    for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(parts))
      if (const std::string text = py::str(name); std::find(names.begin(), names.end(), text) == names.end())
        throw Error("given '" + id + "': the node has no output '" + text + "'; " + suggestion(text, names));
    for (std::size_t i = 0; i < names.size(); ++i)
      values.push_back(output_value(made->pipeline, index, i, parts.attr("get")(names[i])));
  }
  return made;
}

py::list nodes_of(const ReadPipeline& read) {
  py::list nodes;
  for (const PipelineNode& node : read.pipeline.nodes) nodes.append(py::make_tuple(node.id, node.info.name));
  return nodes;
}

struct Part {
  int line = 0, column = 0;
  std::string node, port, option;
  bool is_before(const Place& place) const { return std::tie(line, column) <= std::tie(place.line, place.column); }
};

/// The places at which the nodes of a file and their parts begin, in the order of the file. Empty if the file cannot be
/// read as a pipeline.
std::vector<Part> parts_of(const std::string& file) {
  std::vector<Part> parts;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return parts;
  const auto add = [&](const YAML::Node& key, const std::string& node, const std::string& port,
                       const std::string& option) {
    parts.push_back({key.Mark().line + 1, key.Mark().column + 1, node, port, option});
  };
  try {
    for (const auto& section : YAML::LoadFile(file)) {
      add(section.first, "", "", "");
      if (section.first.Scalar() != "nodes") continue;
      for (const auto& node : section.second) {
        const std::string id = node.first.Scalar();
        add(node.first, id, "", "");
        for (const auto& part : node.second) {
          add(part.first, id, "", "");
          const bool is_input = part.first.Scalar() == "in";
          if (!is_input && part.first.Scalar() != "with") continue;
          for (const auto& item : part.second)
            add(item.first, id, is_input ? item.first.Scalar() : "", is_input ? "" : item.first.Scalar());
        }
      }
    }
  } catch (const YAML::Exception&) {  // the faults say what is wrong with the file
    return {};
  }
  return parts;
}

/// The part that a place without a line names: "set(edges.high)", "set(edges.in.view)" or "edges.canny(high)".
Part part_of_name(const std::string& name) {
  Part part;
  const std::size_t open = name.find('(');
  if (open == std::string::npos || !name.ends_with(')')) return part;
  const std::string before = name.substr(0, open), inside = name.substr(open + 1, name.size() - open - 2);
  if (before != "set") {
    part.node = before;
    part.option = inside;
    return part;
  }
  const std::size_t dot = inside.find('.');
  part.node = inside.substr(0, dot);
  if (dot == std::string::npos) return part;
  const std::string what = inside.substr(dot + 1);
  (what.starts_with("in.") ? part.port : part.option) = what.starts_with("in.") ? what.substr(3) : what;
  return part;
}

bool has_input(const NodeInfo& info, const std::string& name) {
  return std::any_of(info.inputs.begin(), info.inputs.end(), [&](const PortInfo& port) { return port.name == name; });
}

py::object or_none(const std::string& text) { return text.empty() ? py::none() : py::object(py::str(text)); }
py::object or_none(int number) { return number == 0 ? py::none() : py::object(py::int_(number)); }

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
      .def("with_given", &with_given)
      .def("resolved_yaml", [](const ReadPipeline& self) { return resolved_yaml(self.pipeline); });
  module.def("read", &read, py::arg("file"), py::arg("inputs"), py::arg("changes"), py::arg("inputs_required"));
  module.def("read_node", &read_node, py::arg("name"), py::arg("inputs"), py::arg("options"));
  module.def("read_experiment", &read_experiment, py::arg("file"));
}

// Faults of a pipeline for Python. To which node and which of its inputs or options a fault belongs follows from its
// place in the file, or from the name of the argument.

py::list list_of(const Diagnostics& diagnostics, const NodeInfo* called) {
  std::map<std::string, std::vector<Part>> files;
  py::list faults;
  for (const Diagnostic& one : diagnostics.sorted()) {
    Part found;
    if (one.place.line == 0) {
      found = part_of_name(one.place.file);
      if (called && has_input(*called, found.option)) found.port.swap(found.option);
    } else {
      const auto file = files.try_emplace(one.place.file);
      if (file.second) file.first->second = parts_of(one.place.file);
      for (const Part& part : file.first->second)
        if (part.is_before(one.place)) found = part;
    }
    py::dict fault;
    fault["file"] = or_none(one.place.file);
    fault["line"] = or_none(one.place.line);
    fault["column"] = or_none(one.place.column);
    fault["message"] = one.message;
    fault["hint"] = or_none(one.hint);
    fault["node"] = or_none(found.node);
    fault["port"] = or_none(found.port);
    fault["option"] = or_none(found.option);
    faults.append(fault);
  }
  return faults;
}

}  // namespace marrow::python
