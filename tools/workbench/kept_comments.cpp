// SPDX-License-Identifier: Apache-2.0
#include "workbench/case_files.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "marrow/base/error.hpp"
#include "marrow/base/yaml.hpp"
#include "workbench/yaml_text.hpp"

namespace marrow::workbench {
namespace {

bool is_quoted(const YAML::Node& scalar) { return scalar.Tag() == "!"; }

bool is_same_scalar(const YAML::Node& a, const YAML::Node& b) {
  double x = 0, y = 0;
  const bool a_is_number = !is_quoted(a) && YAML::convert<double>::decode(a, x);
  const bool b_is_number = !is_quoted(b) && YAML::convert<double>::decode(b, y);
  if (a_is_number || b_is_number) return a_is_number && b_is_number && x == y;
  if (is_quoted(a) == is_quoted(b)) return a.Scalar() == b.Scalar();
  bool truth = false;
  return a.Scalar() == b.Scalar() && !a.Scalar().empty() && a.Scalar() != "~" && a.Scalar() != "null" &&
         !YAML::convert<bool>::decode(is_quoted(a) ? b : a, truth);
}

/// The upper three rows of a transform's matrix, row by row; nothing if the map is no transform.
std::optional<std::vector<double>> transform_of(const YAML::Node& map) {
  std::vector<double> numbers;
  try {
    for (std::size_t row = 0; row < 3; ++row)
      if (map["matrix"]) {
        for (std::size_t column = 0; column < 4; ++column) numbers.push_back(map["matrix"][row][column].as<double>());
      } else if (map["rotation"] && map["translation_mm"]) {
        for (std::size_t column = 0; column < 3; ++column) numbers.push_back(map["rotation"][row][column].as<double>());
        numbers.push_back(map["translation_mm"][row].as<double>());
      } else {
        return std::nullopt;
      }
  } catch (const YAML::Exception&) {
    return std::nullopt;
  }
  return numbers;
}

bool says_same(const YAML::Node& a, const YAML::Node& b) {
  if (a.Type() != b.Type()) return false;
  if (a.IsScalar()) return is_same_scalar(a, b);
  if (a.IsMap())
    if (const auto one = transform_of(a); one && one == transform_of(b)) return true;
  if (a.size() != b.size()) return false;
  if (a.IsSequence()) {
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!says_same(a[i], b[i])) return false;
    return true;
  }
  for (const auto& entry : a) {
    const YAML::Node other = b[entry.first.Scalar()];
    if (!other.IsDefined() || !says_same(entry.second, other)) return false;
  }
  return true;
}

/// Whether '#' begins a comment here. Inside quotes the answer may be wrong: at worst, a text in quotes is reported as
/// a lost comment.
bool is_comment(const std::string& text, std::size_t at) {
  return text[at] == '#' && (at == 0 || text[at - 1] == ' ' || text[at - 1] == '\t' || text[at - 1] == '\n');
}

std::vector<std::string> comments_in(const std::string& text) {
  std::vector<std::string> comments;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (!is_comment(text, at)) continue;
    std::size_t end = std::min(text.size(), text.find('\n', at));
    if (end > at && text[end - 1] == '\r') --end;
    comments.push_back(text.substr(at, end - at));
    at = end;
  }
  return comments;
}

/// Collects changes of the older text.
class Merge {
 public:
  Merge(const std::string& older, const std::string& newer) : older_(older), newer_(newer) {}

  std::string text() {
    merge_maps(older_.root(), newer_.root());
    // From the end to the beginning. Of two changes at the same place, the one found first comes first in the text.
    std::reverse(changes_.begin(), changes_.end());
    std::stable_sort(changes_.begin(), changes_.end(), [](const auto& a, const auto& b) { return a.begin > b.begin; });
    std::string text = older_.text();
    for (const Change& change : changes_) text.replace(change.begin, change.end - change.begin, change.by);
    return text;
  }

 private:
  struct Change {
    std::size_t begin, end;
    std::string by;
  };

  /// The text of a value in the newer text: with the space before it, or on separate lines that begin at this column.
  std::string value_text(const YamlEntryText& entry, std::size_t column) const {
    const std::string text = newer_.text().substr(entry.value_begin, entry.value_end - entry.value_begin);
    if (newer_.text().substr(entry.colon, entry.value_begin - entry.colon).find('\n') == std::string::npos)
      return " " + text;
    const std::size_t from = newer_.column(entry.value_begin);
    std::string moved = older_.newline() + std::string(column, ' ');
    for (std::size_t i = 0; i < text.size(); ++i) {
      moved += text[i] == '\n' ? older_.newline() + std::string(column, ' ') : std::string(1, text[i]);
      if (text[i] == '\n') i += from;  // the emitter indents all lines of a value by at least this
    }
    return moved;
  }

  void replace(const YamlEntryText& before, const YamlEntryText& after) {
    changes_.push_back({before.colon + 1, before.value_end, value_text(after, older_.column(before.key_begin) + 2)});
  }

  void remove(const YamlEntryText& entry) {
    const std::size_t begin = older_.line_begin(entry.key_begin);
    if (older_.indent(begin) != older_.column(entry.key_begin)) throw Error("the entry begins an item of a list");
    const std::size_t end = older_.text().find('\n', older_.line_end(entry.value_end));
    changes_.push_back({begin, end == std::string::npos ? older_.text().size() : end + 1, ""});
  }

  void merge_maps(const YAML::Node& before, const YAML::Node& after) {
    const auto olds = older_.entries(before), news = newer_.entries(after);
    const YamlEntryText* last = nullptr;  // the last entry that stays
    for (const YamlEntryText& old : olds)
      if (find_entry(news, old.key)) last = &old;
    if (!last) throw Error("no entry stays, so there is no place for new ones");
    std::string added;
    const std::size_t column = older_.column(olds.front().key_begin);
    for (const YamlEntryText& one : news) {
      const YamlEntryText* old = find_entry(olds, one.key);
      if (old)
        merge_values(*old, one);
      else
        added += older_.newline() + std::string(column, ' ') +
                 newer_.text().substr(one.key_begin, one.colon + 1 - one.key_begin) + value_text(one, column + 2);
    }
    for (const YamlEntryText& old : olds)
      if (!find_entry(news, old.key)) remove(old);
    if (added.empty()) return;
    const std::size_t end = older_.line_end(last->value_end);
    changes_.push_back({end, end, added});
  }

  void merge_values(const YamlEntryText& before, const YamlEntryText& after) {
    const YAML::Node &old = before.value, &now = after.value;
    if (says_same(old, now)) return;
    const bool in_block = old.IsMap() && now.IsMap() && old.size() > 0 && !older_.is_flow(old) && now.size() > 0;
    const bool is_transform = in_block && transform_of(old);
    if (in_block && !is_transform) return merge_maps(old, now);
    if (!has_same_beginning(old, now)) return replace(before, after);
    for (std::size_t i = 0; i < old.size(); ++i)
      if (!says_same(old[i], now[i])) merge_maps(old[i], now[i]);
    if (now.size() > old.size()) append_items(before, after);
  }

  /// Whether both are lists of maps on lines of their own, and the newer list begins with the names of the older one.
  bool has_same_beginning(const YAML::Node& old, const YAML::Node& now) const {
    if (!old.IsSequence() || !now.IsSequence() || old.size() == 0 || now.size() < old.size()) return false;
    for (std::size_t i = 0; i < old.size(); ++i) {
      if (!old[i].IsMap() || !now[i].IsMap() || older_.is_flow(old[i]) || !old[i]["name"] || !now[i]["name"])
        return false;
      if (!says_same(old[i]["name"], now[i]["name"])) return false;
    }
    return true;
  }

  /// Adds the further items of the newer list behind the older list.
  void append_items(const YamlEntryText& before, const YamlEntryText& after) {
    const std::size_t dash_column = older_.column(before.value_begin);
    std::string added;
    for (std::size_t i = before.value.size(); i < after.value.size(); ++i) {
      const auto entries = newer_.entries(after.value[i]);
      for (std::size_t k = 0; k < entries.size(); ++k)
        added += older_.newline() + std::string(dash_column, ' ') + (k == 0 ? "- " : "  ") +
                 newer_.text().substr(entries[k].key_begin, entries[k].colon + 1 - entries[k].key_begin) +
                 value_text(entries[k], dash_column + 4);
    }
    const std::size_t end = older_.line_end(before.value_end);
    changes_.push_back({end, end, added});
  }

  const YamlText older_, newer_;
  std::vector<Change> changes_;
};

/// The comments and empty lines that a text begins with.
std::string head_of(const std::string& text) {
  std::size_t end = 0;
  while (end < text.size()) {
    const std::size_t first = text.find_first_not_of(" \t\r", end), next = text.find('\n', end);
    if (first == std::string::npos || (text[first] != '#' && text[first] != '\n')) break;
    end = next == std::string::npos ? text.size() : next + 1;
  }
  const std::string head = text.substr(0, end);
  return head.empty() || head.back() == '\n' ? head : head + "\n";
}

}  // namespace

KeptText with_comments_of(const std::string& older, const std::string& newer) {
  KeptText kept;
  try {
    Merge merge(older, newer);
    kept.text = merge.text();
    if (!says_same(parse_yaml(kept.text, {.aliases = false}), parse_yaml(newer, {.aliases = false}))) kept.text.clear();
  } catch (const std::exception&) {
    kept.text.clear();
  }
  if (kept.text.empty()) kept.text = head_of(older) + newer;
  std::vector<std::string> there = comments_in(kept.text);
  for (const std::string& comment : comments_in(older)) {
    const auto found = std::find(there.begin(), there.end(), comment);
    if (found == there.end())
      kept.lost.push_back(comment);
    else
      there.erase(found);
  }
  return kept;
}

}  // namespace marrow::workbench
