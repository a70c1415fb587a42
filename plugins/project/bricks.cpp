// SPDX-License-Identifier: Apache-2.0
#include "bricks.hpp"

#include <tbb/parallel_for.h>

namespace marrow::rays {

Bricks::Bricks(const Attenuation& attenuation) {
  constexpr int kSide = 4;
  if (attenuation.is_empty()) return;
  std::uint32_t stride = kSide * kSide * kSide, within = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    first_[k] = attenuation.first[k] - kBorder;
    const int bricks = (attenuation.last[k] + kBorder - first_[k]) / kSide + 1;
    for (int i = 0; i < bricks * kSide; ++i) offsets_[k].push_back(std::uint32_t(i / kSide) * stride + std::uint32_t(i % kSide) * within);
    stride *= std::uint32_t(bricks);
    within *= kSide;
  }
  values_.assign(stride, 0);
  const std::uint32_t *x = offsets(0), *y = offsets(1), *z = offsets(2);
  tbb::parallel_for(attenuation.first[2], attenuation.last[2] + 1, [&](int k) {
    for (int j = attenuation.first[1]; j <= attenuation.last[1]; ++j) {
      const std::int16_t* row = attenuation.thousandths.data() + attenuation.grid.offset(0, j, k);
      for (int i = attenuation.first[0]; i <= attenuation.last[0]; ++i) values_[x[i] + y[j] + z[k]] = row[i];
    }
  });
}

}  // namespace marrow::rays
