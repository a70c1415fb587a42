// SPDX-License-Identifier: Apache-2.0
#pragma once
// Nodes as plain data. This suffices to list, check and inspect nodes, and to make the JSON Schema and cache keys.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "marrow/runtime/node/context.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

struct PortInfo {
  std::string name;
  std::string help;
  TypeInfo type;
  bool optional = false;  ///< an input that may be left unwired, or an output that may be absent
  std::string axis;       ///< the axis that a list port takes or makes; empty for one item
  /// For an output of figures (Metrics): the names that its figures can have. * stands for any text. Empty if the names
  /// are not known before the node is called.
  std::vector<std::string> figures = {};
};

enum class OptionType { boolean, integer, number, text, path, numbers, texts, paths };
using OptionVariant =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;

/// The value of an option: a variant that can be copied safely when memory runs out. In libstdc++ 12, if there is no
/// memory to copy a text or list into a new variant, the variant destroys a member that was never constructed. An
/// assignment copies the text first, so the copy constructor here uses it.
struct OptionValue : OptionVariant {
  using OptionVariant::OptionVariant;
  using OptionVariant::operator=;
  OptionValue() = default;
  OptionValue(const OptionValue& other) : OptionVariant() {  // NOLINT(bugprone-copy-constructor-init)
    OptionVariant::operator=(other);
  }
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
  bool required = false;  ///< a pipeline must give it, because there is no sensible default
  std::optional<double> minimum, maximum;
  std::vector<std::string> choices;
  std::size_t length = 0;             ///< how many numbers a list must have; 0 = any
  std::vector<std::string> replaces;  ///< options of nodes whose functions reach this node, which then have no effect
  std::vector<std::string> beside;    ///< endings of files beside the named one that belong to it: ".onnx"
};

/// Conditions between the options of a node.
enum class RelationType { not_above, below, same_length, as_many_or_none, exactly_one, at_least_one, distinct };
struct RelationInfo {
  RelationType type = RelationType::not_above;
  std::vector<std::string> names;  ///< names of options; exactly_one and at_least_one may name inputs, as "in.camera"
};

struct NodeInfo {
  std::string name;  ///< kind.name
  std::string summary;
  std::vector<PortInfo> inputs, outputs;
  std::vector<OptionInfo> options;
  std::vector<RelationInfo> relations;
  std::vector<std::string> traits;  ///< the traits of its kind that it has
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

/// How values of a type are written to disk if they are outputs of a pipeline.
struct WriterInfo {
  TypeInfo type;
  std::string extension;  ///< ".mha"; empty for a folder
  std::string help;
};
struct WriterDefinition {
  WriterInfo info;
  std::function<void(const void* value, const std::string& path)> write;
};

// A kind as plain data. A kind is the part of a node's name before the dot, together with a contract. Because of the
// contract, one changed line of a pipeline replaces a node by another of its kind. Libraries declare kinds and nodes.

/// A port of the contract. A node declares it with one of these types.
struct KindPort {
  std::string name;
  std::string help;
  std::vector<TypeInfo> types;
  std::string axis;  ///< axis of a list port; empty for one item
};

/// A property that some nodes of a kind have. The kind's suite checks it.
struct TraitInfo {
  std::string name;
  std::string help;
};

/// A check of the kind's suite.
struct CheckInfo {
  std::string name;
  std::string what;  ///< what it checks, in one line
  double limit = 0;  ///< the largest value that it may measure
  std::string unit;  ///< unit of the limit; "" if it has none
};

/// Whether nodes of a kind are called in their own process if their options name files. The limits of this process
/// depend on the size of the files: they are tight for nodes that only parse, and wide for nodes that also compute.
enum class Apart { no, parses, computes };

struct KindInfo {
  std::string name;
  std::string summary;
  std::vector<KindPort> inputs;   ///< inputs that its nodes may have; a node may have others too
  std::vector<KindPort> outputs;  ///< outputs that each of its nodes has; a node may have others too
  bool sees_truth = false;        ///< whether its nodes may be given the truth
  Apart apart = Apart::no;
  std::vector<TraitInfo> traits;
  std::vector<CheckInfo> checks;  ///< the checks of its suite
  bool is_suite = false;          ///< only the suite of a kind that another library declares
};

}  // namespace marrow
