// SPDX-License-Identifier: Apache-2.0
// Checks for projectors. Radiographs are compared with the exact chords of a ball, a box and an octahedron, outlines
// with the silhouette of an ellipsoid. A node draws one or both, as the types of its outputs say.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <marrow/plugin.hpp>

#include "checks.hpp"

namespace {

using namespace marrow;
using namespace marrow::conformance;

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  const Camera camera = camera_at(0);
  for (const OutlineProjector* projector : projectors_in<OutlineProjector>(ports, outputs))
    check_outline(projector->outline(camera, pose(), 1), camera);
  for (const RadiographProjector* projector : projectors_in<RadiographProjector>(ports, outputs)) {
    std::vector<float> values = projector->radiograph(camera, pose(), whole());
    for (const float value : projector->radiograph(camera, pose(), std::vector<Eigen::Vector2f>{{80, 80}}))
      values.push_back(value);
    for (const float value : values)
      expect(std::isfinite(value) && value >= 0, "a value of the radiograph is below 0 or not a number");
    projector->region(camera, pose());
  }
}

/// The number of drawings with 1, 2 and 7 threads that differ from the first one.
int differing(const std::function<std::string()>& draw) {
  const std::string expected = draw();
  int count = 0;
  for (const int threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] { count += draw() != expected; });
  }
  return count;
}

double differing_drawings(const Subject& subject) {
  const Made made(subject, inputs_of(egg()));
  const Camera camera = camera_at(35);
  int count = 0;
  for (const OutlineProjector* projector : made.all<OutlineProjector>())
    count += differing([&] {
      std::string text;
      for (const OutlinePoint& p : projector->outline(camera, pose(), 1))
        text += formatted("{} {:f} ", digits(double(p.u_px)), p.v_px);
      return text;
    });
  for (const RadiographProjector* projector : made.all<RadiographProjector>())
    count += differing([&] {
      const std::vector<float> values = projector->radiograph(camera, pose(), whole());
      return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    });
  return count;
}

/// The largest change of a radiograph if model and camera move together. There should be none.
double moved_together(const Subject& subject) {
  const Made made(subject, inputs_of(egg()));
  const RigidTransform motion{"world", "world", rotation_from_vector({0.5, 1.2, -0.8}), {100, -50, 70}};
  const Camera camera = camera_at(35);
  Camera other = camera;
  other.camera_from_world = camera.camera_from_world * inverse(motion);
  const RigidTransform at = motion * pose();
  for (const OutlineProjector* projector : made.all<OutlineProjector>()) {
    const std::size_t count = projector->outline(camera, pose(), 2).size(),
                      same = projector->outline(other, at, 2).size();
    // A point on the border of a pixel may fall on either side.
    expect(std::abs(double(same) - double(count)) <= 2 + 0.02 * double(count),
           formatted("moved together, the outline has {} points, not {}", same, count));
  }
  double most = 0;
  for (const RadiographProjector* projector : made.all<RadiographProjector>()) {
    const std::vector<float> values = radiograph_of(*projector, camera, whole()),
                             same = radiograph_of(*projector, other, whole(), at);
    for (std::size_t i = 0; i < same.size(); ++i) most = std::max(most, std::abs(double(values[i]) - double(same[i])));
  }
  return most;
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

Suite suite_of_kind() {
  Suite suite;
  suite.sample = [] { return inputs_of(egg()); };
  suite.validate = validate;
  suite.trials = trials();
  suite.accuracy = radiograph_checks();
  suite.add("moved_together", "model and camera moved together: largest change", 0.05, "mm of water", moved_together);
  suite.add("any_threads", "outlines and radiographs that differ with 1, 2 and 7 threads", 0, "pictures",
            differing_drawings);
  for (const Check& check : derivative_checks()) suite.accuracy.push_back(check);
  for (const Check& check : outline_checks()) suite.accuracy.push_back(check);
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("project", suite_of_kind()); }
