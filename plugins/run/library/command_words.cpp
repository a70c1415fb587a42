// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/command_words.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::run {
namespace {

std::string filled_word(const std::string& word, const std::function<std::string(const Placeholder&)>& file_of) {
  std::string filled;
  for (std::size_t at = 0; at < word.size(); ++at) {
    if (word.compare(at, 2, "{{") == 0 || word.compare(at, 2, "}}") == 0) {
      filled += word[at++];
      continue;
    }
    if (word[at] != '{') {
      filled += word[at];
      continue;
    }
    const std::size_t end = word.find('}', at);
    if (end == word.npos)
      throw Error("the word " + in_quotes(word) + " of the command has a { without a }; write {{ for the character {");
    const std::string inside = word.substr(at + 1, end - at - 1);
    const std::size_t dot = inside.find('.');
    filled += file_of({inside.substr(0, dot), dot == inside.npos ? "" : inside.substr(dot + 1)});
    at = end;
  }
  return filled;
}

}  // namespace

std::vector<std::string> filled_words(const std::vector<std::string>& words,
                                      const std::function<std::string(const Placeholder&)>& file_of) {
  std::vector<std::string> filled;
  for (const std::string& word : words) filled.push_back(filled_word(word, file_of));
  return filled;
}

}  // namespace marrow::run
