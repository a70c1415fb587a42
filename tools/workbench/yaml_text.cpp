// SPDX-License-Identifier: Apache-2.0
#include "workbench/yaml_text.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/yaml.hpp"

namespace marrow::workbench {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_break(char c) { return c == '\n' || c == '\r'; }
bool is_flow_indicator(char c) { return c == ',' || c == '[' || c == ']' || c == '{' || c == '}'; }

}  // namespace

const YamlEntryText* find_entry(const std::vector<YamlEntryText>& entries, const std::string& key) {
  const auto found = std::find_if(entries.begin(), entries.end(), [&](const auto& one) { return one.key == key; });
  return found == entries.end() ? nullptr : &*found;
}

YamlText::YamlText(std::string text) : text_(std::move(text)) {
  if (text_.starts_with("\xEF\xBB\xBF")) mark_offset_ = 3;
  const std::size_t first = text_.find('\n');
  if (first != std::string::npos && first > 0 && text_[first - 1] == '\r') newline_ = "\r\n";
  try {
    root_.reset(parse_yaml(text_, {.aliases = false}));
  } catch (const YAML::Exception& fault) {
    throw Error(formatted("line {}: {}; change it in the text", fault.mark.line + 1, printable(fault.msg)));
  }
}

void YamlText::refuse(std::size_t at, const std::string& why) const {
  throw Error(formatted("line {}: {}; change it in the text",
                        1 + std::count(text_.begin(), text_.begin() + std::ptrdiff_t(at), '\n'), why));
}

std::size_t YamlText::line_begin(std::size_t at) const {
  while (at > 0 && text_[at - 1] != '\n') --at;
  return at;
}

std::size_t YamlText::line_end(std::size_t at) const {
  while (at < text_.size() && text_[at] != '\n') ++at;
  if (at > 0 && at < text_.size() && text_[at - 1] == '\r') --at;
  return at;
}

std::size_t YamlText::next_line(std::size_t at) const {
  const std::size_t end = text_.find('\n', at);
  return end == std::string::npos ? text_.size() : end + 1;
}

std::size_t YamlText::indent(std::size_t at) const {
  const std::size_t begin = line_begin(at);
  return behind_spaces(begin) - begin;
}

std::size_t YamlText::behind_spaces(std::size_t at) const {
  while (at < text_.size() && is_blank(text_[at])) ++at;
  return at;
}

std::size_t YamlText::begin_of(const YAML::Node& node) const {
  return std::min(text_.size(), std::size_t(std::max(0, node.Mark().pos)) + mark_offset_);
}

bool YamlText::is_flow(const YAML::Node& map) const {
  const std::size_t at = begin_of(map);
  return at < text_.size() && text_[at] == '{';
}

std::size_t YamlText::closing_brace(const YAML::Node& map) const { return end_of_flow(begin_of(map)) - 1; }

std::vector<YamlEntryText> YamlText::entries(const YAML::Node& map) const {
  const bool in_flow = is_flow(map);
  std::vector<YamlEntryText> entries;
  std::set<std::string> keys;
  for (const auto& pair : map) {
    YamlEntryText entry;
    entry.key_begin = begin_of(pair.first);
    if (!pair.first.IsScalar()) refuse(entry.key_begin, "a key is no text");
    entry.key = pair.first.Scalar();
    if (!keys.insert(entry.key).second) refuse(entry.key_begin, "the key " + in_quotes(entry.key) + " occurs twice");
    entry.colon = behind_spaces(end_of_scalar(entry.key_begin, in_flow, text_.size()));
    if (entry.colon >= text_.size() || text_[entry.colon] != ':')
      refuse(entry.key_begin, "behind the key " + in_quotes(printable(entry.key)) + " there is no colon on its line");
    entry.value.reset(pair.second);
    entry.value_begin = pair.second.IsNull() ? behind_spaces(entry.colon + 1) : begin_of(pair.second);
    const char first = entry.value_begin < text_.size() ? text_[entry.value_begin] : '\n';
    if (pair.second.IsNull() && (is_break(first) || first == '#' || (in_flow && is_flow_indicator(first))))
      entry.value_begin = entry.value_end = entry.colon + 1;
    else
      entry.value_end = end_of(pair.second, in_flow, column(entry.key_begin));
    if (pair.second.IsNull() && entry.value_end < entry.value_begin) entry.value_end = entry.value_begin;
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::size_t YamlText::end_of(const YAML::Node& node, bool in_flow, std::size_t parent_column) const {
  const std::size_t begin = begin_of(node);
  if (begin >= text_.size()) return begin;
  if (text_[begin] == '{' || text_[begin] == '[') return end_of_flow(begin);
  if (node.IsMap() && node.size()) return entries(node).back().value_end;
  if (node.IsSequence() && node.size()) {
    const YAML::Node last = node[node.size() - 1];
    if (last.IsNull()) refuse(begin, "the last item of a list is empty");
    return end_of(last, false, column(begin));
  }
  return end_of_scalar(begin, in_flow, parent_column);
}

std::size_t YamlText::end_of_scalar(std::size_t at, bool in_flow, std::size_t parent_column) const {
  const char first = at < text_.size() ? text_[at] : '\n';
  if (first == '"' || first == '\'') return end_of_quoted(at);
  if (!in_flow && (first == '|' || first == '>')) return end_of_literal(at, parent_column);
  return end_of_plain(at, in_flow, parent_column);
}

std::size_t YamlText::end_of_quoted(std::size_t at) const {
  const char quote = text_[at];
  for (std::size_t i = at + 1; i < text_.size(); ++i) {
    if (quote == '"' && text_[i] == '\\')
      ++i;
    else if (text_[i] == quote && quote == '\'' && i + 1 < text_.size() && text_[i + 1] == quote)
      ++i;
    else if (text_[i] == quote)
      return i + 1;
  }
  return text_.size();
}

/// A text behind | or >. It continues while lines are empty or indented more than its key.
std::size_t YamlText::end_of_literal(std::size_t at, std::size_t parent_column) const {
  std::size_t end = line_end(at);
  for (std::size_t line = next_line(at); line < text_.size(); line = next_line(line)) {
    const std::size_t first = behind_spaces(line);
    if (first < text_.size() && is_break(text_[first])) continue;
    if (first - line <= parent_column) break;
    end = line_end(line);
  }
  return end;
}

/// The end of the part of a plain scalar on this line, without the spaces behind it.
std::size_t YamlText::end_of_plain_line(std::size_t at, bool in_flow) const {
  std::size_t end = at;
  for (std::size_t i = at; i < text_.size() && !is_break(text_[i]); ++i) {
    const char c = text_[i], next = i + 1 < text_.size() ? text_[i + 1] : '\n';
    if (c == '#' && i > at && is_blank(text_[i - 1])) break;
    if (c == ':' && (is_blank(next) || is_break(next) || (in_flow && is_flow_indicator(next)))) break;
    if (in_flow && is_flow_indicator(c)) break;
    if (!is_blank(c)) end = i + 1;
  }
  return end;
}

std::size_t YamlText::end_of_plain(std::size_t at, bool in_flow, std::size_t parent_column) const {
  std::size_t end = end_of_plain_line(at, in_flow);
  // It may continue on the next lines. A key never does: its parent's column is then the end of the text.
  while (parent_column < text_.size() && behind_spaces(end) == line_end(end)) {
    std::size_t line = next_line(end);
    while (line < text_.size() && is_break(text_[behind_spaces(line)])) line = next_line(line);
    const std::size_t first = behind_spaces(line);
    if (first >= text_.size() || text_[first] == '#' || (in_flow && is_flow_indicator(text_[first]))) break;
    if (!in_flow && first - line <= parent_column) break;
    end = end_of_plain_line(first, in_flow);
  }
  return end;
}

/// The place behind the brace or bracket that closes the one here.
std::size_t YamlText::end_of_flow(std::size_t at) const {
  int depth = 0;
  for (std::size_t i = at; i < text_.size();) {
    const char c = text_[i];
    if (c == '{' || c == '[') {
      ++depth, ++i;
    } else if (c == '}' || c == ']') {
      ++i;
      if (--depth == 0) return i;
    } else if (c == '#' && (i == 0 || is_blank(text_[i - 1]) || is_break(text_[i - 1]))) {
      i = next_line(i);
    } else if (is_blank(c) || is_break(c) || c == ',' || c == ':') {
      ++i;
    } else if (c == '"' || c == '\'') {
      i = end_of_quoted(i);
    } else {
      i = std::max(i + 1, end_of_plain_line(i, true));
    }
  }
  refuse(at, "a brace is not closed");
}

}  // namespace marrow::workbench
