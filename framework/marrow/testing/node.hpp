// SPDX-License-Identifier: Apache-2.0
#pragma once
// For tests of nodes, marrow's own and others. Nodes are called by their names, from their libraries, as in a pipeline.
// Libraries are searched where the program searches them: in the folders of MARROW_PLUGIN_PATH, then beside marrow's
// library. All functions throw marrow::Error for a node, an input or an option that does not exist.
#include <algorithm>
#include <cmath>
#include <map>
#include <marrow/conformance.hpp>
#include <marrow/runtime/node/node_builder.hpp>
#include <marrow/runtime/node/types.hpp>
#include <marrow/runtime/plugins/catalogue.hpp>
#include <memory>
#include <string>
#include <vector>

namespace marrow::node_test {

using Inputs = std::map<std::string, marrow::Value>;
using Options = std::map<std::string, marrow::OptionValue>;
using Outputs = std::map<std::string, marrow::Value>;

/// One item, and a list along an axis, as inputs.
using marrow::conformance::item;
template <class T>
marrow::Value list(const marrow::List<T>& items, const std::string& axis) {
  return marrow::Value::of<T>(items, axis);
}

inline const marrow::NodeDefinition& definition_of(const std::string& node) {
  static const marrow::Catalogue catalogue;
  if (!catalogue.find(node))
    throw marrow::Error("there is no node '" + node + "'; is it built, and its folder in MARROW_PLUGIN_PATH?");
  return catalogue.load(node);
}

/// Whether a node declares this relation between its options. The runtime's tests cover what happens if a pipeline
/// breaks it.
inline bool declares(const std::string& node, const marrow::RelationInfo& relation) {
  const std::vector<marrow::RelationInfo>& all = definition_of(node).info.relations;
  return std::any_of(all.begin(), all.end(), [&](const marrow::RelationInfo& declared) {
    return declared.type == relation.type && declared.names == relation.names;
  });
}

/// The outputs of a node by port. Options that are not given have their defaults. Exceptions of the node pass through.
/// Throws Error if the node does not have one of the inputs or options.
inline Outputs call(const std::string& node, const Inputs& inputs, const Options& options = {},
                    marrow::Context context = marrow::Context()) {
  const marrow::NodeDefinition& definition = definition_of(node);
  const std::shared_ptr<void> settings = definition.make_options();
  std::size_t known = 0;
  for (std::size_t i = 0; i < definition.info.options.size(); ++i)
    if (const auto given = options.find(definition.info.options[i].name); given != options.end()) {
      definition.set_option[i](settings.get(), given->second);
      ++known;
    }
  if (known != options.size()) throw marrow::Error("the test gives '" + node + "' an option that it does not have");
  std::vector<marrow::Value> values;
  known = 0;
  for (const marrow::PortInfo& port : definition.info.inputs) {
    const auto given = inputs.find(port.name);
    if (given == inputs.end() && !port.optional)
      throw marrow::Error("the test does not give '" + node + "' its input '" + port.name + "'");
    values.push_back(given == inputs.end() ? marrow::Value() : given->second);
    known += given != inputs.end();
  }
  if (known != inputs.size()) throw marrow::Error("the test gives '" + node + "' an input that it does not have");
  Outputs outputs;
  const std::vector<marrow::Value> results = definition.call(values, settings.get(), context);
  for (std::size_t i = 0; i < results.size(); ++i) outputs[definition.info.outputs[i].name] = results[i];
  return outputs;
}

/// The message with which a node refuses its inputs; empty if it accepts them.
inline std::string refusal(const std::string& node, const Inputs& inputs, const Options& options = {}) {
  try {
    call(node, inputs, options);
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "";
}

/// A figure of merit by its name; NaN if there is none.
inline double figure(const marrow::Value& metrics, const std::string& name) {
  if (metrics.is_absent()) return std::nan("");
  for (const marrow::Metric& metric : metrics.as<marrow::Metrics>().items)
    if (metric.name == name) return metric.value;
  return std::nan("");
}

}  // namespace marrow::node_test
