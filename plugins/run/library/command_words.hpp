// SPDX-License-Identifier: Apache-2.0
#pragma once
// The words of a command, with the places of files in them: {volume.nii.gz}.
#include <functional>
#include <string>
#include <vector>

namespace marrow::run {

/// A place in a word: {name.format}, or {name}.
struct Placeholder {
  std::string name, format;
  std::string text() const { return "{" + name + (format.empty() ? "" : "." + format) + "}"; }
};

/// The words with each place replaced by what `file_of` returns for it. {{ stands for {, and }} for }. Throws Error for
/// a { without its }.
std::vector<std::string> filled_words(const std::vector<std::string>& words,
                                      const std::function<std::string(const Placeholder&)>& file_of);

}  // namespace marrow::run
