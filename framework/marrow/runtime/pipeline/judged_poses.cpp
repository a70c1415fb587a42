// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/judged_poses.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

constexpr const char* kJudged = "pose";  ///< the input of the kind verdict that is judged

const PipelineNode& node_of(const Pipeline& pipeline, const PipelineOutput& output) {
  return pipeline.nodes[std::size_t(output.source.node)];
}

template <class T>
bool is_of(const Pipeline& pipeline, const PipelineOutput& output) {
  return node_of(pipeline, output).info.outputs[std::size_t(output.source.output)].type == TypeInfo::of<T>();
}

/// The nodes whose pose a verdict is of. A body that makes verdicts judges its own poses.
std::set<int> judged_by(const Pipeline& pipeline, const PipelineOutput& verdict) {
  const PipelineNode& node = node_of(pipeline, verdict);
  if (node.repetition) return {verdict.source.node};
  std::set<int> judged;
  for (const Wire& wire : node.wires)
    if (node.info.inputs[std::size_t(wire.port)].name == kJudged)
      for (const Reference& source : wire.sources) judged.insert(source.node);
  return judged;
}

/// Whether a pose of one of these nodes reaches a node, at most with changes that no cost has made.
bool comes_from(const Pipeline& pipeline, int node, const std::set<int>& judged) {
  if (judged.contains(node)) return true;
  const PipelineNode& made = pipeline.nodes[std::size_t(node)];
  const auto takes = [&](const Wire& wire, const TypeInfo& type) {
    return made.info.inputs[std::size_t(wire.port)].type == type;
  };
  if (std::any_of(made.wires.begin(), made.wires.end(),
                  [&](const Wire& wire) { return takes(wire, TypeInfo::of<Cost>()); }))
    return false;
  for (const Wire& wire : made.wires) {
    if (!takes(wire, TypeInfo::of<Pose>())) continue;
    for (const Reference& source : wire.sources)
      if (comes_from(pipeline, source.node, judged)) return true;
  }
  return false;
}

}  // namespace

void keep_outputs(Pipeline& pipeline, const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const PipelineOutput& output : pipeline.outputs) known.push_back(output.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error("the pipeline has no output '" + name + "'; " + suggestion(name, known));
  Pipeline wanted = pipeline;
  std::erase_if(wanted.outputs, [&](const PipelineOutput& output) {
    return std::find(names.begin(), names.end(), output.name) == names.end();
  });
  const std::vector<bool> needed = wanted.needed();
  std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) {
    if (std::find(names.begin(), names.end(), output.name) != names.end()) return false;
    if (!is_of<Verdict>(pipeline, output)) return true;
    const std::set<int> judged = judged_by(pipeline, output);
    return std::none_of(judged.begin(), judged.end(), [&](int node) { return needed[std::size_t(node)]; });
  });
}

std::vector<std::string> notes_on_poses(const Pipeline& pipeline) {
  std::set<int> judged;
  for (const PipelineOutput& output : pipeline.outputs)
    if (is_of<Verdict>(pipeline, output)) judged.merge(judged_by(pipeline, output));
  std::vector<std::string> notes;
  for (const PipelineOutput& output : pipeline.outputs)
    if (is_of<Pose>(pipeline, output) && !comes_from(pipeline, output.source.node, judged))
      notes.push_back("nobody judges the output '" + output.name + "': this pipeline has no verdict on that pose");
  return notes;
}

}  // namespace marrow
