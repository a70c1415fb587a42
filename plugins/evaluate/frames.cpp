// SPDX-License-Identifier: Apache-2.0
// Sums up the figures of merit of all frames of a sequence.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::TrackState;

struct Options {
  std::vector<std::string> figures{"mtre_mm", "frontal_deg", "lateral_deg", "axial_deg"};
};

double value_of(const Metrics& metrics, const std::string& name, const std::string& frame) {
  std::string known;
  for (const Metric& metric : metrics.items) {
    if (metric.name == name) return metric.value;
    known += (known.empty() ? "" : ", ") + metric.name;
  }
  throw Error("frame '" + frame + "' has no figure '" + name + "'; there are " + known);
}

Metrics frames(const List<Metrics>& metrics, const List<TrackState>* states, const Options& options) {
  if (states && states->names() != metrics.names())
    throw Error(
        formatted("the states are of other frames than the figures: {} and {}", states->size(), metrics.size()));
  Metrics result;
  std::vector<bool> counts(metrics.size(), true);
  if (states)
    for (std::size_t i = 0; i < metrics.size(); ++i) counts[i] = (*states)[i].is_found();
  const auto lost = std::count(counts.begin(), counts.end(), false);
  result.items.push_back({"frames", double(metrics.size()), ""});
  if (states) result.items.push_back({"frames_lost", double(lost), ""});
  if (std::size_t(lost) == metrics.size()) return result;
  for (const std::string& name : options.figures) {
    std::vector<double> values;
    double squares = 0;
    for (std::size_t i = 0; i < metrics.size(); ++i) {
      if (!counts[i]) continue;
      values.push_back(std::abs(value_of(metrics[i], name, metrics.name(i))));
      squares += values.back() * values.back();
    }
    std::sort(values.begin(), values.end());
    const std::string unit = name.ends_with("_mm") ? "mm" : name.ends_with("_deg") ? "deg" : "";
    result.items.push_back({"median_" + name, quantile_of_sorted(values, 0.5), unit});
    result.items.push_back({"p95_" + name, quantile_of_sorted(values, 0.95), unit});
    result.items.push_back({"worst_" + name, values.back(), unit});
    result.items.push_back({"rms_" + name, std::sqrt(squares / double(values.size())), unit});
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.frames", frames)
      .summary("Figures of merit of a sequence: median, 95th percentile, worst and root mean square over its frames")
      .in("metrics", "figures of each frame", over("frame"))
      .in("states", "state after each frame; if given, only frames in which the bone was found count", over("frame"))
      .out("metrics",
           "number of frames and of lost ones; of the absolute values of each figure: median_NAME, p95_NAME, "
           "worst_NAME, rms_NAME")
      .figures({"frames", "frames_lost", "median_*", "p95_*", "worst_*", "rms_*"})
      .option("figures", &Options::figures, "names of the figures");
}
