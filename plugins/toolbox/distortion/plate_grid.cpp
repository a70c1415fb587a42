// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/distortion/plate.hpp"

namespace marrow::distortion {
namespace {

constexpr double kReach = 0.22;  ///< how far from its predicted place a neighbour may be, in spacings

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

/// A part of the grid while it grows from dot to dot.
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

constexpr std::size_t kSeeds = 80;  ///< so many spots are tried as beginnings
constexpr std::size_t kLeastDots = 9;
constexpr std::size_t kLeastPart = 25;
constexpr double kLeastNeighbours = 0.5;  ///< share of all neighbours; where fewer are known, it is a finer grid
constexpr double kMostUneven = 0.07;      ///< spacings; where neighbours differ by more, noise was taken for dots
constexpr double kMostStretch = 1.5;      ///< of a plate that is tilted by 48 degrees

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

/// Dots with their places on the plate and in the image.
struct Places {
  std::vector<Eigen::Vector2d> plate, seen;

  Places(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid, const Index& offset = {0, 0}) {
    for (const GridDot& dot : dots) {
      plate.push_back(place_on_plate(grid, dot.column + offset.first, dot.row + offset.second));
      seen.push_back(spots[std::size_t(dot.spot)].at_px);
    }
  }
  void append(const Places& other) {
    plate.insert(plate.end(), other.plate.begin(), other.plate.end());
    seen.insert(seen.end(), other.seen.begin(), other.seen.end());
  }
  Polynomial fitted(int degree) const {
    const auto [middle, half] = square_around(plate);
    std::vector<bool> is_used(plate.size(), true);
    return fit_robustly(degree, middle, half, plate, seen, 6, is_used);
  }
  double median_distance(const Polynomial& fit) const {
    std::vector<double> distances;
    for (std::size_t i = 0; i < plate.size(); ++i) distances.push_back((seen[i] - fit.at(plate[i])).norm());
    return quantile_in_place(distances, 0.5);
  }
};

/// Adds dots beside known ones where a polynomial through all of them expects them.
void extend(Growth& growth, const std::vector<Spot>& spots, Pattern grid) {
  for (int round = 0; round < 4; ++round) {
    const std::vector<GridDot> dots = growth.dots();
    std::vector<double> strengths;
    Index low{dots[0].column, dots[0].row}, high = low;
    for (const GridDot& dot : dots) {
      strengths.push_back(spots[std::size_t(dot.spot)].strength);
      low = {std::min(low.first, dot.column), std::min(low.second, dot.row)};
      high = {std::max(high.first, dot.column), std::max(high.second, dot.row)};
    }
    const int degree = dots.size() >= 120 ? 5 : dots.size() >= 40 ? 3 : 1;
    const Polynomial expected = Places(spots, dots, grid).fitted(degree);
    const double strength = quantile_in_place(strengths, 0.5), spacing = spacing_px(spots, dots, grid);
    bool has_grown = false;
    for (int row = low.second - 1; row <= high.second + 1; ++row)
      for (int column = low.first - 1; column <= high.first + 1; ++column)
        has_grown |= growth.take_at({column, row}, expected.at(place_on_plate(grid, column, row)), spacing, strength);
    if (!has_grown) return;
  }
}

/// The index of a place on the plate that is nearest to it.
Index index_near(Pattern grid, const Eigen::Vector2d& plate) {
  if (grid == Pattern::square) return {int(std::lround(plate.x())), int(std::lround(plate.y()))};
  const double row = plate.y() / 0.8660254037844386;
  return {int(std::lround(plate.x() - 0.5 * row)), int(std::lround(row))};
}

/// By how much the indices of a part that something separates from the main part must be moved. A polynomial of degree
/// 3 through both tells; nothing if it does not tell clearly.
std::optional<Index> offset_of(const std::vector<GridDot>& part, const std::vector<GridDot>& main,
                               const std::vector<Spot>& spots, Pattern grid) {
  const Places known(spots, main, grid);
  const Polynomial seen = known.fitted(main.size() >= 40 ? 3 : 1);
  // The expected place on the plate of the part's first dot.
  const Eigen::Vector2d pixel = spots[std::size_t(part[0].spot)].at_px;
  Eigen::Vector2d plate = seen.middle;
  for (int round = 0; round < 20; ++round) plate += seen.derivative_at(plate).inverse() * (pixel - seen.at(plate));
  if (!plate.allFinite() || plate.norm() > 1e6) return std::nullopt;
  const Index expected = index_near(grid, plate);
  double least = std::numeric_limits<double>::infinity(), second = least;
  Index best{0, 0};
  for (int row = -2; row <= 2; ++row)
    for (int column = -2; column <= 2; ++column) {
      const Index offset{expected.first + column - part[0].column, expected.second + row - part[0].row};
      Places both = known;
      both.append(Places(spots, part, grid, offset));
      const auto [middle, half] = square_around(both.plate);
      const double distance = both.median_distance(fit_polynomial(3, middle, half, both.plate, both.seen));
      if (distance < least) best = offset;
      second = std::min(second, std::max(least, distance));
      least = std::min(least, distance);
    }
  if (1.5 * least > second) return std::nullopt;
  return best;
}

/// Joins parts that an instrument or the like separates from the main one, the largest first.
void join_parts(Growth& main, const std::vector<Spot>& spots, const NearbySpots& nearby, Pattern grid) {
  if (main.size() < 40) return;
  const std::vector<GridDot> dots = main.dots();
  const Polynomial seen = Places(spots, dots, grid).fitted(1);
  const Eigen::Matrix2d derivative = seen.derivative_at(seen.middle);
  const Basis basis{derivative * place_on_plate(grid, 1, 0), derivative * place_on_plate(grid, 0, 1)};
  std::list<Growth> parts;
  Growth all = main;
  for (std::size_t seed = 0; seed < spots.size(); ++seed) {
    const auto has_at = [&](const Eigen::Vector2d& step) {
      return nearby.nearest(spots[seed].at_px + step, kReach * step.norm()) >= 0;
    };
    if (all.is_taken(int(seed)) || !has_at(basis.column) || !has_at(basis.row)) continue;
    Growth part(spots, nearby, grid);
    part.leave_to(all);
    part.grow(int(seed), basis);
    all.leave_to(part);
    part.leave_out_doubtful();
    if (part.size() >= kLeastPart) parts.push_back(part);
  }
  parts.sort([](const Growth& a, const Growth& b) { return a.size() > b.size(); });
  for (const Growth& part : parts)
    if (const auto offset = offset_of(part.dots(), main.dots(), spots, grid)) main.join(part, *offset);
}

/// How much longer the grid is along one direction than along the other, if these dots are of this pattern. Rows and
/// columns of another pattern are a grid, too, but one that is stretched.
double stretch_of(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid) {
  const Places places(spots, dots, grid);
  const auto [middle, half] = square_around(places.plate);
  const Eigen::Matrix2d map = fit_polynomial(1, middle, half, places.plate, places.seen).derivative_at(middle);
  const Eigen::Vector2d squares = eigen_of_symmetric<2>(map.transpose() * map).values;
  return squares[0] > 0 ? std::sqrt(squares[1] / squares[0]) : std::numeric_limits<double>::infinity();
}

/// Whether most dots have their neighbours, at places that fit and none nearer, and the pattern is not stretched.
bool is_grid(const std::vector<Spot>& spots, const NearbySpots& nearby, const std::vector<GridDot>& dots,
             Pattern grid) {
  std::set<Index> known;
  for (const GridDot& dot : dots) known.insert({dot.column, dot.row});
  std::size_t neighbours = 0, between = 0;
  const double spacing = spacing_px(spots, dots, grid);
  for (const GridDot& dot : dots) {
    for (const Index& step : steps(grid)) neighbours += known.count({dot.column + step.first, dot.row + step.second});
    const Spot& own = spots[std::size_t(dot.spot)];
    const std::vector<int> near = nearby.within(own.at_px, 0.7 * spacing);
    between += std::any_of(near.begin(), near.end(), [&](int i) {
      const Spot& spot = spots[std::size_t(i)];
      return i != dot.spot && spot.strength > own.strength / kLikeness;
    });
  }
  return double(neighbours) > kLeastNeighbours * double(steps(grid).size() * dots.size()) &&
         2 * between < dots.size() && stretch_of(spots, dots, grid) < kMostStretch &&
         unevenness_px(spots, dots, grid) < kMostUneven * spacing;
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
  if (!best || best->size() < kLeastDots || !is_grid(spots, nearby, best->dots(), grid)) return {};
  best->leave_out_doubtful();
  if (best->size() < kLeastDots) return {};
  join_parts(*best, spots, nearby, grid);
  extend(*best, spots, grid);
  best->leave_out_doubtful();
  return best->size() < kLeastDots ? std::vector<GridDot>() : best->dots();
}

}  // namespace marrow::distortion
