// SPDX-License-Identifier: Apache-2.0
// What programs ask about a pipeline: which nodes could stand in the place of another, and which poses are judged.
#include "marrow/runtime/pipeline/pipeline.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// What the node needs and the pipeline does not give it. Options that the file gives to the replaced node are not
/// given to this node.
std::vector<std::string> missing_for(const PipelineNode& node, const PipelineArguments& arguments) {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < node.info.inputs.size(); ++i) {
    const PortInfo& port = node.info.inputs[i];
    const bool is_wired =
        std::any_of(node.wires.begin(), node.wires.end(), [&](const Wire& wire) { return wire.port == int(i); });
    if (!port.optional && !is_wired)
      missing.push_back("wire " + port.name + ": " + types_text({port.type}, port.axis) + " (" + port.help + ")");
  }
  for (const OptionInfo& option : node.info.options) {
    const auto& given = arguments.overrides;
    const bool is_given = std::any_of(given.begin(), given.end(),
                                      [&](const Override& one) { return one.key == node.id + "." + option.name; });
    if (option.required && !is_given) missing.push_back("give the option " + option.name + ": " + option.help);
  }
  return missing;
}

Fit fit_of(const std::string& name, const std::string& id, const std::filesystem::path& file,
           const PipelineArguments& arguments, const Catalogue& catalogue) {
  PipelineArguments changed = arguments;
  changed.overrides.push_back({id + ".uses", name});
  Diagnostics faults;
  const Pipeline pipeline = try_pipeline(file, changed, catalogue, faults);
  check_writers(pipeline, catalogue, faults);
  Fit fit{name, {}, {}};
  for (const PipelineNode& node : pipeline.nodes)
    if (node.id == id) fit.missing = missing_for(node, arguments);
  // Each missing thing is a fault too. If there is no other fault, the pipeline can be completed.
  if (faults.size() > fit.missing.size())
    for (const Diagnostic& fault : faults.sorted()) fit.faults.push_back(fault.message);
  return fit;
}

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

std::vector<Fit> nodes_in_place_of(const std::string& id, const std::filesystem::path& file,
                                   const PipelineArguments& arguments, const Catalogue& catalogue,
                                   Diagnostics& diagnostics) {
  const Pipeline pipeline = read_pipeline(file, arguments, catalogue, diagnostics, false);
  check_writers(pipeline, catalogue, diagnostics);
  if (!diagnostics.empty()) return {};
  const auto node =
      std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(), [&](const PipelineNode& one) { return one.id == id; });
  if (node == pipeline.nodes.end()) {
    std::vector<std::string> ids;
    for (const PipelineNode& one : pipeline.nodes) ids.push_back(one.id);
    diagnostics.add({file.string(), 0, 0}, "the pipeline has no node " + in_quotes(id), suggestion(id, ids));
    return {};
  }
  std::vector<Fit> fits;
  for (const bool same_kind : {true, false})
    for (const std::string& name : catalogue.node_names()) {
      if (name == node->info.name || (catalogue.find(name)->kind() == node->info.kind()) != same_kind) continue;
      Fit fit = fit_of(name, id, file, arguments, catalogue);
      if (same_kind || fit.faults.empty()) fits.push_back(std::move(fit));
    }
  return fits;
}

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
