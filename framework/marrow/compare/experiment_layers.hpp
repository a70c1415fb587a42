// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/strict_yaml.hpp"

namespace marrow::compare {

/// An experiment file with the files that it extends.
struct LayeredExperiment {
  YAML::Node root;                           ///< a map; if the file cannot be read, null
  std::string text;                          ///< of the file itself
  std::vector<std::filesystem::path> files;  ///< all that were read; the file itself comes first
};

/// Reads the files, and puts the entries of each over those of the file that it extends: maps are merged, anything else
/// is replaced, and null removes an entry of the file below. A file's name is its own.
LayeredExperiment read_layers(StrictYaml& yaml, const std::filesystem::path& file, Diagnostics& diagnostics);

/// The folder of the file that a place is in.
std::filesystem::path folder_of(const Place& place);

}  // namespace marrow::compare
