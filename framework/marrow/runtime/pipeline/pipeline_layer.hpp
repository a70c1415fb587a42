// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is read from the files of a pipeline, one over the other, before nodes are looked up.
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

/// Puts what a file declares under `inputs` over what the files below declare.
void put_inputs_over(DeclaredInputs& inputs, const YamlEntry& section, const PipelineLayer& layer,
                     const Catalogue& catalogue);

/// Gives the inputs their values: given ones, else the defaults. Checks them.
void set_inputs(DeclaredInputs& inputs, const PipelineReading& reading, Diagnostics& diagnostics);

/// What the file declares, for those who use the pipeline.
std::vector<PipelineInput> listed_inputs(const DeclaredInputs& inputs);

/// Where a relative path in a value of an input or in an override starts: the folder of the file that it is written in,
/// else the working folder.
std::filesystem::path folder_of(const Place& written);

/// The entries of `set` in a file.
std::vector<WrittenEntry> changes_in(const YamlEntry& section, const PipelineLayer& layer);

/// Changes the pipeline. `layer`: the number of the changes' layer; those of a later layer of their own come after it.
/// Options that an override makes useless are worth a note.
void apply_changes(WrittenPipeline& pipeline, std::vector<WrittenEntry> changes, int layer, Diagnostics& diagnostics);

/// Replaces each node that uses a pipeline file by the nodes of that file, called NODE/ITS NODE. Its inputs of data are
/// replaced by what the node is wired to, and what names the node by what makes its outputs. If the pipeline is itself
/// a part that is checked alone, nodes stand for its inputs.
void put_parts_in(WrittenPipeline& pipeline, const PipelineReading& reading, const Catalogue& catalogue,
                  Diagnostics& diagnostics);

}  // namespace marrow
