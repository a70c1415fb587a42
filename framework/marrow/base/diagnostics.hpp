// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "marrow/base/names.hpp"

namespace MARROW_EXPORT marrow {

/// A place in a file, with 1-based line and column. Line 0 means that there is no line (a command-line argument).
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

struct Diagnostic {
  Place place;
  std::string message;  ///< what is wrong, what was found and what was expected
  std::string hint;     ///< what to do; may be empty
};

/// Collects all faults of a file, so that they can be shown together. The first 1000 are kept, the others only counted.
class Diagnostics {
 public:
  void add(Place place, const std::string& message, const std::string& hint = {});
  /// Adds the faults of another collection that are not here yet.
  void add_all(const Diagnostics& other);
  bool empty() const { return items_.empty(); }
  /// Whether further faults will only be counted. A hint for them is then not worth computing.
  bool is_full() const;
  /// The number of faults that were found, kept or not.
  std::size_t size() const { return items_.size() + not_kept_; }
  /// The faults that were kept, sorted by file, line and column.
  std::vector<Diagnostic> sorted() const;
  /// The first 50 faults as text: for each file:line:column and the message, the source line with a caret, and the
  /// hint. Control characters are escaped.
  std::string text() const;
  /// Remembers a file's text, so that text() can show its lines.
  void remember(const std::string& file, const std::string& text) { sources_[file] = text; }

 private:
  std::vector<Diagnostic> items_;
  std::size_t not_kept_ = 0;
  std::map<std::string, std::string> sources_;
};

}  // namespace marrow
