// SPDX-License-Identifier: Apache-2.0
#include "axis_maker.hpp"

#include <algorithm>
#include <set>

#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::compare {
namespace {

bool takes_long(const PipelineNode& node) {
  return node.repetition || std::any_of(node.info.outputs.begin(), node.info.outputs.end(),
                                        [](const PortInfo& output) { return output.type.is_function; });
}

class MakerSearch {
 public:
  MakerSearch(const Pipeline& pipeline, const std::string& axis) : pipeline_(pipeline), axis_(axis) {}

  void look_at(const Reference& value) {
    const PipelineNode& node = pipeline_.node_of(value);
    if (node.repetition) return;
    if (pipeline_.output_of(value).axis == axis_) return consider({value.node, value.output});
    if (!seen_.insert(value.node).second) return;
    for (const Wire& wire : node.wires) {
      if (node.input_of(wire).axis == axis_) continue;  // it takes the whole list
      for (const Reference& source : wire.sources)
        if (contains(pipeline_.axes_of(source), axis_)) look_at(source);
    }
  }

  const std::vector<AxisMaker>& best() const { return best_; }

 private:
  void consider(const AxisMaker& maker) {
    std::set<int> needed{maker.node}, open = needed;
    while (!open.empty()) {
      const PipelineNode& node = pipeline_.nodes[std::size_t(*open.begin())];
      open.erase(open.begin());
      if (takes_long(node)) return;
      for (const Wire& wire : node.wires)
        for (const Reference& source : wire.sources)
          if (needed.insert(source.node).second) open.insert(source.node);
    }
    if (!best_.empty() && needed.size() > fewest_) return;
    if (!best_.empty() && needed.size() < fewest_) best_.clear();
    best_.push_back(maker);
    fewest_ = needed.size();
  }

  const Pipeline& pipeline_;
  const std::string& axis_;
  std::set<int> seen_;
  std::vector<AxisMaker> best_;
  std::size_t fewest_ = 0;
};

}  // namespace

std::vector<AxisMaker> quick_makers(const Pipeline& pipeline, const Reference& value, const std::string& axis) {
  MakerSearch search(pipeline, axis);
  search.look_at(value);
  return search.best();
}

}  // namespace marrow::compare
