// SPDX-License-Identifier: Apache-2.0
#pragma once
// Readers for the parts of the sections of an experiment file.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/strict_yaml.hpp"
#include "marrow/compare/experiment.hpp"

namespace marrow::compare {

using PlacedTexts = std::vector<std::pair<std::string, Place>>;

/// A name that a file gives, and where.
struct Named {
  std::string name;
  Place place;
};

/// Reads a list of texts.
PlacedTexts texts_of(StrictYaml& yaml, const YamlEntry& entry);
/// Reads values of inputs, written as name: value, or as name: $env:VARIABLE.
std::vector<InputValue> inputs_of(StrictYaml& yaml, const YamlEntry& section);
/// Reads changes of a pipeline, written as node.option: value and so on. `what` names the section in messages.
std::vector<Override> patches_of(StrictYaml& yaml, const YamlEntry& section, const std::string& what);
/// The value of a change, as it is written on the command line. No value is a fault.
std::string changed_value(StrictYaml& yaml, const std::string& key, const YAML::Node& value, const Place& place);
/// Moves changes of `uses` to the front, because such a change drops the options that the file gives to the replaced
/// node.
void put_uses_first(std::vector<Override>& patches);

/// Reads an integer in a range. Reports a fault and returns the least one for any other value.
std::uint64_t count_of(StrictYaml& yaml, const YamlEntry& entry, std::int64_t least, std::int64_t most);
/// Reads a number from 0 to `most`. Reports a fault and returns 0 for any other value.
double limit_of(StrictYaml& yaml, const YamlEntry& entry, double most);

inline constexpr std::size_t kMostNameBytes = 100;
/// Whether a name can be a part of a cell's name and the name of a folder. Reports a fault if not.
bool check_name(StrictYaml& yaml, const std::string& name, const Place& place, const std::string& what);
/// The name in small letters. To some file systems, names that differ only in the case of their letters are the same.
std::string in_small_letters(std::string name);
/// Sets `number` to that of the variant with this name. Reports a fault if there is none.
void find_variant(StrictYaml& yaml, const Experiment& experiment, const Named& asked, std::size_t& number);
/// The number of the metric with this path. Reports a fault if there is none.
std::optional<std::size_t> find_metric(StrictYaml& yaml, const Experiment& experiment, const Named& asked);
std::vector<Named> names_of_options(const std::vector<SweptOption>& options);
/// The file that a key names, relative to the file that the key is in. If there is none, reports a fault and returns an
/// empty path.
std::filesystem::path file_of(StrictYaml& yaml, const YamlEntry& entry);

}  // namespace marrow::compare
