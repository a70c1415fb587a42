// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/unclosed.hpp"

#include <cctype>
#include <vector>

namespace marrow {
namespace {

/// Whether a bracket or quote after this character begins something. Inside a word, as in "bone's", it is text.
bool begins_after(char before) {
  return std::isspace(static_cast<unsigned char>(before)) || before == '{' || before == '[' || before == ',';
}

}  // namespace

std::optional<Unclosed> last_unclosed(const std::string& text) {
  std::vector<Unclosed> open;
  int line = 1, column = 0;
  bool in_comment = false;
  char before = '\n';
  for (std::size_t i = 0; i < text.size(); before = text[i++]) {
    const char c = text[i];
    ++column;
    if (c == '\n') {
      ++line;
      column = 0;
      in_comment = false;
    }
    const bool quoted = !open.empty() && (open.back().mark == '"' || open.back().mark == '\'');
    if (in_comment) continue;
    if (quoted) {
      // An escaped character does not end a quote. An escaped line break still counts as a line.
      if (c == '\\' && open.back().mark == '"' && text.compare(i + 1, 1, "\n") != 0)
        ++i, ++column;
      else if (c == open.back().mark)
        open.pop_back();
      continue;
    }
    if (c == '#' && std::isspace(static_cast<unsigned char>(before))) in_comment = true;
    if ((c == '{' || c == '[' || c == '"' || c == '\'') && begins_after(before)) open.push_back({c, line, column});
    if ((c == '}' || c == ']') && !open.empty()) {
      if (open.back().mark != (c == '}' ? '{' : '[')) break;
      open.pop_back();
    }
  }
  if (open.empty()) return std::nullopt;
  return open.back();
}

}  // namespace marrow
