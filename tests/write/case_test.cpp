// SPDX-License-Identifier: Apache-2.0
#include "plugins/write/case.cpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "read/files.hpp"
#include "write/full_disk.hpp"

marrow::Case read_back(const std::filesystem::path& folder);

namespace {

using marrow::test::TemporaryFolder;

marrow::View example_view(const std::string& name, int type, double turn) {
  marrow::View view;
  view.name = name;
  view.image.pixels = cv::Mat(5, 7, type);
  cv::randu(view.image.pixels, 0, type == CV_8U ? 255 : 60000);
  view.camera = {7, 5, Eigen::Matrix3d::Identity(), {"camera", "world"}};
  view.camera.intrinsics << 1706.484 / 3, 0, 3.1, 0, 1706.484 / 3, 2.1, 0, 0, 1;
  view.camera.camera_from_world.rotation = marrow::rotation_from_vector({0.1, turn, -0.3});
  view.camera.camera_from_world.translation_mm = {0.1, -1.0 / 3, 600};
  return view;
}

marrow::Case example_case() {
  marrow::Case value;
  value.ct.grid.size = {4, 3, 2};
  value.ct.grid.spacing_mm = {0.8, 0.8, 1.0 / 3};
  value.ct.grid.origin_mm = {-12.1, 7.3, 1e-3};
  value.ct.grid.direction = marrow::rotation_from_vector({0.01, 0.02, 0.03});
  for (int i = 0; i < 24; ++i) value.ct.values.push_back(float(i) * 1.1f - 1000);
  value.views.add("frontal", example_view("frontal", CV_16U, 0.7));
  value.views.add("lateral", example_view("lateral", CV_8U, 1.7));
  marrow::View masked = example_view("60 degrees / oblique", CV_32F, 2.7);
  masked.mask = cv::Mat(5, 7, CV_8U, cv::Scalar(255));
  value.views.add(masked.name, masked);
  value.seeds.add("proximal", {"proximal", {{1, 2, 3}}, false});
  value.seeds.add("distal", {"distal", {{0.1, 0.2, 0.3}, {1.0 / 3, 2.0 / 3, 1e-9}}, true});
  marrow::Pose start;
  start.world_from_model.rotation = marrow::rotation_from_vector({0.1, 0.2, 0.3});
  start.world_from_model.translation_mm = {1.0 / 7, -2.0 / 7, 3e5 / 7};
  value.start.add("distal", start);
  marrow::Truth truth;
  truth.world_from_model.rotation = marrow::rotation_from_vector({-0.4, 0.2, 0.3});
  truth.world_from_model.translation_mm = {1e-17, 1e17, 0.1};
  value.truth.add("distal", truth);
  return value;
}

TEST(WriteCase, ReadCaseGivesTheSameToTheLastBit) {
  const TemporaryFolder folder;
  const marrow::Case written = example_case();
  write_case(written, (folder / "case").string());
  const marrow::Case read = read_back(folder / "case");
  EXPECT_EQ(marrow::hash_of(read.ct), marrow::hash_of(written.ct));
  EXPECT_EQ(marrow::hash_of(read.views), marrow::hash_of(written.views));
  EXPECT_EQ(marrow::hash_of(read.seeds), marrow::hash_of(written.seeds));
  EXPECT_EQ(marrow::hash_of(read.start), marrow::hash_of(written.start));
  EXPECT_EQ(marrow::hash_of(read.truth), marrow::hash_of(written.truth));
}

TEST(WriteCase, ReplacesAnEarlierOneAndWritesTheSameBytes) {
  const TemporaryFolder folder;
  const marrow::Case value = example_case();
  for (const char* name : {"case", "other", "case"}) write_case(value, (folder / name).string());
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "case")) {
    EXPECT_EQ(marrow::test::bytes_of(entry.path()),
              marrow::test::bytes_of(folder / "other" / entry.path().filename().string()));
    ++files;
  }
  EXPECT_EQ(files, 1 + 1 + 3 + 3 + 1);
  int folders = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++folders;
  EXPECT_EQ(folders, 2) << "nothing temporary is left";
}

TEST(WriteCase, EachViewHasFilesOfItsOwn) {
  EXPECT_EQ(file_stems({"frontal", "view-2", "a/b", "a b", "view-3", "", std::string(300, 'x')}),
            (std::vector<std::string>{"frontal", "view-2", "view-4", "view-5", "view-3", "view-6", "view-7"}));
  const TemporaryFolder folder;
  marrow::Case written = example_case();
  written.views = {};
  for (const char* name : {"view-2", "a/b", "a b", "a: b # c"})
    written.views.add(name, example_view(name, CV_16U, double(written.views.size())));
  write_case(written, (folder / "case").string());
  EXPECT_EQ(marrow::hash_of(read_back(folder / "case").views), marrow::hash_of(written.views));
}

TEST(WriteCase, TextOfTheCase) {
  const TemporaryFolder folder;
  marrow::Case value = example_case();
  value.seeds = {};
  value.seeds.add("null", {"null", {{1, 2, 3}}, false});
  value.seeds.add("a: \"b\"", {"a: \"b\"", {{0.1, 0.2, 0.3}, {1e-9, -1, 4}}, true});
  value.start = {};
  value.start.add("a: \"b\"", marrow::Pose{});
  value.truth = {};
  value.truth.add("a: \"b\"", {{"world", "ct", Eigen::Matrix3d::Identity(), {1, 2, 3}}});
  write_case(value, (folder / "case").string());
  EXPECT_EQ(marrow::test::bytes_of(folder / "case/case.yaml"), R"(marrow-case: 1
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

TEST(WriteCase, DiagnosesWhatReadCaseWouldNotTake) {
  const TemporaryFolder folder;
  const std::string path = (folder / "case").string();
  marrow::Case value = example_case();
  value.start.add("middle", marrow::Pose{});
  EXPECT_SAYS((write_case(value, path), 0), "case: fragment 'middle' has a start but no seeds");
  value = example_case();
  value.views = {};
  EXPECT_SAYS((write_case(value, path), 0), "case: the case has no view");
  value = example_case();
  value.views.add("frontal", example_view("frontal", CV_8U, 0));
  EXPECT_SAYS((write_case(value, path), 0), "case: two views are named 'frontal'");
  value = example_case();
  value.views.add("Frontal", example_view("Frontal", CV_8U, 0));
  EXPECT_SAYS((write_case(value, path), 0),
              "case: the views 'frontal' and 'Frontal' are one file to some file systems; rename one of them");
  EXPECT_EQ(file_stems({"View-2", "a/b"}), (std::vector<std::string>{"View-2", "view-3"}));
  value = example_case();
  value.seeds.add("distal", {"distal", {{1, 2, 3}}, false});
  EXPECT_SAYS((write_case(value, path), 0), "case: two fragments are named 'distal'");
  value = example_case();
  value.views.add("a\nb", example_view("a\nb", CV_8U, 0));
  EXPECT_SAYS((write_case(value, path), 0),
              "case: the name 'a\\x0ab' of a view holds a character that cannot be printed; choose another");
  value = example_case();
  value.seeds.add("", {"", {{1, 2, 3}}, false});
  EXPECT_SAYS((write_case(value, path), 0), "case: the name '' of a fragment is empty; choose another");
  value = example_case();
  value.ct.values.pop_back();
  EXPECT_SAYS((write_case(value, path), 0), "ct.mha: 24 samples expected from the grid's size, got 23");
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(WriteCase, FullDiskLeavesNothing) {
  const TemporaryFolder folder;
  const std::string path = (folder / "case").string();
  {
    const marrow::test::FullDisk full(120);
    EXPECT_SAYS((write_case(example_case(), path), 0), "cannot be written");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(WriteView, FolderWithImageAndCamera) {
  const TemporaryFolder folder;
  view(example_view("frontal", CV_16U, 0), (folder / "frontal").string());
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/image.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "frontal/camera.yaml"));
  EXPECT_FALSE(std::filesystem::exists(folder / "frontal/mask.png"));
}

}  // namespace
