// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/smoothed_at_bone.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::smoothed_at_bone_test {

const Vector3d kMiddle_mm(120, -80, 300), kHalf_mm(20, 30, 60);

/// A model in a box. Every value of its radiograph is the variance in mm^2 by which it was smoothed.
class Box : public RadiographProjector {
 public:
  explicit Box(double sigma_mm = 0) : variance_mm2_(sigma_mm * sigma_mm) {}
  std::vector<float> radiograph(const Camera&, const RigidTransform&, const PixelGrid& grid) const override {
    return std::vector<float>(grid.count(), float(variance_mm2_));
  }
  std::vector<float> radiograph(const Camera&, const RigidTransform&,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return std::vector<float>(pixels.size(), float(variance_mm2_));
  }
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Vector2d pixel = project(camera, world_from_model * (kMiddle_mm + side.cwiseProduct(kHalf_mm)));
      low = low.cwiseMin(pixel), high = high.cwiseMax(pixel);
    }
    low = low.array().floor().max(0);
    high = high.array().ceil().min(Eigen::Array2d(camera.width_px - 1, camera.height_px - 1));
    return {low.x(), low.y(), 1, int(high.x() - low.x()) + 1, int(high.y() - low.y()) + 1};
  }
  std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const override {
    return std::make_shared<const Box>(sigma_mm);
  }

 private:
  double variance_mm2_;
};

const Camera kCamera = pinhole(1000, 400, 400, {{200, 200}});

/// The model upright or on its side, with its middle this far from the source.
RigidTransform at_depth(double depth_mm, double turn_rad = 0) {
  RigidTransform pose = placed({0, 0, depth_mm}, {turn_rad, 0, 0});
  pose.translation_mm -= pose.rotation * kMiddle_mm;
  return pose;
}

// 2 px are 2 * depth / 1000 mm at the depth of the model's middle.
TEST(SmoothedAtBone, IsAsSmoothAsTheImageWhereverTheModelIs) {
  const Box box;
  const auto smoothed = match::smoothed_at_bone(box, 2);
  ASSERT_TRUE(smoothed);
  for (const double depth_mm : {300.0, 512.0, 600.0, 600.1, 811.0, 1450.0})
    for (const double turn : {0.0, 1.2}) {
      const double expected = std::pow(2 * depth_mm / 1000, 2);
      const auto values = smoothed->radiograph(kCamera, at_depth(depth_mm, turn), PixelGrid{10, 10, 1, 2, 1});
      ASSERT_EQ(values.size(), 2u);
      EXPECT_NEAR(values[0], expected, 1e-4 * expected) << depth_mm;
      EXPECT_EQ(smoothed->radiograph(kCamera, at_depth(depth_mm, turn), {{3.0f, 4.0f}})[0], values[0]);
    }
}

TEST(SmoothedAtBone, ChangesWithoutAJump) {
  const Box box;
  const auto smoothed = match::smoothed_at_bone(box, 2);
  double before = 0;
  for (double depth_mm = 400; depth_mm < 1200; depth_mm += 0.5) {
    const double value = smoothed->radiograph(kCamera, at_depth(depth_mm), PixelGrid{0, 0, 1, 1, 1})[0];
    if (before > 0) {
      EXPECT_NEAR(value / before, 1 + 2 * 0.5 / depth_mm, 1e-5) << depth_mm;
    }
    before = value;
  }
}

TEST(SmoothedAtBone, ItsRegionHoldsTheBlurredModel) {
  const Box box;
  const PixelGrid sharp = box.region(kCamera, at_depth(900)),
                  soft = match::smoothed_at_bone(box, 2)->region(kCamera, at_depth(900));
  EXPECT_EQ(soft.u_px, sharp.u_px - 6);
  EXPECT_EQ(soft.columns, sharp.columns + 12);
  EXPECT_EQ(soft.rows, sharp.rows + 12);
}

}  // namespace marrow::test::smoothed_at_bone_test
