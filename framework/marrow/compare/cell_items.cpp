// SPDX-License-Identifier: Apache-2.0
// Which items a case has along an axis.
#include <algorithm>

#include "cell_fault.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::compare {
namespace {

/// The names along an axis, at any level of nested lists. These may have different items.
void add_names_along(const Value& value, const std::string& axis, std::vector<std::string>& names) {
  if (value.axis == axis)
    for (const std::string& name : value.names)
      if (!contains(names, name)) names.push_back(name);
  for (const Value& item : value.items) add_names_along(item, axis, names);
}

}  // namespace

std::vector<std::string> CellRunner::items_of(const CellIndex& cell, const NamedItem& asked) {
  Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::figures);
  const auto node = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(),
                                 [&](const PipelineNode& one) { return one.id == asked.node; });
  if (node == pipeline.nodes.end() || std::size_t(asked.output) >= node->info.outputs.size())
    throw Error("the pipeline has no such node '" + asked.node + "' any more");
  const Reference list{asked.node, {}, int(node - pipeline.nodes.begin()), asked.output, {}};
  pipeline.outputs = {{"items", list}};
  const RunResult result = run_pipeline(pipeline, catalogue_, settings_of(cell));
  if (result.failed()) throw Error(reason_of(pipeline, result));
  std::vector<std::string> names;
  add_names_along(value_of(result, list), asked.axis, names);
  return names;
}

}  // namespace marrow::compare
