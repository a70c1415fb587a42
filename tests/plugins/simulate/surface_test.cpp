// SPDX-License-Identifier: Apache-2.0
// Bones from files of surfaces.
#include <fstream>

#include "marrow/base/temporary_folder.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::surface_test {

using simulated::Bone;
using namespace simulated;

// Bones from files of surfaces.

namespace fs = std::filesystem;

/// A surface as the text of an STL file.
std::string stl(const Mesh& mesh, bool ascii = false) {
  std::ostringstream file;
  const auto bytes = [&](const auto& value, std::size_t count) {
    file.write(reinterpret_cast<const char*>(value), std::streamsize(count));
  };
  const std::uint32_t count = std::uint32_t(mesh.triangles.size());
  if (ascii)
    file << "solid bone\n";
  else
    file << std::string(80, ' '), bytes(&count, 4);
  for (const auto& t : mesh.triangles) {
    file << (ascii ? "facet normal 0 0 0\nouter loop\n" : std::string(12, '\0'));
    for (std::uint32_t corner : t) {
      const Eigen::Vector3f p = mesh.vertices_mm[corner].cast<float>();
      if (ascii)
        file << "vertex " << p.x() << " " << p.y() << " " << p.z() << "\n";
      else
        bytes(p.data(), 12);
    }
    file << (ascii ? "endloop\nendfacet\n" : std::string(2, '\0'));
  }
  return file.str() + (ascii ? "endsolid bone\n" : "");
}
std::string stl_of_box(const Vector3d& low_mm, const Vector3d& high_mm) { return stl(box_between(low_mm, high_mm)); }

Bone bone_of(const Options& options) { return output<Bone>("simulate.surface", "bone", {}, options); }

class SimulateSurface : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder.path() / name, std::ios::binary) << text;
    return folder.path() / name;
  }
  /// Options that read a file with this text.
  Options reading(const std::string& text, const std::string& name = "bone.stl") const {
    return {{"outer", write(name, text).string()}};
  }
  std::string message(const std::string& name) const {
    return refusal("simulate.surface", {}, {{"outer", (folder.path() / name).string()}});
  }
  std::string message(const std::string& name, const std::string& text) const {
    write(name, text);
    return message(name);
  }
  std::string in_folder(const std::string& text) const { return (folder.path() / text).string(); }
  const TemporaryFolder folder{new_temporary_folder("test")};
};

TEST_F(SimulateSurface, ReadsBinaryAndAsciiStlScalesAndTurns) {
  const Mesh box = box_between({0, 0, 0}, {0.4, 0.05, 0.03});  // metres, long axis along x
  for (bool ascii : {false, true}) {
    const Bone bone = bone_of(
        with(reading(stl(box, ascii)),
             {{"scale", 1000.0}, {"rotation_deg", Numbers{0, -90, 0}}, {"isocentre_from_distal_end_mm", 100.0}}));
    EXPECT_EQ(bone.outer.vertices_mm.size(), 8u);
    EXPECT_NEAR(enclosed_volume_mm3(bone.outer), 400.0 * 50 * 30, 1);
    EXPECT_NEAR(extent(bone.outer).min().z(), -100, 1e-3);
    EXPECT_NEAR(extent(bone.outer).max().z(), 300, 1e-3);
    EXPECT_NEAR(bone.fill_z_mm.front(), -100, 1e-3);
    EXPECT_NEAR(bone.fill_z_mm.back(), 300, 1e-3);
  }
}

TEST_F(SimulateSurface, BadFilesAreExplained) {
  EXPECT_EQ(message("missing.stl"), in_folder("missing.stl: there is no such file"));
  fs::create_directories(folder.path() / "folder.stl");
  fs::create_symlink("/dev/zero", folder.path() / "zero.stl");
  for (const std::string none : {"folder.stl", "zero.stl"})
    EXPECT_EQ(message(none), in_folder(none + ": expected a file, this is none"));
  const Mesh box = box_between({0, 0, 0}, {10, 10, 100});
  EXPECT_EQ(message("truncated.stl", stl(box).substr(0, 300)),
            in_folder("truncated.stl: its header claims 12 triangles, but the file has room for 4; it is cut off, or "
                      "no STL"));
  EXPECT_EQ(message("empty.stl", ""), in_folder("empty.stl: the file is empty"));
  EXPECT_EQ(message("words.stl", "solid x\nfacet\nvertex 1 2 three\n"),
            in_folder("words.stl: a facet is not three lines 'vertex x y z'; the file is cut off or damaged"));
  EXPECT_HAS(message("open.stl", stl(opened(box))), "the surface is open");
  EXPECT_EQ(message("lying.stl", stl_of_box({0, 0, 0}, {100, 10, 10})),
            "simulate.surface: the bone's long axis must lie along z with the distal end low, but it extends "
            "100.000000 x 10.000000 x 10.000000 mm; turn it with rotation_deg");
}

TEST_F(SimulateSurface, ABoneWithoutALongAxisMayLieAnyhow) {
  const Bone bone = bone_of(with(reading(stl_of_box({0, 0, 0}, {100, 10, 20})), {{"long_bone", false}}));
  EXPECT_NEAR(enclosed_volume_mm3(bone.outer), 100.0 * 10 * 20, 1e-3);
}

// A box whose cortex is 3 mm in its lower half, 6 mm in its upper half, and changes within 1 mm.
TEST_F(SimulateSurface, TheCortexMayBeGivenByItsThickness) {
  Options options = with(reading(stl_of_box({0, 0, 0}, {40, 30, 100})), {{"fill_at", Numbers{0, 0.495, 0.505, 1}},
                                                                         {"fill_fraction", Numbers{0.2, 0.2, 0.1, 0.1}},
                                                                         {"cortex_mm", Numbers{3, 3, 6, 6}},
                                                                         {"isocentre_from_distal_end_mm", 0.0}});
  const Bone bone = bone_of(options);
  EXPECT_TRUE(is_closed(bone.inner));
  // The distance field has corners, which trilinear interpolation rounds a little.
  EXPECT_NEAR(enclosed_volume_mm3(bone.inner), 34.0 * 24 * 47 + 28.0 * 18 * 44, 0.01 * 34 * 24 * 94);
  const Eigen::AlignedBox3d inside = extent(bone.inner);
  EXPECT_NEAR(inside.min().z(), 3, 0.1);
  EXPECT_NEAR(inside.max().z(), 94, 0.1);
  EXPECT_NEAR(inside.sizes().x(), 34, 0.2);

  options["cortex_mm"] = Numbers{20, 20, 20, 20};
  EXPECT_EQ(refusal("simulate.surface", {}, options),
            "simulate.surface: the bone is nowhere thicker than twice its cortex; give a smaller cortex_mm");
  options["inner"] = options["outer"];
  EXPECT_EQ(refusal("simulate.surface", {}, options),
            "simulate.surface: the inner surface is given by a file and by cortex_mm; give one of them");
}

TEST_F(SimulateSurface, TheInnerSurfaceMayBeGivenByAFile) {
  const fs::path inner = write("inner.stl", stl_of_box({5, 5, 5}, {35, 25, 95}));
  const Bone bone = bone_of(with(reading(stl_of_box({0, 0, 0}, {40, 30, 100})), {{"inner", inner.string()}}));
  EXPECT_NEAR(enclosed_volume_mm3(bone.outer), 40.0 * 30 * 100, 1e-3);
  EXPECT_NEAR(enclosed_volume_mm3(bone.inner), 30.0 * 20 * 90, 1e-3);
}

TEST_F(SimulateSurface, DeclaresAShareOfBoneForEachHeight) {
  EXPECT_TRUE(declares("simulate.surface", same_length({"fill_at", "fill_fraction"})));
  EXPECT_TRUE(declares("simulate.surface", as_many_or_none("cortex_mm", "fill_at")));
}

TEST_F(SimulateSurface, RealFemurIsAHollowBone) {
  const fs::path femur = fs::path(MARROW_SOURCE_DIR) / "../shared/data/femur";
  if (!fs::exists(femur / "femur.stl")) GTEST_SKIP() << "the real femur is not at " << femur;
  const Bone bone =
      bone_of({{"outer", (femur / "femur.stl").string()}, {"inner", (femur / "femur_cortex.stl").string()}});
  EXPECT_EQ(bone.outer.triangles.size(), 20308u);
  EXPECT_LT(enclosed_volume_mm3(bone.inner), enclosed_volume_mm3(bone.outer));
  EXPECT_GT(enclosed_volume_mm3(bone.inner), 0.3 * enclosed_volume_mm3(bone.outer));
}

/// A cylinder beside the z axis, whose triangles are small against the fracture.
Mesh tube(double radius_mm, double half_mm) {
  return phantom::polygonise(
      [=](const Vector3d& p) { return std::max(std::hypot(p.x() - 3, p.y()) - radius_mm, std::abs(p.z()) - half_mm); },
      {-20, -20, -104}, {26, 20, 104}, 1.1, 1.5);
}
const Bone& shaft() {
  static const Bone made = [] {
    Bone bone;
    bone.outer = tube(14, 100), bone.inner = tube(6, 94);
    return bone;
  }();
  return made;
}

/// Points of the surface along which a bone breaks, on a raster. The floor of the block below lies 5 mm deeper.
std::vector<Vector3d> relief(const Bone& bone, const Options& options) {
  const Mesh surface = fracture(bone, options).fracture;
  std::vector<Vector3d> points = surface.vertices_mm;
  std::erase_if(points, [floor = extent(surface).min().z()](const auto& point) { return point.z() < floor + 2; });
  EXPECT_GT(points.size(), 1000u);
  return points;
}

TEST(SimulateFracture, CentreOfAnOutlineIsExact) {
  const Eigen::AlignedBox3d all = extent(shaft().outer);
  // A smooth fracture contains the centre of the outline at its height. Here it rises by 1 mm per mm.
  const Options options{
      {"height_fraction", (12.34 - all.min().z()) / all.sizes().z()}, {"obliquity_deg", 45.0}, {"roughness_mm", 0.0}};
  for (const auto& point : relief(shaft(), with(options, {{"direction_deg", 0.0}})))
    ASSERT_NEAR(point.x() - (point.z() - 12.34), 3, 0.02);
  for (const auto& point : relief(shaft(), with(options, {{"direction_deg", 90.0}})))
    ASSERT_NEAR(point.y() - (point.z() - 12.34), 0, 0.02);
}

TEST(SimulateFracture, CutsAtItsLevelWithItsObliquity) {
  const Mesh surface =
      fracture(shaft(),
               {{"height_fraction", 0.4}, {"obliquity_deg", 30.0}, {"direction_deg", 0.0}, {"roughness_mm", 0.0}})
          .fracture;
  EXPECT_TRUE(is_closed(surface));
  EXPECT_GT(enclosed_volume_mm3(surface), 0);
  double below = -1e9, above = 1e9;  // the surface's height at the axis and 10 mm to the left
  for (const auto& vertex : surface.vertices_mm) {
    if (std::hypot(vertex.x() - 3, vertex.y()) < 0.6) below = std::max(below, vertex.z());
    if (std::hypot(vertex.x() - 13, vertex.y()) < 0.6) above = std::min(above, vertex.z() > -100 ? vertex.z() : 1e9);
  }
  EXPECT_NEAR(below, -100 + 0.4 * 200, 0.6);
  EXPECT_NEAR(above, -20 + 10 * std::tan(kPi / 6), 0.6);
}

TEST(SimulateFracture, RoughnessIsItsRootMeanSquareAndItsSeedChangesIt) {
  Bone block;  // much wider than the longest waves of the relief, 40 mm
  block.outer = box_between({-60, -60, -100}, {60, 60, 100});
  const auto surface = [&](int seed) {
    return relief(block,
                  {{"obliquity_deg", 0.0}, {"roughness_mm", 1.5}, {"height_fraction", 0.5}, {"fracture_seed", seed}});
  };
  double squares = 0;
  std::size_t count = 0;
  for (int seed = 1; seed <= 40; ++seed)
    for (const auto& point : surface(seed)) squares += point.z() * point.z(), ++count;
  EXPECT_NEAR(std::sqrt(squares / double(count)), 1.5, 0.1);
  const auto one = surface(1), two = surface(2);
  ASSERT_EQ(one.size(), two.size());
  const std::size_t middle = one.size() / 2;
  EXPECT_EQ(one[middle].head<2>(), two[middle].head<2>());
  EXPECT_NE(one[middle].z(), two[middle].z());
}

TEST(SimulateFracture, MotionIsAboutTheFragmentsOwnAxes) {
  const Phantom phantom = fracture(shaft(), {{"rotation_deg", Numbers{2, -3, 40}},
                                             {"translation_mm", Numbers{4, 5, -6}},
                                             {"ct_gap_mm", Numbers{0.5, 0, -2}}});
  ASSERT_EQ(phantom.fragments.size(), 2u);
  EXPECT_EQ(phantom.fragments[0].name, "proximal");
  EXPECT_EQ(phantom.fragments[1].name, "distal");
  const Fragment& distal = phantom.fragments[1];
  const Vector6d motion = motion_between(placed({0, 0, 0}), distal.world_from_ct, distal.frame);
  EXPECT_LT((motion - Vector6d{radians(2), radians(-3), radians(40), 4, 5, -6}).norm(), 1e-9);
  // The distal shaft reaches from -100 to -10 (level 0.45): its wall of 7917 mm2 around -55 and its cap of 616 mm2 at
  // -100 have their centre at -58.2, and the gap is 2. The cut rises by tan 30 cos 30 = 0.5 along x, which moves the
  // centre of the wall by 0.5 14^2 / (2 90) = 0.54; its share is 0.93.
  EXPECT_NEAR(distal.frame.origin_mm.z(), -58.2 - 2, 0.3);
  EXPECT_NEAR(distal.frame.origin_mm.x(), 3.5 + 0.5, 0.05);
  EXPECT_NEAR(distal.frame.axes(2, 2), 1, 2e-3);
  EXPECT_EQ(distal.ct_from_bone.translation_mm, Vector3d(0.5, 0, -2));
  EXPECT_EQ(phantom.fragments[0].world_from_ct.translation_mm, Vector3d::Zero());
  EXPECT_EQ(phantom.fragments[0].world_from_ct.rotation, Matrix3d::Identity());
}

TEST(SimulateFracture, SeedsLieInTheirOwnFragmentsCortex) {
  for (const Fragment& fragment : fracture(shaft(), {{"ct_gap_mm", Numbers{0, 0, -2}}}).fragments) {
    EXPECT_GE(fragment.seeds_mm.size(), 8u) << fragment.name;
    for (const auto& seed : fragment.seeds_mm) {
      const Vector3d in_bone = inverse(fragment.ct_from_bone) * seed;
      const double radius = std::hypot(in_bone.x() - 3, in_bone.y());
      EXPECT_GT(radius, 8);
      EXPECT_LT(radius, 12);
      const double height = in_bone.z() + 10;  // over the fracture's centre; at radius 12 it rises by 7 mm
      if (fragment.side < 0)
        EXPECT_LT(height, 11);
      else
        EXPECT_GT(height, -11);
    }
  }
}

TEST(SimulateFracture, BadInputIsExplained) {
  const auto refused = [](const Bone& bone, const Options& options = {}) {
    return refusal("simulate.fracture", {{"bone", item(bone)}}, options);
  };
  Bone bad = shaft();
  bad.outer = opened(bad.outer);
  EXPECT_EQ(refused(bad),
            "simulate.fracture, outer surface: the surface is open or not consistently oriented, so it has no inside; "
            "close its holes (each edge must be shared by exactly two triangles)");
  bad = shaft();
  for (auto& triangle : bad.outer.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_HAS(refused(bad), "the triangles face inward");
  bad = shaft();
  bad.fill_fraction = {0.1, 0.2};
  EXPECT_EQ(refused(bad), "simulate.fracture: the bone share needs as many positions as values, got 1 and 2");
  EXPECT_EQ(refused(shaft(), {{"height_fraction", 1.2}}),
            "simulate.fracture: the height_fraction 1.200000 must lie in 0.1 to 0.9 of the bone's length");
}

}  // namespace marrow::test::surface_test
