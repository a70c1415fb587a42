// SPDX-License-Identifier: Apache-2.0
#include "framework/toolbox/search/predicted_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "bowl.hpp"

namespace predicted_covariance_test {

using marrow::Matrix6d;
using marrow::Vector6d;
using marrow::search::PredictedCovariance;
using well::Bowl;

marrow::FragmentFrame frame() { return {Eigen::Vector3d(5, -3, 80), marrow::rotation_from_vector({0.1, -0.2, 0.3})}; }
marrow::RigidTransform bottom() {
  return {"world", "ct", marrow::rotation_from_vector({0.2, 0.1, -0.4}), Eigen::Vector3d(12, -7, 30)};
}

/// Axes that differ by much, and each tied to each other.
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
  mutable std::atomic<int> asked = 0;
};

TEST(PredictedCovariance, IsTheInverseOfTheCurvatureTimesTheFactor) {
  for (const double factor : {1.0, 2.0, 350.0}) {
    const Counted cost(bottom(), frame(), hessian());
    const marrow::RigidTransform pose = bottom();
    const marrow::FragmentFrame about = frame();
    const PredictedCovariance predicted(cost, pose, about, factor);
    const Matrix6d expected = in_radians((factor * hessian()).inverse());
    EXPECT_LT((predicted.covariance() - expected).norm(), 1e-6 * expected.norm()) << predicted.covariance() << "\n\n"
                                                                                  << expected;
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(predicted.covariance()(i, i), expected(i, i), 1e-6 * expected(i, i)) << i;
    EXPECT_EQ(predicted.evaluations(), cost.asked);
    EXPECT_TRUE(predicted.warnings(1e9, 1e9).empty());
  }
}

TEST(PredictedCovariance, StepsAreSoLongThatTheCostRisesByAPartOfAPixel) {
  // Waves of 0.01 px: at a step that raises the bowl by 0.1 to 0.3 px they change a variance by a tenth at most.
  class Rough : public Bowl {
   public:
    using Bowl::Bowl;
    double value(const marrow::RigidTransform& pose) const override {
      const Vector6d motion = well::way(bottom(), pose, frame());
      return Bowl::value(pose) + 0.005 * std::cos(40 * motion.sum());
    }
  };
  Matrix6d steep = Matrix6d::Zero();
  steep.diagonal() << 400, 0.02, 3, 100, 1, 0.01;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Rough(bottom(), frame(), steep), pose, about, 1);
  const Matrix6d expected = in_radians(steep.inverse());
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(predicted.covariance()(i, i) / expected(i, i), 1, 0.15) << i;
  // A wall a little away from the bottom is not seen by steps that stay near.
  class Walled : public Bowl {
   public:
    using Bowl::Bowl;
    double value(const marrow::RigidTransform& pose) const override {
      return Bowl::value(pose) < 0.3 ? Bowl::value(pose) : 1e3;
    }
  };
  const Matrix6d round =
      0.9 * Matrix6d::Identity();  // 0.11 px at half a degree or mm, and twice that where two axes move
  const PredictedCovariance within(Walled(bottom(), frame(), round), pose, about, 1);
  EXPECT_LT((within.covariance() - in_radians(round.inverse())).norm(), 1e-6);
  // Rises are measured at steps of 0.5 to 1/64 (6), 0.5 (1), 0.5 to 16 (6), 0.5 to 0.125 (3), 0.5 and 1 (2), 0.5 (1),
  // two values each; then the bottom, and two for each pair of axes.
  Matrix6d many = Matrix6d::Zero();
  many.diagonal() << 1e6, 0.9, 0, 20, 0.7, 1;
  EXPECT_EQ(PredictedCovariance(Bowl(bottom(), frame(), many), pose, about, 1).evaluations(),
            2 * (6 + 1 + 6 + 3 + 2 + 1) + 1 + 2 * 15);
}

TEST(PredictedCovariance, SaysWhichAxesTheImagesDoNotTell) {
  // sd of 5 degrees and of 8 mm; one axis of each kind that hardly changes anything: 0.04 px at 16 degrees, nothing at
  // 16 mm.
  Matrix6d flat = Matrix6d::Zero();
  flat.diagonal() << 1, 1.0 / 25, 2 * 0.04 / 256, 1, 0, 1.0 / 64;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Bowl(bottom(), frame(), flat), pose, about, 1);
  const auto sd = [&](int axis) {
    return std::sqrt(predicted.covariance()(axis, axis)) * (axis < 3 ? marrow::degrees(1) : 1);
  };
  EXPECT_NEAR(sd(0), 1, 1e-6);
  EXPECT_NEAR(sd(1), 5, 1e-5);
  EXPECT_NEAR(sd(2), 1600, 1e-3) << "a hundred steps stand for what nothing determines";
  EXPECT_NEAR(sd(4), 1600, 1e-3);
  EXPECT_NEAR(sd(5), 8, 1e-5);
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
  // Each axis alone is well determined, their sum against each other is not.
  Matrix6d tied = Matrix6d::Identity();
  tied.topLeftCorner<2, 2>() << 1, 1, 1, 1;
  const marrow::RigidTransform pose = bottom();
  const marrow::FragmentFrame about = frame();
  const PredictedCovariance predicted(Bowl(bottom(), frame(), tied), pose, about, 1);
  EXPECT_GT(std::sqrt(predicted.covariance()(0, 0)), marrow::radians(20));
  EXPECT_TRUE(std::isfinite(predicted.covariance().norm()));
  EXPECT_NEAR(predicted.covariance()(3, 3), 1, 1e-6);
}

}  // namespace predicted_covariance_test
