// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/free_scan.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/initial/seen_space.hpp"

namespace marrow::initial {
namespace {

constexpr double kDepthRatio = 1.15;  ///< of neighbouring depths for which an outline is scaled

/// Adds the scores that one point of the outline meets, for a row of places.
MARROW_DISPATCH void add_row(std::int16_t* sums, const std::int8_t* scores, int count) {
  for (int i = 0; i < count; ++i) sums[i] = std::int16_t(sums[i] + scores[i]);
}

/// The orientation number `i` of `count`, spread evenly (Alexa 2022, Eq 4).
Eigen::Matrix3d orientation(int i, int count) {
  constexpr double kPhi = 1.4142135623730951, kPsi = 1.533751168755204288118041;
  const double s = i + 0.5, inner = std::sqrt(s / count), outer = std::sqrt(1 - s / count);
  const double alpha = 2 * kPi * s / kPhi, beta = 2 * kPi * s / kPsi;
  return Eigen::Quaterniond(outer * std::cos(beta), inner * std::sin(alpha), inner * std::cos(alpha),
                            outer * std::sin(beta))
      .normalized()
      .toRotationMatrix();
}

/// Points of the model that may lie where the views look, in its own coordinates: its middle, and for a long one more
/// of them along its longest axis.
std::vector<Eigen::Vector3d> aims_of(const Mesh& model, const FragmentFrame& frame, double width_mm) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : model.vertices_mm)
    box.extend(frame.axes.transpose() * (vertex - frame.origin_mm));
  Eigen::Index longest;
  const double length_mm = box.sizes().maxCoeff(&longest);
  const double span_mm = length_mm > width_mm ? length_mm - 0.5 * width_mm : 0;
  const int steps = int(std::ceil(span_mm / (0.5 * width_mm)));
  std::vector<Eigen::Vector3d> aims;
  for (int k = 0; k <= steps; ++k) {
    Eigen::Vector3d aim = box.center();
    if (steps > 0) aim[longest] += span_mm * (double(k) / steps - 0.5);
    aims.push_back(frame.origin_mm + frame.axes * aim);
  }
  return aims;
}

/// A view, with what an outline is drawn and slid with.
struct Slide {
  Slide(const View& view, const EdgeMap& edges, const Eigen::Vector3d& middle, double cell_mm, double radius_mm)
      : scores(view, edges, cell_mm / pixel_size_at_mm(view.camera, middle)),
        camera(view.camera),
        middle_depth_mm((view.camera.camera_from_world * middle).z()) {
    const double scale = kFine / scores.cell_px();
    const int half = int(std::ceil(radius_mm / cell_mm + 2)) * kFine;
    const Eigen::Vector2d shift = Eigen::Vector2d::Constant(half) - scale * project(view.camera, middle);
    drawn = view.camera;
    drawn.intrinsics.topRows<2>() *= scale;
    drawn.intrinsics.topRightCorner<2, 1>() += shift;
    drawn.width_px = drawn.height_px = 2 * half + 1;
  }

  static constexpr int kFine = 3;  ///< pixels of the drawn outline per cell
  EdgeScores scores;
  Camera camera, drawn;  ///< `drawn` has the middle of the views in the middle of its image
  double middle_depth_mm;
  int nearest = 0, farthest = 0;  ///< steps of depth from the middle
  std::size_t first = 0;          ///< of its sums among those of all views

  int depth_step(const Eigen::Vector3d& world_mm) const {
    return int(
        std::lround(std::log((camera.camera_from_world * world_mm).z() / middle_depth_mm) / std::log(kDepthRatio)));
  }
  std::size_t cells() const { return std::size_t(scores.columns()) * std::size_t(scores.rows()); }
  std::size_t sums() const { return cells() * std::size_t(farthest - nearest + 1); }
  /// Where the sum of an outline at a place is.
  std::uint32_t index_of(const Eigen::Vector3d& world_mm) const {
    const Eigen::Vector2d cell = project(camera, world_mm) / scores.cell_px();
    const int column = std::clamp(int(cell.x()), 0, scores.columns() - 1),
              row = std::clamp(int(cell.y()), 0, scores.rows() - 1);
    return std::uint32_t(first + std::size_t(depth_step(world_mm) - nearest) * cells() +
                         std::size_t(row) * std::size_t(scores.columns()) + std::size_t(column));
  }

  /// The sums of an outline at all cells and depths.
  void slide(const std::vector<OutlinePoint>& outline, std::vector<std::int16_t>& sums) const {
    constexpr std::size_t kMostPoints = 250;  // more could overflow
    const std::size_t step = 1 + outline.size() / kMostPoints;
    const double middle = 0.5 * (drawn.width_px - 1);
    for (int depth = nearest; depth <= farthest; ++depth) {
      std::int16_t* const of_depth = sums.data() + first + std::size_t(depth - nearest) * cells();
      std::fill(of_depth, of_depth + cells(), std::int16_t(0));
      const double scale = std::pow(kDepthRatio, -depth) / kFine;
      for (std::size_t i = 0; i < outline.size(); i += step)
        add(outline[i], int(std::lround(scale * (outline[i].u_px - middle))),
            int(std::lround(scale * (outline[i].v_px - middle))), of_depth);
    }
  }

 private:
  void add(const OutlinePoint& point, int du, int dv, std::int16_t* sums) const {
    const int columns = scores.columns(), rows = scores.rows(), from = std::max(0, -du),
              count = std::min(columns, columns - du) - from;
    const std::int8_t* of_sector = scores.of(EdgeScores::sector_of(point.normal_u, point.normal_v));
    if (count <= 0) return;
    for (int row = std::max(0, -dv); row < std::min(rows, rows - dv); ++row)
      add_row(sums + row * columns + from, of_sector + (row + dv) * columns + from + du, count);
  }
};

/// The best place of the model in one orientation, with one of its points in view.
struct Placed {
  int score = std::numeric_limits<int>::min();
  RigidTransform world_from_model;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< of the model, in the world
};

class Scan {
 public:
  Scan(const Seen& seen, const FragmentFrame& frame, int rotations)
      : seen_(seen), frame_(frame), rotations_(rotations), space_(SeenSpace::of(seen.views)) {
    aims_ = aims_of(seen.model, frame, space_.width_mm);
    double radius_mm = 0;
    for (const Eigen::Vector3d& vertex : seen.model.vertices_mm)
      radius_mm = std::max(radius_mm, (vertex - frame.origin_mm).norm());
    radius_mm = std::min(radius_mm, space_.width_mm);
    cell_mm_ = std::min(2 * radius_mm, space_.width_mm) / 40;
    places_mm_ = places_in(space_, seen.views, 2 * cell_mm_);
    set_ranges();
    std::size_t first = 0;
    for (std::size_t view = 0; view < seen.views.size(); ++view) {
      slides_.emplace_back(seen.views[view], seen.edges[view], space_.middle_mm, cell_mm_, radius_mm);
      Slide& slide = slides_.back();
      for (const Eigen::Vector3d& place : places_mm_) {
        slide.nearest = std::min(slide.nearest, slide.depth_step(place));
        slide.farthest = std::max(slide.farthest, slide.depth_step(place));
      }
      slide.first = first;
      first += slide.sums();
    }
    sums_ = first;
    for (const Slide& slide : slides_)
      for (const Eigen::Vector3d& place : places_mm_) indices_.push_back(slide.index_of(place));
  }

  /// For each orientation, aim and range of depths, the ranges last.
  std::vector<Placed> run(Context& context) const {
    std::vector<Placed> all(std::size_t(rotations_) * aims_.size() * ranges());
    tbb::parallel_for(0, rotations_, [&](int rotation) {
      context.check_cancelled();
      std::vector<std::int16_t> sums(sums_);
      for (std::size_t k = 0; k < aims_.size(); ++k)
        best(rotation, aims_[k], sums, &all[(std::size_t(rotation) * aims_.size() + k) * ranges()]);
    });
    return all;
  }

  std::size_t ranges() const { return range_ends_.size(); }
  const Eigen::Vector3d& middle_mm() const { return space_.middle_mm; }
  double cell_mm() const { return cell_mm_; }
  /// Neighbours: a registration from one may well end where one from the other does.
  bool near(const Placed& a, const Placed& b) const {
    constexpr double kNear_rad = 15 * kPi / 180;
    return (a.middle_mm - b.middle_mm).norm() < 6 * cell_mm_ &&
           geodesic_angle_rad(a.world_from_model.rotation, b.world_from_model.rotation) < kNear_rad;
  }

 private:
  /// Of one view, each doubling of the depth is a range of its own: far outlines are short, so their scores scatter
  /// less, and near ones that are only nearly right would never come first. The places are in the order of their depth.
  void set_ranges() {
    double begin_mm = space_.nearest_mm;
    for (std::size_t place = 0; seen_.views.size() == 1 && place < places_mm_.size(); ++place) {
      const double depth_mm = (seen_.views[0].camera.camera_from_world * places_mm_[place]).z();
      if (depth_mm < 1.99 * begin_mm) continue;
      range_ends_.push_back(place);
      begin_mm = depth_mm;
    }
    range_ends_.push_back(places_mm_.size());
  }

  RigidTransform placed_at(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& aim,
                           const Eigen::Vector3d& at_mm) const {
    return {"world", seen_.model.frame, rotation, at_mm - rotation * aim};
  }

  /// The best place in each range of depths.
  void best(int number, const Eigen::Vector3d& aim, std::vector<std::int16_t>& sums, Placed* placed) const {
    constexpr double kSpacing_cells = 1.5;
    const Eigen::Matrix3d rotation = seen_.views[0].camera.camera_from_world.rotation.transpose() *
                                     orientation(number, rotations_) * frame_.axes.transpose();
    const RigidTransform in_middle = placed_at(rotation, aim, space_.middle_mm);
    for (const Slide& slide : slides_)
      slide.slide(seen_.projector.outline(slide.drawn, in_middle, kSpacing_cells * Slide::kFine), sums);
    std::size_t place = 0;
    for (const std::size_t end : range_ends_) {
      std::size_t at = place;
      for (; place < end; ++place) {
        int score = 0;
        for (std::size_t view = 0; view < slides_.size(); ++view)
          score += sums[indices_[view * places_mm_.size() + place]];
        if (score > placed->score) placed->score = score, at = place;
      }
      placed->world_from_model = placed_at(rotation, aim, places_mm_[at]);
      placed->middle_mm = placed->world_from_model * frame_.origin_mm;
      ++placed;
    }
  }

  const Seen& seen_;
  const FragmentFrame& frame_;
  const int rotations_;
  const SeenSpace space_;
  std::vector<Eigen::Vector3d> aims_, places_mm_;
  std::vector<std::size_t> range_ends_;  ///< the first place behind each range of depths
  double cell_mm_ = 1;
  std::vector<Slide> slides_;
  std::size_t sums_ = 0;
  std::vector<std::uint32_t> indices_;  ///< of the sum at each place, one view after the other
};

}  // namespace

Scanned free_scan(const Seen& seen, const FragmentFrame& frame, int rotations, std::size_t poses, Context& context) {
  const Scan scan(seen, frame, rotations);
  const std::vector<Placed> all = scan.run(context);
  const std::size_t ranges = scan.ranges();
  Scanned scanned{{}, scan.middle_mm(), scan.cell_mm()};
  for (std::size_t range = 0; range < ranges; ++range) {
    std::vector<Placed> in_range, chosen;
    for (std::size_t i = range; i < all.size(); i += ranges) in_range.push_back(all[i]);
    std::stable_sort(in_range.begin(), in_range.end(),
                     [](const Placed& a, const Placed& b) { return a.score > b.score; });
    for (const Placed& placed : in_range) {
      if (chosen.size() == poses / ranges) break;
      if (std::any_of(chosen.begin(), chosen.end(), [&](const Placed& other) { return scan.near(placed, other); }))
        continue;
      chosen.push_back(placed);
      scanned.poses.push_back(placed.world_from_model);
    }
  }
  return scanned;
}

}  // namespace marrow::initial
