// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "manifest.hpp"
#include "marrow/runtime/node_builder.hpp"

namespace marrow::detail {
namespace {

std::string unit_of_name(const std::string& name) {
  static constexpr std::array<const char*, 8> kUnits{"mm", "deg", "rad", "px", "s", "hu", "kev", "percent"};
  const std::size_t underscore = name.rfind('_');
  if (underscore == std::string::npos) return "";
  const std::string suffix = name.substr(underscore + 1);
  for (const char* unit : kUnits)
    if (suffix == unit) return suffix == "hu" ? "HU" : suffix == "kev" ? "keV" : suffix == "percent" ? "%" : suffix;
  return "";
}

}  // namespace

NodeDeclaration::~NodeDeclaration() {
  if (const std::size_t ports = node_.info.inputs.size(); named_inputs_ != ports)
    node_.faults.push_back("the function takes " + std::to_string(ports) + " inputs, but .in() names " +
                           std::to_string(named_inputs_));
  check_declaration(node_);
}

void NodeDeclaration::add_input(const TypeInfo& type, bool is_list, bool is_optional) {
  PortInfo port;
  port.type = type;
  port.optional = is_optional;
  if (is_list) port.axis = "?";  // a placeholder until over() names the axis
  node_.info.inputs.push_back(std::move(port));
}

void NodeDeclaration::name_input(std::string name, std::string help, Over axis) {
  if (named_inputs_ < node_.info.inputs.size()) {
    PortInfo& port = node_.info.inputs[named_inputs_];
    if (axis.axis.empty() != port.axis.empty())
      node_.faults.push_back("input '" + name +
                             "': " + (axis.axis.empty() ? "a List needs over(\"axis\")" : "over() is for List inputs"));
    port.name = std::move(name);
    port.help = std::move(help);
    port.axis = std::move(axis.axis);
  }
  ++named_inputs_;
}

void NodeDeclaration::add_output(std::string name, std::string help, const TypeInfo& type, const Over& axis,
                                 bool is_list, bool is_optional) {
  if (axis.axis.empty() == is_list)
    output_fault(name, is_list ? "a List needs over(\"axis\")" : "over() is for a List");
  node_.info.outputs.push_back({std::move(name), std::move(help), type, is_optional || is_list, axis.axis});
}

OptionInfo NodeDeclaration::option(std::string name, std::string help, OptionType type, std::size_t length,
                                   OptionValue default_value) {
  OptionInfo info;
  info.unit = unit_of_name(name);
  info.name = std::move(name);
  info.help = std::move(help);
  info.type = type;
  info.length = length;
  info.default_value = std::move(default_value);
  return info;
}

void NodeDeclaration::add_option(OptionInfo info, std::function<void(void* options, const OptionValue&)> set) {
  node_.info.options.push_back(std::move(info));
  node_.set_option.push_back(std::move(set));
}

void NodeDeclaration::output_fault(const std::string& name, const char* fault) {
  node_.faults.push_back("output '" + name + "': " + fault);
}

}  // namespace marrow::detail
