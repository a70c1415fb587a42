// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>

#include "marrow/base/number_text.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/node/relations.hpp"

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

namespace marrow {

KindBuilder::~KindBuilder() { detail::check_declaration(kind_); }

KindBuilder& KindBuilder::summary(std::string text) {
  kind_.info.summary = std::move(text);
  return *this;
}

KindBuilder& KindBuilder::trait(std::string name, std::string help) {
  kind_.info.traits.push_back({std::move(name), std::move(help)});
  return *this;
}

KindBuilder& KindBuilder::sees_truth() {
  kind_.info.sees_truth = true;
  return *this;
}

KindBuilder& KindBuilder::runs_apart(Apart apart) {
  kind_.info.apart = apart;
  return *this;
}

KindBuilder& KindBuilder::suite(conformance::Suite suite) {
  kind_.suite = std::move(suite);
  for (const conformance::Check& check : conformance::checks_of(kind_.suite)) kind_.info.checks.push_back(check);
  return *this;
}

KindBuilder& KindBuilder::add_input(KindPort port) {
  kind_.info.inputs.push_back(std::move(port));
  return *this;
}

KindBuilder& KindBuilder::add_output(KindPort port) {
  kind_.info.outputs.push_back(std::move(port));
  return *this;
}

NodeDefinition& Plugin::add_node(std::string name) {
  nodes.emplace_back().info.name = std::move(name);
  return nodes.back();
}

void Plugin::add_writer(WriterDefinition writer) { writers.push_back(std::move(writer)); }

KindBuilder Plugin::kind(std::string name) {
  kinds.emplace_back().info.name = std::move(name);
  return KindBuilder(kinds.back());
}

void Plugin::suite(std::string kind, conformance::Suite suite) {
  KindBuilder builder = this->kind(std::move(kind));
  kinds.back().info.is_suite = true;
  builder.suite(std::move(suite));
}

}  // namespace marrow
