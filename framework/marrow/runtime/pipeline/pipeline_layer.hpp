// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// One of the files that a pipeline is read from, while it is read.
struct PipelineLayer {
  StrictYaml& yaml;
  Diagnostics& diagnostics;
  std::filesystem::path folder;  ///< where relative paths start
  std::shared_ptr<const DeclaredInputs> inputs;
  int number = 0;

  WrittenValue value_of(const YamlEntry& entry) const { return {entry.place, entry.value, folder, inputs, number}; }
};

/// Puts the entries of a map over those of the files below. `null` removes an entry of these.
void put_over(std::vector<WrittenEntry>& entries, const YamlEntry& map, const std::string& what,
              const PipelineLayer& layer);

/// Puts what a file says of a node over what the files below say.
void put_node_over(WrittenPipeline& pipeline, const YamlEntry& entry, const PipelineLayer& layer);

/// Sets what the node uses. Options of the files below were written for the replaced node, so another node must not get
/// them. Returns whether there were some.
bool set_uses(WrittenNode& node, const std::string& uses, const Place& place, const std::filesystem::path& folder,
              int layer);

/// Sets how many passes there are. `key`: at_most, until or if_pass_fails.
void set_passes(WrittenNode& node, const std::string& key, const YAML::Node& value, const Place& place,
                StrictYaml& yaml);

/// The text "'may_fail' of node 'id'".
std::string may_fail_of(const std::string& node);

/// Whether a node uses a pipeline file, not a node of a plugin.
bool is_part(const std::string& uses);

}  // namespace marrow
