// SPDX-License-Identifier: Apache-2.0
// Seeds, landmarks and implants; and texts that ask for more work than their size allows, or choose names that harm.
#include <ctime>

#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/geometry/implant.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/meshes.hpp"
#include "tests/plugins/read/reading.hpp"

namespace fragments_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using ReadSeeds = InAFolder;
using ReadLandmarks = InAFolder;
using ReadImplant = InAFolder;

List<Seeds> seeds_at(const std::filesystem::path& path) { return list_by<Seeds>("read.seeds", path); }

TEST_F(ReadSeeds, FragmentsInTheirOrder) {
  put(folder / "s.yaml",
      "marrow-seeds: 1\nfragments:\n  proximal: {seeds: [[1, 2, 3]], register: false}\n  distal:\n    seeds:\n      - "
      "[4, 5, 6]\n      - [7, 8, 9]\n");
  const List<Seeds> value = seeds_at(folder / "s.yaml");
  EXPECT_EQ(value.names(), (std::vector<std::string>{"proximal", "distal"}));
  EXPECT_FALSE(value[0].wanted);
  EXPECT_TRUE(value[1].wanted);
  EXPECT_EQ(value[1].points_mm[1], Vector3d(7, 8, 9));
}

TEST_F(ReadSeeds, SeedsOfTheWristLieInBone) {
  const auto file = std::filesystem::path(MARROW_SOURCE_DIR) / "pipelines/wrist/radius.seeds.yaml";
  const List<Seeds> radius = seeds_at(file);
  EXPECT_EQ(radius.names(), std::vector<std::string>{"radius"});
  MARROW_NEED_DATA(data, "wrist/volumes/rad_dcm_cropped.tif");
  const Volume ct = files::read_volume_file(data, {{0.39625, 0.39625, 0.625}, {}, -1024, ""});
  for (const Vector3d& point : radius[0].points_mm)
    EXPECT_GT(sample_trilinear(ct.grid, ct.values, ct.grid.index_from_point(point)), 800);
}

std::string seeds_named(const std::string& name) {
  return "marrow-seeds: 1\nfragments:\n  " + name + ": {seeds: [[1, 2, 3]]}\n";
}

TEST_F(ReadSeeds, DiagnosesFaults) {
  const std::string one = "{seeds: [[1, 2, 3]]}";
  std::string aliases = "marrow-seeds: 1\nfragments:\n  a: &a {seeds: [", many = "marrow-seeds: 1\nfragments:\n",
              keys = "marrow-seeds: 1\n";
  for (int i = 0; i < 2000; ++i) aliases += "[1,2,3],";
  aliases += "[1,2,3]]}\n";
  for (int i = 0; i < 3000; ++i) aliases += "  b" + std::to_string(i) + ": *a\n";
  for (int i = 0; i < 2500; ++i) many += "  f" + std::to_string(i) + ": {seeds: [[1,2,3]]}\n";
  for (int i = 0; i < 6000; ++i) keys += "key" + std::to_string(i) + ": xx\n";
  const std::string no_end = "the file goes on after the end of its first document";
  expect_faults(folder / "s.yaml", seeds_named("a"),
                {{"", "marrow-seeds: 1\n", "key 'fragments' is missing"},
                 {"", "marrow-seeds: 1\nfragments: {}\n", "fragments: expected fragments by name"},
                 {"[[1, 2, 3]]", "[[1, 2]]",
                  "s.yaml:3:15: fragment 'a': seeds: expected a point [x, y, z] in mm, got a list of 2"},
                 {"seeds: [", "seed: [", "unknown key 'seed'; did you mean 'seeds'?"},
                 {one, one + "\n  a: " + one, "s.yaml:4:3: 'a' is given twice in fragments; the first is at line 3"},
                 {"", aliases, "s.yaml:3:6: anchors and aliases (&name, *name) are not read; write the value out"},
                 {"", ",", no_end},
                 {"", ",\na: 1\n", no_end},
                 {"", "a: 1\n---\nb: 2\n", no_end},
                 {"", keys, "unknown key 'key0'; known: marrow-seeds, fragments"},
                 {"", many, "there are more than 1000 of them"},
                 {"", seeds_named("\"a\\nb\""),
                  "s.yaml:3:3: the key 'a\\x0ab' in fragments holds a control character; write it without"},
                 {"", seeds_named("\"a\\eb\""), "the key 'a\\x1bb' in fragments holds a control character"},
                 {"", seeds_named("\"a\\u202eb\""), "the key 'a\\u202eb' in fragments holds a control character"},
                 {"", seeds_named("\"a\\0b\""), "s.yaml:3:3: a text holds the character NUL (\\0); take it out"},
                 {"", seeds_named("\"\""), "a name is empty"},
                 {"", seeds_named(std::string(101, 'n')), "a name has 101 bytes; at most 100 are taken"}},
                seeds_at);
  put(folder / "s.yaml", keys);
  const std::string said = message_of([&] { seeds_at(folder / "s.yaml"); });
  EXPECT_HAS(said, "\n... and 5951 more") << said.substr(0, 500);
  EXPECT_LT(said.size(), 20000u);
  put(folder / "s.yaml", "marrow-seeds: 1\n" + std::string(900, 'k') + ": 1\n");
  EXPECT_LT(message_of([&] { seeds_at(folder / "s.yaml"); }).size(), 1000u);
  put(folder / "s.yaml", seeds_named("R\xC3\xB6hrenknochen, distal"));
  EXPECT_EQ(seeds_at(folder / "s.yaml").name(0), "R\xC3\xB6hrenknochen, distal");
}

using Cases = InAFolder;

TEST_F(Cases, ThatHarm) {
  const std::filesystem::path here = folder / "case";
  EXPECT_SAYS(view_from(nullptr, {"a\n/b", folder / "a.png", folder / "a.yaml"}),
              "the name 'a\\x0a/b' of a view holds a character that cannot be printed; choose another");
  std::filesystem::create_directories(here / "real");
  write_itk(here / "real/ct.mha", filled<std::int16_t>({3, 3, 3}, 40));
  std::filesystem::create_directory_symlink("real", here / "ct");
  shipped::definition_of("read.case");  // so that loading its library does not count as reading
  std::string views = "views:\n";
  for (int i = 0; i < 1500; ++i) views += "  - {name: v" + std::to_string(i) + ", image: a.png, camera: a.yaml}\n";
  for (const auto& [text, said] :
       {std::pair<std::string, std::string>{"ct: ct/ct.mha\nviews: []\n",
                                            "ct: 'ct' is a link to a folder; move the folder itself there"},
        {"ct: real/ct.mha\nviews:\n  - {name: \"x\\ny\", image: a.png, camera: a.yaml}\n",
         "case.yaml:4:12: a view: name: the name of a view holds a character that cannot be printed"},
        {"ct: real/ct.mha\n" + views, "views: there are 1500; at most 1000 are read"}}) {
    put(here / "case.yaml", "marrow-case: 1\n" + text + "fragments: {a: {seeds: [[1, 2, 3]]}}\n");
    EXPECT_REFUSED(case_at(here), "case.yaml", said);
  }
  std::filesystem::rename(here / "case.yaml", folder / "case.yaml");
  std::filesystem::create_symlink("../case.yaml", here / "case.yaml");
  EXPECT_SAYS(case_at(here), "case.yaml: is a link to a place outside the folder");
}

// ---- landmarks

List<Landmarks> landmarks_at(const std::filesystem::path& path) { return list_by<Landmarks>("read.landmarks", path); }

TEST_F(ReadLandmarks, PointsWhereTheyAreSeenAndTracked) {
  put(folder / "l.yaml", R"(marrow-landmarks: 1
fragments:
  distal:
    points: {medial epicondyle: [1, 2, 3], lateral epicondyle: [-4, 5, 6.5]}
    seen:
      frontal: {medial epicondyle: [100.5, 200]}
      lateral: {lateral epicondyle: [10, 20], medial epicondyle: [30, 40, 1.5]}
    tracked: {lateral epicondyle: [7, 8, 9]}
  proximal:
    points: {head: [0, 0, 400]}
)");
  const List<Landmarks> read = landmarks_at(folder / "l.yaml");
  ASSERT_EQ(read.names(), (std::vector<std::string>{"distal", "proximal"}));
  ASSERT_EQ(read[0].points.size(), 2u);
  EXPECT_EQ(read[0].points[1].name, "lateral epicondyle");
  EXPECT_EQ(read[0].points[1].model_mm, Vector3d(-4, 5, 6.5));
  ASSERT_EQ(read[0].seen.size(), 3u);
  EXPECT_EQ(read[0].seen[0].view, "frontal");
  EXPECT_EQ(read[0].seen[2].name, "medial epicondyle");
  EXPECT_EQ(read[0].seen[2].pixel, Eigen::Vector2d(30, 40));
  EXPECT_EQ(read[0].seen[1].deviation_px, 0) << "not known";
  EXPECT_EQ(read[0].seen[2].deviation_px, 1.5);
  ASSERT_EQ(read[0].tracked.size(), 1u);
  EXPECT_EQ(read[0].tracked[0].world_mm, Vector3d(7, 8, 9));
  EXPECT_TRUE(read[1].seen.empty() && read[1].tracked.empty());
}

TEST_F(ReadLandmarks, ShowsAllFaultsAtOnce) {
  put(folder / "l.yaml", R"(marrow-landmarks: 1
fragments:
  distal:
    points: {medial: [1, 2], lateral: [-4, 5, 6], lateral: [0, 0, 0]}
    seen:
      frontal: {medail: [100, 200], lateral: [1, 2, 3, 4]}
      lateral: {lateral: [1, 2, 0]}
    traked: {}
    tracked: {patella: [7, 8, 9]}
  proximal: {seen: {}}
)");
  const std::string said = message_of([&] { landmarks_at(folder / "l.yaml"); });
  for (const char* part :
       {"l.yaml:4:22: fragment 'distal', points: medial: expected 3 numbers [x, y, z], got a list of 2",
        "l.yaml:4:51: 'lateral' is given twice in fragment 'distal', points; the first is at line 4",
        "l.yaml:6:25: fragment 'distal', seen, view 'frontal': the points have no 'medail'; did you mean 'medial'?",
        "l.yaml:6:46: fragment 'distal', seen, view 'frontal': lateral: expected [u, v] or [u, v, deviation_px], got "
        "a list of 4",
        "l.yaml:7:26: fragment 'distal', seen, view 'lateral': lateral: its deviation must be greater than 0 px, got "
        "0; leave it out if it is not known",
        "l.yaml:8:5: fragment 'distal': unknown key 'traked'; did you mean 'tracked'?",
        "l.yaml:9:24: fragment 'distal', tracked: the points have no 'patella'; give its place in the CT under "
        "'points'",
        "l.yaml:10:13: fragment 'proximal': key 'points' is missing"})
    EXPECT_HAS(said, part) << part << "\nit said:\n" << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 15) << "8 faults, a line of the file under each:\n" << said;
}

// Many unknown points: only the first fifty are reported, without comparing all names with each other.
TEST_F(ReadLandmarks, ManyNamesTakeNoLongTime) {
  std::string points, tracked;
  for (int i = 0; i < 9000; ++i) {
    const std::string number = std::to_string(i), point = number + ": [1, 2, 3]";
    points += (i ? ", p" : "p") + point;
    tracked += (i ? ", q" : "q") + point;
  }
  put(folder / "l.yaml",
      "marrow-landmarks: 1\nfragments: {a: {points: {" + points + "}, tracked: {" + tracked + "}}}\n");
  const std::clock_t begin = std::clock();
  const std::string said = message_of([&] { landmarks_at(folder / "l.yaml"); });
  EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 20);
  EXPECT_HAS(said, "there are more than 1000 of them") << said.substr(0, 1000);
  EXPECT_HAS(said, " more");
  EXPECT_LT(said.size(), 20000u);
}

TEST_F(ReadLandmarks, FilesOfAnotherKindAreRefused) {
  const std::string version = "marrow-landmarks: 1", fragments = "{a: {points: {b: [1, 2, 3]}}}";
  expect_faults(
      folder / "l.yaml", version + "\nfragments: " + fragments + "\n",
      {{version, "marrow-seeds: 1", "key 'marrow-landmarks' is missing"},
       {version, "marrow-landmarks: 2", "reads version 1, the file is of version 2"},
       {fragments, "{}", "fragments: expected fragments by name, got none"},
       {fragments, "{a: {points: {}}}", "fragment 'a': points: expected places [x, y, z] in mm by name, got none"},
       {fragments, "[a]", "fragments: expected keys and values, got a list of 1"}},
      landmarks_at);
}

// ---- implants

TEST_F(ReadImplant, SurfaceAndHoles) {
  const shipped::Options options{{"holes", (folder / "holes.yaml").string()},
                                 {"surface", (folder / "nail.stl").string()}};
  const auto read = [&] { return shipped::call("read.implant", {}, options).at("implant").as<geometry::Implant>(); };
  put(folder / "nail.stl", stl_text("a", {40, 60, 90}));
  const std::string good = R"(marrow-implant: 1
holes:
  distal: {centre_mm: [1, 2, 30], axis: [2, 0, 0], diameter_mm: 5.2}
  oblique: {centre_mm: [0, 0, 45], axis: [0, 3, 4], diameter_mm: 4}
)";
  put(folder / "holes.yaml", good);
  const geometry::Implant implant = read();
  ASSERT_EQ(implant.holes.size(), 2u);
  EXPECT_EQ(implant.holes[0].name, "distal");
  EXPECT_EQ(implant.holes[0].centre_mm, Vector3d(1, 2, 30));
  EXPECT_EQ(implant.holes[0].axis, Vector3d(1, 0, 0));
  EXPECT_EQ(implant.holes[0].diameter_mm, 5.2);
  EXPECT_TRUE(implant.holes[1].axis.isApprox(Vector3d(0, 0.6, 0.8), 1e-12));
  EXPECT_EQ(implant.surface.triangles.size(), 4u);
  EXPECT_EQ(implant.surface.frame, "implant");
  expect_faults(folder / "holes.yaml", good,
                {{"", "marrow-implant: 1\nholes: {}\n",
                  "holes: expected holes by name, got none; an implant without holes cannot be locked"},
                 {"[2, 0, 0]", "[0, 0, 0]", "axis: expected a direction, such as [1, 0, 0], got one of length 0"},
                 {"diameter_mm: 4", "diameter_mm: 0", "diameter_mm: expected more than 0, got 0.000000"}},
                [&](const auto&) { read(); });
  put(folder / "nail.stl", stl_text("a", {40, 60, 90}, 3));
  EXPECT_SAYS(read(), "nail.stl: the surface is open or not consistently oriented, so it has no inside");
}

}  // namespace fragments_test
