// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/nearest_result.hpp"

#include <algorithm>
#include <tuple>

#include "marrow/runtime/run/keys.hpp"

namespace marrow {
namespace {

/// Whether an input is another one that is now as it was the last time.
bool has_other_inputs(const Provenance& kept, const Provenance& last, const Provenance& now) {
  const auto key_in = [](const Provenance& from, const std::string& port) {
    const auto found = from.inputs.find(port);
    return found == from.inputs.end() ? Digest{} : found->second;
  };
  return std::any_of(now.inputs.begin(), now.inputs.end(), [&](const auto& input) {
    return key_in(last, input.first) == input.second && key_in(kept, input.first) != input.second;
  });
}

}  // namespace

const Provenance* nearest_result(const std::vector<Store::Last>& kept, const Store::Last& last, const Provenance& now) {
  const Provenance* nearest = nullptr;
  std::tuple<bool, std::size_t, bool> least;
  for (const Store::Last& one : kept) {
    if (one.provenance.node != now.node) continue;
    const std::tuple rank(has_other_inputs(one.provenance, last.provenance, now),
                          differences(one.provenance, now).size(), one.key != last.key);
    if (nearest && rank > least) continue;
    nearest = &one.provenance;
    least = rank;
  }
  return nearest;
}

}  // namespace marrow
