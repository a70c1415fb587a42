// SPDX-License-Identifier: Apache-2.0
// A start from what the views show of a part that stands out, such as an implant of metal: its silhouette. The shape is
// looked up among the outlines of the surface from all sides; the poses that are most like it are moved until the
// silhouettes lie on one another.
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "marrow/domain/decompositions.hpp"
#include "marrow/initial/shape_library.hpp"
#include "marrow/toolbox/geometry/rigid_fit.hpp"
#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace {

using namespace marrow;
using namespace initial;

// Moves a surface until its silhouette lies on the one that is seen.

struct Fitted {
  RigidTransform world_from_model;
  double overlap = 0;  ///< of the drawn and the seen silhouette, the mean over the views; 1: the same
};

/// The signed distance of one point of the outline from the border of the mask, and its derivative by the motion.
struct Residual {
  double mm;
  Vector6d by_motion;
  double pixel_mm;  ///< the width of a pixel there
};

/// The value of the distance at a pixel and its derivatives along the image's axes.
Eigen::Vector3d distance_at(const cv::Mat1f& distance, const cv::Point& pixel) {
  return {distance(pixel), 0.5 * (distance(pixel.y, pixel.x + 1) - distance(pixel.y, pixel.x - 1)),
          0.5 * (distance(pixel.y + 1, pixel.x) - distance(pixel.y - 1, pixel.x))};
}

void add_residuals(const SeenSilhouette& seen, const cv::Mat1i& triangle_of, const Mesh& surface,
                   const FragmentFrame& frame, const RigidTransform& pose, std::vector<Residual>& residuals) {
  std::vector<std::vector<cv::Point>> chains;
  const cv::Mat1b drawn = triangle_of >= 0;
  cv::findContours(drawn, chains, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const RigidTransform camera_from_model = seen.camera.camera_from_world * pose;
  for (const auto& chain : chains)
    for (const cv::Point& pixel : chain) {
      if (std::min({pixel.x, pixel.y, drawn.cols - 1 - pixel.x, drawn.rows - 1 - pixel.y}) < 1) continue;
      const auto& t = surface.triangles[std::size_t(triangle_of(pixel))];
      const Eigen::Vector3d model_mm =
          (surface.vertices_mm[t[0]] + surface.vertices_mm[t[1]] + surface.vertices_mm[t[2]]) / 3;
      const Eigen::Vector3d image = seen.camera.intrinsics * (camera_from_model * model_mm);
      const Eigen::Vector2d at = image.hnormalized();
      Eigen::Matrix<double, 2, 3> by_image;
      by_image << 1, 0, -at.x(), 0, 1, -at.y();
      const Eigen::Vector3d value = distance_at(seen.distance, pixel);
      const double mm_per_px = pixel_size_at_mm(seen.camera, pose * model_mm);
      const Eigen::RowVector3d by_model =
          value.tail<2>().transpose() * by_image / image.z() * seen.camera.intrinsics * camera_from_model.rotation;
      // The part ends half a pixel beyond the centre of its last pixel.
      residuals.push_back({mm_per_px * (value[0] + 0.5),
                           mm_per_px * (by_model * geometry::point_by_motion(frame, model_mm)).transpose(), mm_per_px});
    }
}

/// The motion of least weighted squares; of zero length if the outline says nothing.
Vector6d step_of(const std::vector<Residual>& residuals, bool only_shift) {
  std::vector<double> sizes;
  for (const Residual& one : residuals) sizes.push_back(std::abs(one.mm));
  if (sizes.size() < 6) return Vector6d::Zero();
  std::nth_element(sizes.begin(), sizes.begin() + std::ptrdiff_t(sizes.size() / 2), sizes.end());
  // Not less than two pixels: a few points that stick out of a smooth part may be all that tells its turn.
  const double usual_mm = std::max(1.5 * sizes[sizes.size() / 2], 2 * residuals[0].pixel_mm);
  Matrix6d curvature = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (const Residual& one : residuals) {
    const double weight = std::min(1.0, usual_mm / std::max(std::abs(one.mm), 1e-9));
    curvature += weight * one.by_motion * one.by_motion.transpose();
    gradient += weight * one.mm * one.by_motion;
  }
  constexpr double kDamping = 1e-3;
  curvature.diagonal() *= 1 + kDamping;
  Vector6d motion = Vector6d::Zero();
  if (only_shift)
    motion.tail<3>() = -solve_symmetric<3>(curvature.bottomRightCorner<3, 3>(), gradient.tail<3>());
  else
    motion = -solve_symmetric<6>(curvature, gradient);
  if (!motion.allFinite()) return Vector6d::Zero();
  constexpr double kMostRad = 0.2;  // a longer step leaves the range in which the outline moves as its points do
  if (const double turn = motion.head<3>().norm(); turn > kMostRad) motion *= kMostRad / turn;
  return motion;
}

/// The mean overlap over the views at a pose.
double mean_overlap(const std::vector<SeenSilhouette>& views, const Mesh& surface,
                    const RigidTransform& world_from_model) {
  double sum = 0;
  for (const SeenSilhouette& seen : views)
    sum += overlap(geometry::silhouette_image(surface, seen.camera, world_from_model) >= 0, seen.mask);
  return sum / double(views.size());
}

/// Draws the surface, and moves it so that its outer outlines come to lie on the borders of the masks, in all views at
/// once: Gauss-Newton steps on the signed distances, with Huber's weights, about `frame`. Each step draws anew. Several
/// views first shift the surface alone, because the depths that each knows from the size are not exact. The result is
/// the pose of most overlap among the start and all steps.
Fitted fitted(const std::vector<SeenSilhouette>& views, const Mesh& surface, const FragmentFrame& frame,
              const RigidTransform& start, int steps) {
  const int shifts = views.size() > 1 ? 4 : 0;
  Fitted best{start, 0};
  RigidTransform pose = start;
  for (int i = 0;; ++i) {
    std::vector<Residual> residuals;
    double sum = 0;
    for (const SeenSilhouette& seen : views) {
      const cv::Mat1i triangle_of = geometry::silhouette_image(surface, seen.camera, pose);
      sum += overlap(triangle_of >= 0, seen.mask) / double(views.size());
      add_residuals(seen, triangle_of, surface, frame, pose, residuals);
    }
    if (sum > best.overlap) best = {pose, sum};
    if (i == shifts + steps) return best;
    const Vector6d motion = step_of(residuals, i < shifts);
    if (motion.head<3>().norm() < 1e-4 && motion.tail<3>().norm() < 1e-2 && i >= shifts) return best;
    pose = moved(pose, frame, motion);
  }
}

struct Options {
  int directions = 2000;
  int fits = 60;
  double least_apart_deg = 15;
  double least_overlap = 0.8;
};

constexpr const char* kNode = "initial.silhouette";
constexpr int kCoarse_px = 75, kFine_px = 190, kFinalists = 6;

struct Result {
  Pose pose, other;
};

/// Merged triangles make the surface a little smaller, which is no matter for the coarse silhouettes.
Mesh with_at_most(std::size_t triangles, const Mesh& mesh) {
  Mesh result = mesh;
  while (result.triangles.size() > triangles) {
    const std::size_t before = result.triangles.size();
    result = geometry::coarse_surface(result, std::vector<char>(result.vertices_mm.size(), 0)).mesh;
    if (result.triangles.size() == before) break;
  }
  return result;
}

/// What the views show. A view that cuts the silhouette off is left out, with a warning.
std::vector<SeenSilhouette> whole_silhouettes(const List<View>& views, int size_px, Context* context) {
  std::vector<SeenSilhouette> whole;
  std::string cut;
  for (const View& view : views) {
    SeenSilhouette seen = initial::seen_silhouette(view, size_px, kNode);
    if (seen.is_whole)
      whole.push_back(std::move(seen));
    else
      cut += (cut.empty() ? "'" : ", '") + view.name + "'";
  }
  if (whole.empty())
    throw Error(std::string(kNode) + ": the image's border cuts off the silhouette in view " + cut +
                ", so its shape is not known; take images that show the whole part, or another start");
  if (!cut.empty() && context)
    context->warn("the image's border cuts off the silhouette in view " + cut + "; it is left out");
  return whole;
}

bool are_near(const RigidTransform& a, const RigidTransform& b, double deg) {
  return degrees(geodesic_angle_rad(a.rotation, b.rotation)) < deg;
}

/// The most promising poses: those whose shape is most like that of one of the views, then of these the ones of most
/// overlap in all views. No two of a view are within half the distance of what counts as another pose.
std::vector<RigidTransform> candidates_of(const std::vector<SeenSilhouette>& views, const Mesh& surface,
                                          const Options& options, Context& context) {
  std::vector<Fitted> found;
  const ShapeLibrary library(surface, views[0], options.directions, context);
  for (const SeenSilhouette& seen : views) {
    std::vector<RigidTransform> of_view;
    for (const ShapeLibrary::Match& match : library.matches(seen)) {
      if (of_view.size() == std::size_t(3 * options.fits)) break;
      const auto near = [&](const RigidTransform& one) {
        return are_near(one, match.world_from_model, 0.5 * options.least_apart_deg);
      };
      if (std::none_of(of_view.begin(), of_view.end(), near)) of_view.push_back(match.world_from_model);
    }
    for (const RigidTransform& pose : of_view) found.push_back({pose, 0});
  }
  tbb::parallel_for(std::size_t(0), found.size(),
                    [&](std::size_t i) { found[i].overlap = mean_overlap(views, surface, found[i].world_from_model); });
  std::stable_sort(found.begin(), found.end(), [](const Fitted& a, const Fitted& b) { return a.overlap > b.overlap; });
  std::vector<RigidTransform> poses;
  for (const Fitted& one : found)
    if (poses.size() < std::size_t(options.fits)) poses.push_back(one.world_from_model);
  return poses;
}

/// The poses after a fit, that of most overlap first.
std::vector<Fitted> all_fitted(const std::vector<SeenSilhouette>& views, const Mesh& surface,
                               const FragmentFrame& frame, const std::vector<RigidTransform>& starts, int steps,
                               Context& context) {
  std::vector<Fitted> fits(starts.size());
  tbb::parallel_for(std::size_t(0), starts.size(), [&](std::size_t i) {
    context.check_cancelled();
    fits[i] = fitted(views, surface, frame, starts[i], steps);
  });
  std::stable_sort(fits.begin(), fits.end(), [](const Fitted& a, const Fitted& b) { return a.overlap > b.overlap; });
  return fits;
}

/// The first poses of which no two are near one another.
std::vector<RigidTransform> apart(const std::vector<Fitted>& fits, double deg, std::size_t count) {
  std::vector<RigidTransform> poses;
  for (const Fitted& fit : fits)
    if (poses.size() < count && std::none_of(poses.begin(), poses.end(),
                                             [&](const auto& one) { return are_near(one, fit.world_from_model, deg); }))
      poses.push_back(fit.world_from_model);
  return poses;
}

Pose pose_of(const Fitted& fit, const FragmentFrame& frame) {
  Pose pose;
  pose.world_from_model = fit.world_from_model;
  pose.frame = frame;
  pose.cost = 1 - fit.overlap;
  return pose;
}

Result silhouette(const Mesh& model, const List<View>& silhouettes, const Options& options, Context& context) {
  check_mesh(model, "model");
  if (silhouettes.empty()) throw Error(std::string(kNode) + ": there are no silhouettes");
  const Mesh coarse = with_at_most(8000, model), surface = with_at_most(300000, model);
  const FragmentFrame frame = fragment_frame(model);
  const std::vector<SeenSilhouette> views = whole_silhouettes(silhouettes, kCoarse_px, &context),
                                    fine = whole_silhouettes(silhouettes, kFine_px, nullptr);
  const std::vector<RigidTransform> candidates = candidates_of(views, coarse, options, context);
  context.progress(0.5, "shapes compared");
  const std::vector<Fitted> fits = all_fitted(views, coarse, frame, candidates, 12, context);
  const std::vector<Fitted> last =
      all_fitted(fine, surface, frame, apart(fits, options.least_apart_deg, kFinalists), 25, context);
  const auto other = std::find_if(last.begin(), last.end(), [&](const Fitted& one) {
    return !are_near(one.world_from_model, last[0].world_from_model, options.least_apart_deg);
  });
  Result result{pose_of(last[0], frame), pose_of(other == last.end() ? last[0] : *other, frame)};
  context.info(
      formatted("the silhouettes cover {:.1f} % of what any of them covers; in the next pose that is {:.0f} degrees or "
                "more away {:.1f} %",
                100 * last[0].overlap, options.least_apart_deg, 100 * (1 - result.other.cost)));
  if (last[0].overlap < options.least_overlap) {
    result.pose.warnings.push_back(
        formatted("in the best pose, the silhouette of the surface and that of the mask have only {:.0f} % in common; "
                  "does the mask show this part, and all of it?",
                  100 * last[0].overlap));
    context.warn(result.pose.warnings.back());
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.silhouette", silhouette)
      .summary(
          "Pose from the silhouettes of a part, without any start: its shape is looked up among the outlines of the "
          "surface from all sides (arXiv 2205.00057)")
      .in("model", "surface of the part")
      .in("silhouettes", "X-ray views whose masks are not 0 where the part is seen, and only there", over("view"))
      .out("pose", &Result::pose, "pose of most overlap; its cost is 1 less the overlap")
      .out("other", &Result::other,
           "the next pose that is least_apart_deg away, such as the mirror pose of a nearly symmetric part; the pose "
           "itself if there is none")
      .option("directions", &Options::directions, "number of sides from which outlines are compared", at_least(50),
              at_most(100000))
      .option("fits", &Options::fits, "number of poses that are moved until the silhouettes meet", at_least(1),
              at_most(10000))
      .option("least_apart_deg", &Options::least_apart_deg, "poses that are nearer to one another count as one",
              at_least(1), at_most(90))
      .option("least_overlap", &Options::least_overlap,
              "below this part, a warning says that the mask may be of another part", at_least(0), at_most(1),
              unit(""));
}
