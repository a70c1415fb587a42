// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "bowl.hpp"
#include "marrow/toolbox/search/predicted_covariance.hpp"

namespace marrow::test::predicted_covariance_test {

using search::PredictedCovariance;
using well::Altered, well::Bowl, well::kFrame, well::kTruth;

/// Axes of very different curvature, each coupled to each other.
Matrix6d hessian() {
  Matrix6d root = Matrix6d::Zero();
  root.diagonal() << 1, 0.5, 0.05, 2, 0.1, 0.7;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) root(i, j) = 0.3 * std::sin(3.0 * i + j) * root(j, j);
  return root * root.transpose();
}

/// In rad and mm, as it is told.
Matrix6d in_radians(const Matrix6d& of_degrees) {
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= radians(1);
  return unit.asDiagonal() * of_degrees * unit.asDiagonal();
}

PredictedCovariance predicted(const Cost& cost, const RigidTransform& pose = kTruth) { return {cost, pose, kFrame}; }
/// The deviation along an axis, in degrees or mm.
double deviation(const PredictedCovariance& predicted, int axis) {
  return std::sqrt((*predicted.covariance())(axis, axis)) * (axis < 3 ? degrees(1) : 1);
}
void expect_covariance(const PredictedCovariance& predicted, const Matrix6d& expected, double tolerance) {
  ASSERT_TRUE(predicted.covariance());
  EXPECT_LT((*predicted.covariance() - expected).norm(), tolerance * expected.norm())
      << *predicted.covariance() << "\n\n"
      << expected;
}
void expect_unknown(const PredictedCovariance& predicted) {
  ASSERT_TRUE(predicted.covariance());
  for (int axis = 0; axis < 6; ++axis) EXPECT_GT(deviation(predicted, axis), axis < 3 ? 90 : 100) << axis;
}

/// Counts what it is asked.
class Counted : public Bowl {
 public:
  using Bowl::Bowl;
  double value(const RigidTransform& pose) const override {
    ++asked;
    return Bowl::value(pose);
  }
  Numbers without_each_block(const RigidTransform& pose) const override {
    asked -= 11;  // it asks for twelve values itself, and counts as one
    return Bowl::without_each_block(pose);
  }
  mutable std::atomic<int> asked = 0;
};

// All information is in the first one or two of nine blocks. Nothing is left without this one block, so no motion of
// the minimum shows how far the pose may be off.
TEST(PredictedCovariance, OfOneOrTwoBlocksIsNotKnown) {
  for (const std::size_t few : {1u, 2u}) {
    const Altered cost(Bowl(hessian()), nullptr, [=](const Bowl& bowl, const RigidTransform& pose) {
      Numbers values(9, bowl.value(pose));
      std::fill_n(values.begin(), few, 1);
      return values;
    });
    const auto of_few = predicted(cost);
    expect_unknown(of_few);
    EXPECT_EQ(of_few.warnings(1e9, 1e9), Strings{"all that the images say about the pose lies in one or two small "
                                                 "parts of them, so its deviations are not known"});
  }
}

// All blocks count, and hardly anything depends on the pose. No block moves the minimum, but neither does anything
// else: this is no perfect fit.
TEST(PredictedCovariance, OfACostThatHardlyChangesIsNotKnown) {
  const auto value = [](const Bowl& bowl, const RigidTransform& pose) { return 1 + 1e-9 * bowl.Bowl::value(pose); };
  const Altered cost(Bowl(hessian()), value, [=](const Bowl& bowl, const RigidTransform& pose) {
    Numbers values(9, value(bowl, pose));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += 0.1 * double(i);
    return values;
  });
  const auto of_flat = predicted(cost);
  expect_unknown(of_flat);
  EXPECT_EQ(of_flat.warnings(5, 5).size(), 6u);
}

TEST(PredictedCovariance, IsTheSumOfTheMotionsWithoutEachBlock) {
  for (const double information : {1.0, 2.0, 350.0}) {
    const Counted cost(hessian(), information);
    const auto found = predicted(cost);
    const Matrix6d expected = in_radians((information * hessian()).inverse());
    expect_covariance(found, expected, 1e-5);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR((*found.covariance())(i, i), expected(i, i), 1e-5 * expected(i, i)) << i;
    EXPECT_EQ(found.evaluations(), cost.asked);
    EXPECT_TRUE(found.warnings(1e9, 1e9).empty());
  }
}

// Fifty blocks besides, which show other bones: each changes the cost, and none says anything about the pose. What they
// cost is 7 in all, and 16 degrees about the least certain direction only a fifth of that.
TEST(PredictedCovariance, DoesNotCountBlocksThatShowOtherBones) {
  const Altered cost(Bowl(hessian(), 350), nullptr, [](const Bowl& bowl, const RigidTransform& pose) {
    Numbers values = bowl.Bowl::without_each_block(pose);
    values.resize(values.size() + 50, bowl.value(pose) + 1);
    return values;
  });
  expect_covariance(predicted(cost), in_radians((350 * hessian()).inverse()), 1e-5);
}

/// Sums of squares of nine blocks, four residuals each, so few that each block matters much.
class Squares : public Cost {
 public:
  static constexpr int kBlocks = 9, kResiduals = 4;
  using Slopes = Eigen::Matrix<double, kResiduals, 6>;
  explicit Squares(double size) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int block = 0; block < kBlocks; ++block) {
      slopes.push_back(Slopes::NullaryExpr([&] { return normal(random); }));
      targets.push_back(size * Eigen::Vector4d::NullaryExpr([&] { return normal(random); }));
    }
  }

  /// The minimum without a block (-1: with all), in degrees and mm from the truth.
  Vector6d minimum(int left = -1) const {
    Matrix6d squares = Matrix6d::Zero();
    Vector6d products = Vector6d::Zero();
    for (int block = 0; block < kBlocks; ++block) {
      if (block == left) continue;
      squares += slopes[std::size_t(block)].transpose() * slopes[std::size_t(block)];
      products += slopes[std::size_t(block)].transpose() * targets[std::size_t(block)];
    }
    return squares.inverse() * products;
  }
  RigidTransform pose() const { return search::moved_by_units(kTruth, kFrame, minimum()); }
  /// The covariance of the minima without each block, from the normal equations.
  Matrix6d covariance_of_minima() const {
    Matrix6d sum = Matrix6d::Zero();
    for (int block = 0; block < kBlocks; ++block) {
      const Vector6d motion = minimum(block) - minimum();
      sum += motion * motion.transpose();
    }
    return in_radians(sum);
  }
  double value(const RigidTransform& pose) const override { return about(pose, -1).value; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return nullptr; }
  std::optional<Expansion> expansion(const RigidTransform& pose, const FragmentFrame&) const override {
    return about(pose, -1);
  }
  std::vector<Expansion> expansion_without_each_block(const RigidTransform& pose, const FragmentFrame&) const override {
    std::vector<Expansion> without;
    for (int block = 0; block < kBlocks; ++block) without.push_back(about(pose, block));
    return without;
  }

  std::vector<Slopes> slopes;
  std::vector<Eigen::Vector4d> targets;

 private:
  Expansion about(const RigidTransform& pose, int left) const {
    const Vector6d motion = well::way(kTruth, pose, kFrame);
    Vector6d unit = Vector6d::Ones();
    unit.head<3>() *= degrees(1);
    Expansion expansion;
    for (int block = 0; block < kBlocks; ++block) {
      if (block == left) continue;
      const Slopes slope = slopes[std::size_t(block)] * unit.asDiagonal();
      const Eigen::Vector4d residual = slopes[std::size_t(block)] * motion - targets[std::size_t(block)];
      expansion.value += 0.5 * residual.squaredNorm();
      expansion.gradient += slope.transpose() * residual;
      expansion.curvature += slope.transpose() * slope;
    }
    return expansion;
  }
};

/// The same, but it knows no derivatives.
class SquaresByValues : public Squares {
 public:
  using Squares::Squares;
  std::optional<Expansion> expansion(const RigidTransform&, const FragmentFrame&) const override { return {}; }
  Numbers without_each_block(const RigidTransform& pose) const override {
    Numbers values;
    for (const Expansion& without : Squares::expansion_without_each_block(pose, kFrame))
      values.push_back(without.value);
    return values;
  }
  std::vector<Expansion> expansion_without_each_block(const RigidTransform&, const FragmentFrame&) const override {
    return {};
  }
};

TEST(PredictedCovariance, IsThatOfTheMinimaWithoutEachBlock) {
  const Squares cost(0.05);
  const RigidTransform pose = cost.pose();
  const auto found = predicted(cost, pose);
  expect_covariance(found, cost.covariance_of_minima(), 1e-6);
  EXPECT_EQ(found.evaluations(), 3 + 12 + 13 + 4 + 65 + 2)
      << "the value, the derivatives twice, both ends of six lines, every second of 25 poses on a line, and those "
         "between that matter; the same of 129 turns about the long axis";
  // Derivatives say nothing about a minimum that is wider than degrees, and this cost has no blocks to try.
  EXPECT_FALSE(predicted(Squares(50), pose).covariance());
  const SquaresByValues by_differences(0.05);
  expect_covariance(predicted(by_differences, pose), cost.covariance_of_minima(), 1e-3);
}

TEST(PredictedCovariance, IsAbsentIfTheCostHasNoBlocks) {
  const Altered cost(Bowl(hessian()), nullptr, [](const Bowl&, const RigidTransform&) { return Numbers(); });
  const auto found = predicted(cost);
  EXPECT_FALSE(found.covariance());
  EXPECT_TRUE(found.warnings(0, 0).empty());
}

TEST(PredictedCovariance, StepsAreLongerThanTheRoughnessOfTheCost) {
  // Waves of 0.01: a step that raises the bowl by 0.2 or more does not see them.
  Matrix6d steep = Matrix6d::Zero();
  steep.diagonal() << 400, 0.1, 3, 100, 1, 0.05;
  const Altered rough(Bowl(steep, 4), [](const Bowl& bowl, const RigidTransform& pose) {
    return bowl.Bowl::value(pose) + 0.005 * std::cos(40 * well::way(kTruth, pose, kFrame).sum());
  });
  const auto found = predicted(rough);
  const Matrix6d expected = in_radians((4 * steep).inverse());
  for (int i = 0; i < 6; ++i) EXPECT_NEAR((*found.covariance())(i, i) / expected(i, i), 1, 0.15) << i;
}

TEST(PredictedCovariance, CoversAnotherMinimumThatIsAsDeep) {
  // Along the long axis two bowls, 2 degrees apart; the search ended in the first.
  const Matrix6d of_one = Vector6d(100, 100, 4, 100, 100, 100).asDiagonal();
  const Bowl one(of_one, 4);
  const Altered two(one, [=](const Bowl&, const RigidTransform& pose) {
    const Vector6d way = well::way(kTruth, pose, kFrame), other = way - 2 * Vector6d::Unit(2);
    return 0.5 * std::min(way.dot(of_one * way), other.dot(of_one * other));
  });
  EXPECT_NEAR(deviation(predicted(one), 2), 0.25, 1e-4);
  // Half of the density lies about 2 degrees away: the mean square is 4 / 2, and that of each bowl more.
  EXPECT_NEAR(deviation(predicted(two), 2), std::sqrt(2 + 0.25 * 0.25), 0.01);
}

TEST(PredictedCovariance, ACoarserCostSavesValuesFarAway) {
  const Matrix6d steep = 1e4 * hessian();
  const Counted alone(steep), finer(steep), coarser(0.8 * steep);
  const PredictedCovariance without_it(alone, kTruth, kFrame), with_it(finer, kTruth, kFrame, &coarser);
  EXPECT_EQ(*without_it.covariance(), *with_it.covariance()) << "values that matter are the cost's own";
  EXPECT_LT(finer.asked, alone.asked - 4);
  EXPECT_GT(coarser.asked, 0);
}

TEST(PredictedCovariance, SaysWhichAxesTheImagesDoNotTell) {
  // sd of 5 degrees and of 8 mm; two axes along which nothing changes.
  Matrix6d flat = Matrix6d::Zero();
  flat.diagonal() << 1, 1.0 / 25, 0, 1, 0, 1.0 / 64;
  const Bowl cost(flat);
  const auto found = predicted(cost);
  EXPECT_NEAR(deviation(found, 0), 1, 1e-4);
  EXPECT_NEAR(deviation(found, 1), 5, 1e-3);
  EXPECT_GT(deviation(found, 2), 1000) << "a hundred steps stand for what nothing determines";
  EXPECT_GT(deviation(found, 4), 1000);
  EXPECT_NEAR(deviation(found, 5), 8, 1e-3);
  EXPECT_EQ(
      found.warnings(3, 5),
      (Strings{
          "rotation about the lateral axis is poorly determined by these images: its predicted standard deviation is 5 "
          "degrees",
          "axial rotation is not determined by these images: the cost hardly changes within 16 degrees",
          "translation along the lateral axis is not determined by these images: the cost hardly changes within 16 mm",
          "axial translation is poorly determined by these images: its predicted standard deviation is 8 mm"}));
  EXPECT_EQ(found.warnings(6, 9).size(), 2u);
  EXPECT_EQ(found.warnings(0.9, 0.9).front(),
            "rotation about the frontal axis is poorly determined by these images: its predicted standard deviation is "
            "1 degrees");
  EXPECT_EQ(found.warnings(3, 0.9)[2],
            "translation along the frontal axis is poorly determined by these images: its predicted standard deviation "
            "is 1 mm");
}

TEST(PredictedCovariance, OfADirectionThatOnlyTwoAxesTogetherLeaveOpen) {
  // Each axis alone is well determined, but not their combination.
  Matrix6d tied = Matrix6d::Identity();
  tied.topLeftCorner<2, 2>() << 1, 1, 1, 1;
  const Bowl cost(tied);
  const auto found = predicted(cost);
  EXPECT_GT(deviation(found, 0), 20);
  EXPECT_TRUE(std::isfinite(found.covariance()->norm()));
  EXPECT_NEAR((*found.covariance())(3, 3), 1, 1e-4);
}

TEST(PredictedCovariance, OfAPerfectFitIsTheLeastStep) {
  // All residuals are 0, so no block moves the minimum. What is not tried is not known: steps of 1/256 degree or mm.
  const Matrix6d expected = in_radians(Matrix6d::Identity() / (256.0 * 256.0));
  expect_covariance(predicted(Squares(0)), expected, 1e-6);
  expect_covariance(predicted(SquaresByValues(0)), expected, 1e-6);
}

TEST(PredictedCovariance, OneBlockThatAloneTellsAnAxisLeavesItOpen) {
  // Only one of nine blocks holds the residuals along the last axis. Without it nothing determines that axis: no
  // deviation follows from derivatives, and 0 would be wrong.
  Squares cost(0.05);
  for (int block = 1; block < Squares::kBlocks; ++block) cost.slopes[std::size_t(block)].col(5).setZero();
  EXPECT_FALSE(predicted(cost, cost.pose()).covariance());
}

}  // namespace marrow::test::predicted_covariance_test
