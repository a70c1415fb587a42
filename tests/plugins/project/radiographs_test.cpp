// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::radiographs_test {

using analytic::Body, analytic::BodyProjector, analytic::c_arm;

// What every projector of radiographs must do, compared with integrals that are known exactly.

/// A volume in HU, as a function of the position, around the origin of the frame. `turn` rotates its axes.
Volume volume_of(const std::array<int, 3>& size, const Vector3d& spacing_mm, const Matrix3d& turn,
                 const std::function<double(const Vector3d&)>& hu) {
  return volume_by(analytic::grid_of(size, spacing_mm, turn), hu);
}

constexpr double kWidth_mm = 8;

/// A cloud whose attenuation falls off as a Gaussian from twice water's at its middle.
Volume cloud(const Matrix3d& turn = Matrix3d::Identity()) {
  return volume_of({90, 99, 78}, {0.8, 0.7, 1.0}, turn, [](const Vector3d& p) {
    return -1000 + 2000 * std::exp(-0.5 * p.squaredNorm() / (kWidth_mm * kWidth_mm));
  });
}

double distance_from_ray(const Camera& camera, const Vector2d& pixel, const Vector3d& point) {
  return (point - source_position_mm(camera)).cross(ray_direction(camera, pixel)).norm();
}

/// The integral of the cloud along a line that passes its middle at this distance.
double integral_mm(double distance) {
  return 2 * kWidth_mm * std::sqrt(2 * kPi) * std::exp(-0.5 * distance * distance / (kWidth_mm * kWidth_mm));
}

const Camera& camera(double angle_deg) {
  static std::map<double, Camera> cameras;
  return cameras.try_emplace(angle_deg, shapes::c_arm(angle_deg)).first->second;
}

using Projector = std::shared_ptr<const RadiographProjector>;

Projector projector_of(const std::string& node, const Inputs& inputs, const Options& options = {}) {
  return made<RadiographProjector>(node, "projector", inputs, options);
}

/// What a light field is made from.
Inputs inputs(const Volume& volume) {
  List<View> views;
  for (const double angle : {0.0, 90.0}) views.add(angle > 0 ? "lateral" : "frontal", View{"", {}, camera(angle), {}});
  return {{"volume", item(volume)}, {"views", shipped::list(views, "view")}};
}

Options table(double spacing_mm, double spacing_deg, double most_deg = 2) {
  return {{"ray_spacing_mm", spacing_mm}, {"direction_spacing_deg", spacing_deg}, {"max_rotation_deg", most_deg}};
}

/// A node, and how far its radiographs may be off. Coarse tables are quick to make.
struct Node {
  const char* name;
  double cloud_mean_mm, cloud_worst_mm, smoothed_cloud_mm, grids_mm;
  Options fine = {}, coarse = {};

  Projector make(const Volume& volume, const SignedField* field, const Options& options) const {
    Inputs in{{"volume", item(volume)}};
    if (!options.empty()) in = inputs(volume);
    if (field) in["field"] = item(*field);
    return projector_of(std::string("project.") + name, in, options);
  }
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

class Radiographs : public testing::TestWithParam<Node> {
 protected:
  Projector make(const Volume& volume, const SignedField* field = nullptr) const {
    return GetParam().make(volume, field, GetParam().coarse);
  }
};
class VoxelRadiographs : public Radiographs {};  // of nodes that follow rays through the voxels

const Node kJoseph{"joseph", 0.03, 0.2, 0.25, 0.2}, kRayCasting{"ray_casting", 0.03, 0.2, 0.25, 1e-5},
    kSiddonJacobs{"siddon_jacobs", 0.07, 2, 1.2, 1e-5},
    kLightField{"lightfield", 0.2, 1.0, 0, 1e-3, table(2, 1.5), table(5, 4)};
INSTANTIATE_TEST_SUITE_P(, Radiographs, testing::Values(kJoseph, kRayCasting, kSiddonJacobs, kLightField),
                         [](const auto& info) { return info.param.name; });
INSTANTIATE_TEST_SUITE_P(, VoxelRadiographs, testing::Values(kJoseph, kRayCasting, kSiddonJacobs),
                         [](const auto& info) { return info.param.name; });

TEST_P(Radiographs, IntegralsOfACloud) {
  const RigidTransform pose = shapes::centred_at({3, -4, 6});
  const Vector3d centre = pose * Vector3d(0, 0, 0);
  for (const double angle : {0.0, 30.0, 45.0, 90.0, 200.0})
    for (const bool turned : {false, true}) {
      const Matrix3d turn =
          turned ? Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()).toRotationMatrix() : Matrix3d::Identity();
      const auto projector = GetParam().make(cloud(turn), nullptr, GetParam().fine);
      const PixelGrid grid = projector->region(camera(angle), pose);
      ASSERT_GT(grid.count(), 1000u);
      const auto values = projector->radiograph(camera(angle), pose, grid);
      double sum = 0, worst = 0;
      for (int row = 0; row < grid.rows; ++row)
        for (int column = 0; column < grid.columns; ++column) {
          const double distance = distance_from_ray(camera(angle), grid.pixel(column, row), centre);
          const double error = std::abs(values[std::size_t(row) * std::size_t(grid.columns) + std::size_t(column)] -
                                        integral_mm(distance));
          sum += error / double(grid.count());
          worst = std::max(worst, error);
        }
      EXPECT_LT(sum, GetParam().cloud_mean_mm) << angle << " degrees, turned " << turned;
      EXPECT_LT(worst, GetParam().cloud_worst_mm) << angle << " degrees, turned " << turned;
    }
}

/// A Gaussian cloud smoothed by a Gaussian is a wider and thinner cloud.
TEST_P(VoxelRadiographs, SmoothedCloud) {
  constexpr double kSigma_mm = 3;
  const double width_mm = std::hypot(kWidth_mm, kSigma_mm);
  const auto projector = make(cloud())->smoothed(kSigma_mm);
  ASSERT_NE(projector, nullptr);
  const RigidTransform pose = shapes::centred_at({3, -4, 6});
  const PixelGrid grid = projector->region(camera(30), pose);
  ASSERT_GT(grid.count(), 1000u);
  const auto values = projector->radiograph(camera(30), pose, grid);
  double worst = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const double distance =
          distance_from_ray(camera(30), grid.pixel(column, row), pose * Vector3d(0, 0, 0)) / width_mm;
      const double expected =
          2 * std::pow(kWidth_mm / width_mm, 3) * width_mm * std::sqrt(2 * kPi) * std::exp(-0.5 * distance * distance);
      worst = std::max(worst,
                       std::abs(values[std::size_t(row) * std::size_t(grid.columns) + std::size_t(column)] - expected));
    }
  EXPECT_LT(worst, GetParam().smoothed_cloud_mm);
}

/// Rays at right angles to an even block: the chord is its thickness.
TEST_P(Radiographs, ChordOfABlock) {
  const Volume block = volume_of({40, 30, 50}, {1, 1, 1}, Matrix3d::Identity(), [](const Vector3d&) { return 500; });
  const auto projector = make(block);
  Camera far = camera(0);
  const double distance = 1e5;  // nearly parallel rays
  far.intrinsics(0, 0) = far.intrinsics(1, 1) = 1e5;
  far.camera_from_world.rotation.setIdentity();
  far.camera_from_world.translation_mm = {0, 0, distance};
  const auto values = projector->radiograph(
      far, shapes::centred_at({0, 0, 0}), std::vector<Eigen::Vector2f>{far.intrinsics.col(2).head<2>().cast<float>()});
  EXPECT_NEAR(values.at(0), 1.5 * 50, 1e-3);
}

TEST_P(Radiographs, RegionHoldsAll) {
  const auto projector = make(cloud());
  const RigidTransform pose = shapes::centred_at({10, 5, -8});
  const Camera& view = camera(20);
  const PixelGrid region = projector->region(view, pose), whole{0, 0, 1, view.width_px, view.height_px};
  const auto values = projector->radiograph(view, pose, whole);
  for (int row = 0; row < whole.rows; ++row)
    for (int column = 0; column < whole.columns; ++column) {
      const bool is_in = column >= region.u_px && row >= region.v_px && column < region.u_px + region.columns &&
                         row < region.v_px + region.rows;
      if (is_in) continue;
      ASSERT_EQ(values[std::size_t(row) * std::size_t(whole.columns) + std::size_t(column)], 0) << column << " " << row;
    }
  EXPECT_EQ(projector->region(view, shapes::centred_at({300, 0, 0})).count(), 0u) << "out of view";
}

/// Difference between an image of every step-th pixel and the same pixels one by one.
double largest_difference_mm(const RadiographProjector& projector, double angle_deg, int step) {
  const RigidTransform pose = shapes::centred_at({1, 2, 3});
  const PixelGrid region = projector.region(camera(angle_deg), pose);
  const PixelGrid grid{region.u_px, region.v_px, double(step), region.columns / step, region.rows / step};
  std::vector<Eigen::Vector2f> pixels;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) pixels.push_back(grid.pixel(column, row).cast<float>());
  const auto whole = projector.radiograph(camera(angle_deg), pose, grid),
             single = projector.radiograph(camera(angle_deg), pose, pixels);
  double largest = whole.size() == single.size() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(whole.size(), single.size()); ++i)
    largest = std::max(largest, std::abs(double(whole[i]) - double(single[i])));
  return largest;
}

/// Whole images, sub-sampled images and single pixels agree, up to the interpolation of a whole image. The views are
/// from both sides, with rays from less than a voxel to four voxels apart, because each case has its own inner loop. A
/// smooth volume is summed over fewer slices.
TEST_P(Radiographs, GridsAndPixelsAgree) {
  const double limit_mm = GetParam().grids_mm;
  const auto projector = make(cloud(Eigen::AngleAxisd(0.5, Vector3d(0, 1, 1).normalized()).toRotationMatrix()));
  const auto smoothed = projector->smoothed(2.5);
  for (const double angle_deg : {15.0, 195.0})
    for (const int step : {1, 3, 5, 11}) {
      EXPECT_LT(largest_difference_mm(*projector, angle_deg, step), limit_mm) << angle_deg << " deg, step " << step;
      if (!smoothed) continue;
      EXPECT_LT(largest_difference_mm(*smoothed, angle_deg, step), limit_mm) << angle_deg << " deg, step " << step;
    }
}

TEST_P(Radiographs, AFieldLeavesTheRestOut) {
  const Volume two = volume_of({80, 30, 30}, {1, 1, 1}, Matrix3d::Identity(),
                               [](const Vector3d& p) { return std::abs(std::abs(p.x()) - 20) < 10 ? 1000 : -1000; });
  SignedField field = field_by(two.grid, [](const Vector3d& p) { return p.x(); });  // the left half is the fragment
  const auto projector = make(two, &field);
  const auto pixels = [](double x) {
    return std::vector<Eigen::Vector2f>{project(camera(0), Vector3d(x, 0, 0)).cast<float>()};
  };
  EXPECT_GT(projector->radiograph(camera(0), shapes::centred_at({0, 0, 0}), pixels(-20)).at(0), 50);
  EXPECT_EQ(projector->radiograph(camera(0), shapes::centred_at({0, 0, 0}), pixels(20)).at(0), 0);
  const auto refusal = [&] { return MESSAGE_OF(make(two, &field)); };
  field.grid.origin_mm.x() += 500;
  EXPECT_EQ(refusal(),
            "the field is not where the volume is: voxels of the same index are up to 500 mm apart; wire the field "
            "that was segmented from this volume");
  field.grid = two.grid;
  field.values_mm.pop_back();
  EXPECT_EQ(refusal().substr(0, 14), "the field has ");
  field.grid.size = {2, 2, 2};
  EXPECT_EQ(refusal().substr(0, 45), "the field has another size than the volume: 2");
}

TEST_P(VoxelRadiographs, RefusesNonsense) {
  const Volume air = volume_of({5, 5, 5}, {1, 1, 1}, Matrix3d::Identity(), [](const Vector3d&) { return -1000; });
  EXPECT_EQ(make(air)->region(camera(0), shapes::centred_at({0, 0, 0})).count(), 0u);
  EXPECT_EQ(make(air)->radiograph(camera(0), shapes::centred_at({0, 0, 0}), PixelGrid{0, 0, 1, 3, 2}),
            std::vector<float>(6, 0.0f));
  EXPECT_TRUE(make(cloud())->radiograph(camera(0), shapes::centred_at({0, 0, 0}), PixelGrid{}).empty());
}

/// Rays that start within the volume, so that a part of it lies behind the source.
TEST_P(Radiographs, SourceWithin) {
  const Volume block = volume_of({100, 100, 100}, {2, 2, 2}, Matrix3d::Identity(), [](const Vector3d&) { return 0; });
  Camera view = camera(0);
  view.camera_from_world.rotation.setIdentity();
  view.camera_from_world.translation_mm.setZero();  // the source at the middle
  const auto values = make(block)->radiograph(view, shapes::centred_at({0, 0, 0}),
                                              PixelGrid{view.intrinsics(0, 2), view.intrinsics(1, 2), 1, 1, 1});
  EXPECT_NEAR(values.at(0), 100, 1.1);
}

TEST(LightField, HasNoSmoothedModel) {
  EXPECT_EQ(kLightField.make(cloud(), nullptr, kLightField.coarse)->smoothed(1), nullptr);
}

TEST(LightField, FinerStepsAreMoreAccurate) {
  const Inputs in = inputs(cloud());
  const Camera& view = camera(0);
  RigidTransform pose = shapes::centred_at({3, -4, 6});
  pose.rotation = rotation_from_vector({0.05, -0.04, 0.06});
  const auto exact = projector_of("project.siddon_jacobs", {{"volume", in.at("volume")}});
  const PixelGrid grid{150, 150, 3, 70, 70};
  const auto expected = exact->radiograph(view, pose, grid);
  const auto error = [&](double step_mm, double step_deg) {
    const auto values =
        projector_of("project.lightfield", in, table(step_mm, step_deg, 4))->radiograph(view, pose, grid);
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
  const Inputs in = inputs(cloud());
  const Camera& view = camera(40);
  const std::vector<Eigen::Vector2f> pixels{{250, 250}, {240, 263}, {300, 222}};
  const auto values = projector_of("project.lightfield", in, {{"ray_spacing_mm", 5.0}})
                          ->radiograph(view, shapes::centred_at({0, 0, 0}), pixels);
  const auto expected = projector_of("project.joseph", {{"volume", in.at("volume")}})
                            ->radiograph(view, shapes::centred_at({0, 0, 0}), pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-3);
}

TEST(LightField, SaysWhatIsWrong) {
  Inputs in = inputs(cloud());
  const std::string text = refusal("project.lightfield", in, {{"ray_spacing_mm", 0.2}, {"direction_spacing_deg", 0.3}});
  EXPECT_HAS(text,
             "MB, but max_memory_mb is 1024; raise ray_spacing_mm or direction_spacing_deg, take a smaller "
             "max_rotation_deg, or the field of a fragment");
  in["views"] = {};
  EXPECT_EQ(refusal("project.lightfield", in),
            "there is no view, so the directions to integrate along are not known; wire 'views'");
}

// project.together: line integrals of several bones add.

const Body kFirst{{{0, 0, 0}, {9, 12, 20}}}, kSecond{{{0, 0, 0}, {7, 7, 15}}};
RigidTransform at(double x_mm) { return analytic::moved_by({0, 0, 0}, {x_mm, 0, 5}); }
Camera camera() { return c_arm(20, 160, 160, 1); }
PixelGrid whole() { return {0, 0, 1, 160, 160}; }

struct Pair {
  std::shared_ptr<const RadiographProjector> first = std::make_shared<const BodyProjector>(kFirst),
                                             second = std::make_shared<const BodyProjector>(kSecond);
  Inputs inputs(bool with_pose_of_second = true) const {
    List<RadiographProjector> projectors;
    projectors.add_shared("first", first);
    projectors.add_shared("second", second);
    const List<Pose> poses = with_pose_of_second ? named("second", pose_of(at(12))) : List<Pose>();
    return {{"projector", Value::of<RadiographProjector>(first)},
            {"other_projectors", shipped::list(projectors, "fragment")},
            {"others", shipped::list(poses, "fragment")}};
  }
};

std::vector<float> sum_of(const Pair& pair, const RigidTransform& first, const PixelGrid& grid) {
  std::vector<float> values = pair.first->radiograph(camera(), first, grid);
  const std::vector<float> other = pair.second->radiograph(camera(), at(12), grid);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += other[i];
  return values;
}

TEST(Together, LineIntegralsAddWhereverTheBoneIs) {
  const Pair pair;
  const auto together = projector_of("project.together", pair.inputs());
  for (const double x_mm : {-10.0, 0.0, 14.0})
    // Whole images, every third pixel, and a grid that is not aligned with the pixels that are kept.
    for (const PixelGrid& grid : {whole(), PixelGrid{30, 45, 3, 30, 20}, PixelGrid{31, 40, 2, 20, 30}})
      EXPECT_EQ(together->radiograph(camera(), at(x_mm), grid), sum_of(pair, at(x_mm), grid))
          << x_mm << " " << grid.step_px;
  const std::vector<Eigen::Vector2f> pixels{{80, 80}, {95, 70}, {3, 3}};
  const std::vector<float> values = together->radiograph(camera(), at(0), pixels),
                           first = pair.first->radiograph(camera(), at(0), pixels),
                           second = pair.second->radiograph(camera(), at(12), pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_FLOAT_EQ(values[i], first[i] + second[i]);
}

TEST(Together, TheRegionHoldsAllBones) {
  const Pair pair;
  const auto together = projector_of("project.together", pair.inputs());
  const PixelGrid region = together->region(camera(), at(-15));
  const std::vector<float> values = together->radiograph(camera(), at(-15), whole());
  double outside = 0, inside = 0;
  for (int v = 0; v < 160; ++v)
    for (int u = 0; u < 160; ++u) {
      const bool is_in =
          u >= region.u_px && v >= region.v_px && u < region.u_px + region.columns && v < region.v_px + region.rows;
      (is_in ? inside : outside) += double(values[std::size_t(v) * 160 + std::size_t(u)]);
    }
  EXPECT_EQ(outside, 0);
  EXPECT_GT(inside, 0);
  EXPECT_LT(region.count(), whole().count());
}

TEST(Together, NothingIsDrawnWhereTheBoneItselfIsOutOfView) {
  const Pair pair;
  const auto together = projector_of("project.together", pair.inputs());
  EXPECT_EQ(together->region(camera(), at(500)).count(), 0u);
  for (const float value : together->radiograph(camera(), at(500), whole())) ASSERT_EQ(value, 0);
}

TEST(Together, RefusesABoneWithoutAPose) {
  EXPECT_EQ(
      refusal("project.together", Pair().inputs(false)),
      "other_projectors has the fragment 'second', but others has no pose of it; give the poses of the same fragments");
}

}  // namespace marrow::test::radiographs_test
