// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/transform.hpp>

#include "tests/harness/message_of.hpp"

namespace transform_test {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using marrow::RigidTransform;
using marrow::test::message_of;

RigidTransform quarter_turn(const std::string& target, const std::string& source, const Vector3d& translation_mm) {
  Matrix3d about_z;
  about_z << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return {target, source, about_z, translation_mm};
}

TEST(RigidTransform, RotatesThenTranslates) {
  EXPECT_TRUE((quarter_turn("world", "ct", {10, 20, 30}) * Vector3d(1, 2, 3)).isApprox(Vector3d(8, 21, 33)));
}

TEST(RigidTransform, ComposesFromRightToLeft) {
  const RigidTransform world_from_table = quarter_turn("world", "table", {1, 0, 0}),
                       table_from_ct{"table", "ct", Matrix3d::Identity(), {5, 0, 0}};
  const RigidTransform world_from_ct = world_from_table * table_from_ct;
  EXPECT_EQ(world_from_ct.target, "world");
  EXPECT_EQ(world_from_ct.source, "ct");
  EXPECT_TRUE((world_from_ct * Vector3d(0, 0, 0)).isApprox(Vector3d(1, 5, 0)));
}

TEST(RigidTransform, RefusesFramesThatDoNotMeet) {
  EXPECT_EQ(message_of([] {
              quarter_turn("world", "table", Vector3d::Zero()) * quarter_turn("camera", "ct", Vector3d::Zero());
            }),
            "cannot compose world_from_table with camera_from_ct: the first takes points in 'table', the second gives "
            "points in "
            "'camera'");
}

TEST(RigidTransform, InverseSwapsFramesAndUndoes) {
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
  EXPECT_NE(message(1.1 * identity).find("off orthonormal by 0.21"), std::string::npos);
  EXPECT_EQ(message((1 + 0.4e-6) * identity), "") << "off by 0.8e-6";
  EXPECT_NE(message((1 + 0.6e-6) * identity).find("not a rotation"), std::string::npos);
  Matrix3d holed = identity;
  holed(1, 2) = std::nan("");
  for (const std::string& said : {message(holed), message(identity, {std::numeric_limits<double>::infinity(), 0, 0})})
    EXPECT_EQ(said, "start: the transform has a number that is not finite");
}

TEST(Rotation, VectorAndMatrixAgree) {
  EXPECT_EQ(marrow::rotation_from_vector(Vector3d::Zero()), Matrix3d(Matrix3d::Identity()));
  EXPECT_TRUE(
      marrow::rotation_from_vector({0, 0, marrow::kPi / 2}).isApprox(quarter_turn("", "", Vector3d::Zero()).rotation));
  for (const Vector3d& vector : {Vector3d(0.3, -0.2, 0.9), Vector3d(1e-9, 2e-9, -3e-9), Vector3d(0, 3.1, 0)})
    EXPECT_LT((marrow::vector_from_rotation(marrow::rotation_from_vector(vector)) - vector).norm(),
              1e-7 * vector.norm());
  EXPECT_LT(marrow::vector_from_rotation(Matrix3d::Identity()).norm(), 1e-15);
}

TEST(Rotation, CrossMatrixMultipliesAsTheCrossProduct) {
  const Vector3d v(1, -2, 3), w(-4, 5, 7);
  EXPECT_EQ(Vector3d(marrow::cross_matrix(v) * w), v.cross(w));
}

TEST(Rotation, GeodesicAngleIsExactForSmallAndLargeAngles) {
  const Matrix3d base = AngleAxisd(0.8, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (double angle : {1e-8, 1e-4, 0.01, 1.0, 3.0, 3.14}) {
    const Matrix3d turned = base * AngleAxisd(angle, Vector3d(0.2, 0.4, -1).normalized()).toRotationMatrix();
    EXPECT_NEAR(marrow::geodesic_angle_rad(base, turned), angle, 1e-6 * angle) << angle;
    EXPECT_NEAR(marrow::geodesic_angle_rad(turned, base), angle, 1e-6 * angle) << angle;
  }
  EXPECT_EQ(marrow::geodesic_angle_rad(base, base), 0);
  EXPECT_NEAR(marrow::geodesic_angle_rad(Matrix3d::Identity(), Vector3d(1, -1, -1).asDiagonal()), marrow::kPi, 1e-7);
}

TEST(Angles, DegreesAndRadians) {
  EXPECT_DOUBLE_EQ(marrow::radians(180), marrow::kPi);
  EXPECT_DOUBLE_EQ(marrow::degrees(marrow::kPi / 6), 30);
}

}  // namespace transform_test
