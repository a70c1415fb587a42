// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "marrow/toolbox/phantom/phantom.hpp"
#include "shapes.hpp"
#include "shipped.hpp"

namespace surface_test {

namespace fs = std::filesystem;
using namespace marrow;
using phantom::Bone;
namespace test = phantom::test;

fs::path write_stl(const std::string& name, const Mesh& mesh, bool ascii) {
  const fs::path path = fs::path(testing::TempDir()) / name;
  std::ofstream file(path, std::ios::binary);
  if (ascii)
    file << "solid bone\n";
  else
    file << std::string(80, ' ');
  const std::uint32_t count = std::uint32_t(mesh.triangles.size());
  if (!ascii) file.write(reinterpret_cast<const char*>(&count), 4);
  for (const auto& t : mesh.triangles) {
    if (ascii)
      file << "facet normal 0 0 0\nouter loop\n";
    else
      file.write(std::string(12, '\0').data(), 12);
    for (std::uint32_t corner : t) {
      const Eigen::Vector3f p = mesh.vertices_mm[corner].cast<float>();
      if (ascii)
        file << "vertex " << p.x() << " " << p.y() << " " << p.z() << "\n";
      else
        file.write(reinterpret_cast<const char*>(p.data()), 12);
    }
    if (ascii)
      file << "endloop\nendfacet\n";
    else
      file.write("\0\0", 2);
  }
  if (ascii) file << "endsolid bone\n";
  return path;
}

shipped::Options reading(const fs::path& path) { return {{"outer", path.string()}}; }

Bone surface(const shipped::Options& options) {
  return shipped::call("simulate.surface", {}, options).at("bone").as<Bone>();
}

TEST(SimulateSurface, ReadsBinaryAndAsciiStlScalesAndTurns) {
  const Mesh box = test::box({0, 0, 0}, {0.4, 0.05, 0.03});  // metres, long axis along x
  for (bool ascii : {false, true}) {
    shipped::Options options = reading(write_stl(ascii ? "ascii.stl" : "binary.stl", box, ascii));
    options["scale"] = 1000.0;
    options["rotation_deg"] = std::vector<double>{0, -90, 0};
    options["isocentre_from_distal_end_mm"] = 100.0;
    const Bone bone = surface(options);
    EXPECT_EQ(bone.outer.vertices_mm.size(), 8u);
    EXPECT_NEAR(enclosed_volume_mm3(bone.outer), 400.0 * 50 * 30, 1);
    double low = 1e9, high = -1e9;
    for (const auto& p : bone.outer.vertices_mm) low = std::min(low, p.z()), high = std::max(high, p.z());
    EXPECT_NEAR(low, -100, 1e-3);
    EXPECT_NEAR(high, 300, 1e-3);
    EXPECT_NEAR(bone.fill_z_mm.front(), -100, 1e-3);
    EXPECT_NEAR(bone.fill_z_mm.back(), 300, 1e-3);
  }
}

TEST(SimulateSurface, BadFilesAreExplained) {
  const auto message = [](const shipped::Options& options) {
    return marrow::test::message_of([&] { surface(options); });
  };
  const fs::path folder = testing::TempDir();
  EXPECT_EQ(message(reading(folder / "missing.stl")), (folder / "missing.stl").string() + ": there is no such file");
  fs::create_directories(folder / "folder.stl");
  fs::remove(folder / "zero.stl");
  fs::create_symlink("/dev/zero", folder / "zero.stl");
  for (const char* none : {"folder.stl", "zero.stl"})
    EXPECT_EQ(message(reading(folder / none)), (folder / none).string() + ": expected a file, this is none");
  const Mesh box = test::box({0, 0, 0}, {10, 10, 100});
  const fs::path truncated = write_stl("truncated.stl", box, false);
  fs::resize_file(truncated, 300);
  EXPECT_EQ(
      message(reading(truncated)),
      truncated.string() + ": its header claims 12 triangles, but the file has room for 4; it is cut off, or no STL");
  std::ofstream(folder / "empty.stl");
  EXPECT_EQ(message(reading(folder / "empty.stl")), (folder / "empty.stl").string() + ": the file is empty");
  std::ofstream(folder / "words.stl") << "solid x\nfacet\nvertex 1 2 three\n";
  EXPECT_EQ(
      message(reading(folder / "words.stl")),
      (folder / "words.stl").string() + ": a facet is not three lines 'vertex x y z'; the file is cut off or damaged");
  Mesh open = box;
  open.triangles.pop_back();
  EXPECT_NE(message(reading(write_stl("open.stl", open, false))).find("the surface is open"), std::string::npos);
  EXPECT_EQ(message(reading(write_stl("lying.stl", test::box({0, 0, 0}, {100, 10, 10}), false))),
            "simulate.surface: the bone's long axis must lie along z with the distal end low, but it extends "
            "100.000000 x 10.000000 x "
            "10.000000 mm; turn it with rotation_deg");
}

TEST(SimulateSurface, ABoneWithoutALongAxisMayLieAnyhow) {
  shipped::Options options = reading(write_stl("flat.stl", test::box({0, 0, 0}, {100, 10, 20}), false));
  options["long_bone"] = false;
  EXPECT_NEAR(enclosed_volume_mm3(surface(options).outer), 100.0 * 10 * 20, 1e-3);
}

// A box whose cortex is 3 mm in its lower half, 6 mm in its upper half, and changes within 1 mm.
TEST(SimulateSurface, TheCortexMayBeGivenByItsThickness) {
  shipped::Options options = reading(write_stl("box.stl", test::box({0, 0, 0}, {40, 30, 100}), false));
  options["fill_at"] = std::vector<double>{0, 0.495, 0.505, 1};
  options["fill_fraction"] = std::vector<double>{0.2, 0.2, 0.1, 0.1};
  options["cortex_mm"] = std::vector<double>{3, 3, 6, 6};
  options["isocentre_from_distal_end_mm"] = 0.0;
  const Bone bone = surface(options);
  EXPECT_TRUE(is_closed(bone.inner));
  // The distance field has corners, which trilinear interpolation rounds a little.
  EXPECT_NEAR(enclosed_volume_mm3(bone.inner), 34.0 * 24 * 47 + 28.0 * 18 * 44, 0.01 * 34 * 24 * 94);
  const Eigen::AlignedBox3d inside = phantom::test::extent(bone.inner, [](const auto&) { return true; });
  EXPECT_NEAR(inside.min().z(), 3, 0.1);
  EXPECT_NEAR(inside.max().z(), 94, 0.1);
  EXPECT_NEAR(inside.sizes().x(), 34, 0.2);

  options["cortex_mm"] = std::vector<double>{20, 20, 20, 20};
  EXPECT_EQ(marrow::test::message_of([&] { surface(options); }),
            "simulate.surface: the bone is nowhere thicker than twice its cortex; give a smaller cortex_mm");
  options["inner"] = options["outer"];
  EXPECT_EQ(marrow::test::message_of([&] { surface(options); }),
            "simulate.surface: the inner surface is given by a file and by cortex_mm; give one of them");
}

TEST(SimulateSurface, TheInnerSurfaceMayBeGivenByAFile) {
  shipped::Options options = reading(write_stl("outer.stl", test::box({0, 0, 0}, {40, 30, 100}), false));
  options["inner"] = write_stl("inner.stl", test::box({5, 5, 5}, {35, 25, 95}), false).string();
  const Bone bone = surface(options);
  EXPECT_NEAR(enclosed_volume_mm3(bone.outer), 40.0 * 30 * 100, 1e-3);
  EXPECT_NEAR(enclosed_volume_mm3(bone.inner), 30.0 * 20 * 90, 1e-3);
}

TEST(SimulateSurface, DeclaresAShareOfBoneForEachHeight) {
  EXPECT_TRUE(shipped::declares("simulate.surface", same_length({"fill_at", "fill_fraction"})));
  EXPECT_TRUE(shipped::declares("simulate.surface", as_many_or_none("cortex_mm", "fill_at")));
}

TEST(SimulateSurface, RealFemurIsAHollowBone) {
  const fs::path folder = fs::path(MARROW_SOURCE_DIR) / "../shared/data/femur";
  if (!fs::exists(folder / "femur.stl")) GTEST_SKIP() << "the real femur is not at " << folder;
  shipped::Options options = reading(folder / "femur.stl");
  options["inner"] = (folder / "femur_cortex.stl").string();
  const Bone bone = surface(options);
  EXPECT_EQ(bone.outer.triangles.size(), 20308u);
  EXPECT_LT(enclosed_volume_mm3(bone.inner), enclosed_volume_mm3(bone.outer));
  EXPECT_GT(enclosed_volume_mm3(bone.inner), 0.3 * enclosed_volume_mm3(bone.outer));
}

}  // namespace surface_test
