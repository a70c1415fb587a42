// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/diagnostics.hpp"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <tuple>

namespace marrow {
namespace {

/// Edit distance with neighbour swaps (optimal string alignment).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) cost[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) cost[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1, cost[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  return cost[a.size()][b.size()];
}

std::string line_of(const std::string& text, int line) {
  std::istringstream stream(text);
  std::string content;
  for (int i = 0; i < line; ++i)
    if (!std::getline(stream, content)) return "";
  return content;
}

}  // namespace

void Diagnostics::add(Place place, std::string message, std::string hint) {
  items_.push_back({std::move(place), std::move(message), std::move(hint)});
}

void Diagnostics::add_all(const Diagnostics& other) {
  const auto key = [](const Diagnostic& item) { return std::tie(item.place.file, item.place.line, item.place.column, item.message); };
  for (const Diagnostic& item : other.items_)
    if (std::none_of(items_.begin(), items_.end(), [&](const Diagnostic& known) { return key(known) == key(item); })) items_.push_back(item);
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
  std::ostringstream out;
  for (const Diagnostic& item : sorted()) {
    out << item.place.file;
    if (item.place.line) out << ':' << item.place.line << ':' << item.place.column;
    out << ": error: " << item.message << '\n';
    const auto source = sources_.find(item.place.file);
    if (item.place.line && source != sources_.end()) {
      const std::string line = line_of(source->second, item.place.line);
      out << "  " << line << "\n  " << std::string(std::size_t(std::max(0, item.place.column - 1)), ' ') << "^\n";
    }
    if (!item.hint.empty()) out << "  hint: " << item.hint << '\n';
  }
  return out.str();
}

std::string nearest_name(const std::string& wrong, const std::vector<std::string>& known) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, wrong.size() / 3) + 1;
  for (const std::string& name : known) {
    const std::size_t distance = edit_distance(wrong, name);
    if (distance < least) {
      least = distance;
      best = name;
    }
  }
  return best;
}

std::string suggestion(const std::string& wrong, const std::vector<std::string>& known) {
  const std::string nearest = nearest_name(wrong, known);
  if (!nearest.empty()) return "did you mean '" + nearest + "'?";
  if (known.empty()) return "there are none";
  const std::size_t shown = std::min<std::size_t>(known.size(), 20);
  std::string list = std::accumulate(known.begin() + 1, known.begin() + std::ptrdiff_t(shown), known[0],
                                     [](const std::string& a, const std::string& b) { return a + ", " + b; });
  return "known: " + list + (shown < known.size() ? ", ..." : "");
}

}  // namespace marrow
