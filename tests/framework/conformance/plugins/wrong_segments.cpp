// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "wrong.hpp"

namespace {

using marrow::List;
using marrow::Seeds;
using marrow::SignedField;

template <wrong::Fault fault>
List<SignedField> segment(const marrow::Volume& volume, const List<Seeds>& seeds) {
  if (fault == "careless")
    for (const Seeds& one : seeds)
      if (one.points_mm.empty()) std::abort();
  const marrow::Value made =
      marrow::node_test::call("segment.region_growing", {{"volume", marrow::node_test::item(volume)},
                                                         {"seeds", marrow::node_test::list(seeds, "fragment")}})
          .at("field");
  const List<SignedField> right = made.as_list<SignedField>();
  List<SignedField> fields;
  for (std::size_t i = 0; i < right.size(); ++i) {
    SignedField field = right[fault == "swapped" ? right.size() - 1 - i : i];
    for (std::size_t k = 0; k < field.values_mm.size(); ++k) {
      if (fault == "fat") field.values_mm[k] -= 1.6f;
      for (const SignedField& other : right)
        if (fault == "merged") field.values_mm[k] = std::min(field.values_mm[k], other.values_mm[k]);
    }
    if (fault == "changing") field.values_mm[0] += 0.001f * float(wrong::next_call());
    fields.add(right.name(i), std::move(field));
  }
  return fields;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "fat", "swapped", "merged", "changing", "careless">(
      plugin, "segment", []<wrong::Fault fault>() { return &segment<fault>; },
      [](auto&& node) {
        node.in("volume", "CT")
            .in("seeds", "points in each fragment", marrow::over("fragment"))
            .out("field", "signed distances", marrow::over("fragment"));
      });
}
