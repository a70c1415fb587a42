// SPDX-License-Identifier: Apache-2.0
#include "failure_model.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::verdict {
namespace {

using files::YamlFile, files::YamlMap;

/// A number that must lie in a range; a value outside is a fault.
double number_within(const YamlMap& map, const std::string& key, double least, double most) {
  const auto value = map.number(key);
  if (!value) return least;
  if (!(*value >= least && *value <= most)) {
    const std::string text = formatted(": expected a number from {:g} to {:g}, got {:g}", least, most, *value);
    map.fault(key, key + text);
  }
  return *value;
}

FailureModel::Term term_from(YamlFile& file, const YAML::Node& node, std::size_t number) {
  const YamlMap map(file, node, formatted("term {}", number), {"figure", "scale", "weight", "absent"});
  FailureModel::Term term;
  term.figure = map.text("figure").value_or("");
  term.scale = number_within(map, "scale", 1e-6, 1e6);
  term.weight = number_within(map, "weight", 0, 1e6);
  term.absent = number_within(map, "absent", 0, 1e6);
  return term;
}

}  // namespace

std::vector<FailureModel::Contribution> FailureModel::contributions(const Evidence& evidence) const {
  std::vector<Contribution> all;
  for (const Term& term : terms) {
    const auto found =
        std::find_if(evidence.begin(), evidence.end(), [&](const Metric& one) { return one.name == term.figure; });
    const Metric* const figure = found == evidence.end() ? nullptr : &*found;
    const double value = figure ? figure->value : term.absent;
    all.push_back({&term, figure, term.weight * std::log1p(std::max(0.0, value) / term.scale)});
  }
  return all;
}

double FailureModel::probability(const std::vector<Contribution>& contributions) const {
  double log_odds = bias;
  for (const Contribution& one : contributions) log_odds += one.log_odds;
  return 1 / (1 + std::exp(-log_odds));
}

FailureModel read_failure_model(const std::filesystem::path& path) {
  YamlFile file(path);
  const YamlMap map(file, file.root(), "failure model",
                    {"marrow-failure-model", "record", "bias", "doubtful_above", "wrong_above", "terms"});
  check_version(map, "marrow-failure-model");
  FailureModel model;
  map.text("record");
  model.bias = number_within(map, "bias", -1e6, 1e6);
  model.doubtful_above = number_within(map, "doubtful_above", 0, 1);
  model.wrong_above = number_within(map, "wrong_above", 0, 1);
  if (model.doubtful_above > model.wrong_above)
    map.fault("doubtful_above", "doubtful_above: expected at most wrong_above");
  if (const auto list = map.required("terms")) {
    if (!list->IsSequence() || list->size() == 0)
      map.fault("terms", "terms: expected a list of terms, each with figure, scale, weight and absent");
    else
      for (const auto& item : *list) model.terms.push_back(term_from(file, item, model.terms.size() + 1));
  }
  file.finish();
  return model;
}

}  // namespace marrow::verdict
