// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/border.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include "marrow/domain/decompositions.hpp"

namespace marrow::shaft {
namespace {

/// Calls function(position, distance from the line) for the edge pixels that support a border.
template <class Function>
void for_support(const EdgeMap& edges, const Border& border, const Support& support, Function function) {
  for (const EdgePixel& edge : edges.pixels) {
    const Eigen::Vector2d position(edge.u_px, edge.v_px);
    const double distance = border.normal.dot(position) - border.rho;
    if (std::abs(distance) > support.tolerance_px) continue;
    if (border.normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < support.direction_cosine) continue;
    function(position, distance);
  }
}

}  // namespace

Eigen::Vector2d point_at(const Border& border, const Eigen::Vector2d& along, double s) {
  Eigen::Matrix2d rows;
  rows << border.normal.transpose(), along.transpose();
  return rows.inverse() * Eigen::Vector2d(border.rho, s);
}

std::vector<double> supported_positions(const EdgeMap& edges, const Border& border, const Support& support,
                                        const Eigen::Vector2d& along) {
  std::vector<double> positions;
  for_support(edges, border, support,
              [&](const Eigen::Vector2d& position, double) { positions.push_back(along.dot(position)); });
  std::sort(positions.begin(), positions.end());
  return positions;
}

std::pair<double, double> longest_run(const std::vector<double>& positions, double gap_px) {
  std::pair<double, double> best{0, 0};
  std::size_t most = 0;
  for (std::size_t from = 0, to = 0; from < positions.size(); from = to) {
    for (to = from + 1; to < positions.size() && positions[to] - positions[to - 1] <= gap_px;) ++to;
    if (to - from > most) most = to - from, best = {positions[from], positions[to - 1]};
  }
  return best;
}

Border refit(const EdgeMap& edges, Border border, const Support& support, const Stretch& stretch, int weighted) {
  for (int round = 0; round <= weighted; ++round) {
    double sum = 0;
    int count = 0;
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for_support(edges, border, support, [&](const Eigen::Vector2d& position, double distance) {
      const double s = stretch.along.dot(position), share = distance / support.tolerance_px;
      if (s < stretch.from || s > stretch.to) return;
      const double weight = round < weighted ? (1 - share * share) * (1 - share * share) : 1.0;
      sum += weight, ++count;
      first += weight * position;
      second += weight * position * position.transpose();
    });
    border.pixels = count;
    if (count < 10 || !(sum > 0)) return border.pixels = 0, border;
    const Eigen::Vector2d centre = first / sum;
    const SymmetricEigen<2> eigen = eigen_of_symmetric<2>(second / sum - centre * centre.transpose());
    const Eigen::Vector2d normal = eigen.vectors.col(0);  // the direction of least spread
    border.normal = normal.dot(border.normal) < 0 ? Eigen::Vector2d(-normal) : normal;
    border.rho = border.normal.dot(centre);
    border.spread_px = std::sqrt(std::max(0.0, eigen.values[0]));
  }
  return border;
}

Stretch common_stretch(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                       const Eigen::Vector2d& along, double gap_px, int& supported) {
  const auto whole_positions = [&](const Border& border) {
    std::vector<double> positions = supported_positions(edges, border, support, along);
    for (double& s : positions) s = std::round(s);
    positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
    return positions;
  };
  const std::vector<double> at_one = whole_positions(one), at_other = whole_positions(other);
  std::vector<double> both;
  std::set_intersection(at_one.begin(), at_one.end(), at_other.begin(), at_other.end(), std::back_inserter(both));
  Stretch stretch;
  stretch.along = along;
  std::tie(stretch.from, stretch.to) = longest_run(both, gap_px);
  supported =
      int(std::count_if(both.begin(), both.end(), [&](double s) { return s >= stretch.from && s <= stretch.to; }));
  return stretch;
}

Stretch stretch_at_outline(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                           const Stretch& stretch, double reach_px, double gap_px) {
  const int count = std::max(1, int(std::ceil(stretch.length())));
  std::vector<char> inside(std::size_t(count), 0);
  for (const Border* border : {&one, &other})
    for (const EdgePixel& edge : edges.pixels) {
      const Eigen::Vector2d position(edge.u_px, edge.v_px);
      const double distance = border->normal.dot(position) - border->rho,
                   s = stretch.along.dot(position) - stretch.from;
      if (distance < 1.5 * support.tolerance_px || distance > reach_px || s < 0 || s >= count) continue;
      if (border->normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < support.direction_cosine) continue;
      for (int i = std::max(0, int(s) - 1); i <= std::min(count - 1, int(s) + 1); ++i) inside[std::size_t(i)] = 1;
    }
  std::vector<double> positions;
  for (int i = 0; i < count; ++i)
    if (!inside[std::size_t(i)]) positions.push_back(std::min(stretch.to, stretch.from + i));
  Stretch part = stretch;
  std::tie(part.from, part.to) = longest_run(positions, gap_px);
  return part;
}

}  // namespace marrow::shaft
