// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/written_files.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace itk_transform_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using exchange::ItkTransformFile;
using ItkTransform = InAFolder;

RigidTransform read(const std::filesystem::path& path, const std::string& maps = "world_to_ct") {
  return read_by<Pose>("read.pose", path, {{"maps", maps}}).world_from_model;
}

std::string file(const std::string& type, const std::string& parameters, const std::string& fixed = "0 0 0") {
  return "#Insight Transform File V1.0\n#Transform 0\nTransform: " + type + "\nParameters: " + parameters +
         "\nFixedParameters: " + fixed + "\n";
}

// A quarter turn about z that takes x to y, and a way of (1, 2, 3).
const std::string kQuarter = file("AffineTransform_double_3_3", "0 -1 0 1 0 0 0 0 1 1 2 3");

TEST_F(ItkTransform, BothDirections) {
  put(folder / "a.tfm", kQuarter);
  const RigidTransform itself = read(folder / "a.tfm", "ct_to_world");
  EXPECT_EQ(itself.target, "world");
  EXPECT_EQ(itself.source, "ct");
  EXPECT_EQ(itself * Vector3d(10, 0, 0), Vector3d(1, 12, 3));
  const RigidTransform inverted = read(folder / "a.tfm");
  EXPECT_EQ(inverted.target, "world");
  EXPECT_EQ(inverted.source, "ct");
  EXPECT_EQ(inverted * Vector3d(1, 12, 3), Vector3d(10, 0, 0));
}

// 3D Slicer shows, in RAS, a "transform to parent" that moves a model by (-12, 14, 6), and saves this file for it. In
// LPS the model moves by (12, -14, 6).
TEST_F(ItkTransform, AsSlicerSavesAModelThatWasMoved) {
  put(folder / "a.tfm", file("AffineTransform_double_3_3", "1 0 0 0 1 0 0 0 1 -12 14 -6"));
  EXPECT_EQ(read(folder / "a.tfm") * Vector3d(0, 0, 0), Vector3d(12, -14, 6));
}

TEST_F(ItkTransform, TheCentreOfRotationCounts) {
  put(folder / "a.txt", file("MatrixOffsetTransformBase_float_3_3", "0 -1 0 1 0 0 0 0 1 1 2 3", "10 0 0"));
  // y = R (x - c) + c + t: the centre itself moves by t only.
  EXPECT_EQ(read(folder / "a.txt", "ct_to_world") * Vector3d(10, 0, 0), Vector3d(11, 2, 3));
}

TEST_F(ItkTransform, RigidTypesOfItk) {
  // Half the sine of the angle: a quarter turn about z.
  put(folder / "versor.tfm", file("VersorRigid3DTransform_double_3_3", "0 0 0.70710678118654757 1 2 3"));
  EXPECT_LT((read(folder / "versor.tfm", "ct_to_world") * Vector3d(10, 0, 0) - Vector3d(1, 12, 3)).norm(), 1e-12);
  // Quarter turns about x and z. About y, x, z in this order, y goes to z; about x, y, z the same. z goes to -y and
  // then to x.
  const std::string quarters = "1.5707963267948966 0 1.5707963267948966 0 0 0";
  put(folder / "euler.tfm", file("Euler3DTransform_double_3_3", quarters));
  EXPECT_LT((read(folder / "euler.tfm", "ct_to_world") * Vector3d(0, 0, 1) - Vector3d(1, 0, 0)).norm(), 1e-12);
  // Quarter turns about x and y: x goes by y, then x, to -z and then to y; in the other order it goes to -z.
  const std::string two = "1.5707963267948966 1.5707963267948966 0 0 0 0";
  put(folder / "zxy.tfm", file("Euler3DTransform_double_3_3", two, "0 0 0 0"));
  EXPECT_LT((read(folder / "zxy.tfm", "ct_to_world") * Vector3d(1, 0, 0) - Vector3d(0, 1, 0)).norm(), 1e-12);
  put(folder / "zyx.tfm", file("Euler3DTransform_double_3_3", two, "0 0 0 1"));
  EXPECT_LT((read(folder / "zyx.tfm", "ct_to_world") * Vector3d(1, 0, 0) - Vector3d(0, 0, -1)).norm(), 1e-12);
}

TEST_F(ItkTransform, WhatIsWrittenIsReadBack) {
  Pose pose;
  pose.world_from_model.rotation = rotation_from_vector({0.3, -0.5, 0.8});
  pose.world_from_model.translation_mm = {1.0 / 3, -20, 1e-7};
  const std::string itself =
      written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "a.tfm", {{"maps", "ct_to_world"}});
  const RigidTransform read_back = read(folder / "a.tfm", "ct_to_world");
  EXPECT_EQ(read_back.rotation, pose.world_from_model.rotation);
  EXPECT_EQ(read_back.translation_mm, pose.world_from_model.translation_mm);
  const std::string inverted = written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "b.tfm");
  EXPECT_NE(inverted, itself);
  EXPECT_EQ(read(folder / "b.tfm").rotation, pose.world_from_model.rotation);
  EXPECT_LT((read(folder / "b.tfm").translation_mm - pose.world_from_model.translation_mm).norm(), 1e-13);
}

// What is written for 3D Slicer has the inverse's numbers.
TEST_F(ItkTransform, TheBytesThatAreWritten) {
  Pose pose;
  pose.world_from_model.translation_mm = {12, -14, 6};
  EXPECT_EQ(written_by<ItkTransformFile>("write.tfm", "pose", pose, folder / "a.tfm"),
            file("AffineTransform_double_3_3", "1 0 0 0 1 0 0 0 1 -12 14 -6"));
}

TEST_F(ItkTransform, DiagnosesFaults) {
  put(folder / "p.yaml", "marrow-pose: 1\n");
  EXPECT_SAYS(read(folder / "p.yaml", "ct_to_world"),
              "p.yaml: says itself what it maps; maps is only for transforms of ITK (.tfm or .txt), so leave it out");
  const std::string affine = "AffineTransform_double_3_3";
  expect_faults(
      folder / "a.tfm", kQuarter,
      {{"V1.0", "V2.0", "a.tfm:1: expected '#Insight Transform File V1.0', got '#Insight Transform File V2.0'"},
       {"", "marrow-pose: 1\n", "save the transform as .tfm in 3D Slicer or ITK"},
       {"", kQuarter.substr(0, kQuarter.find("Fixed")),
        "there is no line 'FixedParameters:'; the file is cut off, or no"},
       {"Transform: Aff", "Transformation: Aff", "a.tfm:3: expected 'Transform:', 'Parameters:' or 'Fixed"},
       {"", kQuarter + "#Transform 1\nTransform: " + affine + "\n",
        "a.tfm:7: a second transform begins, but a pose is one; in 3D Slicer, harden the transforms into one"},
       {affine, "BSplineTransform_double_3_3",
        "a.tfm:3: the type 'BSplineTransform_double_3_3' is not read; expected AffineTransform_double_3_3"},
       {affine, "AffineTransform_double_2_2", "the type 'AffineTransform_double_2_2' is not read"},
       {" 1 2 3", " 1 2", "a.tfm:4: AffineTransform_double_3_3 has 12 parameters, got 11"},
       {"0 0 0\n", "0 0\n", "a.tfm:5: AffineTransform_double_3_3 has 3 fixed parameters, got 2"},
       {" 1 2 3", " 1 nan 3", "a.tfm:4: expected numbers of at most 1e6, got 'nan'"},
       {" 1 2 3", " 1 2e300 3", "a.tfm:4: expected numbers of at most 1e6, got '2e300'"},
       {" 1 2 3", " 1 two 3", "a.tfm:4: expected numbers of at most 1e6, got 'two'"},
       {"0 -1 0 1", "0 -2 0 1", "a.tfm:4: the matrix scales, shears or mirrors, but a pose is a rotation"},
       {"0 -1 0 1", "0 1 0 1", "the matrix scales, shears or mirrors, but a pose is a rotation"},
       {"", file("VersorRigid3DTransform_double_3_3", "1 1 0 1 2 3"),
        "a.tfm:4: the versor is longer than 1, so it is no"},
       {"", file("VersorRigid3DTransform_double_3_3", "1 0 0 1 2"),
        "VersorRigid3DTransform_double_3_3 has 6 parameters, got 5"}},
      [](const auto& path) { read(path); });
}

}  // namespace itk_transform_test
