// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>

#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kMostOptions = 6, kMostPoints = 10000;
constexpr const char* kTuneExample =
    "write it as  tune: {options: {edges.high: [60, 90]}, optimizer: {uses: NAME}, points: 40, training_cases: 20}";
constexpr const char* kOptimizerHint = "add  optimizer: {uses: NAME};  marrow list optimizer  shows which there are";
constexpr const char* kTuned = "tuned";

}  // namespace

std::string add_tuned(Experiment& experiment, const std::vector<double>& values) {
  const TuneRule& rule = *experiment.tune;
  Variant variant = experiment.variants[rule.variant];
  variant.name = kTuned;
  variant.levels.clear();  // its options are not those of the matrix
  variant.swept = values;
  for (std::size_t o = 0; o < values.size(); ++o) {
    variant.name += "+" + exact_number(values[o]);
    variant.overrides.push_back({rule.options[o].key, exact_number(values[o]), rule.options[o].place});
  }
  experiment.variants.push_back(variant);
  return variant.name;
}

bool add_tuned(Experiment& experiment, const std::string& name) {
  if (!experiment.tune || !name.starts_with(std::string(kTuned) + "+")) return false;
  std::vector<double> values;
  const char *at = name.data() + std::string(kTuned).size(), *const end = name.data() + name.size();
  while (at != end && *at == '+') {
    double value = 0;
    const auto [stop, failure] = std::from_chars(at + 1, end, value);
    if (failure != std::errc()) return false;
    values.push_back(value);
    at = stop;
  }
  const std::vector<SweptOption>& options = experiment.tune->options;
  if (at != end || values.size() != options.size()) return false;
  for (std::size_t o = 0; o < values.size(); ++o)
    if (!(values[o] >= options[o].range[0] && values[o] <= options[o].range[1])) return false;
  if (add_tuned(experiment, values) == name) return true;
  experiment.variants.pop_back();  // the same numbers, written in another way
  return false;
}

void keep_training_cases(Experiment& experiment) { experiment.cases.resize(experiment.tune->training_cases); }

void keep_held_out_cases(Experiment& experiment) {
  experiment.cases.erase(experiment.cases.begin(),
                         experiment.cases.begin() + std::ptrdiff_t(experiment.tune->training_cases));
}

void TuneReader::read(const YamlEntry& section) {
  static const std::vector<std::string> kKeys{"options", "figure",    "failed_as",     "variant",
                                              "points",  "optimizer", "training_cases"};
  place_ = cases_place_ = rule_.optimizer_place = section.place;
  for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'tune'", &kKeys)) {
    const auto named = [&] { return Named{yaml_.text(entry.value, entry.place, entry.key).value_or(""), entry.place}; };
    if (entry.key == "options")
      for (const YamlEntry& option : yaml_.map(entry.value, entry.place, "'options'"))
        rule_.options.push_back(swept_option_of(yaml_, option));
    if (entry.key == "figure") figure_ = named();
    if (entry.key == "variant") variant_ = named();
    if (entry.key == "failed_as") {
      failed_as_ = yaml_.number(entry.value, entry.place, entry.key).value_or(std::nan(""));  // was said
      failed_as_place_ = entry.place;
    }
    if (entry.key == "points") rule_.points = count_of(yaml_, entry, 1, kMostPoints);
    if (entry.key == "training_cases") {
      cases_place_ = entry.place;
      rule_.training_cases = count_of(yaml_, entry, 1, 100000);
    }
    if (entry.key == "optimizer") read_optimizer(entry);
  }
  if (section.value.IsMap()) check_keys(section);
}

/// As a node of a pipeline is written: {uses: KIND.NAME, with: {OPTION: VALUE}}.
void TuneReader::read_optimizer(const YamlEntry& section) {
  static const std::vector<std::string> kKeys{"uses", "with"};
  rule_.optimizer_place = section.place;
  has_optimizer_ = true;
  bool has_uses = false;
  for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'optimizer'", &kKeys)) {
    has_uses |= entry.key == "uses";
    if (entry.key == "uses") rule_.optimizer = yaml_.text(entry.value, entry.place, "uses").value_or(rule_.optimizer);
    if (entry.key == "with")
      for (const YamlEntry& option : yaml_.map(entry.value, entry.place, "'with'"))
        rule_.optimizer_options.emplace_back(option.key, changed_value(yaml_, option.key, option.value, option.place));
  }
  if (section.value.IsMap() && !has_uses)
    yaml_.fault(section.place, "'optimizer' does not name its node", kOptimizerHint);
}

void TuneReader::check_keys(const YamlEntry& section) {
  is_given_ = true;
  if (rule_.options.empty()) return yaml_.fault(section.place, "'tune' names no option", kTuneExample);
  if (rule_.options.size() > kMostOptions)
    return yaml_.fault(section.place,
                       formatted("'tune' has {} options, at most {} are possible", rule_.options.size(), kMostOptions));
  if (!has_optimizer_) return yaml_.fault(section.place, "'tune' does not name its optimizer", kOptimizerHint);
  if (!rule_.points)
    return yaml_.fault(section.place, "'tune' does not say how many points may be tried", "add  points: 40");
  if (!rule_.training_cases)
    return yaml_.fault(section.place, "'tune' does not say how many cases are for training", "add  training_cases: 20");
  is_good_ = true;
}

/// The tuned variant is named after its values, and variants are told apart by their names.
void TuneReader::check_names(const Experiment& experiment) {
  for (const Variant& variant : experiment.variants)
    if (in_small_letters(variant.name).starts_with(std::string(kTuned) + "+"))
      yaml_.fault(
          variant.place,
          "variant '" + variant.name + "' is named as the points of 'tune' are, so its runs would count as theirs",
          "rename it");
}

void TuneReader::add_variant(Experiment& experiment) const {
  if (is_given_ && experiment.variants.empty()) experiment.variants.push_back({"untuned", place_, {}});
}

void TuneReader::apply(Experiment& experiment, std::size_t starts) {
  if (!is_given_) return;
  for (const auto& [key, is_there] :
       {std::pair("stop", experiment.stop.has_value()), {"sweep", !experiment.swept.empty()}})
    if (is_there)
      return yaml_.fault(place_, "'tune' beside '" + std::string(key) + "'", "make two experiments of them");
  if (!is_good_ || experiment.metrics.empty() || experiment.cases.empty()) return;
  TuneRule rule = rule_;
  find_figure(experiment, rule);
  rule.variant = experiment.baseline;
  if (variant_) find_variant(yaml_, experiment, *variant_, rule.variant);
  check_cases(experiment, rule, starts);
  check_names(experiment);
  const Variant& tuned = experiment.variants[rule.variant];
  refuse_replaced(yaml_, "the option", options_set_by("variant '" + tuned.name + "'", tuned.overrides),
                  {"'tune'", names()});
  experiment.tune = rule;
}

void TuneReader::find_figure(const Experiment& experiment, TuneRule& rule) {
  if (figure_) {
    const auto found = find_metric(yaml_, experiment, *figure_);
    if (!found) return;
    rule.metric = *found;
  }
  find_failed_as(experiment.metrics[rule.metric], rule);
}

void TuneReader::find_failed_as(const MetricChoice& metric, TuneRule& rule) {
  const bool higher = metric.higher_is_better();
  if (!failed_as_ && (higher || !(metric.limit > 0.0)))
    return yaml_.fault(place_, "'tune' does not say what a failed run counts as",
                       "add  failed_as:  with a bad value of " + metric.path +
                           (higher ? "" : "; with a limit above 0 under 'success' it is ten times that limit"));
  rule.failed_as = failed_as_ ? *failed_as_ : 10 * *metric.limit;
  if (metric.better == MetricChoice::Better::nearest_zero) rule.failed_as = std::abs(rule.failed_as);
  const bool is_success = metric.limit && (higher ? rule.failed_as > *metric.limit : rule.failed_as < *metric.limit);
  if (is_success)
    yaml_.fault(failed_as_place_,
                formatted("a failed run would count as {:.6g}, which is a success: the limit of {} is {:.6g}",
                          rule.failed_as, metric.path, *metric.limit),
                "let  failed_as  be a value that is no success");
}

void TuneReader::check_cases(const Experiment& experiment, const TuneRule& rule, std::size_t starts) {
  if (rule.training_cases >= experiment.cases.size())
    return yaml_.fault(cases_place_, formatted("{} training cases of {} leave none that is held out",
                                               rule.training_cases, experiment.cases.size()));
  const double cells = double(rule.points) * double(rule.training_cases) * double(starts);
  if (cells > double(kMostCells))
    yaml_.fault(place_,
                formatted("{} cells for training are more than the {} that can be compared", short_number(cells, 6),
                          kMostCells),
                "take fewer points, training cases or starts");
}

}  // namespace marrow::compare
