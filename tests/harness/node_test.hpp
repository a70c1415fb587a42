// SPDX-License-Identifier: Apache-2.0
#pragma once
// What nearly all tests of nodes use. Tests lie in a namespace within marrow::test, so they name these without a
// prefix.

#include <marrow/plugin.hpp>
#include <random>

#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"
#include "tests/harness/cameras.hpp"
#include "tests/harness/message_of.hpp"

namespace marrow::test {

using namespace marrow::node_test;
using Eigen::Vector2d, Eigen::Vector3d, Eigen::Matrix3d;
using Strings = std::vector<std::string>;
using Numbers = std::vector<double>;

// Edges along straight lines.

/// Edges along the upright line u, one a row from one row to before another, whose gradients point to the right (1) or
/// to the left (-1).
inline EdgeMap upright_edges(int width_px, int height_px, double u_px, float direction, int from_v, int to_v,
                             float magnitude = 1) {
  EdgeMap map{width_px, height_px, {}};
  for (int v = from_v; v < to_v; ++v) map.pixels.push_back({float(u_px), float(v), direction, 0, magnitude});
  return map;
}
/// Both edges of the same image.
inline EdgeMap together(EdgeMap one, const EdgeMap& other) {
  one.pixels.insert(one.pixels.end(), other.pixels.begin(), other.pixels.end());
  return one;
}

// Volumes and fields that are formulas of the place.

inline Grid grid_at(const std::array<int, 3>& size, const Eigen::Vector3d& origin_mm = Eigen::Vector3d::Zero(),
                    const Eigen::Vector3d& spacing_mm = Eigen::Vector3d::Ones()) {
  Grid grid;
  grid.size = size;
  grid.origin_mm = origin_mm;
  grid.spacing_mm = spacing_mm;
  return grid;
}

/// formula(index) at each voxel, in the order in which they are stored.
template <class Formula>
std::vector<float> at_each_index(const Grid& grid, const Formula& formula) {
  std::vector<float> values;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) values.push_back(float(formula(Eigen::Vector3d(x, y, z))));
  return values;
}
/// formula(point in mm) at the middle of each voxel.
template <class Formula>
Volume volume_by(const Grid& grid, const Formula& formula) {
  return {grid, at_each_index(grid, [&](const auto& index) { return formula(grid.point_from_index(index)); })};
}
template <class Formula>
SignedField field_by(const Grid& grid, const Formula& distance_mm) {
  return {grid, at_each_index(grid, [&](const auto& index) { return distance_mm(grid.point_from_index(index)); })};
}

/// The value of a volume at a place.
inline float value_at(const Volume& volume, const Eigen::Vector3d& point_mm) {
  return sample_trilinear(volume.grid, volume.values, volume.grid.index_from_point(point_mm));
}

// Figures of merit against what they must be.

using Figures = std::map<std::string, double>;

/// Each of these figures is there, and within a tolerance of its value.
inline void expect_figures(const Figures& found, const std::vector<std::pair<std::string, double>>& expected,
                           double tolerance) {
  for (const auto& [name, value] : expected)
    if (const auto figure = found.find(name); figure == found.end())
      ADD_FAILURE() << "there is no figure " << name;
    else
      EXPECT_NEAR(figure->second, value, tolerance) << name;
}
inline void expect_figures(const Value& metrics, const std::vector<std::pair<std::string, double>>& expected,
                           double tolerance) {
  ASSERT_FALSE(metrics.is_absent());
  expect_figures(node_test::figures_of(metrics), expected, tolerance);
}

/// Keeps what a node says in this context: its warnings, and all its lines.
struct Heard {
  std::vector<std::string> warnings, lines;
  Context context;

  explicit Heard(std::uint64_t seed = 0)
      : context(Context::Hooks{seed, nullptr, {}, [this](std::string_view message, LogLevel level) {
                                 lines.emplace_back(message);
                                 if (level == LogLevel::warning) warnings.emplace_back(message);
                               }}) {}
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;
};

// Poses of a model, and how far two are apart.

/// From the CT to the world: a turn, then a shift.
inline RigidTransform placed(const Eigen::Vector3d& shift_mm,
                             const Eigen::Vector3d& turn_rad = Eigen::Vector3d::Zero()) {
  return {"world", "ct", rotation_from_vector(turn_rad), shift_mm};
}
inline Pose pose_of(const RigidTransform& world_from_model) {
  Pose pose;
  pose.world_from_model = world_from_model;
  return pose;
}
inline Pose pose_at(const Eigen::Vector3d& shift_mm, const Eigen::Vector3d& turn_rad = Eigen::Vector3d::Zero()) {
  return pose_of(placed(shift_mm, turn_rad));
}

/// Standard deviations of rotations [deg] and translations [mm] about the axes of the pose's frame.
inline Pose with_deviations(Pose pose, const Vector6d& deg_and_mm) {
  Vector6d deviations = deg_and_mm;
  deviations.head<3>() *= radians(1);
  pose.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
  return pose;
}

/// The angle of the rotation between two poses.
inline double turn_between_deg(const RigidTransform& one, const RigidTransform& other) {
  return degrees(geodesic_angle_rad(one.rotation, other.rotation));
}
inline double shift_between_mm(const RigidTransform& one, const RigidTransform& other) {
  return (one.translation_mm - other.translation_mm).norm();
}
/// The mean distance between the places of a surface's points.
inline double mean_distance_mm(const Mesh& model, const RigidTransform& one, const RigidTransform& other,
                               std::size_t points = 500) {
  double sum = 0;
  for (const Eigen::Vector3d& point : sample_surface(model, points)) sum += (one * point - other * point).norm();
  return sum / double(points);
}

// Projectors and costs that are formulas.

/// An outline that a formula draws.
class DrawnOutline : public OutlineProjector {
 public:
  using Formula = std::function<std::vector<OutlinePoint>(const Camera&, const RigidTransform&, double spacing_px)>;
  explicit DrawnOutline(Formula formula) : formula_(std::move(formula)) {}
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                    double spacing_px) const override {
    return formula_(camera, world_from_model, spacing_px);
  }

 private:
  Formula formula_;
};
inline std::shared_ptr<const OutlineProjector> outline_of(DrawnOutline::Formula formula) {
  return std::make_shared<const DrawnOutline>(std::move(formula));
}

/// Line integrals by a formula of the pixel and the pose, in a region that may depend on the pose.
class DrawnRadiograph : public RadiographProjector {
 public:
  using Formula = std::function<double(const Eigen::Vector2d& pixel, const RigidTransform&)>;
  using Region = std::function<PixelGrid(const RigidTransform&)>;
  DrawnRadiograph(Region region, Formula formula) : region_(std::move(region)), formula_(std::move(formula)) {}
  DrawnRadiograph(const PixelGrid& region, Formula formula)
      : DrawnRadiograph([region](const RigidTransform&) { return region; }, std::move(formula)) {}
  std::vector<float> radiograph(const Camera&, const RigidTransform& pose, const PixelGrid& grid) const override {
    std::vector<float> values;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column)
        values.push_back(float(formula_(grid.pixel(column, row), pose)));
    return values;
  }
  std::vector<float> radiograph(const Camera&, const RigidTransform& pose,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    std::vector<float> values;
    for (const Eigen::Vector2f& pixel : pixels) values.push_back(float(formula_(pixel.cast<double>(), pose)));
    return values;
  }
  PixelGrid region(const Camera&, const RigidTransform& pose) const override { return region_(pose); }

 protected:
  double integral(const Eigen::Vector2d& pixel, const RigidTransform& pose) const { return formula_(pixel, pose); }

 private:
  Region region_;
  Formula formula_;
};

/// A cost by a formula of the pose. It is the same at each level.
class FormulaCost : public Cost {
 public:
  using Formula = std::function<double(const RigidTransform&)>;
  explicit FormulaCost(Formula formula) : formula_(std::move(formula)) {}
  double value(const RigidTransform& world_from_model) const override { return formula_(world_from_model); }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<FormulaCost>(*this); }

 private:
  Formula formula_;
};
inline std::shared_ptr<const Cost> cost_of(FormulaCost::Formula formula) {
  return std::make_shared<const FormulaCost>(std::move(formula));
}

// Closed surfaces of known size and place, besides those of tests/framework/domain/shapes.hpp.

inline Mesh box_between(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm) {
  return box((low_mm + high_mm) / 2, high_mm - low_mm);
}
/// A cylinder about z, whose corners lie on the radius.
inline Mesh upright_cylinder(double radius_mm, double low_mm, double high_mm, std::uint32_t sides = 720) {
  return cylinder({0, 0, (low_mm + high_mm) / 2}, Eigen::Vector3d::UnitZ(), radius_mm, high_mm - low_mm, sides);
}

/// The extent of the vertices for which `counts` is true.
template <class Counts>
Eigen::AlignedBox3d extent(const Mesh& mesh, const Counts& counts) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices_mm)
    if (counts(vertex)) box.extend(vertex);
  return box;
}
inline Eigen::AlignedBox3d extent(const Mesh& mesh) {
  return extent(mesh, [](const auto&) { return true; });
}

/// Without its last triangle, so that it is open.
inline Mesh opened(Mesh mesh) {
  mesh.triangles.pop_back();
  return mesh;
}

// Views, and images that are formulas of the pixel.

/// formula(u, v) at each pixel.
template <class Pixel, class Formula>
cv::Mat image_of(int width_px, int height_px, const Formula& formula) {
  cv::Mat_<Pixel> image(height_px, width_px);
  for (int v = 0; v < height_px; ++v)
    for (int u = 0; u < width_px; ++u) image(v, u) = Pixel(formula(u, v));
  return image;
}

/// A mask of an image of this size that shows a part of it, or hides it.
inline cv::Mat mask_of(const Camera& camera, const cv::Rect& part, bool is_shown = true) {
  cv::Mat mask(camera.height_px, camera.width_px, CV_8U, cv::Scalar(is_shown ? 0 : 255));
  mask(part).setTo(is_shown ? 255 : 0);
  return mask;
}
inline cv::Mat nothing_shown(const Camera& camera) { return mask_of(camera, {}); }

/// A view with its name, its camera, and an image and a mask if these matter.
inline View view_of(const std::string& name, const Camera& camera, const cv::Mat& pixels = {},
                    const cv::Mat& mask = {}) {
  return {name, {pixels}, camera, mask};
}
/// The same with an even image of 8 bits.
inline View even_view(const std::string& name, const Camera& camera, double grey = 128) {
  return view_of(name, camera, cv::Mat(camera.height_px, camera.width_px, CV_8U, cv::Scalar(grey)));
}

/// Views under their own names.
template <class... Views>
List<View> views_named(const Views&... views) {
  List<View> list;
  (list.add(views.name, views), ...);
  return list;
}
/// Views under their own names, as an input.
template <class... Views>
Value each_view(const Views&... views) {
  return node_test::list(views_named(views...), "view");
}
inline Value each_view(const List<View>& views) { return node_test::list(views, "view"); }

}  // namespace marrow::test
