// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/project/volume_border.hpp"

namespace {

struct Options {
  double border_voxels = 2;
};

/// A drawn surface: for each pixel the last triangle that covers its centre, or -1.
class Silhouette {
 public:
  Silhouette(int width, int height) : triangle_of(height, width, CV_32S, cv::Scalar(-1)) {}

  /// Fills the pixels whose centres lie inside the triangle.
  void fill(int triangle, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    if (!a.allFinite() || !b.allFinite() || !c.allFinite()) return;
    const double low = std::min({a.y(), b.y(), c.y()}), high = std::max({a.y(), b.y(), c.y()});
    const int first = int(std::ceil(std::max(low, 0.0)));
    const int last = int(std::floor(std::min(high, double(triangle_of.rows - 1))));
    for (int row = first; row <= last; ++row) {
      double left = 1e9, right = -1e9;
      for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
        if ((p.y() < row && q.y() < row) || (p.y() > row && q.y() > row)) continue;
        if (p.y() == q.y()) {
          left = std::min({left, p.x(), q.x()});
          right = std::max({right, p.x(), q.x()});
        } else {
          const double u = p.x() + (row - p.y()) / (q.y() - p.y()) * (q.x() - p.x());
          left = std::min(left, u);
          right = std::max(right, u);
        }
      }
      const int from = int(std::ceil(std::max(left, 0.0))),
                to = int(std::floor(std::min(right, double(triangle_of.cols - 1))));
      int* pixels = triangle_of.ptr<int>(row);
      for (int u = from; u <= to; ++u) pixels[u] = triangle;
    }
  }

  cv::Mat triangle_of;
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
    const Silhouette silhouette = draw(camera, world_from_model);
    std::vector<std::vector<cv::Point>> chains;
    const cv::Mat mask = silhouette.triangle_of >= 0;
    cv::findContours(mask, chains, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
    std::vector<marrow::OutlinePoint> points;
    for (const auto& chain : chains) trace(chain, mask, silhouette, spacing_px, points);
    return points;
  }

 private:
  Silhouette draw(const marrow::Camera& camera, const marrow::RigidTransform& world_from_model) const {
    const marrow::RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
    const Eigen::Matrix3d matrix = camera.intrinsics * camera_from_model.rotation;
    const Eigen::Vector3d offset = camera.intrinsics * camera_from_model.translation_mm;
    std::vector<Eigen::Vector2d> pixels(mesh_.vertices_mm.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Eigen::Vector3d pixel = matrix * mesh_.vertices_mm[i] + offset;
      pixels[i] = pixel.z() > 0 ? Eigen::Vector2d(pixel.hnormalized()) : Eigen::Vector2d::Constant(std::nan(""));
    }
    Silhouette silhouette(camera.width_px, camera.height_px);
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const auto& t = mesh_.triangles[i];
      silhouette.fill(int(i), pixels[t[0]], pixels[t[1]], pixels[t[2]]);
    }
    return silhouette;
  }

  void trace(const std::vector<cv::Point>& chain, const cv::Mat& mask, const Silhouette& silhouette, double spacing_px,
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
      const auto& t = mesh_.triangles[std::size_t(silhouette.triangle_of.at<int>(pixel))];
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
