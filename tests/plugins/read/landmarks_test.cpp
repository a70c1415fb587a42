// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ctime>

#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace landmarks_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

shipped::Options at(const std::filesystem::path& path) { return {{"path", path.string()}}; }

TEST(ReadLandmarks, PointsWhereTheyAreSeenAndTracked) {
  const TemporaryFolder folder;
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
  const auto outputs = shipped::call("read.landmarks", {}, at(folder / "l.yaml"));
  const marrow::List<marrow::Landmarks> read = outputs.at("landmarks").as_list<marrow::Landmarks>();
  ASSERT_EQ(read.names(), (std::vector<std::string>{"distal", "proximal"}));
  ASSERT_EQ(read[0].points.size(), 2u);
  EXPECT_EQ(read[0].points[1].name, "lateral epicondyle");
  EXPECT_EQ(read[0].points[1].model_mm, Eigen::Vector3d(-4, 5, 6.5));
  ASSERT_EQ(read[0].seen.size(), 3u);
  EXPECT_EQ(read[0].seen[0].view, "frontal");
  EXPECT_EQ(read[0].seen[2].name, "medial epicondyle");
  EXPECT_EQ(read[0].seen[2].pixel, Eigen::Vector2d(30, 40));
  EXPECT_EQ(read[0].seen[1].deviation_px, 0) << "not known";
  EXPECT_EQ(read[0].seen[2].deviation_px, 1.5);
  ASSERT_EQ(read[0].tracked.size(), 1u);
  EXPECT_EQ(read[0].tracked[0].world_mm, Eigen::Vector3d(7, 8, 9));
  EXPECT_TRUE(read[1].seen.empty() && read[1].tracked.empty());
}

TEST(ReadLandmarks, ShowsAllFaultsAtOnce) {
  const TemporaryFolder folder;
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
  const std::string said = shipped::refusal("read.landmarks", {}, at(folder / "l.yaml"));
  for (const char* part :
       {"l.yaml:4:22: fragment 'distal', points: medial: expected 3 numbers [x, y, z], got a list of 2",
        "l.yaml:4:51: 'lateral' is given twice in fragment 'distal', points; the first is at line 4",
        "l.yaml:6:25: fragment 'distal', seen, view 'frontal': the points have no 'medail'; did you mean 'medial'?",
        "l.yaml:6:46: fragment 'distal', seen, view 'frontal': lateral: expected [u, v] or [u, v, deviation_px], got "
        "a list of 4",
        "l.yaml:7:26: fragment 'distal', seen, view 'lateral': lateral: its deviation must be greater than 0 px, got "
        "0; "
        "leave it out if it is not known",
        "l.yaml:8:5: fragment 'distal': unknown key 'traked'; did you mean 'tracked'?",
        "l.yaml:9:24: fragment 'distal', tracked: the points have no 'patella'; give its place in the CT under "
        "'points'",
        "l.yaml:10:13: fragment 'proximal': key 'points' is missing"})
    EXPECT_NE(said.find(part), std::string::npos) << part << "\nit said:\n" << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 15) << "8 faults, a line of the file under each:\n" << said;
}

// Many unknown points: only the first fifty are reported, without comparing all names with each other.
TEST(ReadLandmarks, ManyNamesTakeNoLongTime) {
  const TemporaryFolder folder;
  std::string points, tracked;
  for (int i = 0; i < 9000; ++i) {
    const std::string number = std::to_string(i);
    points += (i ? ", p" : "p") + number + ": [1, 2, 3]";
    tracked += (i ? ", q" : "q") + number + ": [1, 2, 3]";
  }
  put(folder / "l.yaml",
      "marrow-landmarks: 1\nfragments: {a: {points: {" + points + "}, tracked: {" + tracked + "}}}\n");
  const std::clock_t begin = std::clock();
  const std::string said = shipped::refusal("read.landmarks", {}, at(folder / "l.yaml"));
  EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 20);
  EXPECT_NE(said.find("there are more than 1000 of them"), std::string::npos) << said.substr(0, 1000);
  EXPECT_NE(said.find(" more"), std::string::npos);
  EXPECT_LT(said.size(), 20000u);
}

TEST(ReadLandmarks, RefusesFilesOfAnotherKind) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    put(folder / "l.yaml", text);
    return shipped::refusal("read.landmarks", {}, at(folder / "l.yaml"));
  };
  EXPECT_NE(
      refusal("marrow-seeds: 1\nfragments: {a: {points: {b: [1, 2, 3]}}}\n").find("key 'marrow-landmarks' is missing"),
      std::string::npos);
  EXPECT_NE(refusal("marrow-landmarks: 2\nfragments: {a: {points: {b: [1, 2, 3]}}}\n")
                .find("reads version 1, the file is of version 2"),
            std::string::npos);
  EXPECT_NE(refusal("marrow-landmarks: 1\nfragments: {}\n").find("fragments: expected fragments by name, got none"),
            std::string::npos);
  EXPECT_NE(refusal("marrow-landmarks: 1\nfragments: {a: {points: {}}}\n")
                .find("fragment 'a': points: expected places [x, y, z] in mm by name, got none"),
            std::string::npos);
  EXPECT_NE(
      refusal("marrow-landmarks: 1\nfragments: [a]\n").find("fragments: expected keys and values, got a list of 1"),
      std::string::npos);
}

}  // namespace landmarks_test
