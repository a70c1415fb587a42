// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/plate_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <optional>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/distortion/polynomial.hpp"

namespace marrow::distortion {
namespace {

constexpr double kReach = 0.22;     ///< how far from its predicted place a neighbour may be, in spacings
constexpr double kLikeness = 2.5;   ///< neighbours' strengths differ by less than this factor
constexpr std::size_t kSeeds = 80;  ///< so many spots are tried as beginnings
constexpr std::size_t kLeastDots = 9;

using Index = std::pair<int, int>;  // column, row

/// Steps to the neighbours of a dot, opposite ones in turn.
std::vector<Index> steps(Pattern grid) {
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
    if (places_.count(index)) return false;
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

/// The distance from a spot to its nearest neighbour, as the median over the most central spots.
double usual_distance(const std::vector<Spot>& spots) {
  std::vector<double> distances;
  const std::size_t count = std::min<std::size_t>(spots.size(), 400);
  for (std::size_t i = 0; i < count; ++i) {
    double least = 1e12;
    for (std::size_t k = 0; k < count; ++k)
      if (k != i) least = std::min(least, (spots[i].at_px - spots[k].at_px).squaredNorm());
    distances.push_back(std::sqrt(least));
  }
  return std::max(2.0, quantile_in_place(distances, 0.5));
}

/// The basis at a spot whose neighbours are where those of a grid's dot are; nothing at any other spot.
std::optional<Basis> basis_at(int seed, const std::vector<Spot>& spots, const NearbySpots& nearby, Pattern grid,
                              double distance) {
  const Spot& spot = spots[std::size_t(seed)];
  std::vector<Eigen::Vector2d> offsets;
  for (const int i : nearby.within(spot.at_px, 2.2 * distance)) {
    const double ratio = spots[std::size_t(i)].strength / spot.strength;
    if (i != seed && ratio < kLikeness && ratio > 1 / kLikeness)
      offsets.push_back(spots[std::size_t(i)].at_px - spot.at_px);
  }
  const auto find = [&](const Eigen::Vector2d& expected, double reach) -> std::optional<Eigen::Vector2d> {
    std::optional<Eigen::Vector2d> best;
    for (const Eigen::Vector2d& offset : offsets)
      if ((offset - expected).norm() < reach && (!best || (offset - expected).norm() < (*best - expected).norm()))
        best = offset;
    return best;
  };
  const double angle = grid == Pattern::square ? 1.5707963267948966 : 1.0471975511965976;
  for (std::size_t n = 0; n < std::min<std::size_t>(offsets.size(), 6); ++n) {
    const Eigen::Vector2d column = offsets[n];
    const double reach = 0.33 * column.norm();
    const Eigen::Vector2d turned(std::cos(angle) * column.x() - std::sin(angle) * column.y(),
                                 std::sin(angle) * column.x() + std::cos(angle) * column.y());
    const auto row = find(turned, reach);
    if (!row) continue;
    const Basis basis{column, *row};
    bool has_all = true;
    for (const Index& step : steps(grid)) has_all &= find(basis.step(step), kReach * column.norm()).has_value();
    if (has_all) return basis;
  }
  return std::nullopt;
}

/// Adds dots where a polynomial through all others expects them, from cell to cell outwards.
void extend(Growth& growth, const std::vector<Spot>& spots, Pattern grid) {
  for (int round = 0; round < 4; ++round) {
    const std::vector<GridDot> dots = growth.dots();
    std::vector<Eigen::Vector2d> plate, seen;
    std::vector<double> strengths;
    Index low{dots[0].column, dots[0].row}, high = low;
    for (const GridDot& dot : dots) {
      plate.push_back(place_on_plate(grid, dot.column, dot.row));
      seen.push_back(spots[std::size_t(dot.spot)].at_px);
      strengths.push_back(spots[std::size_t(dot.spot)].strength);
      low = {std::min(low.first, dot.column), std::min(low.second, dot.row)};
      high = {std::max(high.first, dot.column), std::max(high.second, dot.row)};
    }
    const int degree = dots.size() >= 120 ? 5 : dots.size() >= 40 ? 3 : 1;
    const auto [middle, half] = square_around(plate);
    std::vector<bool> is_used(plate.size(), true);
    const Polynomial expected = fit_robustly(degree, middle, half, plate, seen, 6, is_used);
    const double strength = quantile_in_place(strengths, 0.5), spacing = spacing_px(spots, dots, grid);
    bool has_grown = false;
    for (int row = low.second - 1; row <= high.second + 1; ++row)
      for (int column = low.first - 1; column <= high.first + 1; ++column) {
        const Eigen::Vector2d place = place_on_plate(grid, column, row);
        if ((place - middle).norm() > 1.5 * half) continue;
        has_grown |= growth.take_at({column, row}, expected.at(place), spacing, strength);
      }
    if (!has_grown) return;
  }
}

}  // namespace

Eigen::Vector2d place_on_plate(Pattern grid, int column, int row) {
  if (grid == Pattern::square) return {double(column), double(row)};
  return {column + 0.5 * row, 0.8660254037844386 * row};
}

double spacing_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid) {
  std::map<Index, int> by_index;
  for (const GridDot& dot : dots) by_index[{dot.column, dot.row}] = dot.spot;
  std::vector<double> distances;
  for (const GridDot& dot : dots)
    for (const Index& step : steps(grid))
      if (const auto other = by_index.find({dot.column + step.first, dot.row + step.second}); other != by_index.end())
        distances.push_back((spots[std::size_t(dot.spot)].at_px - spots[std::size_t(other->second)].at_px).norm());
  return distances.empty() ? 0 : quantile_in_place(distances, 0.5);
}

double unevenness_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid) {
  std::map<Index, int> by_index;
  for (const GridDot& dot : dots) by_index[{dot.column, dot.row}] = dot.spot;
  const auto at = [&](int column, int row) -> const Spot* {
    const auto found = by_index.find({column, row});
    return found == by_index.end() ? nullptr : &spots[std::size_t(found->second)];
  };
  std::vector<double> distances;
  const std::vector<Index> all = steps(grid);
  for (const GridDot& dot : dots)
    for (std::size_t i = 0; i < all.size(); i += 2) {
      const Spot *a = at(dot.column + all[i].first, dot.row + all[i].second),
                 *b = at(dot.column - all[i].first, dot.row - all[i].second);
      if (a && b) distances.push_back((spots[std::size_t(dot.spot)].at_px - 0.5 * (a->at_px + b->at_px)).norm());
    }
  return distances.empty() ? 1e9 : quantile_in_place(distances, 0.5);
}

std::vector<GridDot> find_grid(const std::vector<Spot>& spots, Pattern grid) {
  if (spots.size() < kLeastDots) return {};
  const double distance = usual_distance(spots);
  const NearbySpots nearby(spots, distance);
  std::optional<Growth> best;
  std::vector<bool> was_tried(spots.size(), false);
  std::size_t tried = 0;
  for (std::size_t seed = 0; seed < spots.size() && tried < kSeeds; ++seed) {
    if (was_tried[seed]) continue;
    const auto basis = basis_at(int(seed), spots, nearby, grid, distance);
    if (!basis) continue;
    ++tried;
    Growth growth(spots, nearby, grid);
    growth.grow(int(seed), *basis);
    for (std::size_t i = 0; i < spots.size(); ++i) was_tried[i] = was_tried[i] || growth.is_taken(int(i));
    if (!best || growth.size() > best->size()) best.emplace(growth);
    if (2 * best->size() > spots.size()) break;
  }
  if (!best || best->size() < kLeastDots) return {};
  extend(*best, spots, grid);
  best->leave_out_doubtful();
  return best->size() < kLeastDots ? std::vector<GridDot>() : best->dots();
}

}  // namespace marrow::distortion
