// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "compare/comparison.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/experiment_notes.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRunner;
using compare::Experiment;

/// Reading the pipeline of a cell takes some milliseconds. If there are more cells than this, a sample stands for all.
constexpr std::size_t kMostCells = 1000;

/// An evenly spread sample of `taken` out of `all` things.
struct Sample {
  std::size_t all = 0, taken = 0;
  std::size_t at(std::size_t i) const { return i * all / taken; }
  double weight() const { return double(all) / double(taken); }
};

std::pair<Sample, Sample> cases_and_starts(const Experiment& experiment) {
  Sample cases{experiment.cases.size(), experiment.cases.size()},
      starts{experiment.starts.size(), experiment.starts.size()};
  const std::size_t places = std::max<std::size_t>(1, kMostCells / experiment.variants.size());
  if (cases.all * starts.all > places) {
    cases.taken = std::min(cases.all, std::max(std::size_t(std::sqrt(double(places))), places / starts.all));
    starts.taken = std::clamp<std::size_t>(places / cases.taken, 1, starts.all);
  }
  return {cases, starts};
}

/// Numbers of evaluations, estimated from the sampled cells.
struct Counts {
  double all = 0, shared = 0, cached = 0;
  std::map<std::string, double> to_make;  ///< key: name of the node that is used
};

bool makes_functions(const PipelineNode& node) {
  for (const PortInfo& output : node.info.outputs)
    if (!output.type.is_function) return false;
  return true;
}

class Plan {
 public:
  Plan(const Experiment& experiment, const Catalogue& catalogue, const Store* store, const fs::path& folder)
      : experiment_(experiment),
        catalogue_(catalogue),
        store_(store),
        runner_(experiment, catalogue, store, folder, 1),
        samples_(cases_and_starts(experiment)) {
    const auto& [cases, starts] = samples_;
    for (std::size_t c = 0; c < cases.taken; ++c) {
      const fs::path place = runner_.case_place(cases.at(c));
      const bool is_there = place.empty() || fs::exists(place);
      if (experiment.cases[cases.at(c)].is_simulated && !is_there) cases_to_make_ += cases.weight();
      for (std::size_t s = 0; s < starts.taken; ++s)
        for (std::size_t v = 0; v < experiment.variants.size(); ++v)
          count_cell({v, cases.at(c), starts.at(s)}, place, is_there);
    }
  }

  void print() const;
  WorkEstimate estimate() const;

 private:
  void count_cell(const CellIndex& cell, const fs::path& place, bool is_there) {
    const Pipeline pipeline = runner_.pipeline_of(cell, place, CellRunner::Depth::figures);
    const std::vector<Digest> keys = compare::histories(pipeline, experiment_.cases[cell.case_index].name);
    const std::vector<compare::Dependence> dependences = compare::dependences(pipeline, experiment_);
    std::vector<PlannedNode> planned;
    if (store_ && is_there) {
      RunSettings settings;
      settings.store = store_;
      settings.seed = runner_.seed_of(cell.case_index);
      settings.remember = false;
      planned = plan_pipeline(pipeline, catalogue_, settings);
    }
    const auto& [cases, starts] = samples_;
    const std::vector<bool> needed = pipeline.needed();
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
      if (!needed[i] || makes_functions(pipeline.nodes[i])) continue;
      const double all = cases.weight() * starts.weight();
      const double alike =
          (dependences[i].on_case ? cases.weight() : 1) * (dependences[i].on_start ? starts.weight() : 1);
      counts_.all += all;
      counts_.shared += all;
      if (!seen_.insert(keys[i]).second) continue;
      counts_.shared -= alike;
      if (!planned.empty() && planned[i].what == PlannedNode::What::cached)
        counts_.cached += alike;
      else
        counts_.to_make[pipeline.nodes[i].info.name] += alike;
    }
  }

  const Experiment& experiment_;
  const Catalogue& catalogue_;
  const Store* store_;
  const CellRunner runner_;
  std::pair<Sample, Sample> samples_;
  std::set<Digest> seen_;
  Counts counts_;
  double cases_to_make_ = 0;
};

/// Mean time of one call of each node in earlier runs.
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

WorkEstimate Plan::estimate() const {
  WorkEstimate estimate;
  const std::map<std::string, double> before = store_ ? seconds_before(*store_) : std::map<std::string, double>();
  for (const auto& [node, count] : counts_.to_make) {
    estimate.to_make += count;
    const auto known = before.find(node);
    if (known == before.end())
      estimate.unknown += count;
    else
      estimate.seconds += known->second * count;
  }
  return estimate;
}

void Plan::print() const {
  const auto& [to_make, unknown, seconds] = estimate();
  const auto& [cases, starts] = samples_;
  const bool is_sample = cases.taken < cases.all || starts.taken < starts.all;
  std::printf("%zu cells: %zu variants, %zu cases, %zu starts\n", experiment_.cell_count(), experiment_.variants.size(),
              cases.all, starts.all);
  if (const auto counts = compare::comparison_counts(experiment_); counts.comparisons)
    std::printf("%s %s, for which a difference takes at least %zu cases\n",
                counted(counts.comparisons, "comparison").c_str(),
                experiment_.compare_all ? "of all pairs" : "with the baseline", counts.fewest_cases);
  if (is_sample)
    std::printf("looked at: %zu cases and %zu starts, evenly spread; by them there are about\n", cases.taken,
                starts.taken);
  if (cases_to_make_ > 0) std::printf("%.0f cases to simulate\n", cases_to_make_);
  std::printf("%.0f evaluations of nodes: %.0f shared, %.0f cached, %.0f to make\n", counts_.all, counts_.shared,
              counts_.cached, to_make);
  if (to_make > 0)
    std::printf("estimate from earlier runs: %.1f s of work, without cases to simulate, timed runs and pictures",
                seconds);
  if (unknown > 0) std::printf(", and without %.0f evaluations of nodes that never ran", unknown);
  if (to_make > 0) std::printf("\n");
}

}  // namespace

void print_plan(const Experiment& experiment, const Catalogue& catalogue, const Store* store, const fs::path& folder) {
  Plan(experiment, catalogue, store, folder).print();
}

WorkEstimate estimate_of(const Experiment& experiment, const Catalogue& catalogue, const Store* store,
                         const fs::path& folder) {
  return Plan(experiment, catalogue, store, folder).estimate();
}

}  // namespace marrow::cli
