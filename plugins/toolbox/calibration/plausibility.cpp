// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace marrow::calibration {
namespace {

constexpr double kLeastAngle_deg = 2, kLargestAngle_deg = 60;  ///< opening angle of the image
constexpr double kNearest_mm = 200, kFarthest_mm = 5000;       ///< distance of the object from the source
constexpr double kSmallest_mm = 3, kLargest_mm = 2500;         ///< extent of the object
constexpr double kBetter = 5;                                  ///< factor by which undoing a mistake reduces the error
constexpr double kExplained = 0.02;  ///< largest error that may remain then, as a part of the image's width

std::string text(double value) { return formatted("{:.4g}", value); }

std::string size_text(double width, double height) { return formatted("{:.4g} x {:.4g}", width, height); }

void check_focal_length(const Camera& camera, const Device& device, std::vector<std::string>& found) {
  const double f_u = camera.intrinsics(0, 0), f_v = camera.intrinsics(1, 1);
  const double angle = 2 * degrees(std::atan(0.5 * camera.width_px / f_u));
  if (angle > kLargestAngle_deg || angle < kLeastAngle_deg)
    found.push_back(
        formatted("the focal length of {:.4g} px opens an image of {:.4g} px to {:.4g} degrees, where X-ray devices "
                  "open 5 to 30; is it in mm (it is the source-to-detector distance over the size of a pixel), or of "
                  "an image of another size?",
                  f_u, double(camera.width_px), angle));
  if (std::abs(f_u / f_v - 1) > 0.1)
    found.push_back(
        formatted("the focal lengths {:.4g} and {:.4g} px differ, so pixels would not be square; are width and height "
                  "of a pixel exchanged or one of them wrong?",
                  f_u, f_v));
  if (device.source_to_detector_mm > 0 && device.pixel_mm > 0) {
    const double expected = device.source_to_detector_mm / device.pixel_mm;
    if (std::abs(f_u / expected - 1) > 0.05)
      found.push_back(
          formatted("the focal length is {:.4g} px, but {:.4g} mm from source to detector and pixels of {:.4g} mm make "
                    "{:.4g}; the pixels are scaled to the patient, or binned?",
                    f_u, device.source_to_detector_mm, device.pixel_mm, expected));
  }
  const double pixel_mm = device.pixel_mm > 0                ? device.pixel_mm
                          : device.source_to_detector_mm > 0 ? device.source_to_detector_mm / f_u
                                                             : 0;
  if (device.detector_mm > 0 && pixel_mm > 0 &&
      std::max(camera.width_px, camera.height_px) * pixel_mm > 1.02 * device.detector_mm)
    found.push_back(
        formatted("the detector is {:.4g} mm wide, smaller than the image says: {} mm at {:.4g} mm per pixel; the size "
                  "of a pixel is too large, or the image was enlarged",
                  device.detector_mm, size_text(camera.width_px * pixel_mm, camera.height_px * pixel_mm), pixel_mm));
}

void check_principal_point(const Camera& camera, std::vector<std::string>& found) {
  const Eigen::Vector2d principal = camera.intrinsics.topRightCorner<2, 1>(), size(camera.width_px, camera.height_px);
  const Eigen::Vector2d share = principal.cwiseQuotient(size);
  for (const double factor : {0.25, 0.5, 2.0, 4.0})
    if ((share - Eigen::Vector2d::Constant(0.5 * factor)).cwiseAbs().maxCoeff() < 0.03 * factor) {
      found.push_back(
          formatted("the principal point ({:.4g}, {:.4g}) lies in the middle of an image of {} pixels, but this one "
                    "has {}; the camera matrix is that of the image before it was resized or binned",
                    principal.x(), principal.y(), size_text(factor * size.x(), factor * size.y()),
                    size_text(size.x(), size.y())));
      return;
    }
  if ((share.array() < 0).any() || (share.array() > 1).any())
    found.push_back(
        formatted("the principal point ({:.4g}, {:.4g}) lies outside the image of {} pixels; is it in mm, or of an "
                  "image before it was cropped?",
                  principal.x(), principal.y(), size_text(size.x(), size.y())));
  else if ((share.array() - 0.5).abs().maxCoeff() > 0.25)
    found.push_back(
        formatted("the principal point ({:.4g}, {:.4g}) lies far from the middle of the image of {} pixels; are its "
                  "two numbers exchanged, or was the image cropped?",
                  principal.x(), principal.y(), size_text(size.x(), size.y())));
}

void check_object(const Camera& camera, const std::vector<Eigen::Vector3d>& object_mm,
                  std::vector<std::string>& found) {
  Eigen::AlignedBox3d box;
  std::size_t behind = 0, outside = 0;
  for (const auto& point : object_mm) {
    box.extend(point);
    const Eigen::Vector2d at = project(camera, point);
    behind += !at.allFinite();
    outside += at.allFinite() && !(at.x() > -1 && at.y() > -1 && at.x() < camera.width_px && at.y() < camera.height_px);
  }
  if (object_mm.empty()) {  // the patient is near the origin
    if (const std::string doubt = files::doubt_about_distance(camera, 1); !doubt.empty()) found.push_back(doubt);
    return;
  }
  const double distance = (source_position_mm(camera) - box.center()).norm();
  const double extent = object_mm.size() > 1 ? box.diagonal().norm() : 0;
  if (object_mm.size() > 1 && (extent < kSmallest_mm || extent > kLargest_mm))
    found.push_back(formatted("the object is {:.4g} mm large; are its coordinates in {}", extent,
                              extent < kSmallest_mm ? "metres or centimetres?" : "a smaller unit than mm?"));
  if (distance < kNearest_mm || distance > kFarthest_mm)
    found.push_back(
        formatted("the object is {:.4g} mm from the X-ray source, where C-arms have 300 to 1500; the camera's "
                  "translation, or the object, seems to be in another unit than mm{}",
                  distance, files::likely_unit(distance, kNearest_mm, kFarthest_mm, 1)));
  if (behind > 0)
    found.push_back(
        formatted("{:.4g} of {:.4g} points of the object lie behind the X-ray source; is the camera's pose given the "
                  "other way round (world from camera), or does its z axis run away from the detector?",
                  double(behind), double(object_mm.size())));
  else if (outside == object_mm.size())
    found.push_back("the object is projected wholly outside the image; is the camera that of another image?");
}

/// One mistake: the sentence about it, and a function that undoes it in camera, points and pixels.
struct Mistake {
  std::string sentence;
  std::function<void(Camera&, SeenPoints&)> undo;
  bool is_of_points = false;  ///< a mistake of the points' places in the world, which all views share
  bool is_of_unit = false;
};

Mistake pixel_mistake(const std::string& sentence,
                      const std::function<Eigen::Vector2d(const Eigen::Vector2d&, double, double)>& change) {
  return {sentence, [change](Camera& camera, SeenPoints& points) {
            for (auto& pixel : points.pixels) pixel = change(pixel, camera.width_px - 1, camera.height_px - 1);
          }};
}

Mistake point_mistake(const std::string& sentence, const Eigen::Vector3d& scale) {
  return {sentence,
          [scale](Camera&, SeenPoints& points) {
            for (auto& point : points.world_mm) point = point.cwiseProduct(scale);
          },
          true};
}

Mistake pose_mistake(const std::string& sentence, const std::function<void(RigidTransform&)>& change) {
  return {sentence, [change](Camera& camera, SeenPoints&) { change(camera.camera_from_world); }};
}

/// A pixel of the image before it was resized covers `scale` pixels. The middle of the first pixel is 0 in both images,
/// so places are multiplied about the image's corner, at -0.5.
Mistake size_mistake(const std::string& sentence, double scale) {
  return {sentence, [scale](Camera& camera, SeenPoints&) {
            camera.intrinsics.topRows<2>() *= scale;
            camera.intrinsics.topRightCorner<2, 1>().array() += 0.5 * (scale - 1);
          }};
}

std::vector<Mistake> all_mistakes() {
  using Eigen::Vector2d;
  std::vector<Mistake> mistakes{
      pixel_mistake("the image is mirrored left to right; mirror it back",
                    [](const Vector2d& p, double w, double) { return Vector2d(w - p.x(), p.y()); }),
      pixel_mistake("the image is upside down, or its rows are counted from below; turn it",
                    [](const Vector2d& p, double, double h) { return Vector2d(p.x(), h - p.y()); }),
      pixel_mistake("the image is turned by a half; turn it back",
                    [](const Vector2d& p, double w, double h) { return Vector2d(w - p.x(), h - p.y()); }),
      pixel_mistake("columns and rows of the seen places are exchanged; u, to the right, comes first",
                    [](const Vector2d& p, double, double) { return Vector2d(p.y(), p.x()); }),
      point_mistake("the x axis of the points is reversed", {-1, 1, 1}),
      point_mistake("the y axis of the points is reversed", {1, -1, 1}),
      point_mistake("the z axis of the points is reversed", {1, 1, -1}),
      point_mistake("the x and y axes of the points are reversed (RAS in place of LPS)", {-1, -1, 1}),
      pose_mistake("the camera's pose is given the other way round (world from camera)",
                   [](RigidTransform& pose) {
                     pose.rotation.transposeInPlace();
                     pose.translation_mm = -(pose.rotation * pose.translation_mm).eval();
                   }),
      pose_mistake("the camera's rotation is transposed",
                   [](RigidTransform& pose) { pose.rotation.transposeInPlace(); }),
      pose_mistake("the camera's y axis runs up and its z axis away from the detector (OpenGL's convention)",
                   [](RigidTransform& pose) {
                     const Eigen::Vector3d flip(1, -1, -1);
                     pose.rotation = flip.asDiagonal() * pose.rotation;
                     pose.translation_mm = pose.translation_mm.cwiseProduct(flip);
                   }),
      pose_mistake("the camera's translation is the source's position; it must be -R times that",
                   [](RigidTransform& pose) { pose.translation_mm = -(pose.rotation * pose.translation_mm).eval(); }),
      size_mistake(
          "the camera matrix is that of an image half as large; multiply its first two rows by 2, and then add 0.5 to "
          "the principal point",
          2),
      size_mistake(
          "the camera matrix is that of an image twice as large; multiply its first two rows by 0.5, and then subtract "
          "0.25 from the principal point",
          0.5)};
  const std::vector<std::pair<const char*, double>> units{
      {"metres", 1000}, {"centimetres", 10}, {"inches", 25.4}, {"micrometres", 0.001}};
  for (const auto& [unit, factor] : units) {
    mistakes.push_back(
        point_mistake("the points are in " + std::string(unit) + ", not mm", Eigen::Vector3d::Constant(factor)));
    mistakes.back().is_of_unit = true;
    mistakes.push_back(pose_mistake("the camera's translation is in " + std::string(unit) + ", not mm",
                                    [factor = factor](RigidTransform& pose) { pose.translation_mm *= factor; }));
    mistakes.back().is_of_unit = true;
  }
  return mistakes;
}

/// The error before a mistake is undone, and the largest that may remain. Chance can explain three points, and an error
/// below 1 % of the image is not due to a mistake of these kinds.
struct Trouble {
  bool exists = false;
  double error_px = 0, most_left_px = 0;
};

Trouble trouble_of(const Camera& camera, const SeenPoints& points) {
  Trouble trouble;
  trouble.error_px = reprojection_error_px(camera, points);
  trouble.exists = points.world_mm.size() >= 4 && !(trouble.error_px < 0.01 * camera.width_px);
  trouble.most_left_px = std::min(trouble.error_px / kBetter, kExplained * camera.width_px);
  return trouble;
}

/// Whether the source is as far from the points as devices are.
bool is_distance_plausible(const Camera& camera, const SeenPoints& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points.world_mm) box.extend(point);
  const double distance_mm = (source_position_mm(camera) - box.center()).norm();
  return distance_mm >= kNearest_mm && distance_mm <= kFarthest_mm;
}

/// Points in metres, and a translation in micrometres, project to the same pixels. So the distance decides which unit
/// is wrong.
double error_without(const Mistake& mistake, Camera camera, SeenPoints points) {
  mistake.undo(camera, points);
  if (mistake.is_of_unit && !is_distance_plausible(camera, points)) return std::numeric_limits<double>::infinity();
  return reprojection_error_px(camera, points);
}

class Explanations {
 public:
  Explanations(const std::vector<Camera>& cameras, const std::vector<SeenPoints>& points)
      : mistakes_(all_mistakes()), troubles_(cameras.size()), left_px_(cameras.size()) {
    for (std::size_t v = 0; v < cameras.size(); ++v) {
      troubles_[v] = trouble_of(cameras[v], points[v]);
      for (const Mistake& mistake : mistakes_) left_px_[v].push_back(error_without(mistake, cameras[v], points[v]));
    }
  }

  std::vector<std::optional<std::string>> sentences() const {
    const auto of_all = best([&](std::size_t m) { return explains_all(m); }, [&](std::size_t m) { return sum_px(m); });
    std::vector<std::optional<std::string>> found(troubles_.size());
    for (std::size_t v = 0; v < troubles_.size(); ++v) {
      const auto left_px = [&](std::size_t m) { return left_px_[v][m]; };
      auto mistake = of_all;
      for (const bool is_of_points : {false, true})
        if (!mistake)
          mistake =
              best([&](std::size_t m) { return explains(v, m) && mistakes_[m].is_of_points == is_of_points; }, left_px);
      if (mistake && troubles_[v].exists) found[v] = sentence(v, *mistake);
    }
    return found;
  }

 private:
  /// The mistake with the least error among those that may count; the first one of those with nearly the same error.
  std::optional<std::size_t> best(const std::function<bool(std::size_t)>& counts,
                                  const std::function<double(std::size_t)>& error_px) const {
    constexpr double kAlike = 0.9, kRounding_px = 1e-6;
    std::optional<std::size_t> best;
    for (std::size_t m = 0; m < mistakes_.size(); ++m)
      if (counts(m) && (!best || error_px(m) < kAlike * error_px(*best) - kRounding_px)) best = m;
    return best;
  }
  bool explains(std::size_t view, std::size_t mistake) const {
    return troubles_[view].exists && left_px_[view][mistake] < troubles_[view].most_left_px;
  }
  /// Whether undoing the mistake is right in all views with an error, and makes the points wrong in no other view.
  bool explains_all(std::size_t mistake) const {
    for (std::size_t v = 0; v < troubles_.size(); ++v) {
      if (troubles_[v].exists && !explains(v, mistake)) return false;
      if (!troubles_[v].exists && mistakes_[mistake].is_of_points && left_px_[v][mistake] > troubles_[v].error_px)
        return false;
    }
    return true;
  }
  double sum_px(std::size_t mistake) const {
    double sum = 0;
    for (std::size_t v = 0; v < troubles_.size(); ++v)
      if (troubles_[v].exists) sum += left_px_[v][mistake];
    return sum;
  }
  std::string sentence(std::size_t view, std::size_t mistake) const {
    const double error_px = troubles_[view].error_px;
    return formatted("the reprojection error is {}, and only {:.4g} px if {}",
                     std::isfinite(error_px) ? text(error_px) + " px" : std::string("without bound"),
                     left_px_[view][mistake], mistakes_[mistake].sentence);
  }

  const std::vector<Mistake> mistakes_;
  std::vector<Trouble> troubles_;
  std::vector<std::vector<double>> left_px_;  ///< of each view, without each mistake
};

/// The pose of a camera that shows the points best; from the camera's own, or from none.
std::optional<RigidTransform> solved_pose(const Camera& camera, const SeenPoints& points, bool from_its_own) {
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> pixels;
  for (const auto& p : points.world_mm) objects.emplace_back(p.x(), p.y(), p.z());
  for (const auto& p : points.pixels) pixels.emplace_back(p.x(), p.y());
  cv::Mat matrix(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) matrix.at<double>(r, c) = camera.intrinsics(r, c);
  const Eigen::Vector3d turn = vector_from_rotation(camera.camera_from_world.rotation);
  const Eigen::Vector3d& shift = camera.camera_from_world.translation_mm;
  cv::Mat rotation = (cv::Mat_<double>(3, 1) << turn.x(), turn.y(), turn.z());
  cv::Mat translation = (cv::Mat_<double>(3, 1) << shift.x(), shift.y(), shift.z());
  try {
    if (!cv::solvePnP(objects, pixels, matrix, cv::noArray(), rotation, translation, from_its_own,
                      from_its_own ? cv::SOLVEPNP_ITERATIVE : cv::SOLVEPNP_SQPNP))
      return std::nullopt;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  RigidTransform pose = camera.camera_from_world;
  pose.rotation = rotation_from_vector({rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2)});
  pose.translation_mm = {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)};
  return pose;
}

}  // namespace

std::vector<std::string> implausible_numbers(const Camera& camera, const Device& device,
                                             const std::vector<Eigen::Vector3d>& object_mm) {
  std::vector<std::string> found;
  check_focal_length(camera, device, found);
  check_principal_point(camera, found);
  check_object(camera, object_mm, found);
  return found;
}

double reprojection_error_px(const Camera& camera, const SeenPoints& points) {
  double squares = 0;
  for (std::size_t i = 0; i < points.world_mm.size(); ++i) {
    const double square = (project(camera, points.world_mm[i]) - points.pixels[i]).squaredNorm();
    squares += std::isfinite(square) ? square : std::numeric_limits<double>::infinity();
  }
  return std::sqrt(squares / double(std::max<std::size_t>(1, points.world_mm.size())));
}

std::vector<std::optional<std::string>> explanations(const std::vector<Camera>& cameras,
                                                     const std::vector<SeenPoints>& points) {
  return Explanations(cameras, points).sentences();
}

std::optional<RigidTransform> pose_of_points(const Camera& camera, const SeenPoints& points) {
  if (points.world_mm.size() < 4) return std::nullopt;
  return solved_pose(camera, points, false);
}

std::optional<Refit> refit_pose(const Camera& camera, const SeenPoints& points) {
  if (points.world_mm.size() < 6) return std::nullopt;
  const auto pose = solved_pose(camera, points, true);
  if (!pose) return std::nullopt;
  Camera moved = camera;
  moved.camera_from_world = *pose;
  const double error = reprojection_error_px(moved, points);
  if (!std::isfinite(error) || error > reprojection_error_px(camera, points)) return std::nullopt;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& p : points.world_mm) centre += p / double(points.world_mm.size());
  return Refit{error, degrees(geodesic_angle_rad(moved.camera_from_world.rotation, camera.camera_from_world.rotation)),
               (moved.camera_from_world * centre - camera.camera_from_world * centre).norm()};
}

std::string doubtful_focal_length(const Calibration& calibration, const std::string& views) {
  constexpr double kRefused = 0.1, kDoubtful = 0.01;
  for (const int i : {0, 1}) {
    const double focal_px = calibration.intrinsics(i, i), deviation_px = calibration.focal_deviation_px[i];
    if (deviation_px <= kDoubtful * focal_px) continue;
    const std::string text =
        views + formatted(
                    " hardly tell the focal length: it is {:.0f} px, known to {:.0f} px (one standard deviation); take "
                    "the board tilted by 20 degrees or more, to another side in each",
                    focal_px, deviation_px);
    if (!(deviation_px <= kRefused * focal_px)) throw Error(text);
    return text;
  }
  return "";
}

}  // namespace marrow::calibration
