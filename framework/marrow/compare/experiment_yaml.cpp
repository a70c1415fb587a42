// SPDX-License-Identifier: Apache-2.0
#include "experiment_yaml.hpp"

#include "experiment_layers.hpp"

#include <algorithm>

#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_path.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/environment_variable.hpp"
#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::compare {

namespace fs = std::filesystem;

PlacedTexts texts_of(StrictYaml& yaml, const YamlEntry& entry) {
  PlacedTexts result;
  if (!entry.value.IsSequence()) {
    yaml.fault(entry.place, "'" + entry.key + "' must be a list", "write it as  " + entry.key + ": [a, b]");
    return result;
  }
  for (const YAML::Node& item : entry.value)
    if (const auto text = yaml.text(item, yaml.place(item), "an item of '" + entry.key + "'"))
      result.emplace_back(*text, yaml.place(item));
  return result;
}

namespace {

/// A text as it is, or for $env:NAME the environment variable NAME.
std::string with_variable(StrictYaml& yaml, const std::string& text, const Place& place) {
  const std::string variable = kEnvironmentVariable;
  if (!text.starts_with(variable)) return text;
  const auto fault = [&](const std::string& message, const std::string& hint) { yaml.fault(place, message, hint); };
  return value_of_variable(text.substr(variable.size()), fault).value_or(text);
}

}  // namespace

std::vector<InputValue> inputs_of(StrictYaml& yaml, const YamlEntry& section) {
  std::vector<InputValue> result;
  for (const YamlEntry& entry : yaml.map(section.value, section.place, "'" + section.key + "'")) {
    if (entry.value.IsScalar())
      result.push_back({entry.key, with_variable(yaml, entry.value.Scalar(), entry.place), entry.place});
    else
      yaml.fault(entry.place, "'" + entry.key + "' must be one value");
  }
  return result;
}

std::string changed_value(StrictYaml& yaml, const std::string& key, const YAML::Node& value, const Place& place) {
  if (!value.IsNull()) return text_to_give(value);
  yaml.fault(place, "'" + key + "' has no value", "an empty text is written as ''");
  return "";
}

void put_uses_first(std::vector<Override>& patches) {
  std::stable_partition(patches.begin(), patches.end(), [](const Override& one) { return one.key.ends_with(".uses"); });
}

std::vector<Override> patches_of(StrictYaml& yaml, const YamlEntry& section, const std::string& what) {
  std::vector<Override> result;
  if (section.value.IsNull()) return result;
  for (const YamlEntry& entry : yaml.map(section.value, section.place, what))
    result.push_back({entry.key, changed_value(yaml, entry.key, entry.value, entry.place), entry.place});
  put_uses_first(result);
  return result;
}

std::uint64_t count_of(StrictYaml& yaml, const YamlEntry& entry, std::int64_t least, std::int64_t most) {
  const auto value = yaml.integer(entry.value, entry.place, entry.key);
  if (!value) return std::uint64_t(least);
  if (*value >= least && *value <= most) return std::uint64_t(*value);
  yaml.fault(entry.place, formatted("'{}' must be {} to {}, got {}", entry.key, least, most, *value));
  return std::uint64_t(least);
}

double limit_of(StrictYaml& yaml, const YamlEntry& entry, double most) {
  const auto value = yaml.number(entry.value, entry.place, entry.key);
  if (!value) return 0;
  if (*value >= 0 && *value <= most) return *value;
  yaml.fault(entry.place, formatted("'{}' must be 0 to {:.6g}, got {:.6g}", entry.key, most, *value));
  return 0;
}

bool check_name(StrictYaml& yaml, const std::string& name, const Place& place, const std::string& what) {
  const std::string fault = fault_of_name(name);
  if (!fault.empty())
    yaml.fault(place, what + " becomes a file name: " + in_quotes(name) + " cannot be one, " + fault, kNameHint);
  return fault.empty();
}

std::string in_small_letters(std::string name) {
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return name;
}

void find_variant(StrictYaml& yaml, const Experiment& experiment, const Named& asked, std::size_t& number) {
  const Variant* found = find_named(experiment.variants, asked.name);
  if (!found)
    return yaml.fault(asked.place, "there is no variant '" + asked.name + "'",
                      suggestion(asked.name, names_of(experiment.variants)));
  number = std::size_t(found - experiment.variants.data());
}

std::optional<std::size_t> find_metric(StrictYaml& yaml, const Experiment& experiment, const Named& asked) {
  std::vector<std::string> paths;
  for (const MetricChoice& metric : experiment.metrics) paths.push_back(metric.path);
  const auto found = std::find(paths.begin(), paths.end(), asked.name);
  if (found != paths.end()) return std::size_t(found - paths.begin());
  yaml.fault(asked.place, "'" + asked.name + "' is not among the metrics", suggestion(asked.name, paths));
  return std::nullopt;
}

std::vector<Named> names_of_options(const std::vector<SweptOption>& options) {
  std::vector<Named> names;
  for (const SweptOption& option : options) names.push_back({option.key, option.place});
  return names;
}

fs::path file_of(StrictYaml& yaml, const YamlEntry& entry) {
  const auto text = yaml.text(entry.value, entry.place, entry.key);
  if (!text) return {};
  if (text->empty()) {
    yaml.fault(entry.place, "'" + entry.key + "' is empty", "name a file; the path starts at the experiment's file");
    return {};
  }
  fs::path file = plain_path(folder_of(entry.place) / *text);
  std::error_code error;
  if (fs::is_regular_file(file, error)) return file;
  yaml.fault(entry.place, "there is no file '" + *text + "'", "the path starts at the experiment's file");
  return {};
}

}  // namespace marrow::compare
