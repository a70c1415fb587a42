// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
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

namespace fs = std::filesystem;

/// The value of a key, or nothing. Unlike YAML::Node's operator, it never changes the map.
YAML::Node value_in(const YAML::Node& map, const std::string& key) {
  for (const auto& entry : map)
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  return YAML::Node(YAML::NodeType::Undefined);
}

class LayerReader {
 public:
  LayerReader(StrictYaml& yaml, Diagnostics& diagnostics) : yaml_(yaml), diagnostics_(diagnostics) {}

  LayeredExperiment read(const fs::path& file) {
    // reset(), because an assignment would change the files' own nodes.
    made_.root.reset(read_file(file));
    while (made_.root.IsMap()) {
      layers_.push_back(made_.root);
      const YAML::Node below = value_in(made_.root, "extends");
      if (!below.IsDefined()) break;
      const auto file_below = extended_file(yaml_, below, made_.files);
      made_.root.reset(file_below ? read_file(*file_below) : YAML::Node());
    }
    if (!made_.root.IsMap()) return std::move(made_);
    for (std::size_t i = layers_.size() - 1; i-- > 0;)
      made_.root.reset(merged(inherited(made_.root), layers_[i], "the experiment"));
    return std::move(made_);
  }

 private:
  /// A null node if the file cannot be read.
  YAML::Node read_file(const fs::path& file) {
    const auto text = read_source(file, "the experiment file", diagnostics_);
    if (!text) return YAML::Node();
    const std::size_t before = diagnostics_.size();
    const bool is_first = made_.files.empty();
    made_.files.push_back(file);
    if (is_first) made_.text = *text;
    const YAML::Node root = is_first ? yaml_.parse(*text) : yaml_.parse_also(file.string(), *text);
    if (diagnostics_.size() > before) return YAML::Node();
    if (!is_first) yaml_.map(root, {file.string(), 1, 1}, "the experiment");
    return root;
  }

  /// What a file takes over from the one below.
  static YAML::Node inherited(const YAML::Node& below) {
    YAML::Node rest(YAML::NodeType::Map);
    for (const auto& entry : below) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (key != "name" && key != "extends" && key != "experiment") rest.force_insert(entry.first, entry.second);
    }
    return rest;
  }

  YAML::Node merged(const YAML::Node& below, const YAML::Node& over, const std::string& what) {
    if (!below.IsMap() || !over.IsMap()) return over;
    YAML::Node all(YAML::NodeType::Map);
    std::set<std::string> known;
    for (const YamlEntry& entry : yaml_.map(over, {}, what)) known.insert(entry.key);  // its faults: keys given twice
    std::set<std::string> put;
    for (const auto& entry : below) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (!known.contains(key)) {
        all.force_insert(entry.first, entry.second);
        continue;
      }
      put.insert(key);
      for (const auto& own : over) {
        if (!own.first.IsScalar() || own.first.Scalar() != key) continue;
        if (!own.second.IsNull()) all.force_insert(own.first, merged(entry.second, own.second, in_quotes(key)));
        break;
      }
    }
    for (const auto& own : over)
      if (own.first.IsScalar() && known.contains(own.first.Scalar()) && put.insert(own.first.Scalar()).second)
        all.force_insert(own.first, own.second);
    return all;
  }

  StrictYaml& yaml_;
  Diagnostics& diagnostics_;
  LayeredExperiment made_;
  std::vector<YAML::Node> layers_;  ///< the file itself comes first
};

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

LayeredExperiment read_layers(StrictYaml& yaml, const fs::path& file, Diagnostics& diagnostics) {
  return LayerReader(yaml, diagnostics).read(file);
}

fs::path folder_of(const Place& place) { return fs::absolute(place.file).parent_path(); }

}  // namespace marrow::compare
