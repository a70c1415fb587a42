// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <marrow/domain/pose.hpp>

#include "tests/harness/message_of.hpp"

namespace pose_test {

using namespace marrow;
using Eigen::Vector3d;

FragmentFrame some_frame() { return {Vector3d(40, -30, 250), rotation_from_vector({0.4, -0.1, 0.2})}; }

RigidTransform some_pose() { return {"world", "ct", rotation_from_vector({-0.3, 0.8, 0.1}), {12, -7, 100}}; }

TEST(Moved, AppliesTheMotionInTheModelBeforeThePose) {
  Vector6d motion;
  motion << 0.02, -0.05, 0.3, 1, 2, -3;
  const FragmentFrame frame = some_frame();
  const RigidTransform result = moved(some_pose(), frame, motion);
  const Vector3d x(10, 20, 300);
  // The definition at Pose: x' = o + R(axes r) (x - o) + axes t.
  const Vector3d in_model = frame.origin_mm +
                            rotation_from_vector(frame.axes * motion.head<3>()) * (x - frame.origin_mm) +
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

TEST(MotionBetween, UndoesMovedOnlyInOneFrame) {
  for (double size : {1e-7, 0.01, 1.0}) {
    Vector6d motion;
    motion << 0.3, -0.5, 0.7, 10, 20, -30;
    motion *= size;
    const RigidTransform to = moved(some_pose(), some_frame(), motion);
    EXPECT_LT((motion_between(some_pose(), to, some_frame()) - motion).norm(), 1e-9 + 1e-7 * motion.norm()) << size;
  }
  EXPECT_LT(motion_between(some_pose(), some_pose(), some_frame()).norm(), 1e-9);
  RigidTransform other = some_pose();
  other.target = "table";
  EXPECT_EQ(test::message_of([&] { motion_between(some_pose(), other, some_frame()); }),
            "cannot compose ct_from_world with table_from_ct: the first takes points in 'world', the second gives "
            "points in 'table'");
}

// Rotated by r about the z axis through the origin, the point (10, 0, 0) moves by 10 r along y.
TEST(Pose, InAnotherFrame) {
  marrow::Pose pose;
  pose.covariance.emplace(marrow::Matrix6d::Zero());
  (*pose.covariance)(2, 2) = 1e-4;
  (*pose.covariance)(4, 4) = 0.04;
  Eigen::Matrix3d axes;  // the new frame's axes: y, -x, z
  axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const marrow::Pose other = in_frame(pose, {{10, 0, 0}, axes});
  EXPECT_NEAR((*other.covariance)(2, 2), 1e-4, 1e-15);
  EXPECT_NEAR((*other.covariance)(3, 3), 0.04 + 0.01, 1e-12);
  EXPECT_NEAR((*other.covariance)(2, 3), 1e-3, 1e-12);
  EXPECT_NEAR((*other.covariance)(4, 4), 0, 1e-15);
  const marrow::Pose back = in_frame(other, pose.frame);
  EXPECT_TRUE(back.covariance->isApprox(*pose.covariance, 1e-12));
  const FragmentFrame from{{1, 2, 3}, rotation_from_vector({0.3, -0.2, 0.5})};
  const FragmentFrame to{{-20, 40, 7}, rotation_from_vector({-0.7, 0.1, 0.4})};
  Vector6d motion;
  motion << 1e-6, -2e-6, 3e-6, 4e-5, -5e-5, 6e-5;
  const RigidTransform start{"ct", "ct"};
  const Vector6d expected = marrow::motion_between(start, marrow::moved(start, from, motion), to);
  EXPECT_TRUE((change_of_frame(from, to) * motion).isApprox(expected, 1e-4));
}

// By hand: [1 c; c 1] has the eigenvalues 1 - c and 1 + c.
TEST(Covariance, WhatIsNone) {
  using marrow::Matrix6d;
  const auto refused = [](const Matrix6d& covariance) {
    return test::message_of([&] { check_covariance(covariance, "pose 'distal'"); });
  };
  Matrix6d covariance = Vector6d(1e-6, 1e-6, 1e-4, 0.01, 0.01, 4).asDiagonal();
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
  EXPECT_EQ(test::message_of([&] { check_pose(pose, "pose"); }), "");
  pose.frame.axes.col(1) *= -1;
  EXPECT_HAS(test::message_of([&] { check_pose(pose, "pose"); }), "pose: the axes of its fragment");
}

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using test::message_of;

RigidTransform quarter_turn(const std::string& target, const std::string& source, const Vector3d& translation_mm) {
  Matrix3d about_z;
  about_z << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return {target, source, about_z, translation_mm};
}

TEST(RigidTransform, RotatesThenTranslatesAndComposesFromRightToLeft) {
  EXPECT_TRUE((quarter_turn("world", "ct", {10, 20, 30}) * Vector3d(1, 2, 3)).isApprox(Vector3d(8, 21, 33)));
  const RigidTransform world_from_table = quarter_turn("world", "table", {1, 0, 0}),
                       table_from_ct{"table", "ct", Matrix3d::Identity(), {5, 0, 0}};
  const RigidTransform world_from_ct = world_from_table * table_from_ct;
  EXPECT_EQ(world_from_ct.target, "world");
  EXPECT_EQ(world_from_ct.source, "ct");
  EXPECT_TRUE((world_from_ct * Vector3d(0, 0, 0)).isApprox(Vector3d(1, 5, 0)));
}

TEST(RigidTransform, FramesMustMeetAndTheInverseSwapsThem) {
  EXPECT_EQ(message_of([] {
              quarter_turn("world", "table", Vector3d::Zero()) * quarter_turn("camera", "ct", Vector3d::Zero());
            }),
            "cannot compose world_from_table with camera_from_ct: the first takes points in 'table', the second gives "
            "points in "
            "'camera'");
  const RigidTransform back = inverse(quarter_turn("world", "ct", {10, 20, 30}));
  EXPECT_EQ(back.target, "ct");
  EXPECT_EQ(back.source, "world");
  EXPECT_TRUE((back * Vector3d(8, 21, 33)).isApprox(Vector3d(1, 2, 3)));
}

TEST(RigidTransform, CheckNamesTheFault) {
  const auto message = [](const Matrix3d& rotation, const Vector3d& translation_mm = Vector3d::Zero()) {
    return message_of([&] { check_rigid(RigidTransform{"", "", rotation, translation_mm}, "start"); });
  };
  const Matrix3d identity = Matrix3d::Identity();
  EXPECT_EQ(message(identity), "");
  // A mirror is orthonormal, but no rotation.
  EXPECT_EQ(message(Vector3d(-1, 1, 1).asDiagonal()),
            "start: not a rotation (off orthonormal by 0.000000, determinant -1.000000); a rotation is orthonormal "
            "with determinant +1");
  EXPECT_HAS(message(1.1 * identity), "off orthonormal by 0.21");
  EXPECT_EQ(message((1 + 0.4e-6) * identity), "") << "off by 0.8e-6";
  EXPECT_HAS(message((1 + 0.6e-6) * identity), "not a rotation");
  Matrix3d holed = identity;
  holed(1, 2) = std::nan("");
  for (const std::string& said : {message(holed), message(identity, {std::numeric_limits<double>::infinity(), 0, 0})})
    EXPECT_EQ(said, "start: the transform has a number that is not finite");
}

TEST(Rotation, VectorAndMatrixAgree) {
  EXPECT_EQ(rotation_from_vector(Vector3d::Zero()), Matrix3d(Matrix3d::Identity()));
  EXPECT_TRUE(rotation_from_vector({0, 0, kPi / 2}).isApprox(quarter_turn("", "", Vector3d::Zero()).rotation));
  for (const Vector3d& vector : {Vector3d(0.3, -0.2, 0.9), Vector3d(1e-9, 2e-9, -3e-9), Vector3d(0, 3.1, 0)})
    EXPECT_LT((vector_from_rotation(rotation_from_vector(vector)) - vector).norm(), 1e-7 * vector.norm());
  EXPECT_LT(vector_from_rotation(Matrix3d::Identity()).norm(), 1e-15);
  const Vector3d v(1, -2, 3), w(-4, 5, 7);
  EXPECT_EQ(Vector3d(cross_matrix(v) * w), v.cross(w));
}

TEST(Rotation, GeodesicAngleIsExactForSmallAndLargeAngles) {
  const Matrix3d base = AngleAxisd(0.8, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (double angle : {1e-8, 1e-4, 0.01, 1.0, 3.0, 3.14}) {
    const Matrix3d turned = base * AngleAxisd(angle, Vector3d(0.2, 0.4, -1).normalized()).toRotationMatrix();
    EXPECT_NEAR(geodesic_angle_rad(base, turned), angle, 1e-6 * angle) << angle;
    EXPECT_NEAR(geodesic_angle_rad(turned, base), angle, 1e-6 * angle) << angle;
  }
  EXPECT_EQ(geodesic_angle_rad(base, base), 0);
  EXPECT_NEAR(geodesic_angle_rad(Matrix3d::Identity(), Vector3d(1, -1, -1).asDiagonal()), kPi, 1e-7);
}

TEST(Angles, DegreesAndRadians) {
  EXPECT_DOUBLE_EQ(radians(180), kPi);
  EXPECT_DOUBLE_EQ(degrees(kPi / 6), 30);
}

}  // namespace pose_test
