// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/made.hpp"
#include "tests/plugins/project/radiograph_behaviour.hpp"

namespace marrow::test::lightfield_test {

Inputs inputs(const Volume& volume, const SignedField* field) {
  List<View> views;
  for (const double angle : {0.0, 90.0})
    views.add(angle > 0 ? "lateral" : "frontal", View{"", {}, radiograph_behaviour::camera(angle), {}});
  Inputs in{{"volume", item(volume)}, {"views", shipped::list(views, "view")}};
  if (field) in["field"] = item(*field);
  return in;
}

std::shared_ptr<const RadiographProjector> make_medium(const Volume& volume, const SignedField* field) {
  return made::projector<RadiographProjector>(
      "project.lightfield", inputs(volume, field),
      {{"ray_spacing_mm", 2.0}, {"direction_spacing_deg", 1.5}, {"max_rotation_deg", 2.0}});
}
/// With a coarse table, which is quick to make.
std::shared_ptr<const RadiographProjector> make_coarse(const Volume& volume, const SignedField* field) {
  return made::projector<RadiographProjector>(
      "project.lightfield", inputs(volume, field),
      {{"ray_spacing_mm", 5.0}, {"direction_spacing_deg", 4.0}, {"max_rotation_deg", 2.0}});
}

TEST(LightField, IntegralsOfACloud) { radiograph_behaviour::integrals_of_a_cloud(make_medium, 0.2, 1.0); }
TEST(LightField, ChordOfABlock) { radiograph_behaviour::chord_of_a_block(make_coarse); }
TEST(LightField, RegionHoldsAll) { radiograph_behaviour::region_holds_all(make_coarse); }
TEST(LightField, GridsAndPixelsAgree) { radiograph_behaviour::grids_and_pixels_agree(make_coarse, 1e-3); }
TEST(LightField, AFieldLeavesTheRestOut) { radiograph_behaviour::a_field_leaves_the_rest_out(make_coarse); }
TEST(LightField, SourceWithin) { radiograph_behaviour::source_within(make_coarse); }

TEST(LightField, HasNoSmoothedModel) {
  EXPECT_EQ(make_coarse(radiograph_behaviour::cloud(), nullptr)->smoothed(1), nullptr);
}

TEST(LightField, FinerStepsAreMoreAccurate) {
  const Inputs in = inputs(radiograph_behaviour::cloud(), nullptr);
  const Camera& camera = radiograph_behaviour::camera(0);
  RigidTransform pose = shapes::centred_at({3, -4, 6});
  pose.rotation = rotation_from_vector({0.05, -0.04, 0.06});
  const auto exact = made::projector<RadiographProjector>("project.siddon_jacobs", {{"volume", in.at("volume")}});
  const PixelGrid grid{150, 150, 3, 70, 70};
  const auto expected = exact->radiograph(camera, pose, grid);
  const auto error = [&](double step_mm, double step_deg) {
    const auto values =
        made::projector<RadiographProjector>(
            "project.lightfield", in,
            {{"ray_spacing_mm", step_mm}, {"direction_spacing_deg", step_deg}, {"max_rotation_deg", 4.0}})
            ->radiograph(camera, pose, grid);
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += std::abs(double(values[i] - expected[i])) / double(values.size());
    return sum;
  };
  const double coarse = error(4, 2.4), fine = error(2, 1.2);
  EXPECT_LT(fine, 0.4 * coarse);
  EXPECT_LT(fine, 0.2);
}

TEST(LightField, OutOfRangeItIsJosephs) {
  // The table holds no ray for a rotation of 30 degrees.
  const Inputs in = inputs(radiograph_behaviour::cloud(), nullptr);
  const Camera& camera = radiograph_behaviour::camera(40);
  const std::vector<Eigen::Vector2f> pixels{{250, 250}, {240, 263}, {300, 222}};
  const auto values = made::projector<RadiographProjector>("project.lightfield", in, {{"ray_spacing_mm", 5.0}})
                          ->radiograph(camera, shapes::centred_at({0, 0, 0}), pixels);
  const auto expected = made::projector<RadiographProjector>("project.joseph", {{"volume", in.at("volume")}})
                            ->radiograph(camera, shapes::centred_at({0, 0, 0}), pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-3);
}

TEST(LightField, SaysWhatIsWrong) {
  Inputs in = inputs(radiograph_behaviour::cloud(), nullptr);
  const std::string text = refusal("project.lightfield", in, {{"ray_spacing_mm", 0.2}, {"direction_spacing_deg", 0.3}});
  EXPECT_NE(text.find("MB, but max_memory_mb is 1024; raise ray_spacing_mm or direction_spacing_deg, take a smaller "
                      "max_rotation_deg, or the "
                      "field of a fragment"),
            std::string::npos)
      << text;
  in["views"] = {};
  EXPECT_EQ(refusal("project.lightfield", in),
            "there is no view, so the directions to integrate along are not known; wire 'views'");
}

}  // namespace marrow::test::lightfield_test
