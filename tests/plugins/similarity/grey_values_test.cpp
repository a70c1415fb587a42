// SPDX-License-Identifier: Apache-2.0
// What every cost of grey values must do beyond the checks of the suite of its kind, on two dark blobs whose radiograph
// is a formula.
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/match/views_cost.hpp"
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::grey_values_test {

using namespace blob_scene;

struct Node {
  const char* name;
  double worst = 2;
  bool has_blocks = true;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

constexpr const char* kCorrelation = "similarity.normalised_cross_correlation";

class GreyValueCost : public testing::TestWithParam<Node> {
 protected:
  /// The cost that the node gives with its defaults.
  std::shared_ptr<const Cost> cost_of(const View& view) const { return cost_by(GetParam().name, inputs(view)); }
};
INSTANTIATE_TEST_SUITE_P(
    , GreyValueCost,
    testing::Values(Node{"similarity.entropy_of_difference", 2, false}, Node{"similarity.gradient_correlation"},
                    Node{"similarity.gradient_difference"}, Node{"similarity.gradient_orientation", 1, false},
                    Node{"similarity.mutual_information", 1, false}, Node{kCorrelation},
                    Node{"similarity.patch_gradient_correlation"}, Node{"similarity.pattern_intensity"}),
    [](const auto& info) { return std::string(info.param.name).substr(11); });

/// If there is nothing to compare, the cost is the worst, and never NaN.
TEST_P(GreyValueCost, NothingIsTheWorst) {
  const View view = view_of(), masked = with_mask(view, nothing_shown(camera()));
  const auto value = [&](const View& view) { return cost_of(view)->value(at(0, 0)); };
  EXPECT_EQ(cost_of(view)->value(at(500, 0)), GetParam().worst) << "out of the image";
  EXPECT_TRUE(std::isfinite(value(even(view, 30000))));
  EXPECT_GT(value(even(view, 30000)), value(view));
  EXPECT_TRUE(std::isfinite(value(masked)));
  EXPECT_EQ(value(with_mask(view, mask_of(camera(), {89, 79, 3, 3}))), value(masked))
      << "nine pixels say no more than none";
  EXPECT_TRUE(std::isfinite(value(even(view, 0))));
  View nan = view;
  view.image.pixels.convertTo(nan.image.pixels, CV_32F);
  nan.image.pixels.at<float>(80, 90) = std::nanf("");
  EXPECT_TRUE(std::isfinite(value(nan))) << "a pixel that is not a number is left out";
}

TEST_P(GreyValueCost, LevelsCompareFewerPixels) {
  const auto cost = cost_of(view_of()), coarse = cost->at_level({1, 1, 4});
  EXPECT_LT(coarse->value(at(0, 0)), coarse->value(at(5, 0)));
  EXPECT_EQ(cost->at_level({1, 1, 0})->value(at(1, 0)), cost->value(at(1, 0)));
}

TEST_P(GreyValueCost, RefusesNonsense) {
  View broken = view_of();
  broken.camera.width_px = 10;
  EXPECT_THROW(cost_of(broken), Error);
  EXPECT_THROW(cost_by(GetParam().name, with(inputs(), {{"views", each_view(List<View>())}})), Error);
}

/// A cost gives no blocks if they say nothing about its error. So no deviations are predicted from it.
TEST_P(GreyValueCost, HasNoBlocksIfItPredictsNoDeviations) {
  if (GetParam().has_blocks) return;
  const auto cost = cost_of(view_of());
  EXPECT_EQ(cost->without_each_block(at(1, 0.5)), Numbers());
  EXPECT_EQ(cost->at_level({4, 8, 1})->without_each_block(at(1, 0.5)), Numbers());
}

/// The cost without a block equals the cost with a mask that excludes the block.
TEST(NormalisedCrossCorrelation, BlocksAreMasks) {
  const auto cost = cost_by(kCorrelation, inputs());
  const Numbers without = cost->without_each_block(at(1, 0.5));
  ASSERT_EQ(without.size(), 8u * 7) << "of 25 px";
  for (const int block : {7, 20, 28, 35}) {
    const cv::Rect part = cv::Rect(block % 8 * 25, block / 8 * 25, 25, 25) & cv::Rect(0, 0, kWidth_px, kHeight_px);
    const View masked = with_mask(view_of(), mask_of(camera(), part, false));
    EXPECT_NEAR(without[std::size_t(block)], cost_by(kCorrelation, inputs(masked))->value(at(1, 0.5)), 1e-12) << block;
  }
  EXPECT_EQ(without[7], cost->value(at(1, 0.5)));
  EXPECT_NE(without[28], cost->value(at(1, 0.5)));
}

// All costs of grey values share this.
TEST(NormalisedCrossCorrelation, SaysWhatIsEmpty) {
  const auto said = [](const View& view, double u = 0) {
    return cost_by(kCorrelation, inputs(view))->nothing_compared(at(u, 0));
  };
  EXPECT_EQ(said(view_of()), "");
  EXPECT_EQ(said(view_of(), 500), "view 'frontal': it shows nothing of the bone");
  EXPECT_EQ(said(even(view_of(), 30000)), "view 'frontal': its image is constant where the bone would be");
  EXPECT_EQ(said(with_mask(view_of(), nothing_shown(camera()))),
            "view 'frontal': no pixel inside the mask shows the bone");
}

/// exp of minus a formula, in an image of 5 x 5 pixels that patch_correlation compares as one square with another
/// formula.
double one_square(const std::function<double(double, double)>& rendered,
                  const std::function<double(double, double)>& seen) {
  const View small = test::view_of("small", before_origin(pinhole(1000, 5, 5), 600),
                                   image_of<float>(5, 5, [&](int u, int v) { return std::exp(-seen(u, v)); }));
  const auto projector = std::make_shared<const DrawnRadiograph>(
      PixelGrid{0, 0, 1, 5, 5}, [&](const Vector2d& pixel, const auto&) { return rendered(pixel.x(), pixel.y()); });
  return cost_by("similarity.patch_correlation",
                 {{"projector", function<RadiographProjector>(projector)}, {"views", each_view(small)}},
                 {{"pixel_step", std::int64_t(1)},
                  {"margin_px", std::int64_t(0)},
                  {"sigma_steps", 0.0},
                  {"patch_pixels", std::int64_t(5)}})
      ->value(at(0, 0));
}

TEST(PatchCorrelation, IsTheCorrelationOfOneSquare) {
  const auto right = [](double u, double) { return u; };
  EXPECT_NEAR(one_square(right, [](double u, double) { return 0.3 * u + 1; }), 0, 1e-6);
  EXPECT_NEAR(one_square(right, [](double u, double) { return 3 - 0.3 * u; }), 2, 1e-6);
  EXPECT_NEAR(one_square(right, [](double, double v) { return 0.3 * v; }), 1, 1e-6);
  // u against u + v: both vary alike, so r = 1 / sqrt 2.
  EXPECT_NEAR(one_square(right, [](double u, double v) { return 0.2 * (u + v); }), 1 - std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(one_square(right, [](double, double) { return 0.5; }), 1, 1e-6) << "an even image";
  EXPECT_NEAR(one_square([](double, double) { return 7; }, right), 2, 1e-6) << "an even radiograph";
}

}  // namespace marrow::test::grey_values_test

// The derivatives of the costs that compare grey values, against differences of their values.
namespace marrow::test::grey_derivatives_test {

using namespace blob_scene;

struct Blob {
  double x, y, z, height, width;
};
constexpr Blob kBlobs[] = {{-6, -4, 5, 40, 9}, {9, 6, -20, 25, 6}, {-12, 12, 30, 20, 7}, {6, -15, -10, 15, 8}};

/// Blobs in space, each seen as a blob around its projection.
double blobs_in_space(const Vector2d& pixel, const RigidTransform& pose) {
  double sum = 0;
  for (const auto& [x, y, z, height, width] : kBlobs) {
    const Vector3d seen = pose * Vector3d(x, y, z) + Vector3d(0, 0, 600);
    const Vector2d at(100 + 1000 * seen.x() / seen.z(), 85 + 1000 * seen.y() / seen.z());
    sum += height * std::exp(-0.5 * (pixel - at).squaredNorm() / (width * width));
  }
  return sum;
}
class BlobsInSpace : public DrawnRadiograph {
 public:
  BlobsInSpace() : DrawnRadiograph(PixelGrid{45, 40, 1, 100, 85}, blobs_in_space) {}
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& pose,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    constexpr double kStep = 1e-4;
    RadiographExpansion expansion{radiograph(camera, pose, grid), {}};
    for (int k = 0; k < 6; ++k) {
      const RigidTransform above = marrow::moved(pose, frame, kStep * Vector6d::Unit(k)),
                           below = marrow::moved(pose, frame, -kStep * Vector6d::Unit(k));
      for (int row = 0; row < grid.rows; ++row)
        for (int column = 0; column < grid.columns; ++column)
          expansion.slopes[std::size_t(k)].push_back(float(
              (integral(grid.pixel(column, row), above) - integral(grid.pixel(column, row), below)) / (2 * kStep)));
    }
    return expansion;
  }
};

/// The blobs where they are, in soft tissue and noise, with a part that is masked.
View seen_view() {
  std::mt19937 random(5);
  const cv::Mat pixels = image_of<std::uint16_t>(kWidth_px, kHeight_px, [&](int u, int v) {
    const double tissue = 0.8 + 0.3 * std::sin(0.02 * u) + 0.2 * std::cos(0.03 * v),
                 noise = 300 * (double(random()) / 4294967296.0 - 0.5);
    return 40000 * std::exp(-tissue - 0.02 * double(float(blobs_in_space(Vector2d(u, v), at(0, 0))))) + noise;
  });
  return test::view_of("frontal", camera(), pixels, mask_of(camera(), {60, 60, 12, 9}, false));
}

std::shared_ptr<const Cost> cost_of(const std::string& node) {
  View other = seen_view();
  other.name = "lateral";
  other.camera.intrinsics(0, 2) += 3;
  return cost_by("similarity." + node,
                 {{"projector", function<RadiographProjector>(std::make_shared<const BlobsInSpace>())},
                  {"views", each_view(seen_view(), other)}});
}

/// A frame that is turned and lies beside the model's origin.
FragmentFrame frame() { return {{4, -7, 12}, rotation_from_vector({0.3, -0.5, 0.8})}; }
const std::vector<Vector6d>& motions() {
  static const std::vector<Vector6d> all{Vector6d{0, 0, 0, 0, 0, 0}, Vector6d{0.02, -0.01, 0.04, 1.2, -0.7, 3},
                                         Vector6d{-0.05, 0.03, -0.02, -2, 1.5, -6},
                                         Vector6d{0.01, 0.06, 0.1, 0.3, 0.4, 10}};
  return all;
}

class GreyDerivatives : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, GreyDerivatives,
                         testing::Values("normalised_cross_correlation", "gradient_correlation", "patch_correlation",
                                         "patch_gradient_correlation", "metal_gradient_correlation",
                                         "gradient_difference", "pattern_intensity", "mutual_information"),
                         [](const auto& info) { return info.param; });

TEST_P(GreyDerivatives, AreThoseOfTheValue) {
  const auto cost = cost_of(GetParam());
  for (const Vector6d& motion : motions()) {
    const RigidTransform pose = moved(at(0, 0), frame(), motion);
    const auto about = cost->expansion(pose, frame());
    ASSERT_TRUE(about);
    EXPECT_NEAR(about->value, cost->value(pose), 1e-6);
    Vector6d expected;
    for (int k = 0; k < 6; ++k) {
      const double step = k < 3 ? 1e-3 : 0.02;
      const auto difference = [&](double by) {
        return cost->value(moved(pose, frame(), by * Vector6d::Unit(k))) -
               cost->value(moved(pose, frame(), -by * Vector6d::Unit(k)));
      };
      expected[k] = (8 * difference(step) - difference(2 * step)) / (12 * step);
    }
    // A millimetre weighs as much as 1 / 20 of a radian.
    const auto in_mm = [](Vector6d gradient) {
      gradient.head<3>() /= 20;
      return gradient;
    };
    EXPECT_LT(in_mm(about->gradient - expected).norm(), 1e-3 * in_mm(expected).norm() + 1e-6)
        << about->gradient.transpose() << "\n"
        << expected.transpose();
    EXPECT_GT(eigen_of_symmetric(about->curvature).values[0], -1e-9);
  }
}

TEST_P(GreyDerivatives, OfSingleViews) {
  const auto cost = cost_of(GetParam());
  const auto* in_views = dynamic_cast<const match::ViewsCost*>(cost.get());
  ASSERT_TRUE(in_views);
  const RigidTransform pose = moved(at(0, 0), frame(), motions()[1]);
  Vector6d mean = Vector6d::Zero();
  std::size_t blocks = 0;
  for (std::size_t view = 0; view < cost->view_count(); ++view) {
    const auto about = in_views->expansion_in_view(view, pose, frame());
    ASSERT_TRUE(about);
    EXPECT_NEAR(about->whole.value, cost->value_in_view(view, pose), 1e-6);
    mean += about->whole.gradient / double(cost->view_count());
    blocks += about->without_block.size();
  }
  EXPECT_LT((mean - cost->expansion(pose, frame())->gradient).norm(), 1e-9 * mean.norm());
  EXPECT_EQ(blocks, cost->without_each_block(pose).size());
}

TEST_P(GreyDerivatives, WithoutEachBlock) {
  if (std::string(GetParam()) == "mutual_information") GTEST_SKIP() << "it has no blocks";
  const auto cost = cost_of(GetParam());
  const RigidTransform pose = moved(at(0, 0), frame(), motions()[1]);
  const Numbers values = cost->without_each_block(pose);
  const std::vector<Cost::Expansion> without = cost->expansion_without_each_block(pose, frame());
  ASSERT_EQ(without.size(), values.size());
  std::vector<Numbers> above, below;
  const auto step = [](int k) { return (k < 3 ? 1e-3 : 0.02) * Vector6d::Unit(k); };
  for (int k = 0; k < 6; ++k) {
    above.push_back(cost->without_each_block(moved(pose, frame(), step(k))));
    below.push_back(cost->without_each_block(moved(pose, frame(), -step(k))));
  }
  // Where a block is masked, gradients next to it are left out, too.
  const bool is_masked = std::string(GetParam()) == "gradient_correlation";
  const double most = *std::max_element(values.begin(), values.end()),
               least = *std::min_element(values.begin(), values.end());
  EXPECT_GT(most - least, 1e-4);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(without[i].value, values[i], is_masked ? 0.5 * (most - least) : 1e-6) << i;
    if (is_masked) continue;
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(without[i].gradient[Eigen::Index(k)], (above[k][i] - below[k][i]) / (2 * step(int(k)).sum()),
                  0.01 * without[i].gradient.cwiseAbs().maxCoeff())
          << i << ' ' << k;
  }
}

}  // namespace marrow::test::grey_derivatives_test
