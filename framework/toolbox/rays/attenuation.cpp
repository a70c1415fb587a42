// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/rays/attenuation.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "marrow/domain/error.hpp"

namespace marrow::rays {
namespace {

void check_field(const Volume& volume, const SignedField& field) {
  if (field.grid.size != volume.grid.size || field.values_mm.size() != volume.grid.count())
    throw Error("the field has another size than the volume; wire the one that was segmented from it");
}

void find_box(Attenuation& attenuation) {
  const Grid& grid = attenuation.grid;
  std::array<int, 3> first = grid.size, last{-1, -1, -1};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y) {
      const std::int16_t* row = attenuation.thousandths.data() + grid.offset(0, y, z);
      int a = 0, b = grid.size[0] - 1;
      while (a <= b && row[a] == 0) ++a;
      while (b > a && row[b] == 0) --b;
      if (a > b) continue;
      const std::array<int, 3> low{a, y, z}, high{b, y, z};
      for (std::size_t k = 0; k < 3; ++k) {
        first[k] = std::min(first[k], low[k]);
        last[k] = std::max(last[k], high[k]);
      }
    }
  attenuation.first = first;
  attenuation.last = last;
}

}  // namespace

Attenuation attenuation_of(const Volume& volume, const SignedField* field, const AttenuationOptions& options) {
  check_volume(volume, "the volume to project");
  if (field) check_field(volume, *field);
  Attenuation attenuation;
  attenuation.grid = volume.grid;
  attenuation.thousandths.resize(volume.grid.count());
  const std::size_t row = std::size_t(volume.grid.size[0]);
  tbb::parallel_for(std::size_t(0), volume.grid.count() / row, [&](std::size_t r) {
    for (std::size_t i = r * row; i < (r + 1) * row; ++i) {
      const double hu = volume.values[i];
      const bool is_out = hu < options.below_hu || (field && field->values_mm[i] > options.margin_mm);
      attenuation.thousandths[i] =
          is_out ? 0 : std::int16_t(std::lround(std::clamp(hu - options.background_hu, 0.0, 32767.0)));
    }
  });
  find_box(attenuation);
  return attenuation;
}

}  // namespace marrow::rays
