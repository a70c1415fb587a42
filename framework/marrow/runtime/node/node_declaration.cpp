// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/node_builder.hpp"
#include "marrow/runtime/node/node_json.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::detail {
namespace {

std::string unit_of_name(std::string_view name) {
  static constexpr std::array<const char*, 8> kUnits{"mm", "deg", "rad", "px", "s", "hu", "kev", "percent"};
  const std::size_t underscore = name.rfind('_');
  if (underscore == std::string_view::npos) return "";
  const std::string suffix(name.substr(underscore + 1));
  for (const char* unit : kUnits)
    if (suffix == unit) return suffix == "hu" ? "HU" : suffix == "kev" ? "keV" : suffix == "percent" ? "%" : suffix;
  return "";
}

void apply(OptionInfo& option, const Attribute& attribute) {
  switch (attribute.type) {
    case Attribute::Type::minimum:
      option.minimum = attribute.number;
      break;
    case Attribute::Type::maximum:
      option.maximum = attribute.number;
      break;
    case Attribute::Type::unit:
      option.unit = attribute.text;
      break;
    case Attribute::Type::choices:
      option.choices.assign(attribute.names.begin(), attribute.names.end());
      break;
    case Attribute::Type::required:
      option.required = true;
      break;
    case Attribute::Type::replaces:
      option.replaces.assign(attribute.names.begin(), attribute.names.end());
      break;
    case Attribute::Type::beside:
      option.beside.assign(attribute.names.begin(), attribute.names.end());
      break;
  }
}

}  // namespace

Value value_of_item(const TypeInfo& type, std::shared_ptr<const void> item) {
  Value value;
  value.type = type;
  if (item) value.data = std::move(item);
  return value;
}

Value value_of_list(const TypeInfo& type, const std::vector<std::string>& names,
                    std::vector<std::shared_ptr<const void>> items, std::string_view axis) {
  Value value;
  value.type = type;
  if (items.empty()) return value;
  value.axis = axis;
  value.names = names;
  for (std::shared_ptr<const void>& item : items) value.items.push_back(value_of_item(type, std::move(item)));
  return value;
}

NodeDeclaration::NodeDeclaration(NodeDefinition& node, Function function, Call call,
                                 std::shared_ptr<void> (*make_options)())
    : node_(node), parts_(std::make_shared<std::vector<ReturnedPart>>()) {
  node.make_options = make_options;
  node.call = [function, call, parts = parts_](const std::vector<Value>& inputs, const void* options,
                                               Context& context) {
    const std::shared_ptr<const void> whole = call(function, inputs, options, context);
    std::vector<Value> values;
    for (const ReturnedPart& part : *parts) {
      const std::shared_ptr<const void> place(whole, static_cast<const std::byte*>(whole.get()) + part.offset);
      values.push_back(part.value(part.type, place, part.axis));
    }
    return values;
  };
}

NodeDeclaration::~NodeDeclaration() {
  if (const std::size_t ports = node_.info.inputs.size(); named_inputs_ != ports)
    node_.faults.push_back(marrow::formatted("the function takes {} inputs, but .in() names {}", ports, named_inputs_));
  check_declaration(node_);
}

std::size_t NodeDeclaration::outputs() const { return parts_->size(); }

void NodeDeclaration::add_input(const TypeInfo& type, bool is_list, bool is_optional) {
  PortInfo port;
  port.type = type;
  port.optional = is_optional;
  if (is_list) port.axis = "?";  // a placeholder until over() names the axis
  node_.info.inputs.push_back(std::move(port));
}

void NodeDeclaration::name_input(std::string_view name, std::string_view help, const Over& axis) {
  if (named_inputs_ < node_.info.inputs.size()) {
    PortInfo& port = node_.info.inputs[named_inputs_];
    if (axis.axis.empty() != port.axis.empty())
      node_.faults.push_back("input '" + std::string(name) +
                             "': " + (axis.axis.empty() ? "a List needs over(\"axis\")" : "over() is for List inputs"));
    port.name = name;
    port.help = help;
    port.axis = axis.axis;
  }
  ++named_inputs_;
}

void NodeDeclaration::add_output(std::string_view name, std::string_view help, const Over& axis, ReturnedPart part) {
  if (axis.axis.empty() == part.is_list)
    output_fault(name, part.is_list ? "a List needs over(\"axis\")" : "over() is for a List");
  PortInfo& port = node_.info.outputs.emplace_back();
  port.name = name;
  port.help = help;
  port.type = part.type;
  port.optional = part.is_optional || part.is_list;
  port.axis = axis.axis;
  part.axis = axis.axis;
  parts_->push_back(std::move(part));
}

void NodeDeclaration::output_fault(std::string_view name, const char* fault) {
  node_.faults.push_back("output '" + std::string(name) + "': " + fault);
}

void NodeDeclaration::name_figures(std::initializer_list<std::string_view> names) {
  if (node_.info.outputs.empty()) {
    node_.faults.push_back(".figures() belongs after an .out()");
    return;
  }
  PortInfo& port = node_.info.outputs.back();
  if (port.type != TypeInfo::of<Metrics>())
    output_fault(port.name, ".figures() is for an output of figures, which are Metrics");
  port.figures.assign(names.begin(), names.end());
}

void NodeDeclaration::add_option(std::string_view name, std::string_view help, const MemberType& type,
                                 std::ptrdiff_t offset, const void* default_value,
                                 std::initializer_list<Attribute> attributes) {
  OptionInfo& option = node_.info.options.emplace_back();
  option.name = name;
  option.help = help;
  option.unit = unit_of_name(name);
  option.type = type.type;
  option.length = type.length;
  option.default_value = type.get(default_value);
  for (const Attribute& attribute : attributes) apply(option, attribute);
  type.narrow(option);
  node_.set_option.push_back([offset, set = type.set](void* options, const OptionValue& value) {
    set(static_cast<std::byte*>(options) + offset, value);
  });
}

template MARROW_EXPORT_INSTANCE const MemberType* member_type<bool>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<int>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<float>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<double>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::string>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::filesystem::path>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<double>>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<std::string>>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<std::filesystem::path>>();
template MARROW_EXPORT_INSTANCE const MemberType* member_type<Eigen::Vector3d>();

}  // namespace marrow::detail
