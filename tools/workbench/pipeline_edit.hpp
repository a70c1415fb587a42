// SPDX-License-Identifier: Apache-2.0
#pragma once
// Changes one thing in the text of a pipeline. Comments, layout and all other lines stay as they are.
#include <optional>
#include <string>

namespace marrow::workbench {

struct PipelineEdit {
  enum class What { option, wire, uses, may_fail };
  What what = What::option;
  std::string node;
  std::string name;                  ///< of the option or of the input
  std::optional<std::string> value;  ///< as YAML on one line; nothing: remove the entry

  /// What --set calls it: "edges.low", "edges.in.view", "edges.uses".
  std::string key() const;
  /// For people: "edges.low = 60", "edges.low removed".
  std::string in_words() const;
};

/// The text after the edit. Like --set, another `uses` also removes the options of the old node. Throws Error if the
/// node does not exist, the file has anchors, or the edited text would not read back as the same pipeline with only
/// this change.
std::string edited_text(const std::string& text, const PipelineEdit& edit);

/// A YAML scalar that reads back as this text: plain if possible, otherwise in double quotes.
std::string yaml_scalar(const std::string& text);

}  // namespace marrow::workbench
