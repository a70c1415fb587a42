// SPDX-License-Identifier: Apache-2.0
#include "radiograph_checks.hpp"

#include <algorithm>
#include <cmath>

#include "made.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/project/plane_solid.hpp"

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

}  // namespace marrow::conformance
