// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <cctype>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// Without a limit, a long value that is named often fills memory, terminal and records.
constexpr std::size_t kMostInputBytes = 256'000;

const std::string kVariable = kEnvironmentVariable;

}  // namespace

std::optional<std::string> InputTexts::put_into(const std::string& text, const Place& place,
                                                const DeclaredInputs* inputs) {
  static const DeclaredInputs kNone;
  const DeclaredInputs& declared = inputs ? *inputs : kNone;
  const bool has_env = find_named(declared.all, "env") != nullptr;
  const auto fault = [&](const std::string& message, const std::string& hint) {
    diagnostics_.add(place, message, hint);
  };
  std::string result;
  bool known = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool doubled = text[i] == '$' && i + 1 < text.size() && text[i + 1] == '$';
    if (text[i] != '$' || doubled) {
      result += text[i];
      i += doubled;
      continue;
    }
    const bool is_variable = !has_env && text.compare(i, kVariable.size(), kVariable) == 0;
    const std::size_t begin = i + (is_variable ? kVariable.size() : 1);
    std::size_t end = begin;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_')) ++end;
    const std::string name = text.substr(begin, end - begin);
    const auto value = is_variable ? value_of_variable(name, fault) : value_of(name, place, declared);
    if (value && (bytes_ += value->size()) > kMostInputBytes) {
      diagnostics_.add(place,
                       formatted("the values of inputs make the pipeline longer than {} kB", kMostInputBytes / 1000),
                       "give shorter values, or name them less often");
      return std::nullopt;
    }
    known = known && value;
    if (value) result += *value;
    i = end - 1;
  }
  return known ? std::optional(result) : std::nullopt;
}

std::optional<std::string> InputTexts::value_of(const std::string& name, const Place& place,
                                                const DeclaredInputs& inputs) {
  const bool is_own = &inputs == pipeline_.inputs.get();
  if (is_own) used.insert(name);
  const auto value = inputs.values.find(name);
  if (value != inputs.values.end()) return value->second;
  if (contains(inputs.missing, name)) return std::nullopt;
  std::vector<std::string> names;
  for (const DeclaredInput& input : inputs.all)
    if (!input.data) names.push_back(input.name);
  const DeclaredInput* declared = find_named(inputs.all, name);
  diagnostics_.add(place,
                   declared ? "input " + in_quotes(name) + " is data of type " + declared->type + ", not a text"
                            : "the pipeline has no input " + in_quotes(name),
                   declared ? "wire it under  in:  by its name" : suggested(diagnostics_, name, names));
  if (is_own) unknown.insert(name);
  return std::nullopt;
}

}  // namespace marrow
