// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/interior.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <queue>

namespace marrow::field {
namespace {

using marrow::Grid;

/// The box of a bone in the grid and the grid axis that runs along it.
struct Box {
  std::array<int, 3> first{}, last{};  // inclusive
  int along = 2;
  bool empty = true;
};

Box box_of(const Grid& grid, const std::vector<std::uint8_t>& is_bone) {
  Box box;
  box.first = grid.size;
  box.last = {-1, -1, -1};
  Eigen::Array3d sum = Eigen::Array3d::Zero(), squares = Eigen::Array3d::Zero();
  double count = 0;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        if (!is_bone[grid.offset(x, y, z)]) continue;
        const int index[3] = {x, y, z};
        for (int k = 0; k < 3; ++k) {
          box.first[k] = std::min(box.first[k], index[k]);
          box.last[k] = std::max(box.last[k], index[k]);
        }
        const Eigen::Array3d p = Eigen::Array3d(x, y, z) * grid.spacing_mm.array();
        sum += p;
        squares += p * p;
        ++count;
      }
  box.empty = count == 0;
  if (!box.empty) (squares / count - (sum / count).square()).maxCoeff(&box.along);
  return box;
}

/// Columns of voxels along the bone, one bit for each voxel of the box: word (block, pixel) holds 64 voxels of the
/// column at a pixel.
class Columns {
 public:
  explicit Columns(const Box& box)
      : width_(box.last[(box.along + 1) % 3] - box.first[(box.along + 1) % 3] + 1),
        height_(box.last[(box.along + 2) % 3] - box.first[(box.along + 2) % 3] + 1),
        blocks_((box.last[box.along] - box.first[box.along]) / 64 + 1),
        words_(std::size_t(blocks_) * width_ * height_, 0) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int blocks() const { return blocks_; }
  std::uint64_t& word(int block, int pixel) { return words_[std::size_t(block) * width_ * height_ + pixel]; }

  /// The 64 voxels from `first` on. Beyond the box there is no bone.
  std::uint64_t from(int first, int pixel) const {
    const int block = first >> 6, skip = first & 63;
    const auto word = [&](int b) {
      return b < 0 || b >= blocks_ ? 0 : words_[std::size_t(b) * width_ * height_ + pixel];
    };
    return skip ? word(block) >> skip | word(block + 1) << (64 - skip) : word(block);
  }
  /// Sets these of the 64 voxels from `first` on. Threads may call this at the same time.
  void set_from(int first, int pixel, std::uint64_t voxels) {
    const int block = first >> 6, skip = first & 63;
    const auto set = [&](int b, std::uint64_t bits) {
      if (bits && b >= 0 && b < blocks_) std::atomic_ref(word(b, pixel)).fetch_or(bits, std::memory_order_relaxed);
    };
    set(block, voxels << skip);
    if (skip) set(block + 1, voxels >> (64 - skip));
  }

 private:
  int width_, height_, blocks_;
  std::vector<std::uint64_t> words_;
};

/// Calls visit(voxel, block, bit, pixel) for each voxel of the box, for all blocks at the same time.
template <class Visit>
void for_bits(const Grid& grid, const Box& box, const Columns& columns, const Visit& visit) {
  const std::size_t steps[3] = {1, std::size_t(grid.size[0]), std::size_t(grid.size[0]) * grid.size[1]};
  const int w = box.along, u = (w + 1) % 3, v = (w + 2) % 3;
  tbb::parallel_for(0, columns.blocks(), [&](int block) {
    for (int bit = 0; bit < 64 && box.first[w] + 64 * block + bit <= box.last[w]; ++bit)
      for (int j = 0, pixel = 0; j < columns.height(); ++j) {
        const std::size_t row = (box.first[w] + 64 * block + bit) * steps[w] + (box.first[v] + j) * steps[v];
        for (int i = 0; i < columns.width(); ++i, ++pixel)
          visit(row + (box.first[u] + i) * steps[u], block, bit, pixel);
      }
  });
}

/// One family of parallel planes: w = plane + round(slope_u (u - middle) + slope_v (v - middle)), in voxels of the box.
struct Planes {
  double slope_u, slope_v, middle_u, middle_v;

  int shift(int i, int j) const {
    constexpr int kFar = 1 << 20;  // makes the number positive: then truncation rounds, faster than std::lround
    return int(slope_u * (i - middle_u) + slope_v * (j - middle_v) + (kFar + 0.5)) - kFar;
  }
  int reach() const { return int(std::ceil(std::abs(slope_u) * middle_u + std::abs(slope_v) * middle_v)) + 1; }
};

/// Marks in `filled` what bone encloses in each of 64 neighbouring planes: the pixels that a flood from the plane's
/// border cannot reach. Each plane has its own bit, so all of them are flooded at once.
void fill_planes(const Planes& planes, int first_plane, const Columns& bone, Columns& filled) {
  const int width = bone.width() + 2, height = bone.height() + 2;  // with a border around the box
  thread_local std::vector<std::uint64_t> open_of_thread, reached_of_thread;
  open_of_thread.assign(std::size_t(width) * height, ~std::uint64_t(0));
  reached_of_thread.assign(open_of_thread.size(), ~std::uint64_t(0));
  std::uint64_t *open = open_of_thread.data(), *reached = reached_of_thread.data();
  bool any_bone = false;
  for (int j = 1, pixel = 0; j < height - 1; ++j)
    for (int i = 1; i < width - 1; ++i, ++pixel) {
      const std::uint64_t closed = bone.from(first_plane + planes.shift(i - 1, j - 1), pixel);
      any_bone |= closed != 0;
      open[j * width + i] = ~closed;
      reached[j * width + i] = 0;
    }
  if (!any_bone) return;
  std::uint64_t changed = 1;
  const auto visit = [&](int at) {
    const std::uint64_t now =
        (reached[at] | reached[at - 1] | reached[at + 1] | reached[at - width] | reached[at + width]) & open[at];
    changed |= now ^ reached[at];
    reached[at] = now;
  };
  while (changed) {
    changed = 0;
    for (int j = 1; j < height - 1; ++j)
      for (int i = 1; i < width - 1; ++i) visit(j * width + i);
    for (int j = height - 2; j > 0; --j)
      for (int i = width - 2; i > 0; --i) visit(j * width + i);
  }
  for (int j = 1, pixel = 0; j < height - 1; ++j)
    for (int i = 1; i < width - 1; ++i, ++pixel)
      filled.set_from(first_plane + planes.shift(i - 1, j - 1), pixel, open[j * width + i] & ~reached[j * width + i]);
}

bool beside_zero(const Grid& grid, const std::vector<float>& values, int x, int y, int z) {
  const bool inside = values[grid.offset(x, y, z)] < 0;
  const auto differs = [&](int i, int j, int k) {
    return grid.contains(i, j, k) && (values[grid.offset(i, j, k)] < 0) != inside;
  };
  return differs(x - 1, y, z) || differs(x + 1, y, z) || differs(x, y - 1, z) || differs(x, y + 1, z) ||
         differs(x, y, z - 1) || differs(x, y, z + 1);
}

enum class State : std::uint8_t { far, given, known };

/// Distance of a voxel: the upwind solution of |grad u| = 1 from the neighbours whose distance is known.
float distance_from(const Grid& grid, const std::vector<float>& distance, const std::vector<State>& state,
                    const int (&p)[3]) {
  std::array<std::pair<double, double>, 3> terms;  // distance, 1 / spacing^2
  const std::size_t steps[3] = {1, std::size_t(grid.size[0]), std::size_t(grid.size[0]) * grid.size[1]};
  const std::size_t at = grid.offset(p[0], p[1], p[2]);
  for (int k = 0; k < 3; ++k) {
    double nearest = 1e9;
    if (p[k] > 0 && state[at - steps[k]] == State::known) nearest = std::min(nearest, double(distance[at - steps[k]]));
    if (p[k] + 1 < grid.size[k] && state[at + steps[k]] == State::known)
      nearest = std::min(nearest, double(distance[at + steps[k]]));
    terms[k] = {nearest, 1 / (grid.spacing_mm[k] * grid.spacing_mm[k])};
  }
  std::sort(terms.begin(), terms.end());
  double a = 0, b = 0, c = -1, solution = 0;
  for (int k = 0; k < 3 && terms[k].first < 1e9; ++k) {
    if (k && solution <= terms[k].first) break;
    a += terms[k].second;
    b += terms[k].second * terms[k].first;
    c += terms[k].second * terms[k].first * terms[k].first;
    solution = (b + std::sqrt(std::max(0.0, b * b - a * c))) / a;
  }
  return float(solution);
}

}  // namespace

void fill_interior(const Grid& grid, std::vector<std::uint8_t>& is_bone, const std::vector<std::uint8_t>& is_other) {
  const Box box = box_of(grid, is_bone);
  if (box.empty) return;
  const int w = box.along, u = (w + 1) % 3, v = (w + 2) % 3;
  Columns bone(box), filled(box);
  for_bits(grid, box, bone, [&](std::size_t voxel, int block, int bit, int pixel) {
    bone.word(block, pixel) |= std::uint64_t(is_bone[voxel] != 0) << bit;
  });
  constexpr double kTilts[] = {0, 0.5, -0.5, 1, -1};
  tbb::parallel_for(0, 25, [&](int tilt) {
    // At most one voxel along the bone for one voxel across it. A steeper plane would have holes.
    const auto slope = [&](double tangent, int axis) {
      return std::clamp(tangent * grid.spacing_mm[axis] / grid.spacing_mm[w], -1.0, 1.0);
    };
    const Planes planes{slope(kTilts[tilt / 5], u), slope(kTilts[tilt % 5], v), (bone.width() - 1) / 2.0,
                        (bone.height() - 1) / 2.0};
    const int reach = planes.reach(), length = box.last[w] - box.first[w] + 1;
    tbb::parallel_for(0, (length + 2 * reach) / 64 + 1,
                      [&](int block) { fill_planes(planes, 64 * block - reach, bone, filled); });
  });
  for_bits(grid, box, filled, [&](std::size_t voxel, int block, int bit, int pixel) {
    is_bone[voxel] |= std::uint8_t(filled.word(block, pixel) >> bit & 1) & std::uint8_t(!is_other[voxel]);
  });
}

void march_distances(const Grid& grid, std::vector<float>& values_mm, double band_mm) {
  std::vector<float> distance(values_mm.size(), float(band_mm));
  std::vector<State> state(values_mm.size(), State::far);
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        if (!beside_zero(grid, values_mm, x, y, z)) continue;
        const std::size_t at = grid.offset(x, y, z);
        distance[at] = std::min(std::abs(values_mm[at]), float(band_mm));
        state[at] = State::given;
        queue.emplace(distance[at], at);
      }
  const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
  while (!queue.empty()) {
    const auto [reached, at] = queue.top();
    queue.pop();
    if (state[at] == State::known) continue;
    state[at] = State::known;
    const int p[3] = {int(at % row), int(at % slice / row), int(at / slice)};
    for (int k = 0; k < 3; ++k)
      for (int sign : {-1, 1}) {
        int q[3] = {p[0], p[1], p[2]};
        q[k] += sign;
        if (!grid.contains(q[0], q[1], q[2])) continue;
        const std::size_t next = grid.offset(q[0], q[1], q[2]);
        if (state[next] != State::far) continue;
        const float found = distance_from(grid, distance, state, q);
        if (found >= distance[next]) continue;
        distance[next] = found;
        queue.emplace(found, next);
      }
  }
  for (std::size_t at = 0; at < values_mm.size(); ++at)
    values_mm[at] = values_mm[at] < 0 ? -std::max(distance[at], 1e-6f) : distance[at];
}

}  // namespace marrow::field
