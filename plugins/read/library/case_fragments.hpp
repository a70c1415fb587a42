// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fragments of a case file: what each is made from, its start and its truth.
#include <filesystem>
#include <marrow/plugin.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::read {

/// What a case's folder holds. Fragments are given in one of three ways, so two of `seeds`, `label` and `surface` are
/// empty.
struct CaseFiles {
  std::optional<Volume> ct;
  List<Seeds> seeds;
  List<Volume> label;
  List<Mesh> surface;
  List<View> views;
  List<geometry::CameraDeviations> camera_deviations;  ///< of each view, also if nothing is stated
  List<Pose> start;
  List<Truth> truth;
  std::vector<std::string> registered;  ///< names of the fragments whose pose is wanted
  bool has_seeds = false;               ///< whether a fragment is given by seeds, or by nothing at all

  bool can_lack_ct() const { return !registered.empty() && !has_seeds; }
};

/// The file that a key names. The key of the node's result covers only the content of the case's folder, so a file
/// outside the folder is a fault.
std::optional<std::filesystem::path> file_in(const std::filesystem::path& folder, const files::YamlMap& map,
                                             const std::string& key);

/// Calls a reader. An Error that it throws becomes a fault at the key.
template <class Read>
auto read_or_fault(const files::YamlMap& map, const std::string& key, Read read) -> std::optional<decltype(read())> {
  try {
    return read();
  } catch (const Error& error) {
    map.fault(key, key + ": " + error.what());
    return std::nullopt;
  }
}

/// Reads `labels` and `fragments` of a case. Faults are noted in the map's file.
void read_fragments(const std::filesystem::path& folder, const files::YamlMap& map, CaseFiles& result,
                    Context& context);

}  // namespace marrow::read
