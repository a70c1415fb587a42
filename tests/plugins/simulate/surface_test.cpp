// SPDX-License-Identifier: Apache-2.0
// Bones from files of surfaces.
#include "tests/harness/temporary_folder.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::surface_test {

namespace fs = std::filesystem;
using simulated::Bone;

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
  /// Options that read a file with this text.
  Options reading(const std::string& text, const std::string& name = "bone.stl") const {
    return {{"outer", folder.write(name, text).string()}};
  }
  std::string message(const std::string& name) const {
    return refusal("simulate.surface", {}, {{"outer", (folder / name).string()}});
  }
  std::string message(const std::string& name, const std::string& text) const {
    folder.write(name, text);
    return message(name);
  }
  std::string in_folder(const std::string& text) const { return (folder.path / text).string(); }
  TemporaryFolder folder;
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
  fs::create_directories(folder / "folder.stl");
  fs::create_symlink("/dev/zero", folder / "zero.stl");
  for (const std::string none : {"folder.stl", "zero.stl"})
    EXPECT_EQ(message(none), in_folder(none + ": expected a file, this is none"));
  const Mesh box = box_between({0, 0, 0}, {10, 10, 100});
  EXPECT_EQ(message("truncated.stl", stl(box).substr(0, 300)),
            in_folder("truncated.stl: its header claims 12 triangles, but the file has room for 4; it is cut off, or "
                      "no STL"));
  EXPECT_EQ(message("empty.stl", ""), in_folder("empty.stl: the file is empty"));
  EXPECT_EQ(message("words.stl", "solid x\nfacet\nvertex 1 2 three\n"),
            in_folder("words.stl: a facet is not three lines 'vertex x y z'; the file is cut off or damaged"));
  EXPECT_NE(message("open.stl", stl(opened(box))).find("the surface is open"), std::string::npos);
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
  const fs::path inner = folder.write("inner.stl", stl_of_box({5, 5, 5}, {35, 25, 95}));
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

}  // namespace marrow::test::surface_test
