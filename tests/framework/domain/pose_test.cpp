// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <marrow/domain/pose.hpp>

#include "tests/harness/message_of.hpp"

namespace pose_test {

using Eigen::Vector3d;
using marrow::FragmentFrame;
using marrow::RigidTransform;
using marrow::Vector6d;

FragmentFrame some_frame() { return {Vector3d(40, -30, 250), marrow::rotation_from_vector({0.4, -0.1, 0.2})}; }

RigidTransform some_pose() { return {"world", "ct", marrow::rotation_from_vector({-0.3, 0.8, 0.1}), {12, -7, 100}}; }

TEST(Moved, AppliesTheMotionInTheModelBeforeThePose) {
  Vector6d motion;
  motion << 0.02, -0.05, 0.3, 1, 2, -3;
  const FragmentFrame frame = some_frame();
  const RigidTransform result = moved(some_pose(), frame, motion);
  const Vector3d x(10, 20, 300);
  // The definition at Pose: x' = o + R(axes r) (x - o) + axes t.
  const Vector3d in_model = frame.origin_mm +
                            marrow::rotation_from_vector(frame.axes * motion.head<3>()) * (x - frame.origin_mm) +
                            frame.axes * motion.tail<3>();
  EXPECT_LT((result * x - some_pose() * in_model).norm(), 1e-10);
  EXPECT_EQ(result.target, "world");
  EXPECT_EQ(result.source, "ct");
}

TEST(Moved, ARotationKeepsTheOriginOfTheFrame) {
  Vector6d motion = Vector6d::Zero();
  motion[2] = 0.5;
  const RigidTransform result = moved(some_pose(), some_frame(), motion);
  EXPECT_LT((result * some_frame().origin_mm - some_pose() * some_frame().origin_mm).norm(), 1e-10);
  const Vector3d on_axis = some_frame().origin_mm + 50 * some_frame().axes.col(2);
  EXPECT_LT((result * on_axis - some_pose() * on_axis).norm(), 1e-10);
}

TEST(MotionBetween, UndoesMoved) {
  for (double size : {1e-7, 0.01, 1.0}) {
    Vector6d motion;
    motion << 0.3, -0.5, 0.7, 10, 20, -30;
    motion *= size;
    const RigidTransform to = moved(some_pose(), some_frame(), motion);
    EXPECT_LT((motion_between(some_pose(), to, some_frame()) - motion).norm(), 1e-9 + 1e-7 * motion.norm()) << size;
  }
  EXPECT_LT(motion_between(some_pose(), some_pose(), some_frame()).norm(), 1e-9);
}

TEST(MotionBetween, RefusesPosesInDifferentFrames) {
  RigidTransform other = some_pose();
  other.target = "table";
  EXPECT_EQ(marrow::test::message_of([&] { motion_between(some_pose(), other, some_frame()); }),
            "cannot compose ct_from_world with table_from_ct: the first takes points in 'world', the second gives "
            "points in 'table'");
}

// Rotated by r about the z axis through the origin, the point (10, 0, 0) moves by 10 r along y.
TEST(Pose, ACovarianceInAnotherFrame) {
  marrow::Pose pose;
  pose.covariance.emplace(marrow::Matrix6d::Zero());
  (*pose.covariance)(2, 2) = 1e-4;
  (*pose.covariance)(4, 4) = 0.04;
  Eigen::Matrix3d axes;  // the new frame's axes: y, -x, z
  axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const marrow::Pose other = marrow::in_frame(pose, {{10, 0, 0}, axes});
  EXPECT_NEAR((*other.covariance)(2, 2), 1e-4, 1e-15);
  EXPECT_NEAR((*other.covariance)(3, 3), 0.04 + 0.01, 1e-12);
  EXPECT_NEAR((*other.covariance)(2, 3), 1e-3, 1e-12);
  EXPECT_NEAR((*other.covariance)(4, 4), 0, 1e-15);
  const marrow::Pose back = marrow::in_frame(other, pose.frame);
  EXPECT_TRUE(back.covariance->isApprox(*pose.covariance, 1e-12));
}

TEST(Pose, ASmallMotionInAnotherFrame) {
  const marrow::FragmentFrame from{{1, 2, 3}, marrow::rotation_from_vector({0.3, -0.2, 0.5})};
  const marrow::FragmentFrame to{{-20, 40, 7}, marrow::rotation_from_vector({-0.7, 0.1, 0.4})};
  marrow::Vector6d motion;
  motion << 1e-6, -2e-6, 3e-6, 4e-5, -5e-5, 6e-5;
  const marrow::RigidTransform start{"ct", "ct"};
  const marrow::Vector6d expected = marrow::motion_between(start, marrow::moved(start, from, motion), to);
  EXPECT_TRUE((marrow::change_of_frame(from, to) * motion).isApprox(expected, 1e-4));
}

// By hand: [1 c; c 1] has the eigenvalues 1 - c and 1 + c.
TEST(Covariance, WhatIsNone) {
  using marrow::Matrix6d;
  const auto refused = [](const Matrix6d& covariance) {
    return marrow::test::message_of([&] { marrow::check_covariance(covariance, "pose 'distal'"); });
  };
  Matrix6d covariance = marrow::Vector6d(1e-6, 1e-6, 1e-4, 0.01, 0.01, 4).asDiagonal();
  EXPECT_EQ(refused(covariance), "");
  EXPECT_EQ(refused(Matrix6d::Zero()), "") << "exactly known";
  EXPECT_EQ(refused(-Matrix6d::Identity()),
            "pose 'distal': the covariance has the negative variance -1 in row 1, column 1; a covariance is symmetric "
            "and has no negative eigenvalue");
  covariance(2, 5) = 0.01;
  EXPECT_EQ(refused(covariance),
            "pose 'distal': the covariance is not symmetric: 0.01 in row 3, column 6, but 0 in row 6, column 3; a "
            "covariance is symmetric and has no negative eigenvalue");
  covariance(5, 2) = 0.01;
  EXPECT_EQ(refused(covariance), "") << "a correlation of 0.5";
  covariance(2, 5) = covariance(5, 2) = 0.03;
  EXPECT_EQ(refused(covariance),
            "pose 'distal': the covariance has a negative eigenvalue (-0.5 times its variances); a covariance is "
            "symmetric and has no negative eigenvalue")
      << "a correlation of 1.5";
  covariance(2, 5) = covariance(5, 2) = 0.02;
  EXPECT_EQ(refused(covariance), "") << "a correlation of 1 leaves a direction that is exactly known";
  covariance(5, 5) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refused(covariance), "") << "not known along an axis";
}

TEST(Pose, TheAxesOfAFragmentAreARotation) {
  marrow::Pose pose;
  EXPECT_EQ(marrow::test::message_of([&] { marrow::check_pose(pose, "pose"); }), "");
  pose.frame.axes.col(1) *= -1;
  EXPECT_NE(marrow::test::message_of([&] { marrow::check_pose(pose, "pose"); }).find("pose: the axes of its fragment"),
            std::string::npos);
}

}  // namespace pose_test
