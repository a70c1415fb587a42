// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>
#include <optional>
#include <string>

#include "marrow/base/printable.hpp"

namespace marrow {

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
