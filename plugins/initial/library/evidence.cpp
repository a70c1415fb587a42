// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/evidence.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "marrow/initial/seen_space.hpp"

namespace marrow::initial {

/// How one view sees the outline of a bone that was drawn at one pose and then moves a little. The points of the
/// surface on that outline move with the bone, so nothing is drawn anew. The true outline wanders on the surface
/// meanwhile, but along the lines of sight: a turn by an angle about the middle of a sphere moves it by 1 - cos(angle)
/// of the radius.
class MovedOutline {
 public:
  /// All of them are referred to, not copied.
  MovedOutline(const OutlineProjector& projector, const Camera& camera, const EdgeScores& scores);

  /// Draws the outline, and eight cells of it around the image, too: from there, points may move into it.
  void draw(const RigidTransform& world_from_model);

  /// The sum of its scores in the image after a motion of the bone in the world.
  int score_after(const RigidTransform& world_from_world) const;

 private:
  /// In camera coordinates.
  struct SurfacePoint {
    Eigen::Vector3f place_mm, normal;
  };

  const OutlineProjector& projector_;
  const Camera& camera_;
  const EdgeScores& scores_;
  std::vector<SurfacePoint> points_;
};

Evidence::Evidence(const Seen& seen, const Eigen::Vector3d& middle_mm, double cell_mm)
    : seen_(seen), middle_mm_(middle_mm) {
  for (std::size_t view = 0; view < seen.views.size(); ++view)
    scores_.emplace_back(seen.views[view], seen.edges[view],
                         cell_mm / pixel_size_at_mm(seen.views[view].camera, middle_mm));
}

double Evidence::of(const RigidTransform& world_from_model) const {
  double sum = 0;
  for (std::size_t view = 0; view < scores_.size(); ++view) {
    const EdgeScores& scores = scores_[view];
    for (const OutlinePoint& point :
         seen_.projector.outline(seen_.views[view].camera, world_from_model, scores.cell_px()))
      sum += scores.at(point.u_px, point.v_px, point.normal_u, point.normal_v);
  }
  return sum;
}

std::vector<RigidTransform> Evidence::best(const std::vector<RigidTransform>& poses, std::size_t count) const {
  std::vector<double> values(poses.size());
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) { values[i] = of(poses[i]); });
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  order.resize(std::min(order.size(), count));
  std::vector<RigidTransform> best;
  for (const std::size_t i : order) best.push_back(poses[i]);
  return best;
}

namespace {

RigidTransform motion_about(const Eigen::Vector3d& pivot_mm, const Eigen::Matrix3d& turn) {
  return {"world", "world", turn, pivot_mm - turn * pivot_mm};
}

}  // namespace

struct Evidence::Climber {
  explicit Climber(const Evidence& evidence) : axes(evidence.seen_.views[0].camera.camera_from_world.rotation) {
    axes.transposeInPlace();
    for (std::size_t view = 0; view < evidence.scores_.size(); ++view)
      outlines.emplace_back(evidence.seen_.projector, evidence.seen_.views[view].camera, evidence.scores_[view]);
  }

  void draw(const RigidTransform& pose) {
    for (MovedOutline& outline : outlines) outline.draw(pose);
  }
  int after(const RigidTransform& motion) const {
    int sum = 0;
    for (const MovedOutline& outline : outlines) sum += outline.score_after(motion);
    return sum;
  }

  /// The moves of one round, one after the other: each that gives more evidence counts.
  RigidTransform round(const Eigen::Vector3d& pivot_mm, double step_deg, double step_mm) const {
    RigidTransform best = motion_about(pivot_mm, Eigen::Matrix3d::Identity());
    int most = after(best);
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        const Eigen::Vector3d direction = sense * axes.col(axis % 3);
        RigidTransform moved = best;
        if (axis < 3)
          moved = best * motion_about(pivot_mm, rotation_from_vector(radians(step_deg) * direction));
        else
          moved.translation_mm += step_mm * direction;
        const int value = after(moved);
        if (value <= most) continue;
        most = value, best = moved;
        break;
      }
    return best;
  }

  /// After the moves of each round, the outline is drawn anew.
  RigidTransform climbed(RigidTransform pose, const Eigen::Vector3d& pivot_mm, double step_deg, double step_mm) {
    constexpr int kRounds = 2;
    const RigidTransform stay = motion_about(pivot_mm, Eigen::Matrix3d::Identity());
    draw(pose);
    int most = after(stay);
    for (int round_number = 0; round_number < kRounds; ++round_number) {
      const RigidTransform moved = round(pivot_mm, step_deg, step_mm) * pose;
      draw(moved);
      const int value = after(stay);
      if (value <= most) break;
      most = value, pose = moved;
    }
    return pose;
  }

  Eigen::Matrix3d axes;  ///< of the first camera, in the world
  std::vector<MovedOutline> outlines;
};

void Evidence::climb(std::vector<RigidTransform>& poses, const Eigen::Vector3d& model_middle_mm, double step_deg,
                     double step_mm) const {
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) {
    const Eigen::Vector3d at_mm = poses[i] * model_middle_mm;
    bool is_in_view = true;
    for (const View& view : seen_.views) is_in_view = is_in_view && is_seen(view.camera, at_mm);
    poses[i] = Climber(*this).climbed(poses[i], is_in_view ? at_mm : middle_mm_, step_deg, step_mm);
  });
}

namespace {

/// The cells of edges whose gradient is within 35 degrees of a direction are 0, all others 255.
cv::Mat cells_without(const EdgeMap& edges, const cv::Mat& usable, double cell_px, double direction_rad) {
  constexpr double kLeastCosine = 0.82;
  cv::Mat cells(usable.size(), CV_8U, cv::Scalar(255));
  const double cu = std::cos(direction_rad), cv = std::sin(direction_rad);
  for (const EdgePixel& edge : edges.pixels) {
    if (edge.direction_u * cu + edge.direction_v * cv < kLeastCosine) continue;
    const int column = int(edge.u_px / cell_px), row = int(edge.v_px / cell_px);
    if (column < 0 || row < 0 || column >= cells.cols || row >= cells.rows) continue;
    if (usable.at<std::uint8_t>(row, column)) cells.at<std::uint8_t>(row, column) = 0;
  }
  return cells;
}

}  // namespace

int EdgeScores::sector_of(double normal_u, double normal_v) {
  const double turns = std::atan2(normal_v, normal_u) / (2 * kPi);
  return int(std::lround(turns * kSectors) + kSectors) % kSectors;
}

EdgeScores::EdgeScores(const View& view, const EdgeMap& edges, double cell_px)
    : columns_(int(std::ceil(view.camera.width_px / cell_px))),
      rows_(int(std::ceil(view.camera.height_px / cell_px))),
      cell_px_(cell_px) {
  constexpr double kMatchedOfBone = 0.95, kReach_cells = 7;
  cv::Mat usable(rows_, columns_, CV_8U, cv::Scalar(255));
  if (!view.mask.empty()) cv::resize(view.mask, usable, usable.size(), 0, 0, cv::INTER_NEAREST);
  std::vector<cv::Mat> matched(kSectors);  // 1 at an edge, 0 from the reach on
  double sum = 0;
  for (int sector = 0; sector < kSectors; ++sector) {
    cv::Mat distance;
    cv::distanceTransform(cells_without(edges, usable, cell_px, 2 * kPi * sector / kSectors), distance, cv::DIST_L2,
                          cv::DIST_MASK_PRECISE);
    matched[std::size_t(sector)] = cv::max(1 - distance / kReach_cells, 0);
    sum += cv::mean(matched[std::size_t(sector)], usable)[0] / kSectors;
  }
  const double by_chance = std::clamp(sum, 0.05, 0.6);
  const double of_hit = std::log(kMatchedOfBone / by_chance),
               of_miss = std::log((1 - kMatchedOfBone) / (1 - by_chance)),
               unit = kMost / std::log(kMatchedOfBone / 0.05);
  scores_.assign(std::size_t(kSectors) * std::size_t(columns_) * std::size_t(rows_), 0);
  auto score = scores_.begin();
  for (const cv::Mat& of_sector : matched)
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column, ++score)
        if (usable.at<std::uint8_t>(row, column))
          *score = std::int8_t(
              std::lround(unit * (of_miss + double(of_sector.at<float>(row, column)) * (of_hit - of_miss))));
}

MovedOutline::MovedOutline(const OutlineProjector& projector, const Camera& camera, const EdgeScores& scores)
    : projector_(projector), camera_(camera), scores_(scores) {}

void MovedOutline::draw(const RigidTransform& world_from_model) {
  constexpr double kMargin_cells = 8;
  const int margin_px = int(kMargin_cells * scores_.cell_px());
  Camera wide = camera_;
  wide.intrinsics.topRightCorner<2, 1>().array() += margin_px;
  wide.width_px += 2 * margin_px, wide.height_px += 2 * margin_px;
  const RigidTransform camera_from_model = camera_.camera_from_world * world_from_model;
  points_.clear();
  for (const OutlinePoint& point : projector_.outline(wide, world_from_model, scores_.cell_px())) {
    const Eigen::Vector2d normal(point.normal_u, point.normal_v);
    const Eigen::Vector2d at_px(point.u_px - margin_px, point.v_px - margin_px);
    // The tangent plane of the surface contains the ray, so the tangent of the outline is its image.
    const Eigen::Vector3d tangent(normal.x(), normal.y(), -normal.dot(at_px));
    points_.push_back({(camera_from_model * point.model_mm.cast<double>().eval()).cast<float>(),
                       (camera_.intrinsics.transpose() * tangent).normalized().cast<float>()});
  }
}

int MovedOutline::score_after(const RigidTransform& world_from_world) const {
  const RigidTransform moved = camera_.camera_from_world * world_from_world * inverse(camera_.camera_from_world);
  const Eigen::Matrix3d& intrinsics = camera_.intrinsics;
  const Eigen::Matrix3f image = (intrinsics * moved.rotation).cast<float>(),
                        tangents = (intrinsics.inverse().transpose() * moved.rotation).cast<float>();
  const Eigen::Vector3f offset = (intrinsics * moved.translation_mm).cast<float>();
  const float width_px = float(camera_.width_px - 1), height_px = float(camera_.height_px - 1);
  int sum = 0;
  for (const SurfacePoint& point : points_) {
    const Eigen::Vector3f place = image * point.place_mm + offset;
    const float u_px = place.x() / place.z(), v_px = place.y() / place.z();
    if (!(place.z() > 0 && u_px >= 0 && v_px >= 0 && u_px <= width_px && v_px <= height_px)) continue;
    const Eigen::Vector2f normal = (tangents * point.normal).head<2>();
    sum += scores_.at(u_px, v_px, normal.x(), normal.y());
  }
  return sum;
}

}  // namespace marrow::initial
