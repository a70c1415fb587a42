// SPDX-License-Identifier: Apache-2.0
#include "marrow/mesh/signs.hpp"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstring>

namespace marrow::surface {
namespace {

/// The signs of a run of samples. Computed without branches, so that the compiler can vectorise the loop.
struct Packed {
  Word inside = 0;
  bool finite = true;
};

Packed pack(const float* values, int count) {
  std::uint8_t flags[64] = {};
  std::uint32_t not_finite = 0;
  for (int i = 0; i < count; ++i) {
    flags[i] = values[i] < 0;
    not_finite |= std::uint32_t(!(values[i] - values[i] == 0));
  }
  Packed packed;
  packed.finite = not_finite == 0;
  for (int group = 0; group < 8; ++group) {  // one multiplication collects the lowest bits of eight bytes
    Word eight;
    std::memcpy(&eight, flags + 8 * group, 8);
    packed.inside |= (eight * 0x0102040810204080u >> 56) << (8 * group);
  }
  return packed;
}

}  // namespace

Signs::Signs(const marrow::SignedField& field)
    : padded_(field),
      size_{field.grid.size[0] + 2, field.grid.size[1] + 2, field.grid.size[2] + 2},
      words_((size_[0] + 63) / 64) {
  check_grid(field);
  bits_.resize(std::size_t(words_) * size_[1] * size_[2], 0);
  std::atomic<bool> all_finite = true, any_inside = false, any_outside = false;
  tbb::parallel_for(1, size_[2] - 1, [&](int z) {
    bool finite = true, inside = false, outside = false;
    for (int y = 1; y < size_[1] - 1; ++y) {
      const float* row = field.values_mm.data() + field.grid.offset(0, y - 1, z - 1);
      Word* packed = bits_.data() + (std::size_t(z) * size_[1] + y) * words_;
      for (int word = 0; word < words_; ++word) {  // bit 0 of a row is padding, so words are shifted by one sample
        const int first = std::max(64 * word, 1), last = std::min(64 * word + 64, size_[0] - 1);
        if (first >= last) continue;
        const Packed run = pack(row + first - 1, last - first);
        packed[word] = run.inside << (first - 64 * word);
        finite &= run.finite;
        inside |= run.inside != 0;
        outside |= std::popcount(run.inside) < last - first;
      }
    }
    if (!finite) all_finite = false;
    if (inside) any_inside = true;
    if (outside) any_outside = true;
  });
  check_values(all_finite, any_inside, any_outside);
}

}  // namespace marrow::surface
