// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <set>

#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRunner;
using compare::Experiment;

struct Counts {
  long all = 0, shared = 0, cached = 0;
  std::map<std::string, long> to_make;  ///< by what the node uses
};

bool makes_functions(const PipelineNode& node) {
  for (const PortInfo& output : node.info.outputs)
    if (!output.type.is_function) return false;
  return true;
}

void count_cell(const Experiment& experiment, const CellRunner& runner, const CellIndex& cell, const Catalogue& catalogue, const Store* store,
                std::set<Digest>& seen, Counts& counts) {
  const fs::path place = runner.case_place(cell.case_index);
  const Pipeline pipeline = runner.pipeline_of(cell, place, CellRunner::Depth::figures);
  const std::vector<Digest> keys = compare::histories(pipeline, experiment.cases[cell.case_index].name);
  std::vector<PlannedNode> planned;
  if (store && (place.empty() || fs::exists(place))) {
    RunSettings settings;
    settings.store = store;
    settings.seed = runner.seed_of(cell.case_index);
    settings.remember = false;
    planned = plan_pipeline(pipeline, catalogue, settings);
  }
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    if (!needed[i] || makes_functions(pipeline.nodes[i])) continue;
    ++counts.all;
    if (!seen.insert(keys[i]).second) ++counts.shared;
    else if (!planned.empty() && planned[i].what == PlannedNode::What::cached) ++counts.cached;
    else ++counts.to_make[pipeline.nodes[i].info.name];
  }
}

/// Mean time of a call of each node in earlier runs.
std::map<std::string, double> seconds_before(const Store& store) {
  std::map<std::string, std::pair<double, long>> sums;
  for (const Store::Entry& entry : store.entries()) {
    sums[entry.provenance.node].first += entry.provenance.seconds;
    ++sums[entry.provenance.node].second;
  }
  std::map<std::string, double> means;
  for (const auto& [node, sum] : sums) means[node] = sum.first / double(sum.second);
  return means;
}

}  // namespace

void print_plan(const Experiment& experiment, const Catalogue& catalogue, const Store* store, const fs::path& folder) {
  const CellRunner runner(experiment, catalogue, store, folder, 1);
  Counts counts;
  std::set<Digest> seen;
  long cases_to_make = 0;
  for (std::size_t c = 0; c < experiment.cases.size(); ++c) {
    cases_to_make += experiment.cases[c].is_simulated && !fs::exists(runner.case_place(c));
    for (std::size_t s = 0; s < experiment.starts.size(); ++s)
      for (std::size_t v = 0; v < experiment.variants.size(); ++v) count_cell(experiment, runner, {v, c, s}, catalogue, store, seen, counts);
  }
  long to_make = 0, unknown = 0;
  double seconds = 0;
  const std::map<std::string, double> before = store ? seconds_before(*store) : std::map<std::string, double>();
  for (const auto& [node, count] : counts.to_make) {
    to_make += count;
    const auto known = before.find(node);
    if (known == before.end()) unknown += count;
    else seconds += known->second * double(count);
  }
  std::printf("%zu cells: %zu variants, %zu cases, %zu starts\n", experiment.cell_count(), experiment.variants.size(), experiment.cases.size(), experiment.starts.size());
  if (cases_to_make) std::printf("%ld cases to simulate\n", cases_to_make);
  std::printf("%ld evaluations of nodes: %ld shared, %ld cached, %ld to make\n", counts.all, counts.shared, counts.cached, to_make);
  if (to_make) std::printf("estimate from earlier runs: %.1f s of work", seconds);
  if (unknown) std::printf(", without %ld evaluations of nodes that never ran", unknown);
  if (to_make) std::printf("\n");
}

}  // namespace marrow::cli
