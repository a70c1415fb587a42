// SPDX-License-Identifier: Apache-2.0

#include "tests/plugins/write/example_case.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace case_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Matrix3d;
using example_case::example;
using example_case::example_view;
using writing::write;

using WriteCase = InAFolder;
using WriteView = InAFolder;

TEST_F(WriteCase, ReplacesAnEarlierOneAndWritesTheSameBytes) {
  const Case value = example();
  for (const char* name : {"case", "other", "case"}) write(value, folder / name);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "case")) {
    EXPECT_EQ(bytes_of(entry.path()), bytes_of(folder / "other" / entry.path().filename().string()));
    ++files;
  }
  EXPECT_EQ(files, 1 + 1 + 3 + 3 + 1);
  int folders = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++folders;
  EXPECT_EQ(folders, 2) << "nothing temporary is left";
}

TEST_F(WriteCase, TextOfTheCase) {
  Case value = example();
  value.seeds = {};
  value.seeds.add("null", {"null", {{1, 2, 3}}, false});
  value.seeds.add("a: \"b\"", {"a: \"b\"", {{0.1, 0.2, 0.3}, {1e-9, -1, 4}}, true});
  value.start = {};
  value.start.add("a: \"b\"", Pose{});
  value.truth = {};
  value.truth.add("a: \"b\"", {{"world", "ct", Matrix3d::Identity(), {1, 2, 3}}});
  write(value, folder / "case");
  EXPECT_EQ(bytes_of(folder / "case/case.yaml"), R"(marrow-case: 1
ct: ct.mha
views:
  - name: "frontal"
    image: frontal.png
    camera: frontal.camera.yaml
  - name: "lateral"
    image: lateral.png
    camera: lateral.camera.yaml
  - name: "60 degrees / oblique"
    image: view-3.tif
    camera: view-3.camera.yaml
    mask: view-3.mask.png
fragments:
  "null":
    seeds:  # mm, in CT coordinates
      - [1, 2, 3]
    register: false
  "a: \"b\"":
    seeds:  # mm, in CT coordinates
      - [0.1, 0.2, 0.3]
      - [1e-09, -1, 4]
    register: true
    start:
      target: world
      source: ct
      matrix:  # world_from_ct, mm
        - [1, 0, 0, 0]
        - [0, 1, 0, 0]
        - [0, 0, 1, 0]
        - [0, 0, 0, 1]
    truth:
      target: world
      source: ct
      matrix:  # world_from_ct, mm
        - [1, 0, 0, 1]
        - [0, 1, 0, 2]
        - [0, 0, 1, 3]
        - [0, 0, 0, 1]
)");
}

TEST_F(WriteCase, DiagnosesWhatReadCaseWouldNotTake) {
  const auto expect = [&](void (*change)(Case&), const std::string& said) {
    Case value = example();
    change(value);
    EXPECT_SAYS(write(value, folder / "case"), said);
  };
  expect([](Case& c) { c.start.add("middle", Pose{}); }, "case: fragment 'middle' has a start but no seeds");
  expect([](Case& c) { c.views = {}; }, "case: the case has no view");
  expect([](Case& c) { c.views.add("frontal", example_view("frontal", CV_8U, 0)); },
         "case: two views are named 'frontal'");
  expect([](Case& c) { c.views.add("Frontal", example_view("Frontal", CV_8U, 0)); },
         "case: the views 'frontal' and 'Frontal' are the same file on some file systems; rename one of them");
  expect(
      [](Case& c) {
        c.seeds.add("distal", {"distal", {{1, 2, 3}}, false});
      },
      "case: two fragments are named 'distal'");
  expect([](Case& c) { c.views.add("a\nb", example_view("a\nb", CV_8U, 0)); },
         "case: the name 'a\\x0ab' of a view holds a character that cannot be printed; choose another");
  expect(
      [](Case& c) {
        c.seeds.add("", {"", {{1, 2, 3}}, false});
      },
      "case: the name '' of a fragment is empty; choose another");
  expect([](Case& c) { c.ct.values.pop_back(); }, ": ct: 24 voxels expected from its size, got 23");
  EXPECT_FALSE(std::filesystem::exists(folder / "case"));
  Case value = example();
  value.views = {};
  for (const char* name : {"View-2", "a/b"}) value.views.add(name, example_view(name, CV_8U, 0));
  write(value, folder / "other");
  EXPECT_TRUE(std::filesystem::exists(folder / "other/View-2.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "other/view-3.png"));
}

TEST_F(WriteCase, FullDiskLeavesNothing) {
  const auto path = folder / "case";
  {
    const FullDisk full(120);
    EXPECT_SAYS(write(example(), path), "cannot be written");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(WriteView, FolderWithImageAndCamera) {
  write(example_view("frontal", CV_16U, 0), folder / "frontal");
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/image.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/camera.yaml"));
  EXPECT_FALSE(std::filesystem::exists(folder / "frontal/mask.png"));
}

}  // namespace case_test
