// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include <algorithm>

#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kMostLooks = 200;
constexpr const char* kSuccess = "success";

}  // namespace

void StopReader::read(const YamlEntry& section) {
  static const std::vector<std::string> kKeys{"figure", "width",      "difference", "variant",
                                              "alpha",  "most_cases", "look_every"};
  place_ = most_place_ = section.place;
  for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'stop'", &kKeys)) {
    const auto named = [&] { return Named{yaml_.text(entry.value, entry.place, entry.key).value_or(""), entry.place}; };
    if (entry.key == "figure") figure_ = named();
    if (entry.key == "difference") difference_ = named();
    if (entry.key == "variant") variant_ = named();
    if (entry.key == "width") {
      width_ = Named{entry.key, entry.place};
      rule_.width = yaml_.number(entry.value, entry.place, entry.key).value_or(1);
      if (!(rule_.width > 0)) yaml_.fault(entry.place, "'width' must be above 0, got " + short_number(rule_.width, 6));
    }
    if (entry.key == "alpha") {
      alpha_ = Named{entry.key, entry.place};
      rule_.alpha = yaml_.number(entry.value, entry.place, entry.key).value_or(0.05);
      if (!(rule_.alpha >= 0.001 && rule_.alpha <= 0.5))
        yaml_.fault(entry.place, "'alpha' must be 0.001 to 0.5, got " + short_number(rule_.alpha, 6));
    }
    if (entry.key == "most_cases") {
      most_place_ = entry.place;
      rule_.most_cases = count_of(yaml_, entry, 1, 100000);
    }
    if (entry.key == "look_every") rule_.look_every = count_of(yaml_, entry, 1, 100000);
  }
  if (section.value.IsMap()) check_keys(section);
}

void StopReader::check_keys(const YamlEntry& section) {
  is_given_ = true;
  if (figure_.has_value() == difference_.has_value())
    yaml_.fault(
        section.place, "'stop' must name either a figure or a difference",
        "write it as  stop: {figure: errors.distal.final.mtre_mm, width: 0.05, most_cases: 300, look_every: 20} "
        " or  {difference: errors.distal.final.mtre_mm, most_cases: 300, look_every: 20}");
  if (figure_ && !difference_ && !width_)
    yaml_.fault(section.place, "'stop' does not say how wide the interval may be", "add  width: 0.05");
  for (const auto& [one, other] : {std::pair(&width_, &figure_), {&variant_, &difference_}, {&alpha_, &difference_}})
    if (*one && !*other && (figure_ || difference_))
      yaml_.fault((*one)->place, one == &width_     ? "'width' belongs to a figure, not to a difference"
                                 : one == &variant_ ? "'variant' belongs to a difference, not to a figure"
                                                    : "'alpha' belongs to a difference, not to a figure");
  if (!rule_.most_cases) yaml_.fault(section.place, "'stop' does not say where it ends", "add  most_cases: 300");
  if (!rule_.look_every) yaml_.fault(section.place, "'stop' does not say how often to look", "add  look_every: 20");
}

void StopReader::apply(Experiment& experiment, std::size_t starts) {
  if (!is_given_ || (!figure_ && !difference_) || !rule_.most_cases || !rule_.look_every) return;
  StopRule rule = rule_;
  rule.goal = figure_ ? StopRule::Goal::width : StopRule::Goal::difference;
  rule.first_cases = experiment.cases.size() - experiment.more_cases;
  find_figure(experiment, rule);
  if (rule.goal == StopRule::Goal::difference) find_variant(experiment, rule);
  check_cases(experiment, rule, starts);
  experiment.stop = rule;
}

void StopReader::find_figure(const Experiment& experiment, StopRule& rule) {
  const Named& asked = figure_ ? *figure_ : *difference_;
  std::vector<std::string> names;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    names.push_back(experiment.metrics[m].path);
    if (names.back() == asked.name) rule.metric = m;
  }
  if (figure_) names.push_back(kSuccess);
  if (rule.metric || asked.name.empty()) return;
  if (!figure_ || asked.name != kSuccess)
    return yaml_.fault(asked.place, "'" + asked.name + "' is not among the metrics", suggestion(asked.name, names));
  if (!experiment.defines_success())
    return yaml_.fault(asked.place, "there is no success rate to wait for: no figure has a limit under 'success'",
                       "add  success: {" + (names.size() > 1 ? names[0] : "FIGURE") + ": 2}");
  if (rule.width > 1)
    yaml_.fault(width_ ? width_->place : asked.place,
                "the interval of a success rate is never wider than 1, got " + short_number(rule.width, 6));
}

void StopReader::find_variant(const Experiment& experiment, StopRule& rule) {
  std::vector<std::string> names;
  std::optional<std::size_t> found;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
    if (v == experiment.baseline) continue;
    names.push_back(experiment.variants[v].name);
    if (!variant_ || variant_->name == names.back()) found = v;
  }
  if (names.empty())
    return yaml_.fault(difference_->place, "there is no variant beside the baseline to differ from it");
  if (!variant_ && names.size() > 1)
    return yaml_.fault(place_, "'stop' does not say which variant must differ from the baseline",
                       "add  variant: " + names[0]);
  if (!found)
    return yaml_.fault(variant_->place, "there is no variant '" + variant_->name + "' beside the baseline",
                       suggestion(variant_->name, names));
  rule.variant = *found;
}

void StopReader::check_cases(const Experiment& experiment, const StopRule& rule, std::size_t starts) {
  const bool has_seeds = std::any_of(experiment.cases.begin(), experiment.cases.end(),
                                     [](const ExperimentCase& one) { return one.folder.empty(); });
  if (experiment.cases.empty()) return;
  if (!has_seeds)
    return yaml_.fault(place_, "'stop' needs cases that are made from seeds, because only these can become more",
                       "use  cases: {simulate: ...}  or  {seeds: 1..20}");
  if (rule.most_cases < rule.first_cases)
    return yaml_.fault(most_place_, formatted("'most_cases' is {}, but there are {} cases already", rule.most_cases,
                                              rule.first_cases));
  if (const std::size_t looks = rule.looks().size(); looks > kMostLooks)
    yaml_.fault(place_, formatted("the rule makes {} looks, at most {} are possible", looks, kMostLooks),
                formatted("look at more cases at once, as  look_every: {}",
                          (rule.most_cases - rule.first_cases) / (kMostLooks - 1) + 1));
  const double cells = double(experiment.variants.size()) * double(rule.most_cases) * double(starts);
  if (cells > double(kMostCells))
    yaml_.fault(most_place_, formatted("with {} cases there would be {} cells, at most {} can be compared",
                                       rule.most_cases, std::size_t(cells), kMostCells));
}

}  // namespace marrow::compare
