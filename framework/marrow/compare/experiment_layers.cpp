// SPDX-License-Identifier: Apache-2.0
#include "experiment_layers.hpp"

#include <set>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/extended_file.hpp"

namespace marrow::compare {
namespace {

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

LayeredExperiment read_layers(StrictYaml& yaml, const fs::path& file, Diagnostics& diagnostics) {
  return LayerReader(yaml, diagnostics).read(file);
}

fs::path folder_of(const Place& place) { return fs::absolute(place.file).parent_path(); }

}  // namespace marrow::compare
