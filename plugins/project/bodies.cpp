// SPDX-License-Identifier: Apache-2.0
#include "bodies.hpp"

namespace marrow::conformance {

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
