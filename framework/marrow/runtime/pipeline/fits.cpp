// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/fits.hpp"

#include <algorithm>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/plugins/contract.hpp"

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

}  // namespace marrow
