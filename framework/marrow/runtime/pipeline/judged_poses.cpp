// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/judged_poses.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

constexpr const char* kJudged = "pose";  ///< the input that holds the judged pose, in nodes of the kind verdict

template <class T>
bool is_of(const Pipeline& pipeline, const PipelineOutput& output) {
  return pipeline.output_of(output.source).type == TypeInfo::of<T>();
}

/// The nodes whose poses a verdict judges. A body that makes verdicts judges its own poses.
std::set<int> judged_by(const Pipeline& pipeline, const PipelineOutput& verdict) {
  const PipelineNode& node = pipeline.node_of(verdict.source);
  if (node.repetition) return {verdict.source.node};
  std::set<int> judged;
  for (const Wire& wire : node.wires)
    if (node.input_of(wire).name == kJudged)
      for (const Reference& source : wire.sources) judged.insert(source.node);
  return judged;
}

/// Whether the pose of a node comes from one of the judged nodes, and no node in between has a cost.
bool comes_from(const Pipeline& pipeline, int index, const std::set<int>& judged) {
  if (judged.contains(index)) return true;
  const PipelineNode& node = pipeline.nodes[std::size_t(index)];
  for (const Wire& wire : node.wires)
    if (node.input_of(wire).type == TypeInfo::of<Cost>()) return false;
  for (const Wire& wire : node.wires) {
    if (node.input_of(wire).type != TypeInfo::of<Pose>()) continue;
    for (const Reference& source : wire.sources)
      if (comes_from(pipeline, source.node, judged)) return true;
  }
  return false;
}

}  // namespace

void keep_outputs(Pipeline& pipeline, const std::vector<std::string>& names) {
  const std::vector<std::string> known = names_of(pipeline.outputs);
  for (const std::string& name : names)
    if (!contains(known, name)) throw Error("the pipeline has no output '" + name + "'; " + suggestion(name, known));
  Pipeline wanted = pipeline;
  std::erase_if(wanted.outputs, [&](const PipelineOutput& output) { return !contains(names, output.name); });
  const std::vector<bool> needed = wanted.needed();
  std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) {
    if (contains(names, output.name)) return false;
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
