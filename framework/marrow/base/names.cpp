// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/names.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

constexpr std::size_t kMostInName = 100;  // bytes; longer names are not compared

/// Edit distance with neighbour swaps (optimal string alignment) of names of at most kMostInName bytes.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  using Row = std::array<std::size_t, kMostInName + 1>;
  Row rows[3];
  Row *before_last = &rows[0], *last = &rows[1], *now = &rows[2];
  for (std::size_t j = 0; j <= b.size(); ++j) (*last)[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    (*now)[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      (*now)[j] = std::min({(*last)[j] + 1, (*now)[j - 1] + 1, (*last)[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        (*now)[j] = std::min((*now)[j], (*before_last)[j - 2] + 1);
    }
    std::tie(before_last, last, now) = std::tuple(last, now, before_last);
  }
  return (*last)[b.size()];
}

}  // namespace

std::string fault_of_item_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.size() > 100) return formatted("has {} bytes; at most 100 are taken", name.size());
  return printable(name) == name ? "" : "holds a character that cannot be printed";
}

void check_item_name(const std::string& what, const std::string& name) {
  if (const std::string fault = fault_of_item_name(name); !fault.empty())
    throw Error("the name " + in_quotes(printable(name)) + " of a " + what + " " + fault + "; choose another");
}

std::string nearest_name(const std::string& wrong, const std::vector<std::string>& known) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, wrong.size() / 3) + 1;
  if (wrong.size() > kMostInName) return best;
  for (const std::string& name : known) {
    const std::size_t longer = std::max(name.size(), wrong.size()), shorter = std::min(name.size(), wrong.size());
    if (longer > kMostInName || longer - shorter >= least)
      continue;  // the distance is at least the difference of lengths
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
  std::string list;
  for (std::size_t i = 0; i < shown; ++i) list += (i ? ", " : "") + cut(known[i]);
  return "known: " + list + (shown < known.size() ? ", ..." : "");
}

}  // namespace marrow
