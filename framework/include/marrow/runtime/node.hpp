// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of a node, as plain data: all that listing, checking, inspecting, the JSON Schema and the cache key
// need.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "marrow/runtime/context.hpp"
#include "marrow/runtime/value.hpp"

namespace marrow {

struct PortInfo {
  std::string name;
  std::string help;
  TypeInfo type;
  bool optional = false;  ///< of an input: may be left unwired; of an output: may be absent
  std::string axis;       ///< of a list port: the axis that it consumes or makes; empty for one item
};

enum class OptionType { boolean, integer, number, text, path, numbers, texts, paths };
using OptionVariant =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;

/// The value of an option: a variant whose copies survive a lack of memory. In libstdc++ 12, where a text or list that
/// is copied into a new variant gets no memory, the variant destroys what was never made. An assignment copies the text
/// first.
struct OptionValue : OptionVariant {
  using OptionVariant::OptionVariant;
  using OptionVariant::operator=;
  OptionValue() = default;
  OptionValue(const OptionValue& other) : OptionVariant() { OptionVariant::operator=(other); }
  OptionValue(OptionValue&&) noexcept = default;
  OptionValue& operator=(const OptionValue&) = default;
  OptionValue& operator=(OptionValue&&) noexcept = default;
  ~OptionValue() = default;
};

struct OptionInfo {
  std::string name;
  std::string help;
  std::string unit;
  OptionType type = OptionType::number;
  OptionValue default_value;
  bool required = false;  ///< a path or text with no sensible default
  std::optional<double> minimum, maximum;
  std::vector<std::string> choices;
  std::size_t length = 0;  ///< of numbers: how many there must be; 0 = any
};

/// What options must be to each other.
enum class RelationType { not_above, below, same_length, as_many_or_none, exactly_one };
struct RelationInfo {
  RelationType type = RelationType::not_above;
  std::vector<std::string> names;  ///< of options; exactly_one may name inputs, too: "in.camera"
};

struct NodeInfo {
  std::string name;  ///< kind.name
  std::string summary;
  std::vector<PortInfo> inputs, outputs;
  std::vector<OptionInfo> options;
  std::vector<RelationInfo> relations;
  std::vector<std::string> traits;  ///< of those that its kind knows
  bool random = false;              ///< draws from Context::seed()

  std::string kind() const { return name.substr(0, name.find('.')); }
};

/// A node with its code, as a loaded plugin registers it.
struct NodeDefinition {
  NodeInfo info;
  std::vector<std::string> faults;  ///< what is wrong with the declaration itself
  std::function<std::shared_ptr<void>()> make_options;
  std::vector<std::function<void(void* options, const OptionValue&)>> set_option;  ///< in the order of info.options
  std::function<std::vector<Value>(const std::vector<Value>& inputs, const void* options, Context&)> call;
};

/// How values of a type are written to disk when a pipeline names them as outputs.
struct WriterInfo {
  TypeInfo type;
  std::string extension;  ///< ".mha"; empty for a folder
  std::string help;
};
struct WriterDefinition {
  WriterInfo info;
  std::function<void(const void* value, const std::string& path)> write;
};

}  // namespace marrow
