// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/interior.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
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

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

double squared_distance_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / std::max(along.squaredNorm(), 1e-30), 0.0, 1.0);
  return (p - a - t * along).squaredNorm();
}

double distance_to(const Triangle& triangle, const Vector3d& p) {
  const Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  bool over = normal.squaredNorm() > 1e-30;
  double nearest = 1e30;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &a = triangle[k], &b = triangle[(k + 1) % 3];
    over &= (b - a).cross(p - a).dot(normal) >= 0;
    nearest = std::min(nearest, squared_distance_to_segment(p, a, b));
  }
  return over ? std::abs((p - triangle[0]).dot(normal)) / normal.norm() : std::sqrt(nearest);
}

/// Where the line through (x, y) along z meets the triangle. A line exactly through an edge does not count as a
/// crossing: the caller shifts its lines, so that no line meets an edge.
bool crossing(const Triangle& t, double x, double y, double& z) {
  const auto side = [&](const Vector3d& a, const Vector3d& b) {
    return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  };
  const double u = side(t[1], t[2]), v = side(t[2], t[0]), w = side(t[0], t[1]);
  if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) return false;
  z = (u * t[0].z() + v * t[1].z() + w * t[2].z()) / (u + v + w);
  return true;
}

/// The signed distances of points that lie in the field's grid. Outside of it nothing is known but that the bone is
/// far away.
std::vector<double> distances_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                                 const RigidTransform& bone_from_points) {
  const Eigen::Vector3d last = Eigen::Vector3i(bone.grid.size.data()).cast<double>().array() - 1;
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : points_mm) {
    const Eigen::Vector3d index = bone.grid.index_from_point(bone_from_points * point);
    if ((index.array() >= 0).all() && (index.array() <= last.array()).all())
      distances.push_back(double(sample_trilinear(bone.grid, bone.values_mm, index)));
  }
  return distances;
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

marrow::SignedField field_of_mesh(const marrow::Grid& grid, const marrow::Mesh& mesh, double band_mm) {
  const auto& size = grid.size;
  const Vector3d spacing = grid.spacing_mm;
  std::vector<float> distance(grid.count(), float(band_mm));
  std::vector<std::vector<float>> crossings(std::size_t(size[0]) * size[1]);
  const double reach_mm = 1.8 * spacing.maxCoeff();
  const Vector3d aside(1.7e-5, 2.3e-5, 0);  // in voxels; so that no line meets an edge
  for (const auto& corners : mesh.triangles) {
    Triangle index, mm;
    for (int k = 0; k < 3; ++k) {
      index[k] = grid.index_from_point(mesh.vertices_mm[corners[k]]);
      mm[k] = index[k].cwiseProduct(spacing);
    }
    const Vector3d least = index[0].cwiseMin(index[1]).cwiseMin(index[2]),
                   most = index[0].cwiseMax(index[1]).cwiseMax(index[2]);
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = std::max(0, int(std::floor(std::clamp(least[k] - reach_mm / spacing[k], -1e6, 1e6))));
      high[k] = std::min(size[k] - 1, int(std::ceil(std::clamp(most[k] + reach_mm / spacing[k], -1e6, 1e6))));
    }
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) {
        double z = 0;
        if (crossing(index, x + aside.x(), y + aside.y(), z))
          crossings[std::size_t(y) * size[0] + std::size_t(x)].push_back(float(z));
        for (int k = low[2]; k <= high[2]; ++k) {
          float& value = distance[grid.offset(x, y, k)];
          value = std::min(value, float(distance_to(mm, Vector3d(x, y, k).cwiseProduct(spacing))));
        }
      }
  }
  for (int y = 0; y < size[1]; ++y)
    for (int x = 0; x < size[0]; ++x) {
      auto& heights = crossings[std::size_t(y) * size[0] + std::size_t(x)];
      std::sort(heights.begin(), heights.end());
      std::size_t passed = 0;
      for (int z = 0; z < size[2]; ++z) {
        while (passed < heights.size() && heights[passed] < float(z)) ++passed;
        float& value = distance[grid.offset(x, y, z)];
        value = std::max(value, 1e-4f);
        if (passed % 2) value = -value;
      }
    }
  march_distances(grid, distance, band_mm);
  return {grid, std::move(distance)};
}

double penetration_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                      const RigidTransform& bone_from_points) {
  double squares = 0, fourths = 0;
  for (const double distance : distances_mm(points_mm, bone, bone_from_points)) {
    if (!(distance < 0)) continue;
    squares += distance * distance;
    fourths += std::pow(distance, 4);
  }
  return squares > 0 ? std::sqrt(fourths / squares) : 0;
}

double gap_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
              const RigidTransform& bone_from_points) {
  constexpr double kFall_mm = 0.2;
  const std::vector<double> distances = distances_mm(points_mm, bone, bone_from_points);
  if (distances.empty()) return double(*std::max_element(bone.values_mm.begin(), bone.values_mm.end()));
  const double nearest = *std::min_element(distances.begin(), distances.end());
  double sum = 0, weights = 0;
  for (const double distance : distances) {
    const double weight = std::exp((nearest - distance) / kFall_mm);
    sum += weight * distance;
    weights += weight;
  }
  return sum / weights;
}

double deepest_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                  const RigidTransform& bone_from_points) {
  double deepest = 0;
  for (const double distance : distances_mm(points_mm, bone, bone_from_points)) deepest = std::max(deepest, -distance);
  return deepest;
}

}  // namespace marrow::field
