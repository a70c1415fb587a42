// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every projector of radiographs must do, compared with integrals that are known exactly.
#include "marrow/plugin.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::radiograph_behaviour {

using Make = std::function<std::shared_ptr<const RadiographProjector>(const Volume&, const SignedField*)>;

/// A volume in HU, as a function of the position, around the origin of the frame. `turn` rotates its axes.
inline Volume volume_of(const std::array<int, 3>& size, const Vector3d& spacing_mm, const Matrix3d& turn,
                        const std::function<double(const Vector3d&)>& hu) {
  Volume volume;
  volume.grid.size = size;
  volume.grid.spacing_mm = spacing_mm;
  volume.grid.direction = turn;
  volume.grid.origin_mm = -turn * (0.5 * Vector3d(size[0] - 1, size[1] - 1, size[2] - 1).cwiseProduct(spacing_mm));
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x)
        volume.values.push_back(float(hu(volume.grid.point_from_index({double(x), double(y), double(z)}))));
  return volume;
}

constexpr double kWidth_mm = 8;

/// A cloud whose attenuation falls off as a Gaussian from twice water's at its middle.
inline Volume cloud(const Matrix3d& turn = Matrix3d::Identity()) {
  return volume_of({90, 99, 78}, {0.8, 0.7, 1.0}, turn, [](const Vector3d& p) {
    return -1000 + 2000 * std::exp(-0.5 * p.squaredNorm() / (kWidth_mm * kWidth_mm));
  });
}

inline double distance_from_ray(const Camera& camera, const Vector2d& pixel, const Vector3d& point) {
  return (point - source_position_mm(camera)).cross(ray_direction(camera, pixel)).norm();
}

/// The integral of the cloud along a line that passes its middle at this distance.
inline double integral_mm(double distance) {
  return 2 * kWidth_mm * std::sqrt(2 * kPi) * std::exp(-0.5 * distance * distance / (kWidth_mm * kWidth_mm));
}

inline const Camera& camera(double angle_deg) {
  static std::map<double, Camera> cameras;
  return cameras.try_emplace(angle_deg, shapes::c_arm(angle_deg)).first->second;
}

inline void integrals_of_a_cloud(const Make& make, double mean_limit_mm, double worst_limit_mm) {
  const RigidTransform pose = shapes::centred_at({3, -4, 6});
  const Vector3d centre = pose * Vector3d(0, 0, 0);
  for (const double angle : {0.0, 30.0, 45.0, 90.0, 200.0})
    for (const bool turned : {false, true}) {
      const Matrix3d turn =
          turned ? Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()).toRotationMatrix() : Matrix3d::Identity();
      const auto projector = make(cloud(turn), nullptr);
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
      EXPECT_LT(sum, mean_limit_mm) << angle << " degrees, turned " << turned;
      EXPECT_LT(worst, worst_limit_mm) << angle << " degrees, turned " << turned;
    }
}

/// A Gaussian cloud smoothed by a Gaussian is a wider and thinner cloud.
inline void smoothed_cloud(const Make& make, double limit_mm) {
  constexpr double kSigma_mm = 3;
  const double width_mm = std::hypot(kWidth_mm, kSigma_mm);
  const auto projector = make(cloud(), nullptr)->smoothed(kSigma_mm);
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
  EXPECT_LT(worst, limit_mm);
}

/// Rays at right angles to an even block: the chord is its thickness.
inline void chord_of_a_block(const Make& make) {
  const Volume block = volume_of({40, 30, 50}, {1, 1, 1}, Matrix3d::Identity(), [](const Vector3d&) { return 500; });
  const auto projector = make(block, nullptr);
  Camera far = camera(0);
  const double distance = 1e5;  // nearly parallel rays
  far.intrinsics(0, 0) = far.intrinsics(1, 1) = 1e5;
  far.camera_from_world.rotation.setIdentity();
  far.camera_from_world.translation_mm = {0, 0, distance};
  const auto values = projector->radiograph(
      far, shapes::centred_at({0, 0, 0}), std::vector<Eigen::Vector2f>{far.intrinsics.col(2).head<2>().cast<float>()});
  EXPECT_NEAR(values.at(0), 1.5 * 50, 1e-3);
}

inline void region_holds_all(const Make& make) {
  const auto projector = make(cloud(), nullptr);
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
inline double largest_difference_mm(const RadiographProjector& projector, double angle_deg, int step) {
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
inline void grids_and_pixels_agree(const Make& make, double limit_mm) {
  const auto projector =
      make(cloud(Eigen::AngleAxisd(0.5, Vector3d(0, 1, 1).normalized()).toRotationMatrix()), nullptr);
  const auto smoothed = projector->smoothed(2.5);
  for (const double angle_deg : {15.0, 195.0})
    for (const int step : {1, 3, 5, 11}) {
      EXPECT_LT(largest_difference_mm(*projector, angle_deg, step), limit_mm) << angle_deg << " deg, step " << step;
      if (!smoothed) continue;
      EXPECT_LT(largest_difference_mm(*smoothed, angle_deg, step), limit_mm) << angle_deg << " deg, step " << step;
    }
}

inline void a_field_leaves_the_rest_out(const Make& make) {
  const Volume two = volume_of({80, 30, 30}, {1, 1, 1}, Matrix3d::Identity(),
                               [](const Vector3d& p) { return std::abs(std::abs(p.x()) - 20) < 10 ? 1000 : -1000; });
  SignedField field{two.grid, {}};
  for (int z = 0; z < 30; ++z)
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 80; ++x)
        field.values_mm.push_back(
            float(two.grid.point_from_index({double(x), 0, 0}).x()));  // the left half is the fragment
  const auto projector = make(two, &field);
  const auto pixels = [](double x) {
    return std::vector<Eigen::Vector2f>{project(camera(0), Vector3d(x, 0, 0)).cast<float>()};
  };
  EXPECT_GT(projector->radiograph(camera(0), shapes::centred_at({0, 0, 0}), pixels(-20)).at(0), 50);
  EXPECT_EQ(projector->radiograph(camera(0), shapes::centred_at({0, 0, 0}), pixels(20)).at(0), 0);
  const auto refusal = [&] { return message_of([&] { make(two, &field); }); };
  field.grid.origin_mm.x() += 500;
  EXPECT_EQ(refusal(),
            "the field is not where the volume is: voxels of the same index are up to 500 mm apart; wire the "
            "field that was segmented from this volume");
  field.grid = two.grid;
  field.values_mm.pop_back();
  EXPECT_EQ(refusal().substr(0, 14), "the field has ");
  field.grid.size = {2, 2, 2};
  EXPECT_EQ(refusal().substr(0, 45), "the field has another size than the volume: 2");
}

inline void refuses_nonsense(const Make& make) {
  const Volume air = volume_of({5, 5, 5}, {1, 1, 1}, Matrix3d::Identity(), [](const Vector3d&) { return -1000; });
  EXPECT_EQ(make(air, nullptr)->region(camera(0), shapes::centred_at({0, 0, 0})).count(), 0u);
  EXPECT_EQ(make(air, nullptr)->radiograph(camera(0), shapes::centred_at({0, 0, 0}), PixelGrid{0, 0, 1, 3, 2}),
            std::vector<float>(6, 0.0f));
  EXPECT_TRUE(make(cloud(), nullptr)->radiograph(camera(0), shapes::centred_at({0, 0, 0}), PixelGrid{}).empty());
}

/// Rays that start within the volume, so that a part of it lies behind the source.
inline void source_within(const Make& make) {
  const Volume block = volume_of({100, 100, 100}, {2, 2, 2}, Matrix3d::Identity(), [](const Vector3d&) { return 0; });
  Camera view = camera(0);
  view.camera_from_world.rotation.setIdentity();
  view.camera_from_world.translation_mm.setZero();  // the source at the middle
  const auto values = make(block, nullptr)
                          ->radiograph(view, shapes::centred_at({0, 0, 0}),
                                       PixelGrid{view.intrinsics(0, 2), view.intrinsics(1, 2), 1, 1, 1});
  EXPECT_NEAR(values.at(0), 100, 1.1);
}

}  // namespace marrow::test::radiograph_behaviour
