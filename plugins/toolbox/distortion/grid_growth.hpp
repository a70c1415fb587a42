// SPDX-License-Identifier: Apache-2.0
#pragma once
// A grid that grows from dot to dot. Only for plate_grid.cpp.
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "marrow/toolbox/distortion/plate_dots.hpp"
#include "marrow/toolbox/distortion/plate_grid.hpp"

namespace marrow::distortion {

constexpr double kReach = 0.22;    ///< how far from its predicted place a neighbour may be, in spacings
constexpr double kLikeness = 2.5;  ///< neighbours' strengths differ by less than this factor

using Index = std::pair<int, int>;  // column, row

/// Steps to the neighbours of a dot, opposite ones in turn.
inline std::vector<Index> steps(Pattern grid) {
  std::vector<Index> all{{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  if (grid == Pattern::hexagonal) all.insert(all.end(), {{1, -1}, {-1, 1}});
  return all;
}

/// The vectors of one step along a row and along a column, near a dot.
struct Basis {
  Eigen::Vector2d column = Eigen::Vector2d::Zero(), row = Eigen::Vector2d::Zero();
  Eigen::Vector2d step(const Index& step) const { return step.first * column + step.second * row; }
};

/// A part of the grid while it grows.
class Growth {
 public:
  Growth(const std::vector<Spot>& spots, const NearbySpots& nearby, Pattern grid)
      : spots_(spots), nearby_(nearby), grid_(grid), is_taken_(spots.size(), false) {}

  /// Leaves the spots of another part to that.
  void leave_to(const Growth& other) {
    for (std::size_t i = 0; i < is_taken_.size(); ++i) is_taken_[i] = is_taken_[i] || other.is_taken_[i];
  }

  /// Takes over all dots of another part, its indices moved by `offset`.
  void join(const Growth& other, const Index& offset) {
    for (const auto& [index, place] : other.places_) {
      is_taken_[std::size_t(place.spot)] = true;
      places_.emplace(moved(index, offset, 1), place);
    }
  }

  /// Grows from a spot with this basis.
  void grow(int seed, const Basis& basis) {
    take({0, 0}, seed, basis, spots_[std::size_t(seed)].strength);
    while (!queue_.empty()) {
      const Index from = queue_.front();
      queue_.pop_front();
      for (const Index& step : steps(grid_))
        if (!try_step(from, step, 1)) try_step(from, step, 2);
    }
  }

  /// Takes the spot at an expected place, if there is one.
  bool take_at(const Index& index, const Eigen::Vector2d& place, double spacing, double strength) {
    if (places_.count(index) || !has_neighbour(index)) return false;
    const int spot = nearby_.nearest(place, kReach * spacing);
    if (spot < 0 || is_taken_[std::size_t(spot)] || !is_alike(spot, strength)) return false;
    take(index, spot, {}, strength);
    return true;
  }

  /// Leaves out dots with fewer than two neighbours, and those that lie off the middle of opposite neighbours.
  void leave_out_doubtful() {
    std::vector<Index> doubtful;
    for (const auto& [index, place] : places_) {
      int neighbours = 0;
      bool is_off = false;
      for (std::size_t i = 0; i < steps(grid_).size(); i += 2) {
        const auto first = places_.find(moved(index, steps(grid_)[i], 1)),
                   second = places_.find(moved(index, steps(grid_)[i], -1));
        neighbours += int(first != places_.end()) + int(second != places_.end());
        if (first == places_.end() || second == places_.end()) continue;
        const Eigen::Vector2d a = at(first->second.spot), b = at(second->second.spot);
        is_off |= (at(place.spot) - 0.5 * (a + b)).norm() > 0.15 * 0.5 * (a - b).norm();
      }
      if (neighbours < 2 || is_off) doubtful.push_back(index);
    }
    for (const Index& index : doubtful) places_.erase(index);
  }

  std::vector<GridDot> dots() const {
    std::vector<GridDot> all;
    for (const auto& [index, place] : places_) all.push_back({index.first, index.second, place.spot});
    return all;
  }
  std::size_t size() const { return places_.size(); }
  bool is_taken(int spot) const { return is_taken_[std::size_t(spot)]; }

 private:
  struct Place {
    int spot;
    Basis basis;
    double strength;  ///< usual near here
  };

  static Index moved(const Index& from, const Index& step, int times) {
    return {from.first + times * step.first, from.second + times * step.second};
  }
  Eigen::Vector2d at(int spot) const { return spots_[std::size_t(spot)].at_px; }
  bool has_neighbour(const Index& index) const {
    for (const Index& step : steps(grid_))
      if (places_.count(moved(index, step, 1)) || places_.count(moved(index, step, 2))) return true;
    return false;
  }
  bool is_alike(int spot, double strength) const {
    const double ratio = spots_[std::size_t(spot)].strength / strength;
    return ratio < kLikeness && ratio > 1 / kLikeness;
  }

  void take(const Index& index, int spot, const Basis& basis, double strength) {
    places_[index] = {spot, basis, 0.7 * strength + 0.3 * spots_[std::size_t(spot)].strength};
    is_taken_[std::size_t(spot)] = true;
    queue_.push_back(index);
  }

  /// Whether the dot so many steps away is known afterwards.
  bool try_step(const Index& from, const Index& step, int times) {
    const Index to = moved(from, step, times);
    if (places_.count(to)) return true;
    const Place& place = places_.at(from);
    const Eigen::Vector2d vector = place.basis.step(step);
    const int spot = nearby_.nearest(at(place.spot) + times * vector, kReach * vector.norm());
    if (spot < 0 || is_taken_[std::size_t(spot)] || !is_alike(spot, place.strength)) return false;
    Basis basis = place.basis;
    const Eigen::Vector2d off = (at(spot) - at(place.spot)) / times - vector;
    // The vector of this step is corrected by half of what was observed. The part along each axis is shared.
    if (step.first != 0) basis.column += 0.5 * off * step.first / double(std::abs(step.first) + std::abs(step.second));
    if (step.second != 0) basis.row += 0.5 * off * step.second / double(std::abs(step.first) + std::abs(step.second));
    take(to, spot, basis, place.strength);
    return true;
  }

  const std::vector<Spot>& spots_;
  const NearbySpots& nearby_;
  Pattern grid_;
  std::vector<bool> is_taken_;
  std::map<Index, Place> places_;
  std::deque<Index> queue_;
};

}  // namespace marrow::distortion
