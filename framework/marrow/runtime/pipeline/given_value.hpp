// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values that come as texts: from --set, from an experiment, from a call in Python.
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/printable.hpp"

namespace MARROW_EXPORT marrow {

/// The value that a text stands for. A text that begins with [, {, " or ' is a list, a map or a quoted text in one line
/// of YAML. Any other text is taken letter by letter: nothing in it is a comment, an anchor, a tag or an empty value.
/// The option that gets it decides whether it is a number or a boolean. If a text begins as a list, a map or a quoted
/// text but is something else, this is a fault at `place`, and there is no value.
std::optional<YAML::Node> given_value(const std::string& text, const Place& place, Diagnostics& diagnostics);

/// The text that stands for a value of a YAML file: given_value() makes the same value of it.
std::string text_to_give(const YAML::Node& value);

inline constexpr const char* kEnvironmentVariable = "$env:";  ///< stands before its name

/// The value of an environment variable. If there is none, calls fault(message, hint) and returns nothing.
template <class Fault>
std::optional<std::string> value_of_variable(const std::string& name, const Fault& fault) {
  if (name.empty())
    fault("$env: names no environment variable", "write it as  $env:NAME");
  else if (const char* value = std::getenv(name.c_str()))
    return value;
  else
    fault("the environment has no variable " + in_quotes(name), "set it, as in  export " + name + "=...");
  return std::nullopt;
}

}  // namespace marrow
