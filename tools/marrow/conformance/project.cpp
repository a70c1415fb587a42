// SPDX-License-Identifier: Apache-2.0
// Projectors: radiographs against the chords of a ball, a box and an octahedron that are known exactly, and outlines
// against the silhouette of an ellipsoid. A node draws one or the other, or both; what it cannot draw it refuses in
// words.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "conformance/body.hpp"
#include "conformance/plane_solid.hpp"
#include "conformance/suite.hpp"

namespace marrow::conformance {
namespace {

constexpr int kSize_px = 160;
constexpr double kDensity = 1.5;  // of what the volumes show, relative to water: 500 HU
constexpr double kSpacing_px = 1;

Camera camera_at(double angle_deg) { return c_arm(angle_deg, kSize_px, kSize_px, 1); }
const std::vector<double>& angles() {
  static const std::vector<double> kAngles{0, 35, 90, 160};
  return kAngles;
}
RigidTransform pose() { return moved_by({0.3, -0.2, 0.5}, {3, -4, 6}); }

Body ball() { return {{{0, 0, 0}, {18, 18, 18}}}; }
const Eigen::Vector3d kBox_mm(12, 16, 9.6);        // half of its sides, whole voxels
const Eigen::Vector3d kOctahedron_mm(20, 16, 24);  // half of its diagonals
Body egg() { return {{{1, -2, 1.5}, {11, 16, 27}, rotation_from_vector({0.4, 0.2, -0.3})}}; }
Grid fine_grid() { return grid_of({62, 62, 78}, {0.8, 0.8, 0.8}); }
Grid turned_grid() { return grid_of({56, 70, 48}, {1, 0.8, 1.2}, rotation_from_vector({0.5, -0.3, 0.8})); }

/// Of the box, the octahedron and the ball the mesh is that of the ball: no radiograph depends on it.
Inputs inputs_of(Volume volume, SignedField field, Mesh mesh) {
  List<View> views;
  for (const double angle : {0.0, 90.0}) {
    const std::string name = angle == 0 ? "frontal" : "lateral";
    views.add(name, View{name, Image{cv::Mat(kSize_px, kSize_px, CV_16U, cv::Scalar(20000))}, camera_at(angle), {}});
  }
  return {{"volume", item(std::move(volume))},
          {"field", item(std::move(field))},
          {"mesh", item(std::move(mesh))},
          {"views", Value::of(views, "view")}};
}
Inputs inputs_of(const Body& body, const Grid& grid = fine_grid()) {
  return inputs_of(volume_of(body, grid, 1000 * kDensity - 1000, -1000), field_of(body, grid, 6), mesh_of(body));
}

/// The node's projector with what it refers to.
class Made {
 public:
  Made(const Subject& subject, Inputs inputs)
      : inputs_(std::move(inputs)), value_(subject.output(inputs_, "projector")) {}
  const Projector* operator->() const { return &value_.as<Projector>(); }

 private:
  Inputs inputs_;
  Value value_;
};

/// What `draw` gives, or nothing where the projector refuses to draw such a thing.
template <class Draw>
auto drawn(const Draw& draw) -> std::optional<decltype(draw())> {
  try {
    return draw();
  } catch (const Error& error) {
    expect_reason(error.what());
    return std::nullopt;
  }
}
std::vector<OutlinePoint> outline_of(const Made& projector, const Camera& camera, double spacing_px = kSpacing_px) {
  auto points = drawn([&] { return projector->outline(camera, pose(), spacing_px); });
  if (!points) throw NotApplicable("it draws no outlines");
  return std::move(*points);
}
std::vector<float> radiograph_of(const Made& projector, const Camera& camera, const PixelGrid& grid,
                                 const RigidTransform& at = pose()) {
  auto values = drawn([&] { return projector->radiograph(camera, at, grid); });
  if (!values) throw NotApplicable("it makes no radiographs");
  expect(values->size() == grid.count(),
         "of " + std::to_string(grid.count()) + " pixels it gives " + std::to_string(values->size()) + " values");
  return std::move(*values);
}
PixelGrid whole() { return {0, 0, 1, kSize_px, kSize_px}; }

void check_outline(const std::vector<OutlinePoint>& points, const Camera& camera) {
  for (const OutlinePoint& p : points) {
    expect(std::isfinite(p.u_px) && std::isfinite(p.v_px) && p.model_mm.allFinite(),
           "a point of the outline is not a number");
    expect(p.u_px >= 0 && p.v_px >= 0 && p.u_px <= float(camera.width_px - 1) && p.v_px <= float(camera.height_px - 1),
           "a point of the outline lies outside of the image");
    expect(std::abs(std::hypot(p.normal_u, p.normal_v) - 1) < 1e-3f,
           "a normal of the outline is " + digits(double(std::hypot(p.normal_u, p.normal_v))) + " long, and not 1");
  }
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "projector") continue;
    expect(outputs[i].data != nullptr, "it gives no projector");
    const Projector& projector = outputs[i].as<Projector>();
    const Camera camera = camera_at(0);
    const auto outline = drawn([&] { return projector.outline(camera, pose(), kSpacing_px); });
    const auto values = drawn([&] { return projector.radiograph(camera, pose(), whole()); });
    const auto pixels = drawn([&] {
      return projector.radiograph(camera, pose(), std::vector<Eigen::Vector2f>{{80, 80}});
    });
    const auto region = drawn([&] { return projector.region(camera, pose()); });
    expect(outline || values, "it draws neither outlines nor radiographs");
    expect(bool(values) == bool(pixels) && bool(values) == bool(region),
           "it makes some radiographs and refuses others: whole ones, single pixels, their region");
    if (outline) check_outline(*outline, camera);
    if (values)
      for (const float value : *values)
        expect(std::isfinite(value) && value >= 0, "a value of the radiograph is below 0 or not a number");
  }
}

/// The mean error over the pixels that see the solid by more than 2 mm of water, of all views.
double mean_error_mm(const Subject& subject, const Inputs& inputs,
                     const std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>& chord_mm) {
  const Made projector(subject, inputs);
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
            kDensity * chord_mm(source, model_from_world.rotation * ray_direction(camera, Eigen::Vector2d(u, v)));
        if (expected < 2) continue;
        sum += std::abs(double(values[std::size_t(v) * kSize_px + std::size_t(u)]) - expected);
        ++count;
      }
  }
  return sum / count;
}

double ball_error_mm(const Subject& subject) {
  return mean_error_mm(subject, inputs_of(ball()),
                       [](const auto& start, const auto& direction) { return chord_mm(ball(), start, direction); });
}
double solid_error_mm(const Subject& subject, const std::vector<Eigen::Vector3d>& normals, const Grid& grid) {
  return mean_error_mm(
      subject, inputs_of(volume_of(normals, grid, 1000 * kDensity - 1000), field_of(normals, grid), mesh_of(ball())),
      [&](const auto& start, const auto& direction) { return chord_mm(normals, start, direction); });
}

/// Root mean square of the differences; the bodies' borders are steep, where interpolation differs most.
double pixels_off_mm(const Subject& subject, bool single) {
  const Made projector(subject, inputs_of(egg()));
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
        single ? projector->radiograph(camera, pose(), pixels) : projector->radiograph(camera, pose(), some);
    expect(values.size() == pixels.size(),
           "of " + std::to_string(pixels.size()) + " pixels it gives " + std::to_string(values.size()) + " values");
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const float expected = all[std::size_t(pixels[i].y()) * kSize_px + std::size_t(pixels[i].x())];
      squares += std::pow(double(values[i] - expected), 2);
      count += expected > 0 || values[i] > 0;
    }
  }
  expect(count > 0, "its radiographs are empty");
  return std::sqrt(squares / double(count));
}

/// The largest value outside of the region, with the body in and partly out of the image.
double beyond_region_mm(const Subject& subject) {
  const Made projector(subject, inputs_of(egg()));
  float most = 0;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(35, 0, 40), Eigen::Vector3d(-45, 0, -30)}) {
    RigidTransform at = pose();
    at.translation_mm += shift;
    const Camera camera = camera_at(0);
    const std::vector<float> values = radiograph_of(projector, camera, whole(), at);
    const PixelGrid region = projector->region(camera, at);
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

/// Out of view, and behind the source: nothing to be seen.
double seen_from_behind(const Subject& subject) {
  const Made projector(subject, inputs_of(ball()));
  double most = 0;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(0, 0, 300), Eigen::Vector3d(0, -1200, 0), Eigen::Vector3d(0, -700, 0)}) {
    RigidTransform at = pose();
    at.translation_mm += shift;
    for (const float value : radiograph_of(projector, camera_at(0), whole(), at))
      most = std::max(most, double(std::abs(value)));
    for (const float value : projector->radiograph(camera_at(0), at, std::vector<Eigen::Vector2f>{{80, 80}, {10, 100}}))
      most = std::max(most, double(std::abs(value)));
  }
  return most;
}

/// The source within the body: only what lies in front of it counts.
double source_within_mm(const Subject& subject) {
  const Made projector(subject, inputs_of(ball()));
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

double differing_drawings(const Subject& subject) {
  const Made projector(subject, inputs_of(egg()));
  const auto draw = [&] {
    std::string text;
    const Camera camera = camera_at(35);
    if (const auto outline = drawn([&] { return projector->outline(camera, pose(), 1); }))
      for (const OutlinePoint& p : *outline) text += digits(double(p.u_px)) + " " + std::to_string(p.v_px) + " ";
    if (const auto values = drawn([&] { return projector->radiograph(camera, pose(), whole()); }))
      text.append(reinterpret_cast<const char*>(values->data()), values->size() * sizeof(float));
    return text;
  };
  const std::string expected = draw();
  int differing = 0;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] { differing += draw() != expected; });
  }
  return differing;
}

/// Model and camera moved alike: the picture is the same.
double moved_together(const Subject& subject) {
  const Made projector(subject, inputs_of(egg()));
  const RigidTransform motion{"world", "world", rotation_from_vector({0.5, 1.2, -0.8}), {100, -50, 70}};
  const Camera camera = camera_at(35);
  Camera other = camera;
  other.camera_from_world = camera.camera_from_world * inverse(motion);
  const RigidTransform at = motion * pose();
  double most = 0;
  const auto compare = [&](double a, double b) { most = std::max(most, std::abs(a - b)); };
  if (const auto outline = drawn([&] { return projector->outline(camera, pose(), 2); })) {
    const auto same = projector->outline(other, at, 2);
    // A point on a pixel's border may fall to either side.
    expect(std::abs(double(same.size()) - double(outline->size())) <= 2 + 0.02 * double(outline->size()),
           "moved together, the outline has " + std::to_string(same.size()) + " points, not " +
               std::to_string(outline->size()));
  }
  if (const auto values = drawn([&] { return projector->radiograph(camera, pose(), whole()); })) {
    const auto same = projector->radiograph(other, at, whole());
    for (std::size_t i = 0; i < same.size(); ++i) compare(double((*values)[i]), double(same[i]));
  }
  return most;
}

/// A field of one of two balls: what is seen of the other.
double other_fragment_mm(const Subject& subject) {
  const Body two{{{-12, 0, 0}, {8, 8, 8}}, {{12, 0, 0}, {8, 8, 8}}}, one{two[0]};
  const Grid grid = fine_grid();
  bool has_field = false;
  for (const PortInfo& port : subject.info().inputs) has_field = has_field || port.name == "field";
  if (!has_field) throw NotApplicable("it has no input 'field'");
  const Made projector(subject, inputs_of(volume_of(two, grid, 500, -1000), field_of(one, grid, 6), mesh_of(one)));
  const RigidTransform at = moved_by({0, 0, 0}, {0, 0, 0});
  const auto pixel = [](const Eigen::Vector3d& point) {
    return Eigen::Vector2f(project(camera_at(0), point).cast<float>());
  };
  const std::vector<float> values =
      projector->radiograph(camera_at(0), at, std::vector<Eigen::Vector2f>{pixel({-12, 0, 0}), pixel({12, 0, 0})});
  expect(values.at(0) > 20, "the fragment that the field means is not seen");
  return double(values.at(1));
}

/// Points of the true silhouette, densely.
std::vector<OutlinePoint> true_outline(const Camera& camera) {
  return BodyProjector(egg()).outline(camera, pose(), 0.05);
}
const OutlinePoint& nearest(const std::vector<OutlinePoint>& points, const OutlinePoint& p) {
  return *std::min_element(points.begin(), points.end(), [&](const OutlinePoint& a, const OutlinePoint& b) {
    return std::hypot(a.u_px - p.u_px, a.v_px - p.v_px) < std::hypot(b.u_px - p.u_px, b.v_px - p.v_px);
  });
}

/// Of the outline in all views, against the silhouette: mean and largest distance, mean angle, and the part of the
/// silhouette without a point near.
struct OutlineErrors {
  double mean_px = 0, worst_px = 0, angle_deg = 0, missing_percent = 0, model_mm = 0;
};
OutlineErrors outline_errors(const Subject& subject) {
  const Made projector(subject, inputs_of(egg()));
  OutlineErrors errors;
  double count = 0, missing = 0, all = 0;
  for (const double angle : angles()) {
    const Camera camera = camera_at(angle);
    const std::vector<OutlinePoint> points = outline_of(projector, camera), silhouette = true_outline(camera);
    expect(!points.empty(), "its outline is empty");
    check_outline(points, camera);
    for (const OutlinePoint& p : points) {
      const OutlinePoint& q = nearest(silhouette, p);
      const double off = std::abs(double((p.u_px - q.u_px) * q.normal_u + (p.v_px - q.v_px) * q.normal_v));
      errors.mean_px += off;
      errors.worst_px = std::max(errors.worst_px, off);
      errors.angle_deg +=
          degrees(std::acos(std::clamp(double(p.normal_u * q.normal_u + p.normal_v * q.normal_v), -1.0, 1.0)));
      const Eigen::Vector2d seen = project(camera, pose() * p.model_mm.cast<double>());
      errors.model_mm += 0.6 * std::hypot(seen.x() - double(p.u_px), seen.y() - double(p.v_px));
      count += 1;
    }
    for (const OutlinePoint& q : silhouette) {
      const OutlinePoint& p = nearest(points, q);
      missing += std::hypot(p.u_px - q.u_px, p.v_px - q.v_px) > 2.5 * kSpacing_px;
      all += 1;
    }
  }
  errors.mean_px /= count;
  errors.angle_deg /= count;
  errors.model_mm /= count;
  errors.missing_percent = 100 * missing / all;
  return errors;
}

/// A wider spacing gives as many points fewer.
double spacing_off_percent(const Subject& subject) {
  const Made projector(subject, inputs_of(egg()));
  const double fine = double(outline_of(projector, camera_at(0), 1).size()),
               coarse = double(outline_of(projector, camera_at(0), 4).size());
  return 100 * std::abs(4 * coarse / fine - 1);
}

std::vector<Trial> trials() {
  const auto changed = [](const std::function<void(Volume&, SignedField&, Mesh&)>& change) {
    Volume volume = volume_of(ball(), fine_grid(), 500, -1000);
    SignedField field = field_of(ball(), fine_grid(), 6);
    Mesh mesh = mesh_of(ball());
    change(volume, field, mesh);
    return inputs_of(std::move(volume), std::move(field), std::move(mesh));
  };
  return {
      {"air",
       [changed] { return changed([](Volume& v, SignedField&, Mesh&) { v.values.assign(v.values.size(), -1000); }); }},
      {"nothing_inside",
       [changed] {
         return changed([](Volume&, SignedField& f, Mesh&) { f.values_mm.assign(f.values_mm.size(), 6); });
       }},
      {"one_voxel",
       [changed] {
         return changed([](Volume& v, SignedField& f, Mesh& m) {
           v.grid.size = f.grid.size = {1, 1, 1};
           v.values = {500};
           f.values_mm = {-1};
           m.triangles.resize(1);
         });
       }},
      {"missing_values",
       [changed] {
         return changed([](Volume& v, SignedField&, Mesh& m) {
           v.values.resize(10);
           m.triangles.clear();
         });
       }},
      {"not_a_number",
       [changed] {
         return changed([](Volume& v, SignedField&, Mesh& m) {
           v.values[5000] = std::nanf("");
           m.vertices_mm[3].x() = std::nan("");
         });
       }},
      {"other_size",
       [changed] {
         return changed([](Volume&, SignedField& f, Mesh&) {
           f.grid.size = {3, 3, 3};
           f.values_mm.resize(27);
         });
       }},
      {"bad_triangle", [changed] {
         return changed([](Volume& v, SignedField&, Mesh& m) {
           m.triangles[0][1] = 100000000;
           v.grid.spacing_mm.x() = 0;
         });
       }}};
}

}  // namespace

Suite project_suite() {
  Suite suite;
  suite.kind = "project";
  suite.sample = [] { return inputs_of(egg()); };
  suite.validate = validate;
  suite.trials = trials();
  const auto add = [&](const char* name, const std::string& what, double limit, const char* unit,
                       std::function<double(const Subject&)> measure) {
    suite.accuracy.push_back({name, what, limit, unit, std::move(measure)});
  };
  add("ball", "radiograph of a ball of 36 mm: mean error", 0.4, "mm of water", ball_error_mm);
  add("box", "radiograph of a box in a turned grid: mean error", 0.6, "mm of water",
      [](const Subject& s) { return solid_error_mm(s, box_between(kBox_mm), fine_grid()); });
  add("octahedron", "radiograph of a closed mesh made voxels in a turned grid: mean error", 0.6, "mm of water",
      [](const Subject& s) { return solid_error_mm(s, octahedron_between(kOctahedron_mm), turned_grid()); });
  add("single_pixels", "single pixels against the same of a whole radiograph: root mean square", 0.4, "mm of water",
      [](const Subject& s) { return pixels_off_mm(s, true); });
  add("sub_sampled", "every third pixel against the same of a whole radiograph: root mean square", 1, "mm of water",
      [](const Subject& s) { return pixels_off_mm(s, false); });
  add("region", "largest value outside of the region", 0, "mm of water", beyond_region_mm);
  add("out_of_view", "largest value where the body is out of view or behind the source", 0, "mm of water",
      seen_from_behind);
  add("source_within", "with the source in the body: largest error", 2.5, "mm of water", source_within_mm);
  add("other_fragment", "value where only another fragment is", 0, "mm of water", other_fragment_mm);
  add("moved_together", "model and camera moved alike: largest change", 0.05, "mm of water", moved_together);
  add("any_threads", "pictures that differ with 1, 2 and 7 threads", 0, "pictures", differing_drawings);
  add("outline", "mean distance of the outline from an ellipsoid's silhouette", 0.35, "px",
      [](const Subject& s) { return outline_errors(s).mean_px; });
  add("outline_worst", "largest distance of the outline from an ellipsoid's silhouette", 1.2, "px",
      [](const Subject& s) { return outline_errors(s).worst_px; });
  add("outline_direction", "mean angle between the outline's normals and the silhouette's", 6, "deg",
      [](const Subject& s) { return outline_errors(s).angle_deg; });
  add("outline_complete", "part of the silhouette further than 2.5 px from the outline", 0, "%",
      [](const Subject& s) { return outline_errors(s).missing_percent; });
  add("outline_model",
      "mean distance, across the ray, between an outline's pixel and the surface point that it is the image of", 1,
      "mm", [](const Subject& s) { return outline_errors(s).model_mm; });
  add("outline_spacing", "four times the spacing: deviation of the number of points from a quarter", 30, "%",
      spacing_off_percent);
  return suite;
}

}  // namespace marrow::conformance
