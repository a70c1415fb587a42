// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pieces that the sections of an experiment file are made of.
#include <string>
#include <utility>
#include <vector>

#include "marrow/compare/experiment.hpp"
#include "runtime/strict_yaml.hpp"

namespace marrow::compare {

using PlacedTexts = std::vector<std::pair<std::string, Place>>;

/// A list of texts.
PlacedTexts texts_of(StrictYaml& yaml, const YamlEntry& entry);
/// name: value of inputs.
std::vector<InputValue> inputs_of(StrictYaml& yaml, const YamlEntry& section);
/// node.option: value and the like. `what` names the section in messages.
std::vector<Override> patches_of(StrictYaml& yaml, const YamlEntry& section, const std::string& what);
/// A patch's value as it is written on the command line.
std::string patch_value(const YAML::Node& value);
/// What a node uses goes first: it drops the options that were written for another one.
void put_uses_first(std::vector<Override>& patches);

/// An integer in a range; the least where it is none.
std::uint64_t count_of(StrictYaml& yaml, const YamlEntry& entry, std::int64_t least, std::int64_t most);
/// A number from 0 to `most`; 0 where it is none.
double limit_of(StrictYaml& yaml, const YamlEntry& entry, double most);

inline constexpr std::size_t kMostNameBytes = 100;
/// Whether a name can be part of a cell's name and be a folder's; a fault where not.
bool check_name(StrictYaml& yaml, const std::string& name, const Place& place, const std::string& what);
/// The same for names that differ by the case of their letters alone: to some file systems they are one.
std::string in_small_letters(std::string name);
/// The file that a key names, from the experiment's folder. Empty where there is none.
std::filesystem::path file_of(StrictYaml& yaml, const YamlEntry& entry, const std::filesystem::path& folder);

}  // namespace marrow::compare
