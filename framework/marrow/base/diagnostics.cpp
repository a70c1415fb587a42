// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/diagnostics.hpp"

#include <algorithm>
#include <functional>
#include <set>
#include <sstream>
#include <tuple>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

constexpr std::size_t kMostKept = 1000, kMostShown = 50;
constexpr std::size_t kMostInMessage = 1000;  // bytes
constexpr std::size_t kMostInLine = 200;      // bytes of a source line

std::string line_of(const std::string& text, int line) {
  std::istringstream stream(text);
  std::string content;
  for (int i = 0; i < line; ++i)
    if (!std::getline(stream, content)) return "";
  if (content.ends_with('\r')) content.pop_back();
  return content;
}

/// A source line, with a caret below the column, which counts bytes. Of a long line, only the part around the column is
/// shown.
std::string quoted_line(const std::string& line, int column) {
  const std::size_t at = std::min(std::size_t(std::max(0, column - 1)), line.size());
  const auto is_inside = [&](std::size_t i) { return i < line.size() && goes_on(line[i]); };
  std::size_t begin = line.size() > kMostInLine && at > kMostInLine / 2 ? at - kMostInLine / 2 : 0;
  std::size_t end = std::min(line.size(), begin + kMostInLine);
  while (is_inside(begin)) ++begin;
  while (is_inside(end)) ++end;
  const auto shown = [&](std::size_t first, std::size_t last) {
    std::string part = line.substr(first, last - first);
    std::replace(part.begin(), part.end(), '\t', ' ');
    return printable(part);
  };
  const std::string before = (begin ? "\u2026" : "") + shown(begin, at);
  const auto width = std::size_t(std::count_if(before.begin(), before.end(), std::not_fn(goes_on)));
  return "  " + before + shown(at, end) + (end < line.size() ? "\u2026" : "") + "\n  " + std::string(width, ' ') +
         "^\n";
}

}  // namespace

bool Diagnostics::is_full() const { return items_.size() >= kMostKept; }

void Diagnostics::add(Place place, const std::string& message, const std::string& hint) {
  if (is_full())
    ++not_kept_;
  else
    items_.push_back({std::move(place), cut(message, kMostInMessage), cut(hint, kMostInMessage)});
}

void Diagnostics::add_all(const Diagnostics& other) {
  const auto key = [](const Diagnostic& item) {
    return std::tie(item.place.file, item.place.line, item.place.column, item.message);
  };
  const auto is_before = [&](const Diagnostic* a, const Diagnostic* b) { return key(*a) < key(*b); };
  items_.reserve(items_.size() + other.items_.size());  // `known` points into it
  std::set<const Diagnostic*, decltype(is_before)> known(is_before);
  for (const Diagnostic& item : items_) known.insert(&item);
  for (const Diagnostic& item : other.items_) {
    if (known.contains(&item)) continue;
    add(item.place, item.message, item.hint);
    if (!is_full()) known.insert(&items_.back());
  }
  not_kept_ += other.not_kept_;
  sources_.insert(other.sources_.begin(), other.sources_.end());
}

std::vector<Diagnostic> Diagnostics::sorted() const {
  std::vector<Diagnostic> items = items_;
  std::stable_sort(items.begin(), items.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.place.file, a.place.line, a.place.column) < std::tie(b.place.file, b.place.line, b.place.column);
  });
  return items;
}

std::string Diagnostics::text() const {
  std::string all;
  const std::vector<Diagnostic> items = sorted();
  for (std::size_t i = 0; i < items.size() && i < kMostShown; ++i) {
    const Diagnostic& item = items[i];
    all += cut(printable(item.place.file), kMostInMessage);
    if (item.place.line) all += formatted(":{}:{}", item.place.line, item.place.column);
    all += ": error: " + printable_lines(item.message) + "\n";
    const auto source = sources_.find(item.place.file);
    if (item.place.line && source != sources_.end())
      all += quoted_line(line_of(source->second, item.place.line), item.place.column);
    if (!item.hint.empty()) all += "  hint: " + printable_lines(item.hint) + "\n";
  }
  if (size() > kMostShown) all += formatted("and {}\n", counted(size() - kMostShown, "more fault"));
  return all;
}

}  // namespace marrow
