// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/interior.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
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

/// One family of parallel planes: w = plane + round(slope_u (u - middle) + slope_v (v - middle)), in voxels.
struct Planes {
  const Grid& grid;
  const Box& box;
  int u, v, w;  // grid axes; w runs along the bone
  double slope_u, slope_v;

  int shift(int i, int j) const {
    constexpr int kFar = 1 << 20;  // makes the number positive: then truncation rounds, faster than std::lround
    return int(slope_u * (i - (box.first[u] + box.last[u]) / 2.0) + slope_v * (j - (box.first[v] + box.last[v]) / 2.0) +
               (kFar + 0.5)) -
           kFar;
  }
  int reach() const {
    return int(std::ceil(std::abs(slope_u) * (box.last[u] - box.first[u]) +
                         std::abs(slope_v) * (box.last[v] - box.first[v]))) /
               2 +
           1;
  }
};

/// Marks in `is_filled` what bone encloses in one plane: the pixels that a flood from the plane's border cannot reach.
void fill_plane(const Planes& planes, int plane, const std::vector<std::uint8_t>& is_bone,
                std::vector<std::uint8_t>& is_filled) {
  const Box& box = planes.box;
  const int width = box.last[planes.u] - box.first[planes.u] + 3, height = box.last[planes.v] - box.first[planes.v] + 3;
  const std::size_t steps[3] = {1, std::size_t(planes.grid.size[0]),
                                std::size_t(planes.grid.size[0]) * planes.grid.size[1]};
  thread_local std::vector<std::uint8_t> closed;
  thread_local std::vector<int> stack;
  closed.assign(std::size_t(width) * height, 0);
  // Offset of the voxel at a pixel. False if the plane lies outside the box there.
  const auto source = [&](int i, int j, std::size_t& at) {
    const int a = box.first[planes.u] + i - 1, b = box.first[planes.v] + j - 1, c = plane + planes.shift(a, b);
    at = a * steps[planes.u] + b * steps[planes.v] + c * steps[planes.w];
    return c >= box.first[planes.w] && c <= box.last[planes.w];
  };
  std::size_t at = 0;
  bool any_bone = false;
  for (int j = 1; j < height - 1; ++j)
    for (int i = 1; i < width - 1; ++i) {
      if (source(i, j, at)) any_bone |= closed[std::size_t(j) * width + i] = is_bone[at];
    }
  if (!any_bone) return;
  stack.assign(1, 0);
  closed[0] = 2;  // reached from outside
  while (!stack.empty()) {
    const int from = stack.back(), i = from % width, j = from / width;
    stack.pop_back();
    const auto visit = [&](bool exists, int next) {
      if (!exists || closed[std::size_t(next)]) return;
      closed[std::size_t(next)] = 2;
      stack.push_back(next);
    };
    visit(i > 0, from - 1);
    visit(i + 1 < width, from + 1);
    visit(j > 0, from - width);
    visit(j + 1 < height, from + width);
  }
  for (int j = 1; j < height - 1; ++j)
    for (int i = 1; i < width - 1; ++i)
      if (!closed[std::size_t(j) * width + i] && source(i, j, at)) is_filled[at] = 1;
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
  std::vector<std::uint8_t> is_filled(grid.count(), 0);
  for (double tilt_u : {0.0, 0.5, -0.5, 1.0, -1.0})
    for (double tilt_v : {0.0, 0.5, -0.5, 1.0, -1.0}) {
      // At most one voxel along the bone for one voxel across it. A steeper plane would have holes.
      const auto slope = [&](double tilt, int axis) {
        return std::clamp(tilt * grid.spacing_mm[axis] / grid.spacing_mm[w], -1.0, 1.0);
      };
      const Planes planes{grid, box, u, v, w, slope(tilt_u, u), slope(tilt_v, v)};
      const int reach = planes.reach();
      tbb::parallel_for(box.first[w] - reach, box.last[w] + reach + 1,
                        [&](int plane) { fill_plane(planes, plane, is_bone, is_filled); });
    }
  for (std::size_t at = 0; at < is_bone.size(); ++at) is_bone[at] |= is_filled[at] & !is_other[at];
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
