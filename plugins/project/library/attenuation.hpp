// SPDX-License-Identifier: Apache-2.0
#pragma once
// The attenuation of a volume relative to water. A radiograph (DRR) is its line integral.
#include <cstdlib>
#include <new>

#include "marrow/plugin.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace marrow::rays {

/// Allocator for memory in pages of 2 MiB, if the system supports them. Rays jump through volumes of tens of megabytes.
/// With pages of 4 KiB most of the time would go into address translation. Throws std::bad_alloc.
template <class T>
struct LargePages {
  using value_type = T;
  static constexpr std::size_t kPage = std::size_t(2) << 20;

  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}

  T* allocate(std::size_t count) {
    const std::size_t bytes = (count * sizeof(T) + kPage - 1) / kPage * kPage;
    void* memory = std::aligned_alloc(kPage, bytes);
    if (!memory) throw std::bad_alloc();
#if defined(__linux__)
    madvise(memory, bytes, MADV_HUGEPAGE);  // only a hint: if it has no effect, all is slower but correct
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  bool operator==(const LargePages&) const { return true; }
};

/// Which voxels attenuate, and how much.
struct AttenuationOptions {
  double below_hu = -1000;       ///< voxels below this attenuate nothing
  double background_hu = -1000;  ///< value that attenuates nothing: air, or the tissue around the bone
  double margin_mm = 1;          ///< voxels farther outside the fragment than this attenuate nothing
};

/// Attenuation of each voxel in thousandths of water's, x fastest, then y, then z.
struct Attenuation {
  Grid grid;
  std::vector<std::int16_t, LargePages<std::int16_t>> thousandths;
  std::array<int, 3> first{0, 0, 0}, last{-1, -1, -1};  ///< box of the voxels that attenuate; last < first if none does
  /// Along each axis, a sum over every n-th voxel is n times less than that over all; more than 1 in a smooth volume.
  std::array<int, 3> enough{1, 1, 1};

  bool is_empty() const { return last[0] < first[0]; }
};

/// Attenuation of a voxel: (HU - background_hu) / 1000, between 0 and 32.767. With a field, only the voxels of that
/// fragment attenuate. The grid is the part of the volume's that holds all voxels that attenuate. `field` may be null.
/// Throws Error if check_volume() refuses the volume, or if the sizes of field and volume differ.
Attenuation attenuation_of(const Volume& volume, const SignedField* field, const AttenuationOptions& options);

/// The same attenuation smoothed by a Gaussian, on a grid that holds all voxels that then attenuate.
Attenuation smoothed(const Attenuation& attenuation, double sigma_mm);

/// Declares the inputs, the output and the options that all projectors of radiographs share.
template <class Options, class Node>
Node& declare(Node&& node) {
  return node.in("volume", "CT")
      .in("field", "signed field of one fragment: only its voxels attenuate")
      .out("projector", "draws the radiograph for any camera and pose")
      .option("below_hu", &Options::below_hu, "voxels below this attenuate nothing", unit("HU"))
      .option("background_hu", &Options::background_hu,
              "value that attenuates nothing: air, or the tissue around the bone", unit("HU"))
      .option("margin_mm", &Options::margin_mm, "voxels farther outside the fragment than this attenuate nothing",
              at_least(0));
}

}  // namespace marrow::rays
