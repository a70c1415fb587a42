// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/run_recipe.hpp"

#include <cctype>
#include <cstdlib>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {
namespace {

/// Whether a path goes on with this character.
bool continues_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '-'; }

/// The text with $env:HOME in place of the user's home folder. In an option of a pipeline both mean the same.
std::string without_home(std::string text) {
  const char* variable = std::getenv("HOME");
  std::string home = variable ? variable : "";
  while (home.ends_with('/')) home.pop_back();
  if (!home.starts_with('/')) return text;
  const std::string name = "$env:HOME";
  for (std::size_t at = 0; (at = text.find(home, at)) != std::string::npos;) {
    const std::size_t end = at + home.size();
    const bool begins = at == 0 || !(continues_name(text[at - 1]) || text[at - 1] == '/');
    const bool is_home = begins && (end == text.size() || !continues_name(text[end]));
    if (is_home) text.replace(at, home.size(), name);
    at += is_home ? name.size() : home.size();
  }
  return text;
}

}  // namespace

std::string RunRecipe::text() const {
  std::string options = formatted("--seed {}", seed);
  if (file_limits.memory_mb > 0) options += " --file-memory " + exact_number(file_limits.memory_mb);
  if (file_limits.seconds > 0) options += " --file-seconds " + exact_number(file_limits.seconds);
  return "# The recipe of a run with marrow " + printable(version) +
         ".\n# As a file, it runs again by: marrow run FILE " + options + "\n" + without_home(pipeline);
}

RunRecipe recipe_of_run(const Pipeline& pipeline, const RunSettings& settings) {
  return {MARROW_VERSION, settings.seed, settings.file_limits, resolved_yaml(pipeline)};
}

}  // namespace marrow
