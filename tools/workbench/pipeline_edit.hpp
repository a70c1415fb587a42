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
  std::optional<std::string> value;  ///< as YAML on one line; nothing: what is written there is taken out

  /// What --set calls it: "edges.low", "edges.in.view", "edges.uses".
  std::string key() const;
  /// For people: "edges.low = 60", "edges.low taken out".
  std::string in_words() const;
};

/// The text after the edit. Another `uses` also takes out the options that were written for the node before, as --set
/// does. Throws Error, and the text is left alone, if the node is not there, the file has anchors, or the edited text
/// would not read back as the same pipeline with only this change.
std::string edited_text(const std::string& text, const PipelineEdit& edit);

/// A text as a YAML scalar that reads back as this text: plain where possible, otherwise in double quotes.
std::string yaml_scalar(const std::string& text);

}  // namespace marrow::workbench
