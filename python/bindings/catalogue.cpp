// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <mutex>

#include "marrow/base/framework_file.hpp"
#include "pipelines.hpp"

namespace marrow::python {
namespace {

std::mutex catalogue_mutex;

std::shared_ptr<const Catalogue>& kept_catalogue() {
  static auto* const kept = new std::shared_ptr<const Catalogue>;  // outlives every Python object
  return *kept;
}

py::object python_of_option(const OptionValue& value) {
  return std::visit([](const auto& one) -> py::object { return py::cast(one); },
                    static_cast<const OptionVariant&>(value));
}

py::dict dict_of(const PortInfo& port) {
  py::dict made;
  made["name"] = port.name;
  made["help"] = port.help;
  made["type"] = port.type.id;
  made["optional"] = port.optional;
  made["axis"] = port.axis;
  made["figures"] = port.figures;
  return made;
}

py::dict dict_of(const OptionInfo& option) {
  static const char* const kTypes[] = {"boolean", "integer", "number", "text", "path", "numbers", "texts", "paths"};
  py::dict made;
  made["name"] = option.name;
  made["help"] = option.help;
  made["unit"] = option.unit;
  made["type"] = kTypes[int(option.type)];
  made["default"] = python_of_option(option.default_value);
  made["required"] = option.required;
  made["minimum"] = option.minimum;
  made["maximum"] = option.maximum;
  made["choices"] = option.choices;
  return made;
}

py::dict dict_of(const KindPort& port) {
  py::dict made;
  made["name"] = port.name;
  made["help"] = port.help;
  made["axis"] = port.axis;
  py::list types;
  for (const TypeInfo& type : port.types) types.append(type.id);
  made["types"] = types;
  return made;
}

template <class T>
py::list list_of_dicts(const std::vector<T>& items) {
  py::list made;
  for (const T& item : items) made.append(dict_of(item));
  return made;
}

py::object node_info(const std::string& name) {
  const auto known = catalogue();
  const NodeInfo* info = known->find(name);
  if (!info) return py::none();
  py::dict made;
  made["name"] = info->name;
  made["summary"] = info->summary;
  made["inputs"] = list_of_dicts(info->inputs);
  made["outputs"] = list_of_dicts(info->outputs);
  made["options"] = list_of_dicts(info->options);
  made["random"] = info->random;
  return made;
}

py::object kind_info(const std::string& name) {
  const auto known = catalogue();
  const KindInfo* kind = known->find_kind(name);
  if (!kind) return py::none();
  py::dict made;
  made["inputs"] = list_of_dicts(kind->inputs);
  made["outputs"] = list_of_dicts(kind->outputs);
  made["library"] = std::filesystem::canonical(known->library_of_kind(name)->file).string();
  return made;
}

}  // namespace

std::shared_ptr<const Catalogue> catalogue() {
  const py::gil_scoped_release release;  // reading all manifests takes long
  const std::scoped_lock lock(catalogue_mutex);
  auto& kept = kept_catalogue();
  std::vector<std::filesystem::path> folders = Catalogue::default_folders();
  if (!kept || kept->folders() != folders) kept = std::make_shared<const Catalogue>(std::move(folders));
  return kept;
}

void forget_catalogue() {
  const py::gil_scoped_release release;
  const std::scoped_lock lock(catalogue_mutex);
  kept_catalogue().reset();
}

void bind_catalogue(py::module_& module) {
  module.def("forget_catalogue", &forget_catalogue, "Looks for plugins again when they are next needed.");
  module.def(
      "node_names", [] { return catalogue()->node_names(); }, "The names of all nodes, sorted.");
  module.def(
      "kind_names", [] { return catalogue()->kind_names(); }, "The names of all kinds, sorted.");
  module.def(
      "kind_summary",
      [](const std::string& name) {
        const auto known = catalogue();
        const KindInfo* kind = known->find_kind(name);
        return kind ? kind->summary : std::string();
      },
      "What a kind does; empty if no library says it.");
  module.def("kind_info", &kind_info, "A kind's contract and the library that brings it; None if there is none.");
  module.def("node_info", &node_info, "All that a manifest says about a node, as a dictionary; None if there is none.");
  module.def(
      "remedy_for", [](const std::string& node) { return catalogue()->remedy_for(node); }, py::arg("missing_node"),
      "What to do where there is no such node; empty if nothing is known of the name.");
  module.def("suggestion", &suggestion, "\"did you mean ...\" for a wrong name, or the known names.");
  module.def(
      "framework_file", [] { return framework_file().string(); }, "marrow's own library.");
}

}  // namespace marrow::python
