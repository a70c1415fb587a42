// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the parts of a YAML text, so that one part can be replaced while all others stay. yaml-cpp says where a value
// begins; this finds its end.
#include <yaml-cpp/yaml.h>
#include <string>
#include <vector>

namespace marrow::workbench {

/// One entry of a map. Places are bytes of the text.
struct YamlEntryText {
  std::string key;
  std::size_t key_begin = 0, colon = 0;
  std::size_t value_begin = 0, value_end = 0;  ///< both are behind the colon if the value is empty
  YAML::Node value;
};

/// nullptr if the map has no such key.
const YamlEntryText* find_entry(const std::vector<YamlEntryText>& entries, const std::string& key);

class YamlText {
 public:
  /// Throws Error if the text is not YAML, or uses anchors or aliases: a value then has several places.
  explicit YamlText(std::string text);

  const std::string& text() const { return text_; }
  const YAML::Node& root() const { return root_; }
  /// The entries of a map in their order. Throws Error if they cannot be told apart in the text.
  std::vector<YamlEntryText> entries(const YAML::Node& map) const;
  /// Whether the map is in braces.
  bool is_flow(const YAML::Node& map) const;
  /// The place of the closing brace of a map in braces.
  std::size_t closing_brace(const YAML::Node& map) const;

  std::size_t line_begin(std::size_t at) const;
  /// The place of the line's end, before "\n" or "\r\n".
  std::size_t line_end(std::size_t at) const;
  std::size_t column(std::size_t at) const { return at - line_begin(at); }
  /// The spaces at the beginning of the line.
  std::size_t indent(std::size_t at) const;
  /// The line break of the first line: "\n" or "\r\n".
  const std::string& newline() const { return newline_; }

 private:
  std::size_t begin_of(const YAML::Node& node) const;
  std::size_t end_of(const YAML::Node& node, bool in_flow, std::size_t parent_column) const;
  std::size_t end_of_scalar(std::size_t at, bool in_flow, std::size_t parent_column) const;
  std::size_t end_of_quoted(std::size_t at) const;
  std::size_t end_of_literal(std::size_t at, std::size_t parent_column) const;
  std::size_t end_of_plain(std::size_t at, bool in_flow, std::size_t parent_column) const;
  std::size_t end_of_plain_line(std::size_t at, bool in_flow) const;
  std::size_t end_of_flow(std::size_t at) const;
  std::size_t next_line(std::size_t at) const;
  std::size_t behind_spaces(std::size_t at) const;
  [[noreturn]] void refuse(std::size_t at, const std::string& why) const;

  std::string text_, newline_ = "\n";
  std::size_t mark_offset_ = 0;  ///< yaml-cpp does not count a byte order mark
  YAML::Node root_;
};

}  // namespace marrow::workbench
