// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/board.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::calibration {
namespace {

/// Least part of a side's beads in the image that must be found. The four that define the map do not count.
constexpr double kLeastFound = 0.6;
constexpr std::size_t kLeastBeads = 8;  ///< least number of beads to be found per side
/// This many hits are no coincidence if they are most of the side's beads.
constexpr std::size_t kSurelyFound = 12;
/// Largest distance of a bead from its position by the projective map, due to distortion; a part of the image's width.
constexpr double kReach = 0.02;
constexpr double kReachOfCamera = 0.006;  ///< the same after a camera with distortion was fitted

using Points = std::vector<Eigen::Vector2d>;

/// A point and the disc on which it falls.
struct Hit {
  int point, disc;
};

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Orientations of the four triangles of four points. A projective map of a plane in front of the source keeps all of
/// them or reverses all of them.
std::array<bool, 4> turns_of(const std::array<Eigen::Vector2d, 4>& p) {
  return {turn(p[0], p[1], p[2]) > 0, turn(p[0], p[1], p[3]) > 0, turn(p[0], p[2], p[3]) > 0,
          turn(p[1], p[2], p[3]) > 0};
}

/// Whether no three of the four points lie nearly on a line.
bool in_general_position(const std::array<Eigen::Vector2d, 4>& p) {
  double longest = 0, least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < i; ++k) longest = std::max(longest, (p[std::size_t(i)] - p[std::size_t(k)]).squaredNorm());
  for (const auto& t : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}})
    least = std::min(least, std::abs(turn(p[std::size_t(t[0])], p[std::size_t(t[1])], p[std::size_t(t[2])])));
  return least > 0.05 * longest;
}

/// The four beads that define a map are always hit, so only the others count.
bool are_enough(std::size_t hits, int expected, double share) { return double(hits) - 4 >= share * (expected - 4); }

Eigen::Matrix3d to_eigen(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result(r, c) = m.at<double>(r, c);
  return result;
}

Eigen::Matrix3d map_of_four(const std::array<Eigen::Vector2d, 4>& from, const std::array<Eigen::Vector2d, 4>& to) {
  cv::Point2f a[4], b[4];
  for (std::size_t i = 0; i < 4; ++i) {
    a[i] = {float(from[i].x()), float(from[i].y())};
    b[i] = {float(to[i].x()), float(to[i].y())};
  }
  return to_eigen(cv::getPerspectiveTransform(a, b));
}

/// Pairs of a predicted point and a disc within reach that are each other's nearest.
std::vector<Hit> hits_of(const Points& predicted, const Points& discs, double reach) {
  std::vector<int> owner(discs.size(), -1);
  std::vector<double> best(discs.size(), reach * reach);
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    int nearest = -1;
    double least = reach * reach;
    for (std::size_t k = 0; k < discs.size(); ++k)
      if (const double distance = (discs[k] - predicted[i]).squaredNorm(); distance < least) {
        least = distance;
        nearest = int(k);
      }
    if (nearest < 0 || !(least < best[std::size_t(nearest)])) continue;
    best[std::size_t(nearest)] = least;
    owner[std::size_t(nearest)] = int(i);
  }
  std::vector<Hit> hits;
  for (std::size_t k = 0; k < discs.size(); ++k)
    if (owner[k] >= 0) hits.push_back({owner[k], int(k)});
  return hits;
}

Points mapped(const Eigen::Matrix3d& map, const Points& points) {
  Points result;
  for (const auto& point : points) result.emplace_back((map * point.homogeneous()).hnormalized());
  return result;
}

/// Calls `visit` for every choice of four indices below `count`, in ascending order. `visit` returns true to stop.
void for_each_four(int count, const std::function<bool(const std::array<int, 4>&)>& visit) {
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b)
      for (int c = b + 1; c < count; ++c)
        for (int d = c + 1; d < count; ++d)
          if (visit({a, b, c, d})) return;
}

struct Side {
  Points points;               ///< all its beads in the plane, in mm
  std::vector<int> landmarks;  ///< indices into points
};

Side side_of(const Board& board, int side) {
  const std::vector<int> all = board.of_side(side);
  Side result{board.flat_mm(side, all), {}};
  for (std::size_t i = 0; i < all.size(); ++i)
    if (board.beads[std::size_t(all[i])].landmark) result.landmarks.push_back(int(i));
  return result;
}

std::array<Eigen::Vector2d, 4> pick(const Points& points, const std::array<int, 4>& indices) {
  return {points[std::size_t(indices[0])], points[std::size_t(indices[1])], points[std::size_t(indices[2])],
          points[std::size_t(indices[3])]};
}

/// Calls `judge` for every projective map that takes four landmarks of a side to four of the first `candidates` discs.
/// `judge` returns true to stop.
void for_each_map(const Side& side, const Points& discs, int candidates,
                  const std::function<bool(const Eigen::Matrix3d&)>& judge) {
  bool stop = false;
  for_each_four(int(side.landmarks.size()), [&](const std::array<int, 4>& chosen) {
    std::array<int, 4> indices;
    for (std::size_t i = 0; i < 4; ++i) indices[i] = side.landmarks[std::size_t(chosen[i])];
    const auto from = pick(side.points, indices);
    if (!in_general_position(from)) return false;
    const auto turns = turns_of(from);
    for_each_four(candidates, [&](std::array<int, 4> taken) {
      do {
        const auto to = pick(discs, taken);
        const auto seen = turns_of(to);
        int kept = 0;
        for (std::size_t i = 0; i < 4; ++i) kept += turns[i] == seen[i];
        if ((kept == 0 || kept == 4) && in_general_position(to)) stop = judge(map_of_four(from, to));
      } while (!stop && std::next_permutation(taken.begin(), taken.end()));
      return stop;
    });
    return stop;
  });
}

bool is_inside(const Eigen::Vector2d& at, int width_px, int height_px) {
  return at.x() >= 0 && at.y() >= 0 && at.x() <= width_px - 1 && at.y() <= height_px - 1;
}

struct SideFound {
  std::vector<Hit> hits;
  int in_image = 0;
};

SideFound find_side(const Side& side, const Points& discs, int landmarks_in_image, int width_px, int height_px) {
  const double reach = kReach * width_px;
  SideFound best;
  const auto count = [&](const Eigen::Matrix3d& map) {
    SideFound found;
    const Points predicted = mapped(map, side.points);
    for (const auto& at : predicted) found.in_image += is_inside(at, width_px, height_px);
    found.hits = hits_of(predicted, discs, reach);
    return found;
  };
  const int candidates = std::min(int(discs.size()), landmarks_in_image + 3);
  for_each_map(side, discs, candidates, [&](const Eigen::Matrix3d& map) {
    SideFound found = count(map);
    if (found.hits.size() > best.hits.size()) best = std::move(found);
    return best.hits.size() >= kSurelyFound && are_enough(best.hits.size(), best.in_image, 0.8);
  });
  // A map fitted to all beads found so far reaches beads that the map of four landmarks misses.
  for (int round = 0; round < 3 && best.hits.size() >= 4; ++round) {
    std::vector<cv::Point2d> from, to;
    for (const Hit& hit : best.hits) {
      from.emplace_back(side.points[std::size_t(hit.point)].x(), side.points[std::size_t(hit.point)].y());
      to.emplace_back(discs[std::size_t(hit.disc)].x(), discs[std::size_t(hit.disc)].y());
    }
    const cv::Mat map = cv::findHomography(from, to, 0);
    if (map.empty()) break;
    SideFound found = count(to_eigen(map));
    if (found.hits.size() < best.hits.size()) break;
    best = std::move(found);
  }
  return best;
}

ViewPoints points_of(const Board& board, const std::vector<Hit>& hits, const Points& discs, const std::string& view) {
  ViewPoints points{view, {}, {}, {}};
  for (const Hit& hit : hits) {
    points.beads.push_back(hit.point);
    points.board_mm.push_back(board.beads[std::size_t(hit.point)].centre_mm);
    points.pixels.push_back(discs[std::size_t(hit.disc)]);
  }
  return points;
}

double root_mean_square(const std::vector<Eigen::Vector2d>& residuals) {
  double squares = 0;
  for (const auto& residual : residuals) squares += residual.squaredNorm();
  return std::sqrt(squares / double(std::max<std::size_t>(1, residuals.size())));
}

/// Fits a camera to the beads of both sides, predicts where each bead is seen, and matches again. This adds beads and
/// removes wrong matches.
ViewPoints match_by_camera(const Board& board, const Points& discs, ViewPoints points, int width_px, int height_px) {
  const CalibrationModel model{.radial_terms = 1, .square_pixels = true, .principal_point = false};
  for (const double reach : {2 * kReachOfCamera * width_px, kReachOfCamera * width_px, kReachOfCamera * width_px}) {
    const CalibrationResult camera = calibrate({points}, width_px, height_px, model);
    const double rms = root_mean_square(camera.views[0].residuals_px);
    if (rms > kReach * width_px)
      throw Error(
          formatted("view '{}': the board's two sides are found but do not fit one camera ({} px off); check the "
                    "distance and the position of the sides in the board's file",
                    points.name, int(rms)));
    Points predicted;
    for (const Bead& bead : board.beads)
      predicted.push_back(seen_at(camera.calibration, camera.views[0].camera_from_world, bead.centre_mm));
    points = points_of(board, hits_of(predicted, discs, reach), discs, points.name);
  }
  return points;
}

}  // namespace

ViewPoints match_board(const Board& board, const std::vector<BeadImage>& images, int width_px, int height_px,
                       const std::string& view) {
  Points discs;
  for (const BeadImage& image : images) discs.push_back(image.centre_px);
  const int landmarks = int(board.of_side(0, true).size() + board.of_side(1, true).size());
  std::vector<Hit> hits;
  for (int side : {0, 1}) {
    const std::vector<int> beads = board.of_side(side);
    const SideFound found = find_side(side_of(board, side), discs, landmarks, width_px, height_px);
    if (found.hits.size() < kLeastBeads || !are_enough(found.hits.size(), found.in_image, kLeastFound))
      throw Error(formatted(
          "view '{}': side '{}' of the board is not found: among {} dark discs, the best match explains {} of its {} "
          "beads; at least 4 of its landmarks must be seen whole, not hidden by another bead or cut by the border",
          view, board.sides[std::size_t(side)], discs.size(), found.hits.size(), beads.size()));
    for (const Hit& hit : found.hits) hits.push_back({beads[std::size_t(hit.point)], hit.disc});
  }
  // A disc that both sides claim is left out here. The camera decides about it.
  std::vector<int> claims(discs.size());
  for (const Hit& hit : hits) ++claims[std::size_t(hit.disc)];
  std::erase_if(hits, [&](const Hit& hit) { return claims[std::size_t(hit.disc)] > 1; });
  return match_by_camera(board, discs, points_of(board, hits, discs, view), width_px, height_px);
}

bool can_be_mistaken(const Board& board, int side, int other) {
  const Side flat = side_of(board, side), as = side_of(board, other);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < as.points.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) nearest = std::min(nearest, (as.points[i] - as.points[k]).norm());
  // The other side is used as an image, with its landmarks first. A side compared with itself may only fit under the
  // map that leaves all beads in place.
  Points discs;
  for (int i : as.landmarks) discs.push_back(as.points[std::size_t(i)]);
  for (std::size_t i = 0; i < as.points.size(); ++i)
    if (std::find(as.landmarks.begin(), as.landmarks.end(), int(i)) == as.landmarks.end())
      discs.push_back(as.points[i]);
  bool mistaken = false;
  for_each_map(flat, discs, int(as.landmarks.size()), [&](const Eigen::Matrix3d& map) {
    const Points predicted = mapped(map, flat.points);
    double moved = 0;
    for (std::size_t i = 0; i < predicted.size(); ++i) moved = std::max(moved, (predicted[i] - flat.points[i]).norm());
    const std::size_t hits = hits_of(predicted, discs, 0.3 * nearest).size();
    mistaken = are_enough(hits, int(std::min(flat.points.size(), as.points.size())), kLeastFound) &&
               (side != other || moved > 0.5 * nearest);
    return mistaken;
  });
  return mistaken;
}

}  // namespace marrow::calibration
