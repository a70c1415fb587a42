// SPDX-License-Identifier: Apache-2.0
#include "experiment_layers.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/nearest_file.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostLayers = 8;

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
      made_.root.reset(read_below(below));
    }
    if (!made_.root.IsMap()) return std::move(made_);
    for (std::size_t i = layers_.size() - 1; i-- > 0;)
      made_.root.reset(merged(inherited(made_.root), layers_[i], "the experiment"));
    return std::move(made_);
  }

 private:
  /// A null node if the file cannot be read.
  YAML::Node read_file(const fs::path& file) {
    std::error_code ignored;
    whole_.push_back(fs::weakly_canonical(file, ignored));
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

  YAML::Node read_below(const YAML::Node& name) {
    const Place place = yaml_.place(name);
    const auto text = yaml_.text(name, place, "extends");
    if (!text) return YAML::Node();
    const fs::path file = (made_.files.back().parent_path() / *text).lexically_normal();
    std::error_code ignored;
    const fs::path whole = fs::weakly_canonical(file, ignored);
    if (std::find(whole_.begin(), whole_.end(), whole) != whole_.end()) {
      std::string circle;
      for (const fs::path& one : whole_) circle += one.filename().string() + " extends ";
      yaml_.fault(place, "the files extend each other in a circle: " + circle + whole.filename().string(),
                  "one of them must stand alone");
    } else if (whole_.size() == kMostLayers) {
      yaml_.fault(place, formatted("more than {} files extend each other", kMostLayers));
    } else if (text->empty() || !fs::exists(file, ignored)) {
      yaml_.fault(place, "there is no file " + in_quotes(*text) + " to extend", nearest_file(file));
    } else {
      return read_file(file);
    }
    return YAML::Node();
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
  std::vector<fs::path> whole_;
};

}  // namespace

LayeredExperiment read_layers(StrictYaml& yaml, const fs::path& file, Diagnostics& diagnostics) {
  return LayerReader(yaml, diagnostics).read(file);
}

fs::path folder_of(const Place& place) { return fs::absolute(place.file).parent_path(); }

}  // namespace marrow::compare
