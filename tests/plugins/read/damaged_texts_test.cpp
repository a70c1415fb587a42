// SPDX-License-Identifier: Apache-2.0
// Damaged texts, and texts that grow without end: cameras, boards, points, poses, seeds and whole cases.
#include <gtest/gtest.h>

#include "marrow/camera/points_file.hpp"
#include "marrow/read/calibration_file.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/plugins/read/damaged.hpp"
#include "tests/plugins/read/reading.hpp"

namespace damaged_texts_test {

using namespace damaged;
using namespace marrow::test;
using Path = std::filesystem::path;

const std::string kCamera =
    "marrow-camera: 1\nwidth_px: 640\nheight_px: 480\nintrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]\n"
    "radial_distortion: [0.1, 0, 0]\ncamera_from_world: {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, "
    "0], [0, 0, 1]], translation_mm: [1, 2, 900]}\n";

Sample text_sample(const std::string& name, const std::string& text,
                   std::vector<std::pair<std::string, std::string>> lies) {
  return {name, text, text.size(), std::move(lies), true};
}

TEST(Damaged, Texts) {
  const TemporaryFolder folder;
  expect_handled(folder,
                 text_sample("camera.yaml", kCamera,
                             {{"640", "64000000000000"},
                              {"[1000, 0, 320]", "[1000, 0]"},
                              {"900", ".nan"},
                              {"900", "1e999"},
                              {"640", "-640"}}),
                 [](const Path& path) { marrow::files::read_camera_file(path); });
  expect_handled(
      folder,
      text_sample(
          "camera.txt",
          "image size\n640,480\n\ncamera "
          "matrix\n1000,0,320\n0,1001,240\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\ntranslation\n1\n-2.5\n900\n\n",
          {{"640,480", "64000000,480"}, {"1000,0,320", "1000,0,320,7"}, {"0,-1,0", "0,-1,nan"}}),
      [](const Path& path) { marrow::files::read_camera_file(path); });
  expect_handled(folder,
                 text_sample("calibration.yaml",
                             "marrow-calibration: 1\nwidth_px: 640\nheight_px: 480\nintrinsics: [[1000, 0, 320], [0, "
                             "1001, 240], [0, 0, 1]]\nradial_distortion: [0.1, 0, 0]\n",
                             {{"640", "1e10"}, {"[0.1, 0, 0]", "[-100, 0, 0]"}}),
                 [](const Path& path) { marrow::read::read_calibration_file(path); });
  expect_handled(folder,
                 text_sample("board.yaml", bytes_of(Path(MARROW_SOURCE_DIR) / "pipelines/calibration/board.yaml"),
                             {{"[-23, -47.5, 0]", "[-23, -47.5]"}, {"diameter_mm: 3", "diameter_mm: 1e30"}}),
                 [](const Path& path) { marrow::calibration::read_board_file(path); });
  expect_handled(
      folder,
      text_sample("points.yaml", bytes_of(Path(MARROW_SOURCE_DIR) / "pipelines/wrist/beads-0002.points.yaml"),
                  {{"[859.48, 1293.81]", "[859.48, 1293.81, 1]"}}),
      [](const Path& path) { marrow::files::read_points_file(path); });
  expect_handled(folder,
                 text_sample("pose.yaml", bytes_of(Path(MARROW_SOURCE_DIR) / "pipelines/wrist/radius-0002.pose.yaml"),
                             {{"target: world", "target: ct"}}),
                 [](const Path& path) { marrow::files::read_pose_file(path); });
  expect_handled(folder,
                 text_sample("seeds.yaml", bytes_of(Path(MARROW_SOURCE_DIR) / "pipelines/wrist/radius.seeds.yaml"),
                             {{"[12.68, 31.3038, 18.75]", "[12.68, inf, 18.75]"}}),
                 [](const Path& path) { marrow::files::read_seeds_file(path); });
}

TEST(Damaged, YamlBombs) {
  const TemporaryFolder folder;
  const auto read = [](const Path& path) { marrow::files::read_camera_file(path); };
  std::string aliases = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    aliases += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int k = 0; k < 9; ++k) aliases += ", " + before;
    aliases += "]\n";
  }
  const std::string deep = "intrinsics: " + std::string(100000, '[');
  for (const std::string& text : {aliases, deep, std::string("x: ") + std::string(100000, '{'),
                                  std::string(200000, '-'), std::string("? ") + std::string(50000, '?')}) {
    put(folder / "c.yaml", text);
    std::string said;
    const Outcome outcome = outcome_of([&] { read(folder / "c.yaml"); }, "c.yaml", kMemory, said);
    EXPECT_EQ(outcome, Outcome::refused) << text.substr(0, 40) << ": " << name_of(outcome);
  }
}

TEST(Damaged, Case) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "case");
  write_itk(folder / "case/ct.mha", stack());
  write_itk(folder / "case/a.png", picture());
  put(folder / "case/a.yaml",
      marrow::test::with(marrow::test::with(marrow::test::with(kCamera, "640", "60"), "480", "40"), "[0.1, 0, 0]",
                         "[0, 0, 0]"));
  const std::string text =
      "marrow-case: 1\nct: ct.mha\nviews:\n  - {name: frontal, image: a.png, camera: a.yaml}\nfragments:\n  distal: "
      "{seeds: [[1, 2, 3]], register: true}\n";
  shipped::definition_of("read.case");  // so that loading its library does not count as memory for reading
  const auto read = [&](const Path&) { case_at(folder / "case"); };
  expect_handled(
      folder,
      [&] {
        Sample s = text_sample("case/case.yaml", text, {{"ct.mha", "../ct.mha"}, {"[[1, 2, 3]]", "[]"}});
        return s;
      }(),
      read);
}

}  // namespace damaged_texts_test
