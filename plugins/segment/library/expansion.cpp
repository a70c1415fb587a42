// SPDX-License-Identifier: Apache-2.0
#include "marrow/segment/expansion.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "marrow/segment/fragments.hpp"

namespace marrow::segment {
namespace {

using marrow::Grid, marrow::Volume;

constexpr int kBlock = 32;
constexpr std::uint8_t kStopped = 255;
constexpr double kFreeCost = 2, kMostCost = 254;

/// Cost of crossing each voxel (1 / speed), in blocks. A block is computed only if a front can reach it.
class Costs {
 public:
  Costs(const Volume& volume, const Race& race) : volume_(volume), race_(race) {
    for (int k = 0; k < 3; ++k) {
      const double spacing = volume.grid.spacing_mm[k];
      blocks_[k] = (volume.grid.size[k] + kBlock - 1) / kBlock;
      const int reach = std::clamp(int(std::ceil(2.5 * race.sigma_mm / spacing)), 1, 12);
      for (int i = -reach; i <= reach; ++i)
        weights_[k].push_back(float(std::exp(-0.5 * std::pow(i * spacing / race.sigma_mm, 2))));
      float sum = 0;
      for (const float weight : weights_[k]) sum += weight;
      for (float& weight : weights_[k]) weight /= sum;
      radius_[k] = std::clamp(int(std::lround(0.5 * race.cleft_mm / spacing)), 1, 12);
      halo_[k] = reach + 2 * radius_[k];
    }
    costs_.resize(std::size_t(blocks_[0]) * blocks_[1] * blocks_[2]);
  }

  std::uint8_t at(int x, int y, int z) const {
    const auto& block = costs_[block_of(x / kBlock, y / kBlock, z / kBlock)];
    return block.empty() ? kStopped : block[local(x % kBlock, y % kBlock, z % kBlock)];
  }

  /// Makes all blocks that can be reached from these voxels.
  void make_from(const std::vector<std::array<int, 3>>& voxels) {
    std::vector<std::uint8_t> is_chosen(costs_.size(), 0);
    std::vector<std::size_t> frontier;
    const auto choose = [&](int x, int y, int z) {
      if (x < 0 || y < 0 || z < 0 || x >= blocks_[0] || y >= blocks_[1] || z >= blocks_[2]) return;
      const std::size_t block = block_of(x, y, z);
      if (is_chosen[block]) return;
      is_chosen[block] = 1;
      frontier.push_back(block);
    };
    for (const auto& voxel : voxels) choose(voxel[0] / kBlock, voxel[1] / kBlock, voxel[2] / kBlock);
    while (!frontier.empty()) {
      tbb::parallel_for(
          std::size_t(0), frontier.size(), [&](std::size_t i) { make(frontier[i]); }, tbb::simple_partitioner());
      const std::vector<std::size_t> made = std::move(frontier);
      frontier.clear();
      for (const std::size_t block : made) {
        const int x = int(block % blocks_[0]), y = int(block / blocks_[0] % blocks_[1]),
                  z = int(block / blocks_[0] / blocks_[1]);
        for (int k = 0; k < 3; ++k)
          for (const int side : {-1, 1})
            if (is_open(costs_[block], k, side)) choose(x + side * (k == 0), y + side * (k == 1), z + side * (k == 2));
      }
    }
  }

 private:
  static std::size_t local(int x, int y, int z) { return (std::size_t(z) * kBlock + y) * kBlock + x; }
  std::size_t block_of(int x, int y, int z) const { return (std::size_t(z) * blocks_[1] + y) * blocks_[0] + x; }

  static bool is_open(const std::vector<std::uint8_t>& costs, int axis, int side) {
    if (costs.empty()) return false;
    for (int a = 0; a < kBlock; ++a)
      for (int b = 0; b < kBlock; ++b) {
        const int at_side = side > 0 ? kBlock - 1 : 0;
        if (costs[axis == 0   ? local(at_side, a, b)
                  : axis == 1 ? local(a, at_side, b)
                              : local(a, b, at_side)] != kStopped)
          return true;
      }
    return false;
  }

  /// Copies the block and its halo. Outside the volume the border's values are repeated. False if nothing in it is as
  /// bright as bone.
  bool load(const std::array<int, 3>& first, const std::array<int, 3>& size, std::vector<float>& values) const {
    const auto& whole = volume_.grid.size;
    float brightest = -1e9f;
    for (int z = 0; z < size[2]; ++z)
      for (int y = 0; y < size[1]; ++y) {
        const float* row = volume_.values.data() + volume_.grid.offset(0, std::clamp(first[1] + y, 0, whole[1] - 1),
                                                                       std::clamp(first[2] + z, 0, whole[2] - 1));
        float* out = values.data() + (std::size_t(z) * size[1] + y) * size[0];
        for (int x = 0; x < size[0]; ++x) {
          out[x] = row[std::clamp(first[0] + x, 0, whole[0] - 1)];
          brightest = std::max(brightest, out[x]);
        }
      }
    return brightest >= race_.floor_hu;
  }

  /// Filters along one axis: combine(tap) is a function of the result so far and the value at that tap. At the buffer's
  /// rim neighbouring rows mix. Only the halo is affected, and it is not used afterwards.
  template <class Combine>
  static void filter(std::vector<float>& values, std::vector<float>& out, std::size_t step, int reach, float start,
                     const Combine& combine) {
    constexpr std::size_t kChunk = 2048;  // stays in the cache for all taps
    const std::size_t margin = step * std::size_t(reach), end = values.size() - margin;
    out.resize(values.size());
    for (std::size_t first = margin; first < end; first += kChunk) {
      const std::size_t count = std::min(kChunk, end - first);
      float* to = out.data() + first;
      std::fill_n(to, count, start);
      for (int tap = 0; tap <= 2 * reach; ++tap) {
        const float* in = values.data() + first - margin + std::size_t(tap) * step;
        const auto combined = combine(tap);
        for (std::size_t i = 0; i < count; ++i) to[i] = combined(to[i], in[i]);
      }
    }
    values.swap(out);
  }

  void make(std::size_t block) {
    const std::array<int, 3> index{int(block % blocks_[0]), int(block / blocks_[0] % blocks_[1]),
                                   int(block / blocks_[0] / blocks_[1])};
    std::array<int, 3> first, size;
    for (int k = 0; k < 3; ++k) {
      first[k] = index[k] * kBlock - halo_[k];
      size[k] = kBlock + 2 * halo_[k];
    }
    const std::array<std::size_t, 3> steps{1, std::size_t(size[0]), std::size_t(size[0]) * size[1]};
    std::vector<float> smooth(steps[2] * size[2]), scratch;
    if (!load(first, size, smooth)) return;
    for (int k = 0; k < 3; ++k) {
      const auto& weights = weights_[k];
      filter(smooth, scratch, steps[k], int(weights.size() / 2), 0, [&](int tap) {
        return [weight = weights[std::size_t(tap)]](float sum, float value) { return sum + weight * value; };
      });
    }
    const auto brightest = [](int) { return [](float most, float value) { return std::max(most, value); }; };
    const auto darkest = [](int) { return [](float least, float value) { return std::min(least, value); }; };
    std::vector<float> around = smooth, least = smooth;
    for (int k = 0; k < 3; ++k) filter(around, scratch, steps[k], radius_[k], -1e9f, brightest);
    for (int k = 0; k < 3; ++k) filter(least, scratch, steps[k], 1, 1e9f, darkest);
    // Grey closing: a dark gap between two bright walls becomes as bright as they are.
    std::vector<float> closed = around;
    for (int k = 0; k < 3; ++k) filter(closed, scratch, steps[k], radius_[k], 1e9f, darkest);
    std::vector<std::uint8_t>& costs = costs_[block];
    costs.assign(std::size_t(kBlock) * kBlock * kBlock, kStopped);
    for (int z = 0; z < kBlock; ++z)
      for (int y = 0; y < kBlock; ++y)
        for (int x = 0; x < kBlock; ++x) {
          const std::size_t at = (z + halo_[2]) * steps[2] + (y + halo_[1]) * steps[1] + std::size_t(x + halo_[0]);
          if (smooth[at] < race_.floor_hu) continue;
          // At the rim of the bone a cleft is open to the side, so the closing does not find it. A front could then run
          // along the rim around the cleft.
          const float walls = least[at] < race_.floor_hu ? around[at] : closed[at];
          const double part = std::max(0.f, walls - smooth[at]) / std::max(walls, 1.f) / race_.cleft_fraction;
          costs[local(x, y, z)] =
              std::uint8_t(std::min(kMostCost, std::round(kFreeCost * std::exp(std::min(part * part, 10.0)))));
        }
  }

  const Volume& volume_;
  const Race& race_;
  std::array<int, 3> blocks_{}, radius_{}, halo_{};
  std::array<std::vector<float>, 3> weights_;
  std::vector<std::vector<std::uint8_t>> costs_;
};

/// The voxels within two voxel widths (in the plane) of a seed. So a front also starts from a seed in a pore.
std::vector<std::array<int, 3>> ball(const Grid& grid, const Eigen::Vector3d& centre) {
  std::vector<std::array<int, 3>> voxels;
  for (int z = -2; z <= 2; ++z)
    for (int y = -2; y <= 2; ++y)
      for (int x = -2; x <= 2; ++x) {
        const Eigen::Vector3d index = centre + Eigen::Vector3d(x, y, z);
        const int i = int(std::lround(index.x())), j = int(std::lround(index.y())), k = int(std::lround(index.z()));
        const Eigen::Vector3d away = (Eigen::Vector3d(i, j, k) - centre).cwiseProduct(grid.spacing_mm);
        if (grid.contains(i, j, k) && away.norm() <= 2 * grid.spacing_mm[0]) voxels.push_back({i, j, k});
      }
  return voxels;
}

}  // namespace

std::vector<std::uint8_t> race(const Volume& volume, const std::vector<std::vector<Eigen::Vector3d>>& seeds,
                               const Race& race) {
  struct Arrival {
    std::uint32_t at;
    std::uint8_t fragment;
  };
  const Grid& grid = volume.grid;
  Costs costs(volume, race);
  // Dijkstra's algorithm for costs of one byte: a ring of 256 lists, one for each arrival time.
  std::array<std::vector<Arrival>, 256> due;
  std::vector<std::array<int, 3>> starts;
  for (std::size_t f = 0; f < seeds.size(); ++f)
    for (const auto& seed : seeds[f])
      for (const auto& voxel : ball(grid, seed)) {
        starts.push_back(voxel);
        due[0].push_back({std::uint32_t(grid.offset(voxel[0], voxel[1], voxel[2])), std::uint8_t(f)});
      }
  costs.make_from(starts);
  std::vector<std::uint8_t> owner(grid.count(), kNobody);
  std::size_t waiting = due[0].size();
  const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
  for (std::size_t time = 0; waiting > 0; ++time) {
    std::vector<Arrival> now;
    now.swap(due[time % 256]);
    waiting -= now.size();
    for (const auto [at, fragment] : now) {
      if (owner[at] != kNobody) continue;
      owner[at] = fragment;
      const int x = int(at % row), y = int(at % slice / row), z = int(at / slice);
      const auto visit = [&, fragment = fragment](int i, int j, int k) {
        if (!grid.contains(i, j, k)) return;
        const std::size_t next = grid.offset(i, j, k);
        if (owner[next] != kNobody) return;
        const std::uint8_t cost = costs.at(i, j, k);
        if (cost == kStopped) return;
        due[(time + cost) % 256].push_back({std::uint32_t(next), fragment});
        ++waiting;
      };
      visit(x - 1, y, z);
      visit(x + 1, y, z);
      visit(x, y - 1, z);
      visit(x, y + 1, z);
      visit(x, y, z - 1);
      visit(x, y, z + 1);
    }
  }
  return owner;
}

}  // namespace marrow::segment
