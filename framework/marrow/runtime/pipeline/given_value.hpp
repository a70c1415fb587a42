// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values that are given as texts: by --set, by an experiment, by a call from Python.
#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The value that a text stands for. A text that begins with [, {, " or ' is a list, a map or a quoted text, as YAML
/// writes it in one line. Any other text is itself, letter by letter: nothing in it is a comment, an anchor, a tag or
/// an empty value. Whether it is a number or a boolean is decided by the option that gets it. If a text begins as a
/// list, a map or a quoted text and is none, that is a fault at `place`, and there is no value.
std::optional<YAML::Node> given_value(const std::string& text, const Place& place, Diagnostics& diagnostics);

/// The text that stands for a value of a YAML file: given_value() makes the same value of it.
std::string text_to_give(const YAML::Node& value);

}  // namespace marrow
