// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/search/predicted_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <atomic>
#include <random>

#include "bowl.hpp"

namespace predicted_covariance_test {

using marrow::Matrix6d;
using marrow::Vector6d;
using marrow::search::PredictedCovariance;
using well::Bowl;

marrow::FragmentFrame frame() {
  return {Eigen::Vector3d(5, -3, 80), marrow::rotation_from_vector({0.1, -0.2, 0.3}), true};
}
marrow::RigidTransform bottom() {
  return {"world", "ct", marrow::rotation_from_vector({0.2, 0.1, -0.4}), Eigen::Vector3d(12, -7, 30)};
}

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
  unit.head<3>() *= marrow::radians(1);
  return unit.asDiagonal() * of_degrees * unit.asDiagonal();
}

/// Counts what it is asked.
class Counted : public Bowl {
 public:
  using Bowl::Bowl;
  double value(const marrow::RigidTransform& pose) const override {
    ++asked;
    return Bowl::value(pose);
  }
  std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
    asked -= 11;  // it asks for twelve values itself, and counts as one
    return Bowl::without_each_block(pose);
  }
  mutable std::atomic<int> asked = 0;
};

/// All its information is in the first one or two of its blocks.
class OfFewBlocks : public Bowl {
 public:
  OfFewBlocks(std::size_t few, const Bowl& bowl) : Bowl(bowl), few_(few) {}
  std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
    std::vector<double> values(9, value(pose));
    for (std::size_t i = 0; i < few_; ++i) values[i] = 1;
    return values;
  }

 private:
  std::size_t few_;
};

// Nothing is left without this one block, so no motion of the minimum shows how far the pose may be off.
TEST(PredictedCovariance, OfOneOrTwoBlocksIsNotKnown) {
  for (const std::size_t few : {1u, 2u}) {
    const OfFewBlocks cost(few, Bowl(bottom(), frame(), hessian()));
    const marrow::FragmentFrame about = frame();
    const PredictedCovariance predicted(cost, bottom(), about);
    ASSERT_TRUE(predicted.covariance());
    for (int axis = 0; axis < 6; ++axis)
      EXPECT_GT(std::sqrt((*predicted.covariance())(axis, axis)), axis < 3 ? marrow::radians(90) : 100) << axis;
    EXPECT_EQ(predicted.warnings(1e9, 1e9),
              std::vector<std::string>{"all that the images say about the pose lies in one or two small parts of them, "
                                       "so its deviations are not known"});
  }
}

/// All blocks count, and hardly anything depends on the pose.
class NearlyFlat : public Bowl {
 public:
  explicit NearlyFlat(const Bowl& bowl) : Bowl(bowl) {}
  double value(const marrow::RigidTransform& pose) const override { return 1 + 1e-9 * Bowl::value(pose); }
  std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
    std::vector<double> values(9, value(pose));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += 0.1 * double(i);
    return values;
  }
};

// No block moves the minimum, but neither does anything else: this is no perfect fit.
TEST(PredictedCovariance, OfACostThatHardlyChangesIsNotKnown) {
  const NearlyFlat cost(Bowl(bottom(), frame(), hessian()));
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(cost, bottom(), about);
  ASSERT_TRUE(predicted.covariance());
  for (int axis = 0; axis < 6; ++axis)
    EXPECT_GT(std::sqrt((*predicted.covariance())(axis, axis)), axis < 3 ? marrow::radians(90) : 100) << axis;
  EXPECT_EQ(predicted.warnings(5, 5).size(), 6u);
}

TEST(PredictedCovariance, IsTheSumOfTheMotionsWithoutEachBlock) {
  for (const double information : {1.0, 2.0, 350.0}) {
    const Counted cost(bottom(), frame(), hessian(), information);
    const marrow::RigidTransform pose = bottom();
    const marrow::FragmentFrame about = frame();
    const PredictedCovariance predicted(cost, pose, about);
    const Matrix6d expected = in_radians((information * hessian()).inverse());
    ASSERT_TRUE(predicted.covariance());
    EXPECT_LT((*predicted.covariance() - expected).norm(), 1e-5 * expected.norm()) << *predicted.covariance() << "\n\n"
                                                                                   << expected;
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR((*predicted.covariance())(i, i), expected(i, i), 1e-5 * expected(i, i)) << i;
    EXPECT_EQ(predicted.evaluations(), cost.asked);
    EXPECT_TRUE(predicted.warnings(1e9, 1e9).empty());
  }
}

/// Fifty blocks besides, which show other bones: each changes the cost, and none says anything about the pose.
class WithOthers : public Bowl {
 public:
  explicit WithOthers(const Bowl& bowl) : Bowl(bowl) {}
  std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
    std::vector<double> values = Bowl::without_each_block(pose);
    values.resize(values.size() + 50, value(pose) + 1);
    return values;
  }
};

// What the other blocks cost is 7 in all, and 16 degrees about the least certain direction only a fifth of that.
TEST(PredictedCovariance, DoesNotCountBlocksThatShowOtherBones) {
  const WithOthers cost(Bowl(bottom(), frame(), hessian(), 350));
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(cost, bottom(), about);
  const Matrix6d expected = in_radians((350 * hessian()).inverse());
  ASSERT_TRUE(predicted.covariance());
  EXPECT_LT((*predicted.covariance() - expected).norm(), 1e-5 * expected.norm()) << *predicted.covariance() << "\n\n"
                                                                                 << expected;
}

/// Sums of squares of nine blocks, four residuals each, so few that each block matters much.
class Squares : public marrow::Cost {
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

  /// The minimum without a block (-1: with all), in degrees and mm from bottom().
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
  double value(const marrow::RigidTransform& pose) const override { return about(pose, -1).value; }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override { return nullptr; }
  std::optional<Expansion> expansion(const marrow::RigidTransform& pose, const marrow::FragmentFrame&) const override {
    return about(pose, -1);
  }
  std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform& pose,
                                                      const marrow::FragmentFrame&) const override {
    std::vector<Expansion> without;
    for (int block = 0; block < kBlocks; ++block) without.push_back(about(pose, block));
    return without;
  }

  std::vector<Slopes> slopes;
  std::vector<Eigen::Vector4d> targets;

 private:
  Expansion about(const marrow::RigidTransform& pose, int left) const {
    const Vector6d motion = well::way(bottom(), pose, frame());
    Vector6d unit = Vector6d::Ones();
    unit.head<3>() *= marrow::degrees(1);
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

/// The covariance of the minima without each block, from the normal equations.
Matrix6d covariance_of_minima(const Squares& cost) {
  Matrix6d sum = Matrix6d::Zero();
  for (int block = 0; block < Squares::kBlocks; ++block) {
    const Vector6d motion = cost.minimum(block) - cost.minimum();
    sum += motion * motion.transpose();
  }
  return in_radians(sum);
}

TEST(PredictedCovariance, IsThatOfTheMinimaWithoutEachBlock) {
  const Squares cost(0.05);
  const Vector6d least = cost.minimum();
  const Matrix6d expected = covariance_of_minima(cost);
  const marrow::FragmentFrame about = frame();
  const marrow::RigidTransform pose = marrow::search::moved_by_units(bottom(), about, least);
  const PredictedCovariance predicted(cost, pose, about);
  ASSERT_TRUE(predicted.covariance());
  EXPECT_LT((*predicted.covariance() - expected).norm(), 1e-6 * expected.norm());
  EXPECT_EQ(predicted.evaluations(), 3 + 12 + 13 + 4 + 65 + 2)
      << "the value, the derivatives twice, both ends of six lines, every second of 25 poses on a line, and those "
         "between that matter; the same of 129 turns about the long axis";
  // Derivatives say nothing about a minimum that is wider than degrees, and this cost has no blocks to try.
  EXPECT_FALSE(PredictedCovariance(Squares(50), pose, about).covariance());
}

TEST(PredictedCovariance, IsThatOfTheMinimaWithoutEachBlockByDifferencesToo) {
  class Values : public Squares {
   public:
    using Squares::Squares;
    std::optional<Expansion> expansion(const marrow::RigidTransform&, const marrow::FragmentFrame&) const override {
      return std::nullopt;
    }
    std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
      std::vector<double> values;
      for (const Expansion& without : Squares::expansion_without_each_block(pose, frame()))
        values.push_back(without.value);
      return values;
    }
    std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform&,
                                                        const marrow::FragmentFrame&) const override {
      return {};
    }
  };
  const Values cost(0.05);
  const marrow::FragmentFrame about = frame();
  const marrow::RigidTransform pose = marrow::search::moved_by_units(bottom(), about, cost.minimum());
  const PredictedCovariance predicted(cost, pose, about);
  const Matrix6d expected = covariance_of_minima(cost);
  ASSERT_TRUE(predicted.covariance());
  EXPECT_LT((*predicted.covariance() - expected).norm(), 1e-3 * expected.norm()) << *predicted.covariance() << "\n\n"
                                                                                 << expected;
}

TEST(PredictedCovariance, IsAbsentIfTheCostHasNoBlocks) {
  class Whole : public Bowl {
   public:
    using Bowl::Bowl;
    std::vector<double> without_each_block(const marrow::RigidTransform&) const override { return {}; }
  };
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Whole(bottom(), frame(), hessian()), pose, about);
  EXPECT_FALSE(predicted.covariance());
  EXPECT_TRUE(predicted.warnings(0, 0).empty());
}

TEST(PredictedCovariance, StepsAreLongerThanTheRoughnessOfTheCost) {
  // Waves of 0.01: a step that raises the bowl by 0.2 or more does not see them.
  class Rough : public Bowl {
   public:
    using Bowl::Bowl;
    double value(const marrow::RigidTransform& pose) const override {
      const Vector6d motion = well::way(bottom(), pose, frame());
      return Bowl::value(pose) + 0.005 * std::cos(40 * motion.sum());
    }
  };
  Matrix6d steep = Matrix6d::Zero();
  steep.diagonal() << 400, 0.1, 3, 100, 1, 0.05;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Rough(bottom(), frame(), steep, 4), pose, about);
  const Matrix6d expected = in_radians((4 * steep).inverse());
  for (int i = 0; i < 6; ++i) EXPECT_NEAR((*predicted.covariance())(i, i) / expected(i, i), 1, 0.15) << i;
}

TEST(PredictedCovariance, CoversAnotherMinimumThatIsAsDeep) {
  // Along the long axis two bowls, 2 degrees apart; the search ended in the first.
  class Double : public Bowl {
   public:
    using Bowl::Bowl;
    double value(const marrow::RigidTransform& pose) const override {
      const Vector6d way = well::way(bottom(), pose, frame());
      Vector6d other = way;
      other[2] -= 2;
      return 0.5 * std::min(way.dot(hessian_of * way), other.dot(hessian_of * other));
    }
    Matrix6d hessian_of = Vector6d(100, 100, 4, 100, 100, 100).asDiagonal();
  };
  const Matrix6d of_one = Vector6d(100, 100, 4, 100, 100, 100).asDiagonal();
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const auto axial_deg = [&](const marrow::Cost& cost) {
    return marrow::degrees(std::sqrt((*PredictedCovariance(cost, pose, about).covariance())(2, 2)));
  };
  EXPECT_NEAR(axial_deg(Bowl(bottom(), frame(), of_one, 4)), 0.25, 1e-4);
  // Half of the density lies about 2 degrees away: the mean square is 4 / 2, and that of each bowl more.
  EXPECT_NEAR(axial_deg(Double(bottom(), frame(), of_one, 4)), std::sqrt(2 + 0.25 * 0.25), 0.01);
}

TEST(PredictedCovariance, ACoarserCostSavesValuesFarAway) {
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const Matrix6d steep = 1e4 * hessian();
  const Counted alone(bottom(), frame(), steep), with(bottom(), frame(), steep),
      coarser(bottom(), frame(), 0.8 * steep);
  const PredictedCovariance without_it(alone, pose, about), with_it(with, pose, about, &coarser);
  EXPECT_EQ(*without_it.covariance(), *with_it.covariance()) << "values that matter are the cost's own";
  EXPECT_LT(with.asked, alone.asked - 4);
  EXPECT_GT(coarser.asked, 0);
}

TEST(PredictedCovariance, SaysWhichAxesTheImagesDoNotTell) {
  // sd of 5 degrees and of 8 mm; two axes along which nothing changes.
  Matrix6d flat = Matrix6d::Zero();
  flat.diagonal() << 1, 1.0 / 25, 0, 1, 0, 1.0 / 64;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Bowl(bottom(), frame(), flat), pose, about);
  const auto sd = [&](int axis) {
    return std::sqrt((*predicted.covariance())(axis, axis)) * (axis < 3 ? marrow::degrees(1) : 1);
  };
  EXPECT_NEAR(sd(0), 1, 1e-4);
  EXPECT_NEAR(sd(1), 5, 1e-3);
  EXPECT_GT(sd(2), 1000) << "a hundred steps stand for what nothing determines";
  EXPECT_GT(sd(4), 1000);
  EXPECT_NEAR(sd(5), 8, 1e-3);
  EXPECT_EQ(
      predicted.warnings(3, 5),
      (std::vector<std::string>{
          "rotation about the lateral axis is poorly determined by these images: its predicted standard deviation is 5 "
          "degrees",
          "axial rotation is not determined by these images: the cost hardly changes within 16 degrees",
          "translation along the lateral axis is not determined by these images: the cost hardly changes within 16 mm",
          "axial translation is poorly determined by these images: its predicted standard deviation is 8 mm"}));
  EXPECT_EQ(predicted.warnings(6, 9).size(), 2u);
  EXPECT_EQ(predicted.warnings(0.9, 0.9).front(),
            "rotation about the frontal axis is poorly determined by these images: its predicted standard deviation is "
            "1 degrees");
  EXPECT_EQ(predicted.warnings(3, 0.9)[2],
            "translation along the frontal axis is poorly determined by these images: its predicted standard deviation "
            "is 1 mm");
}

TEST(PredictedCovariance, OfADirectionThatOnlyTwoAxesTogetherLeaveOpen) {
  // Each axis alone is well determined, but not their combination.
  Matrix6d tied = Matrix6d::Identity();
  tied.topLeftCorner<2, 2>() << 1, 1, 1, 1;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Bowl(bottom(), frame(), tied), pose, about);
  EXPECT_GT(std::sqrt((*predicted.covariance())(0, 0)), marrow::radians(20));
  EXPECT_TRUE(std::isfinite(predicted.covariance()->norm()));
  EXPECT_NEAR((*predicted.covariance())(3, 3), 1, 1e-4);
}

TEST(PredictedCovariance, OfAPerfectFitIsTheLeastStep) {
  // All residuals are 0, so no block moves the minimum. What is not tried is not known: steps of 1/256 degree or mm.
  class PerfectValues : public Squares {
   public:
    PerfectValues() : Squares(0) {}
    std::optional<Expansion> expansion(const marrow::RigidTransform&, const marrow::FragmentFrame&) const override {
      return std::nullopt;
    }
    std::vector<double> without_each_block(const marrow::RigidTransform& pose) const override {
      std::vector<double> values;
      for (const Expansion& without : Squares::expansion_without_each_block(pose, frame()))
        values.push_back(without.value);
      return values;
    }
    std::vector<Expansion> expansion_without_each_block(const marrow::RigidTransform&,
                                                        const marrow::FragmentFrame&) const override {
      return {};
    }
  };
  const Matrix6d expected = in_radians(Matrix6d::Identity() / (256.0 * 256.0));
  const marrow::FragmentFrame about = frame();
  const marrow::RigidTransform pose = bottom();
  const Squares with_derivatives(0);
  const PerfectValues with_values;
  for (const marrow::Cost* cost :
       {static_cast<const marrow::Cost*>(&with_derivatives), static_cast<const marrow::Cost*>(&with_values)}) {
    const PredictedCovariance predicted(*cost, pose, about);
    ASSERT_TRUE(predicted.covariance());
    EXPECT_LT((*predicted.covariance() - expected).norm(), 1e-6 * expected.norm()) << *predicted.covariance();
  }
}

TEST(PredictedCovariance, OneBlockThatAloneTellsAnAxisLeavesItOpen) {
  // Only one of nine blocks holds the residuals along the last axis. Without it nothing determines that axis: no
  // deviation follows from derivatives, and 0 would be wrong.
  class Alone : public Squares {
   public:
    Alone() : Squares(0.05) {
      for (int block = 1; block < kBlocks; ++block) slopes[std::size_t(block)].col(5).setZero();
    }
  };
  const Alone cost;
  const marrow::FragmentFrame about = frame();
  const marrow::RigidTransform pose = marrow::search::moved_by_units(bottom(), about, cost.minimum());
  EXPECT_FALSE(PredictedCovariance(cost, pose, about).covariance());
}

}  // namespace predicted_covariance_test
