// SPDX-License-Identifier: Apache-2.0
// Faults of a pipeline for Python. To which node and which of its inputs or options a fault belongs follows from its
// place in the file, or from the name of the argument.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <tuple>

#include "pipelines.hpp"

namespace marrow::python {
namespace {

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
