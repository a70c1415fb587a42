// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a YAML file again and keeps the comments of people.
#include <string>
#include <vector>

namespace marrow::workbench {

struct KeptText {
  std::string text;
  std::vector<std::string> lost;  ///< comments of the older text that are not in `text`, each from its '#'
};

/// A text with the content of `newer`. Parts with the same content in both are taken from `older`, with their comments,
/// layout and order. Maps are compared key by key. In lists of maps with a `name`, the items at the beginning of both
/// are compared. A transform may be a rotation and a shift in one text and a matrix in the other. If `older` cannot be
/// changed part by part (it is not YAML, or has anchors), the result is `newer` below the first comments of `older`.
KeptText with_comments_of(const std::string& older, const std::string& newer);

}  // namespace marrow::workbench
