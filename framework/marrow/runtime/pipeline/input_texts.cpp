// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/input_texts.hpp"

#include <cctype>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// Without a limit, a long value that is named often fills memory, terminal and records.
constexpr std::size_t kMostInputBytes = 256'000;

}  // namespace

std::optional<std::string> InputTexts::put_into(const std::string& text, const Place& place) {
  std::string result;
  bool known = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool doubled = text[i] == '$' && i + 1 < text.size() && text[i + 1] == '$';
    if (text[i] != '$' || doubled) {
      result += text[i];
      i += doubled;
      continue;
    }
    std::size_t end = i + 1;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_')) ++end;
    const std::string* value = value_of(text.substr(i + 1, end - i - 1), place);
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

const std::string* InputTexts::value_of(const std::string& name, const Place& place) {
  used.insert(name);
  const auto input = pipeline_.inputs.find(name);
  if (input != pipeline_.inputs.end()) return &input->second;
  if (contains(pipeline_.missing_inputs, name)) return nullptr;
  std::string hint;
  if (!diagnostics_.is_full()) {
    std::vector<std::string> names = pipeline_.missing_inputs;
    for (const auto& [known, value] : pipeline_.inputs) names.push_back(known);
    hint = suggestion(name, names);
  }
  diagnostics_.add(place, "the pipeline has no input " + in_quotes(name), hint);
  unknown.insert(name);
  return nullptr;
}

}  // namespace marrow
