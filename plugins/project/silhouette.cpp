// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/project/volume_border.hpp"
#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace {

struct Options {
  double border_voxels = 2;
};

/// The direction at a border pixel follows from this many pixels of the border on each side.
constexpr int kReach_px = 4;

/// Outward unit normal at point `i` of a closed chain of border pixels. `sense` is +1 or -1: the side of the chain on
/// which the bone lies.
cv::Point2d chain_normal(const std::vector<cv::Point>& chain, std::size_t i, double sense) {
  const std::size_t n = chain.size(), reach = std::min(std::size_t(kReach_px), n / 3);
  const cv::Point2d tangent = chain[(i + reach) % n] - chain[(i + n - reach) % n];
  const double length = std::hypot(tangent.x, tangent.y);
  return length > 0 ? cv::Point2d(tangent.y, -tangent.x) * (sense / length) : cv::Point2d(0, 0);
}

class SilhouetteProjector : public marrow::OutlineProjector {
 public:
  SilhouetteProjector(const marrow::Mesh& mesh, std::vector<char> at_border)
      : mesh_(mesh), at_border_(std::move(at_border)) {}

  std::vector<marrow::OutlinePoint> outline(const marrow::Camera& camera,
                                            const marrow::RigidTransform& world_from_model,
                                            double spacing_px) const override {
    if (!(spacing_px > 0)) throw marrow::Error("the outline's spacing must be positive");
    const cv::Mat1i triangle_of = marrow::geometry::silhouette_image(mesh_, camera, world_from_model);
    std::vector<std::vector<cv::Point>> chains;
    const cv::Mat mask = triangle_of >= 0;
    cv::findContours(mask, chains, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
    std::vector<marrow::OutlinePoint> points;
    for (const auto& chain : chains) trace(chain, mask, triangle_of, spacing_px, points);
    return points;
  }

 private:
  void trace(const std::vector<cv::Point>& chain, const cv::Mat& mask, const cv::Mat1i& triangle_of, double spacing_px,
             std::vector<marrow::OutlinePoint>& points) const {
    if (chain.size() < 3) return;
    double passed = spacing_px;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const cv::Point& pixel = chain[i];
      const cv::Point step = pixel - chain[(i + chain.size() - 1) % chain.size()];
      passed += std::hypot(step.x, step.y);
      if (passed < spacing_px) continue;
      // Near the edge of the image, the border may be the image's and not the bone's.
      if (std::min({pixel.x, pixel.y, mask.cols - 1 - pixel.x, mask.rows - 1 - pixel.y}) <= kReach_px) continue;
      passed = std::fmod(passed, spacing_px);
      const auto& t = mesh_.triangles[std::size_t(triangle_of(pixel))];
      if (at_border_[t[0]] || at_border_[t[1]] || at_border_[t[2]]) continue;
      // OpenCV traces outer borders and holes with the object on the same side.
      const cv::Point2d normal = chain_normal(chain, i, -1);
      if (normal == cv::Point2d(0, 0)) continue;
      marrow::OutlinePoint point;
      // On average, the bone ends half a pixel beyond the centre of its last pixel.
      point.u_px = float(pixel.x + 0.5 * normal.x);
      point.v_px = float(pixel.y + 0.5 * normal.y);
      point.normal_u = float(normal.x);
      point.normal_v = float(normal.y);
      point.model_mm =
          ((mesh_.vertices_mm[t[0]] + mesh_.vertices_mm[t[1]] + mesh_.vertices_mm[t[2]]) / 3).cast<float>();
      points.push_back(point);
    }
  }

  const marrow::Mesh& mesh_;
  const std::vector<char> at_border_;
};

std::shared_ptr<const marrow::OutlineProjector> silhouette(const marrow::Mesh& mesh, const marrow::Volume* volume,
                                                           const Options& options) {
  marrow::check_mesh(mesh, "the mesh to project");
  return std::make_shared<SilhouetteProjector>(
      mesh, marrow::rays::vertices_at_volume_border(mesh, volume, options.border_voxels));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("project.silhouette", silhouette)
      .summary("Outer outline of a surface by drawing: its triangles are filled and the border pixels are traced")
      .in("model", "surface of the bone")
      .in("volume", "CT from which the surface was made; outline within border_voxels of its end is left out")
      .out("projector", "draws the outline for any camera and pose")
      .option("border_voxels", &Options::border_voxels, "outline closer than this to the end of the CT is left out",
              marrow::at_least(0), marrow::unit("voxels"));
}
