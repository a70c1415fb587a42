// SPDX-License-Identifier: Apache-2.0
// What all frames of a sequence have in common. An error that differs from frame to frame shows in their scatter. One
// that is the same in all, such as that of a camera or of a surface's frame, does not: it is the mean of a figure that
// should be 0.
#include <algorithm>
#include <cmath>
#include <marrow/base/names.hpp>
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

struct Options {
  std::vector<std::string> figures;
  double certain_errors = 4;
};

/// The values of a figure over the frames: their mean, its standard error, and the standard deviation between frames.
struct Common {
  double mean = 0, error = 0, rest = 0;

  explicit Common(const std::vector<double>& values) {
    for (const double value : values) mean += value / double(values.size());
    double squares = 0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    rest = std::sqrt(squares / double(values.size() - 1));
    error = rest / std::sqrt(double(values.size()));
  }
};

const Metric* find(const Metrics& metrics, const std::string& name) {
  const auto found = std::find_if(metrics.items.begin(), metrics.items.end(),
                                  [&](const Metric& metric) { return metric.name == name; });
  return found == metrics.items.end() ? nullptr : &*found;
}

std::vector<std::string> names_of(const List<Metrics>& metrics, const Options& options) {
  if (!options.figures.empty()) return options.figures;
  std::vector<std::string> names;
  for (const Metric& metric : metrics[0].items) names.push_back(metric.name);
  return names;
}

std::vector<double> values_of(const List<Metrics>& metrics, const std::string& name) {
  std::vector<double> values;
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    const Metric* metric = find(metrics[i], name);
    if (!metric) {
      std::vector<std::string> known;
      for (const Metric& one : metrics[i].items) known.push_back(one.name);
      throw Error("frame '" + metrics.name(i) + "' has no figure '" + name + "'; " + suggestion(name, known));
    }
    if (!std::isfinite(metric->value))
      throw Error("frame '" + metrics.name(i) + "': '" + name + "' is no finite number; leave this frame out");
    values.push_back(metric->value);
  }
  return values;
}

Metrics common_offset(const List<Metrics>& metrics, const Options& options, Context& context) {
  if (metrics.size() < 3)
    throw Error(formatted("there are {} frames; it takes at least 3 to tell what they have in common", metrics.size()));
  Metrics result;
  result.items.push_back({"frames", double(metrics.size()), ""});
  for (const std::string& name : names_of(metrics, options)) {
    const Common common(values_of(metrics, name));
    const std::string unit = find(metrics[0], name)->unit;
    const bool stands_out = std::abs(common.mean) > std::max(common.rest, options.certain_errors * common.error);
    result.items.push_back({"common_" + name, common.mean, unit});
    result.items.push_back({"error_" + name, common.error, unit});
    result.items.push_back({"rest_" + name, common.rest, unit});
    if (stands_out)
      context.warn(
          formatted("all {} frames have in common: {} {:.3g} {}, known to {:.2g}; without it they scatter by {:.2g}",
                    metrics.size(), name, common.mean, unit, common.error, common.rest));
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.common_offset", common_offset)
      .summary(
          "What all frames of a sequence have in common: the mean of each signed figure, how exactly it is known, and "
          "what remains without it")
      .in("metrics",
          "signed figures of each frame, at least 3, such as those of evaluate.outline_offset, or of "
          "evaluate.pose_difference from a reference",
          over("frame"))
      .out("metrics",
           "the number of frames; of each figure: common_NAME, its mean; error_NAME, the mean's standard error, as if "
           "frames were independent; rest_NAME, the standard deviation between frames. A mean that stands out gives a "
           "warning")
      .figures({"frames", "common_*", "error_*", "rest_*"})
      .option("figures", &Options::figures, "names of the figures; none: all")
      .option("certain_errors", &Options::certain_errors,
              "a mean stands out if it is larger than this many of its standard errors, and than the deviation between "
              "frames",
              at_least(1), at_most(100));
}
