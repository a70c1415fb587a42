// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writing a YAML file anew without losing what people wrote beside its values.
#include <string>
#include <vector>

namespace marrow::workbench {

struct KeptText {
  std::string text;
  std::vector<std::string> lost;  ///< comments of the older text that are not in it, each from its '#' on
};

/// A text that says what `newer` says, in the words of `older` wherever both say the same: comments, layout and order
/// of those parts stay. Maps are compared key by key; of lists of maps with a `name`, the items that both begin with. A
/// transform may be written by a rotation and a shift in one and by a matrix in the other. Where `older` cannot be
/// changed part by part (it is no YAML, or has anchors), the result is `newer` under the comments that `older` begins
/// with.
KeptText with_comments_of(const std::string& older, const std::string& newer);

}  // namespace marrow::workbench
