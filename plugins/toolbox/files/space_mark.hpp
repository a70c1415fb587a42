// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string_view>

namespace marrow::files {

/// What the comments of a surface's file say about its coordinates. 3D Slicer writes SPACE=LPS or SPACE=RAS into them.
/// The first such mark of a file counts, because later ones tell where it came from ("converted from SPACE=RAS").
class SpaceMark {
 public:
  /// Looks for marks in a comment. The comments must be given in the order of the file.
  void look_into(std::string_view comment);
  bool is_ras() const { return first_ == Space::ras; }
  /// Whether a later mark says the opposite of the first one.
  bool is_contradicted() const { return is_contradicted_; }

 private:
  enum class Space { unknown, lps, ras };
  Space first_ = Space::unknown;
  bool is_contradicted_ = false;
};

}  // namespace marrow::files
