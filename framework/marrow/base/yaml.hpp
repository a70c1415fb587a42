// SPDX-License-Identifier: Apache-2.0
#pragma once
// The only way in which marrow reads YAML, no matter who wrote the file. yaml-cpp 0.7 accepts duplicate keys, does not
// merge `<<`, reads 010 as 8 and yes as true, and builds trees that fill the memory from a few aliases. The functions
// here prevent all of this. Only files that read YAML include this header, because it needs yaml-cpp.
#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Limits of a YAML text. Lists and maps may never be nested more than 100 deep, and no scalar may hold the character
/// NUL.
struct YamlLimits {
  bool aliases = true;  ///< whether aliases are allowed; they may repeat 100,000 values in total
  std::size_t most_values = std::numeric_limits<std::size_t>::max();
};

/// Parses a text with one document. An empty text gives a null node. Throws YAML::Exception with the place if the text
/// is not YAML, has more than one document, exceeds the limits, or has a tag or an anchor that no alias names: `&a b`
/// and `! b` would be read as b.
YAML::Node parse_yaml(const std::string& text, const YamlLimits& limits = {});

/// Describes a node for a message that says what was found: "a map", "a list of 3", "nothing", "'text'", "the quoted
/// text \"6\"".
std::string yaml_described(const YAML::Node& node);

/// The value of a plain scalar, or nothing for anything else. A quoted scalar is a text even if it looks like a number.
/// Numbers are decimal and finite. An integer has no leading zeros, because 010 means 8 to some people and 10 to
/// others.
std::optional<double> yaml_number(const YAML::Node& node);
std::optional<std::int64_t> yaml_integer(const YAML::Node& node);
std::optional<bool> yaml_boolean(const YAML::Node& node);

/// Whether a scalar would be an integer if it had no leading zeros.
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
/// The keys of a map in their order, each once. A key is left out and added to `faults` if it is not a scalar, occurs
/// twice, is a merge key (`<<`) or has characters that cannot be printed. `what` names the map in messages.
std::vector<YamlKey> yaml_keys(const YAML::Node& map, const std::string& what, std::vector<YamlFault>& faults);

}  // namespace marrow
