// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "marrow/domain/names.hpp"

namespace marrow {

/// A place in a file: 1-based line and column; line 0 where there is none (a command-line argument).
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

struct Diagnostic {
  Place place;
  std::string message;  ///< what is wrong, with what was got and expected
  std::string hint;     ///< what to do; may be empty
};

/// Collects all faults of a file, so that they are shown together. The first 1000 are kept, the others counted.
class Diagnostics {
 public:
  void add(Place place, std::string message, std::string hint = {});
  /// Those of another collection that are not here yet.
  void add_all(const Diagnostics& other);
  bool empty() const { return items_.empty(); }
  /// Whether others will only be counted, so that a hint is not worth looking for.
  bool is_full() const;
  /// All that were found, kept or not.
  std::size_t size() const { return items_.size() + not_kept_; }
  /// Those that were kept, by file, line and column.
  std::vector<Diagnostic> sorted() const;
  /// file:line:column: message, the source line with a caret, and the hint, for each of the first 50; control
  /// characters are written out.
  std::string text() const;
  /// Remembers a file's text, so that its lines can be shown.
  void remember(const std::string& file, const std::string& text) { sources_[file] = text; }

 private:
  std::vector<Diagnostic> items_;
  std::size_t not_kept_ = 0;
  std::map<std::string, std::string> sources_;
};

}  // namespace marrow
