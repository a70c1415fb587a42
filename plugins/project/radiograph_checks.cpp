// SPDX-License-Identifier: Apache-2.0
#include "checks.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::analytic {
namespace {

/// A solid between pairs of parallel planes around the origin, |normal_k . x| <= 1, such as a box: unit normals, each
/// divided by its plane's distance from the origin.
using PlaneSolid = std::vector<Eigen::Vector3d>;

/// Length in mm of the part of a ray that is inside the solid and in front of its start. `direction`: a unit vector.
double chord_mm(const PlaneSolid& solid, const Eigen::Vector3d& start, const Eigen::Vector3d& direction) {
  double from = 0, to = 1e9;
  for (const Eigen::Vector3d& n : solid) {
    const double s = n.dot(start), d = n.dot(direction);
    if (std::abs(d) < 1e-12) {
      if (std::abs(s) > 1) return 0;
      continue;
    }
    const double a = (-1 - s) / d, b = (1 - s) / d;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return std::max(0.0, to - from);
}

PlaneSolid box_between(const Eigen::Vector3d& half) {
  return {Eigen::Vector3d::UnitX() / half.x(), Eigen::Vector3d::UnitY() / half.y(),
          Eigen::Vector3d::UnitZ() / half.z()};
}

PlaneSolid octahedron_between(const Eigen::Vector3d& half) {
  PlaneSolid normals;
  for (int k = 0; k < 4; ++k) normals.push_back(Eigen::Vector3d(1, k & 1 ? -1 : 1, k & 2 ? -1 : 1).cwiseQuotient(half));
  return normals;
}

/// `hu` inside and -1000 outside. A voxel at the surface is a mix, by the part of it that lies inside.
Volume volume_of(const PlaneSolid& solid, const Grid& grid, double hu) {
  constexpr int kParts = 4;  // a voxel is divided into this many parts along each axis
  Volume volume{grid, {}};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        int inside = 0;
        for (int i = 0; i < kParts * kParts * kParts; ++i) {
          const int v = i / kParts % kParts, w = i / kParts / kParts;
          const Eigen::Vector3d part(i % kParts, v, w);
          const Eigen::Vector3d p = grid.point_from_index(
              Eigen::Vector3d(x, y, z) + (part + Eigen::Vector3d::Constant(0.5 - 0.5 * kParts)) / kParts);
          inside += std::all_of(solid.begin(), solid.end(),
                                [&](const Eigen::Vector3d& n) { return std::abs(n.dot(p)) <= 1; });
        }
        volume.values.push_back(float(-1000 + (hu + 1000) * inside / (kParts * kParts * kParts)));
      }
  return volume;
}

/// Negative inside. Inside and in front of a face it is the distance to the surface. In front of an edge or a corner it
/// is smaller.
SignedField field_of(const PlaneSolid& solid, const Grid& grid) {
  SignedField field{grid, {}};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        double distance = -1e9;
        const Eigen::Vector3d p = grid.point_from_index({double(x), double(y), double(z)});
        for (const Eigen::Vector3d& n : solid) distance = std::max(distance, (std::abs(n.dot(p)) - 1) / n.norm());
        field.values_mm.push_back(float(distance));
      }
  return field;
}

}  // namespace
}  // namespace marrow::analytic

namespace marrow::conformance {
namespace {

using namespace analytic;

const Eigen::Vector3d kBox_mm(12, 16, 9.6);        // half the lengths of its sides, in whole voxels
const Eigen::Vector3d kOctahedron_mm(20, 16, 24);  // half the lengths of its diagonals
Grid turned_grid() { return grid_of({56, 70, 48}, {1, 0.8, 1.2}, rotation_from_vector({0.5, -0.3, 0.8})); }

double largest(const Subject& subject, Inputs inputs, const std::function<double(const RadiographProjector&)>& figure) {
  return largest_of<RadiographProjector>(subject, std::move(inputs), "it makes no radiographs", figure);
}

/// Mean error in all views, over the pixels where the solid is thicker than 2 mm of water.
double mean_error_mm(const RadiographProjector& projector,
                     const std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>& chord) {
  double sum = 0;
  int count = 0;
  for (const double angle : angles()) {
    const Camera camera = camera_at(angle);
    const std::vector<float> values = radiograph_of(projector, camera, whole());
    const RigidTransform model_from_world = inverse(pose());
    const Eigen::Vector3d source = model_from_world * source_position_mm(camera);
    for (int v = 0; v < kSize_px; ++v)
      for (int u = 0; u < kSize_px; ++u) {
        const double expected =
            kDensity * chord(source, model_from_world.rotation * ray_direction(camera, Eigen::Vector2d(u, v)));
        if (expected < 2) continue;
        sum += std::abs(double(values[std::size_t(v) * kSize_px + std::size_t(u)]) - expected);
        ++count;
      }
  }
  return sum / count;
}

double ball_error_mm(const RadiographProjector& projector) {
  return mean_error_mm(projector,
                       [](const auto& start, const auto& direction) { return chord_mm(ball(), start, direction); });
}

/// The mesh is that of the ball, because radiographs do not depend on the mesh.
double solid_error_mm(const Subject& subject, const PlaneSolid& solid, const Grid& grid) {
  const Inputs inputs =
      inputs_of(volume_of(solid, grid, 1000 * kDensity - 1000), field_of(solid, grid), mesh_of(ball()));
  return largest(subject, inputs, [&](const RadiographProjector& projector) {
    return mean_error_mm(projector,
                         [&](const auto& start, const auto& direction) { return chord_mm(solid, start, direction); });
  });
}

/// Root mean square of the differences. The largest differences are at the steep borders of the bodies, due to
/// interpolation.
double pixels_off_mm(const RadiographProjector& projector, bool single) {
  double squares = 0;
  std::size_t count = 0;
  for (const double angle : angles()) {
    const Camera camera = camera_at(angle);
    const std::vector<float> all = radiograph_of(projector, camera, whole());
    const PixelGrid some{7, 11, 3, 45, 40};
    std::vector<Eigen::Vector2f> pixels;
    for (int row = 0; row < some.rows; ++row)
      for (int column = 0; column < some.columns; ++column) pixels.push_back(some.pixel(column, row).cast<float>());
    const std::vector<float> values =
        single ? projector.radiograph(camera, pose(), pixels) : projector.radiograph(camera, pose(), some);
    expect(values.size() == pixels.size(), formatted("of {} pixels it gives {} values", pixels.size(), values.size()));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const float expected = all[std::size_t(pixels[i].y()) * kSize_px + std::size_t(pixels[i].x())];
      squares += std::pow(double(values[i] - expected), 2);
      count += expected > 0 || values[i] > 0;
    }
  }
  expect(count > 0, "its radiographs are empty");
  return std::sqrt(squares / double(count));
}

/// The largest value outside the region, with the body inside the image and partly outside it.
double beyond_region_mm(const RadiographProjector& projector) {
  float most = 0;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(35, 0, 40), Eigen::Vector3d(-45, 0, -30)}) {
    RigidTransform at = pose();
    at.translation_mm += shift;
    const Camera camera = camera_at(0);
    const std::vector<float> values = radiograph_of(projector, camera, whole(), at);
    const PixelGrid region = projector.region(camera, at);
    expect(region.count() > 0 && region.step_px == 1 && region.u_px == std::floor(region.u_px) &&
               region.v_px == std::floor(region.v_px),
           "its region is empty or not of whole pixels");
    expect(region.u_px >= 0 && region.v_px >= 0 && region.u_px + region.columns <= kSize_px &&
               region.v_px + region.rows <= kSize_px,
           "its region reaches out of the image");
    for (int v = 0; v < kSize_px; ++v)
      for (int u = 0; u < kSize_px; ++u)
        if (u < region.u_px || v < region.v_px || u >= region.u_px + region.columns || v >= region.v_px + region.rows)
          most = std::max(most, values[std::size_t(v) * kSize_px + std::size_t(u)]);
  }
  return double(most);
}

/// The largest value if the body is out of view or behind the source.
double seen_from_behind(const RadiographProjector& projector) {
  double most = 0;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(0, 0, 300), Eigen::Vector3d(0, -1200, 0), Eigen::Vector3d(0, -700, 0)}) {
    RigidTransform at = pose();
    at.translation_mm += shift;
    for (const float value : radiograph_of(projector, camera_at(0), whole(), at))
      most = std::max(most, double(std::abs(value)));
    for (const float value : projector.radiograph(camera_at(0), at, std::vector<Eigen::Vector2f>{{80, 80}, {10, 100}}))
      most = std::max(most, double(std::abs(value)));
  }
  return most;
}

/// Largest error if the source lies within the body. Only the part in front of the source counts.
double source_within_mm(const RadiographProjector& projector) {
  RigidTransform at = moved_by({0, 0, 0}, source_position_mm(camera_at(0)) + Eigen::Vector3d(2, 5, -3));
  const Camera camera = camera_at(0);
  const std::vector<float> values = radiograph_of(projector, camera, PixelGrid{0, 0, 40, 4, 4}, at);
  double most = 0;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) {
      const double expected = kDensity * chord_mm(ball(), inverse(at) * source_position_mm(camera),
                                                  ray_direction(camera, Eigen::Vector2d(40.0 * column, 40.0 * row)));
      most = std::max(most, std::abs(double(values[std::size_t(row * 4 + column)]) - expected));
    }
  return most;
}

/// The field is that of one of two balls. Returns the value where the other ball lies.
double other_fragment_mm(const RadiographProjector& projector) {
  const RigidTransform at = moved_by({0, 0, 0}, {0, 0, 0});
  const auto pixel = [](const Eigen::Vector3d& point) {
    return Eigen::Vector2f(project(camera_at(0), point).cast<float>());
  };
  const std::vector<float> values =
      projector.radiograph(camera_at(0), at, std::vector<Eigen::Vector2f>{pixel({-12, 0, 0}), pixel({12, 0, 0})});
  expect(values.at(0) > 20, "the fragment that the field means is not seen");
  return double(values.at(1));
}
double other_fragment_mm(const Subject& subject) {
  bool has_field = false;
  for (const PortInfo& port : subject.info().inputs) has_field = has_field || port.name == "field";
  if (!has_field) throw NotApplicable("it has no input 'field'");
  const Body two{{{-12, 0, 0}, {8, 8, 8}}, {{12, 0, 0}, {8, 8, 8}}}, one{two[0]};
  const Grid grid = fine_grid();
  return largest(subject, inputs_of(volume_of(two, grid, 500, -1000), field_of(one, grid, 6), mesh_of(one)),
                 [](const RadiographProjector& projector) { return other_fragment_mm(projector); });
}

/// A check on the radiographs of one body.
Check check_of(const char* name, const char* what, double limit, Body (*body)(),
               const std::function<double(const RadiographProjector&)>& figure) {
  return {{name, what, limit, "mm of water"},
          [body, figure](const Subject& subject) { return largest(subject, inputs_of(body()), figure); }};
}

}  // namespace

PixelGrid whole() { return {0, 0, 1, kSize_px, kSize_px}; }

std::vector<float> radiograph_of(const RadiographProjector& projector, const Camera& camera, const PixelGrid& grid,
                                 const RigidTransform& at) {
  std::vector<float> values = projector.radiograph(camera, at, grid);
  expect(values.size() == grid.count(), formatted("of {} pixels it gives {} values", grid.count(), values.size()));
  return values;
}

std::vector<Check> radiograph_checks() {
  return {check_of("ball", "radiograph of a ball of 36 mm: mean error", 0.4, ball, ball_error_mm),
          {{"box", "radiograph of a box: mean error", 0.6, "mm of water"},
           [](const Subject& subject) { return solid_error_mm(subject, box_between(kBox_mm), fine_grid()); }},
          {{"octahedron", "radiograph of an octahedron in a rotated grid: mean error", 0.6, "mm of water"},
           [](const Subject& subject) {
             return solid_error_mm(subject, octahedron_between(kOctahedron_mm), turned_grid());
           }},
          check_of("single_pixels",
                   "single pixels against the same pixels of a whole radiograph: root mean square difference", 0.4, egg,
                   [](const RadiographProjector& projector) { return pixels_off_mm(projector, true); }),
          check_of("sub_sampled",
                   "every third pixel against the same pixels of a whole radiograph: root mean square difference", 1,
                   egg, [](const RadiographProjector& projector) { return pixels_off_mm(projector, false); }),
          check_of("region", "largest value outside the projector's region", 0, egg, beyond_region_mm),
          check_of("out_of_view", "largest value if the body is out of view or behind the source", 0, ball,
                   seen_from_behind),
          check_of("source_within", "largest error if the source lies within the body", 2.5, ball, source_within_mm),
          {{"other_fragment", "value at a pixel that shows only another fragment", 0, "mm of water"},
           [](const Subject& subject) { return other_fragment_mm(subject); }}};
}

Camera camera_at(double angle_deg) { return analytic::c_arm(angle_deg, kSize_px, kSize_px, 1); }
const std::vector<double>& angles() {
  static const std::vector<double> kAngles{0, 35, 90, 160};
  return kAngles;
}
RigidTransform pose() { return analytic::moved_by({0.3, -0.2, 0.5}, {3, -4, 6}); }

analytic::Body ball() { return {{{0, 0, 0}, {18, 18, 18}}}; }
analytic::Body egg() { return {{{1, -2, 1.5}, {11, 16, 27}, rotation_from_vector({0.4, 0.2, -0.3})}}; }
Grid fine_grid() { return analytic::grid_of({62, 62, 78}, {0.8, 0.8, 0.8}); }

Inputs inputs_of(Volume volume, SignedField field, Mesh mesh) {
  List<View> views;
  for (const double angle : {0.0, 90.0}) {
    const std::string name = angle == 0 ? "frontal" : "lateral";
    views.add(name, View{name, Image{cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(20000))}, camera_at(angle), {}});
  }
  return {{"volume", item(std::move(volume))},
          {"field", item(std::move(field))},
          {"model", item(std::move(mesh))},
          {"views", Value::of(views, "view")}};
}
Inputs inputs_of(const analytic::Body& body) {
  Inputs inputs = inputs_of(volume_of(body, fine_grid(), 1000 * kDensity - 1000, -1000), field_of(body, fine_grid(), 6),
                            mesh_of(body));
  const auto projector = std::make_shared<const analytic::BodyProjector>(body, kDensity);
  List<RadiographProjector> projectors;
  projectors.add_shared("bone", projector);
  List<Pose> poses;
  poses.add("bone", Pose());
  inputs.set("projector", Value::of<RadiographProjector>(projector));
  inputs.set("other_projectors", Value::of(projectors, "fragment"));
  inputs.set("others", Value::of(poses, "fragment"));
  return inputs;
}

}  // namespace marrow::conformance
