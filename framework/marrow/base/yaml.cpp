// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/yaml.hpp"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

constexpr std::size_t kMostLevels = 100;
constexpr std::size_t kMostRepeated = 100'000;  // values that aliases may repeat

[[noreturn]] void refuse(const YAML::Mark& mark, const std::string& why) { throw YAML::Exception(mark, why); }

/// Counts values and levels of nesting as if every alias were written out. It runs before a tree is built. It also
/// refuses what YAML would silently remove from a text: a tag ("! b", "!!str 5"), and an anchor ("&a b") that no alias
/// names.
class Survey : public YAML::EventHandler {
 public:
  Survey(const std::string& text, const YamlLimits& limits) : text_(text), limits_(limits) {}
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++) refuse(mark, "the file goes on after the end of its first document; keep one document per file");
  }
  void OnDocumentEnd() override {
    if (!unnamed_.empty())
      refuse(unnamed_.begin()->second,
             "this begins with an anchor (&name) that no alias (*name) names; put quotes around a text that begins so");
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(mark, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& text) override {
    expect_no_tag(mark, tag);
    if (text.find('\0') != std::string::npos)  // file names and messages would end there
      refuse(mark, "a text holds the character NUL (\\0); take it out");
    add(mark, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    expect_no_tag(mark, tag);
    open(mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    expect_no_tag(mark, tag);
    open(mark, anchor);
  }
  void OnMapEnd() override { close(); }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    expect_no_anchor(mark, anchor);
    unnamed_.erase(anchor);
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) refuse(mark, "an alias names the list or map that contains it");
    repeated_ += found->second.values;
    if (repeated_ > kMostRepeated)
      refuse(mark,
             formatted("aliases repeat more than {} values; write out what is meant, or less of it", kMostRepeated));
    count(mark, found->second);
  }

 private:
  struct Extent {
    std::size_t values = 1, levels = 0;
  };
  struct Open {
    YAML::anchor_t anchor;
    Extent extent;
  };

  void expect_no_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor && !limits_.aliases)
      refuse(mark, "anchors and aliases (&name, *name) are not read; write the value out");
  }
  /// A quoted text has the tag "!", too.
  void expect_no_tag(const YAML::Mark& mark, const std::string& tag) const {
    const std::size_t at = std::size_t(mark.pos);
    const bool is_written = tag == "!" ? at < text_.size() && text_[at] == '!' : !tag.empty() && tag != "?";
    if (is_written) refuse(mark, "tags (! or !!name) are not read; put quotes around a text that begins so");
  }
  void enter(const YAML::Mark& mark, YAML::anchor_t anchor) {
    expect_no_anchor(mark, anchor);
    if (anchor) unnamed_.emplace(anchor, mark);
    if (++values_ > limits_.most_values) refuse(mark, formatted("it has more than {} values", limits_.most_values));
  }
  void add(const YAML::Mark& mark, YAML::anchor_t anchor) {
    enter(mark, anchor);
    if (anchor) anchored_[anchor] = {};
    count(mark, {});
  }
  void open(const YAML::Mark& mark, YAML::anchor_t anchor) {
    enter(mark, anchor);
    open_.push_back({anchor, {1, 1}});
    check_levels(mark, 0);
  }
  void close() {
    const Open last = open_.back();
    open_.pop_back();
    if (last.anchor) anchored_[last.anchor] = last.extent;
    if (!open_.empty()) merge(last.extent);
  }
  void count(const YAML::Mark& mark, const Extent& extent) {
    check_levels(mark, extent.levels);
    if (!open_.empty()) merge(extent);
  }
  void merge(const Extent& inner) {
    Extent& outer = open_.back().extent;
    outer.values += inner.values;
    outer.levels = std::max(outer.levels, inner.levels + 1);
  }
  void check_levels(const YAML::Mark& mark, std::size_t below) const {
    if (open_.size() + below > kMostLevels)
      refuse(mark, formatted("lists and maps are nested more than {} deep", kMostLevels));
  }

  const std::string& text_;
  const YamlLimits limits_;
  std::map<YAML::anchor_t, YAML::Mark> unnamed_;  ///< anchors that no alias has named yet
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Extent> anchored_;
  std::size_t values_ = 0, repeated_ = 0;
  int documents_ = 0;
};

/// Throws if a tab indents the line in which a fault was found. The parser seldom says that this is the reason.
void refuse_tab(const std::string& text, YAML::Mark mark) {
  std::istringstream lines(text);
  std::string line;
  for (int i = 0; i <= mark.line; ++i) std::getline(lines, line);
  const std::size_t tab = line.find('\t');
  if (tab == std::string::npos || tab != line.find_first_not_of(' ')) return;
  mark.column = int(tab);
  throw YAML::ParserException(mark, "a tab indents this line; write spaces instead");
}

/// A quoted scalar has the tag "!".
bool is_plain(const YAML::Node& node) { return node.IsScalar() && node.Tag() != "!"; }

}  // namespace

YAML::Node parse_yaml(const std::string& text, const YamlLimits& limits) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Survey survey(text, limits);
  bool is_empty = true;
  try {
    while (parser.HandleNextDocument(survey)) is_empty = false;
  } catch (const YAML::ParserException& error) {
    refuse_tab(text, error.mark);
    throw;
  }
  return is_empty ? YAML::Node() : YAML::Load(text);
}

std::string yaml_described(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return formatted("a list of {}", node.size());
  if (is_plain(node)) return in_quotes(node.Scalar());
  const std::string text = node.Scalar().substr(0, 40);
  return "the quoted text \"" + printable(text) + "\"";
}

std::optional<double> yaml_number(const YAML::Node& node) {
  const std::optional<double> value = is_plain(node) ? parsed_number(node.Scalar()) : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

bool has_leading_zeros(const YAML::Node& node) {
  if (!is_plain(node)) return false;
  const std::string& text = node.Scalar();
  const std::size_t digits = text.starts_with("-") ? 1 : 0;
  return text.size() > digits + 1 && text[digits] == '0' &&
         std::all_of(text.begin() + std::ptrdiff_t(digits), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::optional<std::int64_t> yaml_integer(const YAML::Node& node) {
  if (!is_plain(node) || has_leading_zeros(node)) return std::nullopt;
  const std::string& text = node.Scalar();
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<bool> yaml_boolean(const YAML::Node& node) {
  if (is_plain(node) && node.Scalar() == "true") return true;
  if (is_plain(node) && node.Scalar() == "false") return false;
  return std::nullopt;
}

std::vector<YamlKey> yaml_keys(const YAML::Node& map, const std::string& what, std::vector<YamlFault>& faults) {
  std::vector<YamlKey> keys;
  std::map<std::string, int> lines;  ///< lines of the keys so far
  for (const auto& item : map) {
    const YAML::Mark mark = item.first.Mark();
    if (!item.first.IsScalar()) {
      faults.push_back({mark, "a key in " + what + " must be a name, got " + yaml_described(item.first), ""});
      continue;
    }
    const std::string& name = item.first.Scalar();
    const std::string shown = in_quotes(cut(name, 100));
    const auto [twin, is_new] = lines.try_emplace(name, mark.line + 1);
    if (name == "<<")
      faults.push_back({mark, "merge keys (<<) are not supported", "repeat the entries"});
    else if (!is_new)
      faults.push_back(
          {mark, shown + " is given twice in " + what, formatted("the first is at line {}", twin->second)});
    else if (const std::string odd = odd_character_in(name); !odd.empty())
      faults.push_back({mark, "the key " + shown + " in " + what + " holds " + odd, "write it without"});
    else
      keys.push_back({name, mark, item.second});
  }
  return keys;
}

}  // namespace marrow
