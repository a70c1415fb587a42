// SPDX-License-Identifier: Apache-2.0
// Draws the models in their poses, shaded, as seen from the X-ray source, beside the X-ray itself (Fig. 8 of the
// chapter).
#include <Eigen/LU>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;
using Eigen::Vector3d;

struct Options {
  int size_px = 800;
  std::string contrast = "local";
};

/// Area-weighted normals of the vertices; zero if a vertex has no triangle.
std::vector<Vector3d> vertex_normals(const marrow::Mesh& mesh) {
  std::vector<Vector3d> normals(mesh.vertices_mm.size(), Vector3d::Zero());
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices_mm[t[0]], &b = mesh.vertices_mm[t[1]], &c = mesh.vertices_mm[t[2]];
    const Vector3d area = (b - a).cross(c - a);
    for (std::uint32_t corner : t) normals[corner] += area;
  }
  for (Vector3d& normal : normals)
    if (normal.norm() > 0) normal.normalize();
  return normals;
}

/// A vertex to draw: its position in the canvas, its inverse depth (linear in the image), and its brightness with a
/// light at the source.
struct Corner {
  double x, y, inverse_depth, brightness;
};

std::vector<Corner> project_corners(const marrow::Mesh& mesh, const marrow::RigidTransform& world_from_model,
                                    const marrow::Camera& camera, const Panel& canvas) {
  const std::vector<Vector3d> normals = vertex_normals(mesh);
  const Vector3d source = marrow::source_position_mm(camera);
  std::vector<Corner> corners;
  corners.reserve(normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vector3d world = world_from_model * mesh.vertices_mm[i];
    const double depth_mm = (camera.camera_from_world * world).z();
    const Eigen::Vector2d pixel = marrow::project(camera, world);  // NaN behind the source
    const cv::Point2d at = canvas.at(pixel.x(), pixel.y());
    const double facing = (world_from_model.rotation * normals[i]).dot((source - world).normalized());
    corners.push_back({at.x, at.y, 1 / depth_mm, 0.2 + 0.8 * std::abs(facing)});
  }
  return corners;
}

/// Draws a triangle into the canvas wherever it is nearer than the triangles drawn before.
void fill(cv::Mat& canvas, cv::Mat& nearest, const Corner& a, const Corner& b, const Corner& c,
          const cv::Scalar& colour) {
  const double doubled_area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (!(std::abs(doubled_area) > 0)) return;  // also for NaN
  const auto clamped = [](double value, int size) { return int(std::clamp(value, 0.0, double(size - 1))); };
  const int left = clamped(std::floor(std::min({a.x, b.x, c.x})), canvas.cols);
  const int right = clamped(std::ceil(std::max({a.x, b.x, c.x})), canvas.cols);
  const int top = clamped(std::floor(std::min({a.y, b.y, c.y})), canvas.rows);
  const int bottom = clamped(std::ceil(std::max({a.y, b.y, c.y})), canvas.rows);
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      const double of_b = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / doubled_area;
      const double of_c = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / doubled_area;
      const double of_a = 1 - of_b - of_c;
      if (of_a < 0 || of_b < 0 || of_c < 0) continue;
      const float inverse_depth = float(of_a * a.inverse_depth + of_b * b.inverse_depth + of_c * c.inverse_depth);
      if (inverse_depth <= nearest.at<float>(y, x)) continue;
      nearest.at<float>(y, x) = inverse_depth;
      const double brightness = of_a * a.brightness + of_b * b.brightness + of_c * c.brightness;
      auto& pixel = canvas.at<cv::Vec3b>(y, x);
      for (int k = 0; k < 3; ++k) pixel[k] = cv::saturate_cast<unsigned char>(colour[k] * brightness);
    }
}

/// The pose of a fragment, by its name.
const marrow::Pose& pose_of(const std::string& fragment, const marrow::List<marrow::Pose>& poses) {
  const marrow::Pose* pose = poses.find(fragment);
  if (!pose) throw marrow::Error("fragment '" + fragment + "': there is a mesh, but no pose of that name");
  marrow::check_rigid(pose->world_from_model, "pose of '" + fragment + "'");
  return *pose;
}

marrow::Picture scene(const marrow::List<marrow::Mesh>& meshes, const marrow::List<marrow::Pose>& poses,
                      const marrow::View& view, const Options& options, marrow::Context& context) {
  static const cv::Scalar kColours[] = {{240, 200, 120}, kSkyBlue, kPurple, kGreen};
  const Contrast contrast = contrast_of(options.contrast);
  Panel image = make_panel(view, whole_image(view), options.size_px, contrast);
  // The models are drawn at twice the size and then reduced. This smooths their borders.
  Panel canvas = make_panel(view, whole_image(view), 2 * options.size_px, contrast);
  canvas.pixels *= 0.5;
  cv::Mat nearest(canvas.pixels.size(), CV_32F, cv::Scalar(0));
  std::vector<LegendItem> legend;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    context.check_cancelled();
    marrow::check_mesh(meshes[i], "mesh of '" + meshes.name(i) + "'");
    const cv::Scalar& colour = kColours[i % std::size(kColours)];
    const auto corners =
        project_corners(meshes[i], pose_of(meshes.name(i), poses).world_from_model, view.camera, canvas);
    for (const auto& t : meshes[i].triangles)
      fill(canvas.pixels, nearest, corners[t[0]], corners[t[1]], corners[t[2]], colour);
    legend.push_back({meshes.name(i), colour});
  }
  Panel models;
  cv::resize(canvas.pixels, models.pixels, image.pixels.size(), 0, 0, cv::INTER_AREA);
  draw_title(image, view.name);
  draw_title(models, view.name + ": models in their poses");
  cv::Mat picture;
  cv::hconcat(image.pixels, models.pixels, picture);
  return {with_legend(picture, legend)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.scene", scene)
      .summary("Draws the models in their poses, shaded, as seen from the X-ray source, beside the X-ray")
      .in("models", "surfaces of the fragments", marrow::over("fragment"))
      .in("poses", "poses of the fragments", marrow::over("fragment"))
      .in("view", "X-ray view")
      .out("picture", "on the left the X-ray, on the right the models over the dimmed X-ray")
      .option("size_px", &Options::size_px, "longer side of a panel", marrow::at_least(64), marrow::at_most(4096))
      .option("contrast", &Options::contrast, "how grey values are shown",
              marrow::one_of({"local", "logarithmic", "linear"}));
}
