// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one way in which marrow reads YAML, whoever wrote the file. yaml-cpp 0.7 takes duplicate keys, does not merge
// `<<`, reads 010 as 8 and yes as true, and builds trees from a few aliases that fill the memory. Here none of this
// passes. Only files that read YAML include this header; it needs yaml-cpp.
#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace marrow {

/// What a text may hold. Lists and maps are never nested more than 100 deep, and never hold the character NUL.
struct YamlLimits {
  bool aliases = true;  ///< where they are allowed, they may repeat 100,000 values in all
  std::size_t most_values = std::numeric_limits<std::size_t>::max();
};

/// The one document of a text. Throws YAML::Exception with the place for what is no YAML or beyond the limits. An empty
/// text gives a null node.
YAML::Node parse_yaml(const std::string& text, const YamlLimits& limits = {});

/// "a map", "a list of 3", "nothing", "'text'", "the quoted text \"6\"": what a message says was got.
std::string yaml_described(const YAML::Node& node);

/// The value of a plain scalar; a quoted one is a text even where it looks like a number. Numbers are decimal and
/// finite. An integer has no leading zeros, because 010 means 8 to some and 10 to others. Nothing for anything else.
std::optional<double> yaml_number(const YAML::Node& node);
std::optional<std::int64_t> yaml_integer(const YAML::Node& node);
std::optional<bool> yaml_boolean(const YAML::Node& node);

/// Whether a scalar would be an integer without its leading zeros.
bool has_leading_zeros(const YAML::Node& node);

struct YamlFault {
  YAML::Mark mark;
  std::string text;
  std::string hint;  ///< may be empty
};
struct YamlKey {
  std::string name;
  YAML::Mark mark;
  YAML::Node value;
};
/// The keys of a map in their order, each once. A key that is no text, that is there already, that merges (`<<`) or
/// that cannot be printed is a fault and left out. `what` names the map in messages.
std::vector<YamlKey> yaml_keys(const YAML::Node& map, const std::string& what, std::vector<YamlFault>& faults);

}  // namespace marrow
