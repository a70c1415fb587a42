// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace case_test {

using marrow::test::case_at;
using marrow::test::ItkGrid;
using marrow::test::message_of;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;
using marrow::test::write_itk;

const std::string kCase = R"(marrow-case: 1
ct: ct.mha
views:
  - name: frontal
    image: frontal.png
    camera: frontal.yaml
  - name: lateral
    image: lateral.png
    camera:
      width_px: 6
      height_px: 4
      intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]
      camera_from_world:
        target: camera
        source: world
        rotation: [[0, 1, 0], [0, 0, -1], [-1, 0, 0]]
        translation_mm: [0, 0, 600]
    mask: mask.png
fragments:
  proximal:
    seeds: [[0, 0, 1]]
    register: false
  distal:
    seeds: [[1, 2, 3], [4, 5, 6.5]]
    start: {target: world, source: ct, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [1, 2, 3]}
    truth: {target: world, source: ct, matrix: [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]}
)";

const std::string kCamera = R"(marrow-camera: 1
width_px: 6
height_px: 4
intrinsics: [[10, 0, 2.5], [0, 10, 1.5], [0, 0, 1]]
camera_from_world:
  {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [0, 0, 600]}
)";

/// A good case whose case.yaml the tests change.
class ReadCase : public testing::Test {
 protected:
  ReadCase() {
    ItkGrid<std::int16_t> ct{.size = {3, 3, 3}, .samples = std::vector<std::int16_t>(27, 40)};
    write_itk(folder / "ct.mha", ct);
    ItkGrid<std::uint16_t> image{.size = {6, 4}, .samples = std::vector<std::uint16_t>(24, 5000)};
    write_itk(folder / "frontal.png", image);
    write_itk(folder / "lateral.png", image);
    ItkGrid<std::uint8_t> mask{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, 255)};
    write_itk(folder / "mask.png", mask);
    put(folder / "frontal.yaml", kCamera);
    put(folder / "case.yaml", kCase);
  }
  marrow::Case read() { return case_at(folder.path()); }
  std::string said(const std::string& text) {
    put(folder / "case.yaml", text);
    return message_of([&] { read(); });
  }
  void expect_said(const std::string& from, const std::string& to, const std::string& expected) {
    const std::string message = said(with(kCase, from, to));
    EXPECT_NE(message.find(expected), std::string::npos) << "it said: " << message;
  }
  TemporaryFolder folder;
};

TEST_F(ReadCase, AllParts) {
  const marrow::Case value = read();
  EXPECT_EQ(value.ct.grid.size, (std::array<int, 3>{3, 3, 3}));
  EXPECT_EQ(value.ct.values[5], 40);
  EXPECT_EQ(value.views.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_EQ(value.views[0].image.pixels.type(), CV_16U);
  EXPECT_TRUE(value.views[0].mask.empty());
  EXPECT_EQ(value.views[1].mask.at<std::uint8_t>(2, 3), 255);
  EXPECT_EQ(value.views[1].camera.camera_from_world.rotation(2, 0), -1);
  EXPECT_EQ(value.seeds.names(), (std::vector<std::string>{"proximal", "distal"}));
  EXPECT_FALSE(value.seeds[0].wanted);
  EXPECT_TRUE(value.seeds[1].wanted);
  EXPECT_EQ(value.seeds[1].fragment, "distal");
  EXPECT_EQ(value.seeds[1].points_mm[1], Eigen::Vector3d(4, 5, 6.5));
  ASSERT_EQ(value.start.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.start[0].world_from_model.translation_mm, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(value.truth.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.truth[0].world_from_model.translation_mm, Eigen::Vector3d(4, 5, 6));
}

TEST_F(ReadCase, WithoutStartAndTruthTheirListsAreEmpty) {
  put(folder / "case.yaml", kCase.substr(0, kCase.find("    start:")));
  EXPECT_TRUE(read().start.empty());
  EXPECT_TRUE(read().truth.empty());
}

const std::string kPose = R"(marrow-pose: 1
target: world
source: ct
matrix: [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1]]
)";

TEST_F(ReadCase, StartsOfAnotherFolderTakeThePlaceOfItsOwn) {
  const TemporaryFolder starts;
  put(starts / "distal.yaml", kPose);
  const marrow::Case value = case_at(folder.path(), starts.path());
  ASSERT_EQ(value.start.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.start[0].world_from_model.translation_mm, Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(value.truth[0].world_from_model.translation_mm, Eigen::Vector3d(4, 5, 6));
}

TEST_F(ReadCase, StartsOfAFragmentWhoseNameIsNoFileName) {
  const TemporaryFolder starts;
  put(folder / "case.yaml", with(kCase, "  distal:", "  \"a/b%\":"));
  put(starts / "a%2Fb%25.yaml", kPose);
  EXPECT_EQ(case_at(folder.path(), starts.path()).start.names(), std::vector<std::string>{"a/b%"});
}

TEST_F(ReadCase, StartsThatAreMissing) {
  const TemporaryFolder starts;
  const auto message = [&](const auto& place) { return message_of([&] { case_at(folder.path(), place); }); };
  EXPECT_EQ(message(starts / "nowhere"),
            (starts / "nowhere").string() +
                ": expected a folder with a pose for each fragment, such as the output 'pose' of a run");
  put(starts / "proximal.yaml", kPose);
  EXPECT_EQ(
      message(starts.path()),
      starts.path().string() +
          ": there is no pose of the fragment 'distal'; a pose file is named after its fragment, such as distal.yaml");
}

TEST_F(ReadCase, CtWithWhatItsFileDoesNotSay) {
  put(folder / "case.yaml",
      with(kCase, "ct: ct.mha", "ct: {file: ct.mha, voxel_size_mm: [1, 2, 3], value_offset_hu: -1024, flip: [z]}"));
  EXPECT_EQ(read().ct.grid.spacing_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read().ct.values[0], 40 - 1024);
}

// After a lossy compression, zeros of a mask may have other values.
TEST_F(ReadCase, AMaskIsStoredWithoutLoss) {
  auto elements = marrow::test::fluoroscopy();
  elements[0x00282110] = "CS:01";  // LossyImageCompression
  put(folder / "mask.png", marrow::test::dicom_file(elements));
  const std::string message = message_of([&] { read(); });
  EXPECT_NE(
      message.find(
          "mask: was compressed with loss (JPEG or the like), so its zeros may have changed; save the mask as PNG"),
      std::string::npos)
      << message;
}

TEST_F(ReadCase, EveryFaultIsShownAtItsPlaceAndAllTogether) {
  std::string text = kCase;
  text = with(text, "ct: ct.mha", "ct: ct.mah");
  text = with(text, "    image: frontal.png", "    imagge: frontal.png");
  text = with(text, "register: false", "register: no");
  text = with(text, "[4, 5, 6.5]", "[4, five, 6.5]");
  const std::string message = said(text);
  for (const char* expected :
       {"case.yaml:2:5: case: ct: there is no 'ct.mah' in the case's folder\n    ct: ct.mah",
        "case.yaml:5:5: a view: unknown key 'imagge'; did you mean 'image'?\n        imagge: frontal.png",
        "a view: key 'image' is missing", "register: expected true or false, got 'no'",
        "seeds: expected a point [x, y, z] in mm"})
    EXPECT_NE(message.find(expected), std::string::npos) << expected << "\nit said:\n" << message;
}

TEST_F(ReadCase, StrictYaml) {
  expect_said("marrow-case: 1", "marrow-case: 2",
              "case.yaml:1:14: case: marrow-case: this program reads version 1, the file is of version 2");
  expect_said("marrow-case: 1\n", "", "key 'marrow-case' is missing");
  expect_said("ct: ct.mha", "ct: ct.mha\nct: ct.mha",
              "case.yaml:3:1: 'ct' is given twice in case; the first is at line 2");
  expect_said("width_px: 6", "width_px: \"6\"", "width_px: expected a whole number, got the quoted text \"6\"");
  expect_said("width_px: 6", "width_px: 0x6", "width_px: expected a whole number, got '0x6'");
  expect_said("[1, 2, 3], [4", "[1, .inf, 3], [4", "expected a point [x, y, z] in mm");
  expect_said("views:\n", "views: {}\nother:\n", "views: expected a list of views");
  expect_said("fragments:\n", "fragments: []\nfragment:\n", "fragments: expected at least one fragment by name");
  expect_said("name: lateral", "name: frontal", "name: two views are named 'frontal'");
  expect_said("  - name: frontal", "  - name: [frontal]", "name: expected a text, got a list of 1");
  expect_said("ct: ct.mha", "ct: [ct.mha", "not YAML: ");
  expect_said("marrow-case: 1", "marrow-case: 1\n<<: {a: 1}", "merge keys (<<) are not supported; repeat the entries");
}

TEST_F(ReadCase, TransformsSayTheirFramesAndAreRigid) {
  expect_said("start: {target: world", "start: {target: ct", "target: expected the frame 'world', got 'ct'");
  expect_said("start: {target: world, ", "start: {", "start: key 'target' is missing");
  expect_said("rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [1",
              "rotation: [[1, 0, 0], [0, 1, 0], [0, 0, -1]], translation_mm: [1", "rotation: not a rotation");
  expect_said("[0, 0, 0, 1]]}", "[0, 0, 0, 2]]}", "matrix: the last row of a rigid transform is [0, 0, 0, 1]");
  expect_said("[0, 0, 0, 1]]}", "[0, 0, 0, 1]], rotation: 1}", "'matrix' already gives it");
  expect_said("translation_mm: [1, 2, 3]}", "translation_mm: [1, 2]}",
              "translation_mm: expected 3 numbers [x, y, z], got a list of 2");
}

TEST_F(ReadCase, NothingOutsideTheFolderIsOpened) {
  expect_said("ct: ct.mha", "ct: ../ct.mha", "'../ct.mha' lies outside the case's folder");
  expect_said("ct: ct.mha", "ct: /etc/passwd", "lies outside the case's folder");
  expect_said("ct: ct.mha", "ct: a/../../ct.mha", "lies outside the case's folder");
  const TemporaryFolder elsewhere;
  put(elsewhere / "ct.mha", marrow::test::bytes_of(folder / "ct.mha"));
  std::filesystem::create_symlink(elsewhere / "ct.mha", folder / "link.mha");
  expect_said("ct: ct.mha", "ct: link.mha", "is a link to a place outside the case's folder");
}

// The wrong side would be masked.
TEST_F(ReadCase, TheMaskIsMirroredWithItsImage) {
  ItkGrid<std::uint8_t> mask{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, 255)};
  mask.samples[0] = 0;
  write_itk(folder / "mask.png", mask);
  put(folder / "case.yaml", with(kCase, "image: lateral.png", "image: lateral.dcm"));
  auto elements = marrow::test::fluoroscopy();
  for (const bool mirrored : {false, true}) {
    elements[0x00200020] = mirrored ? "CS:L\\F" : "CS:R\\F";
    put(folder / "lateral.dcm", marrow::test::dicom_file(elements));
    marrow::Case value;
    ASSERT_EQ(message_of([&] { value = read(); }), "");
    const marrow::View& view = value.views[1];
    EXPECT_EQ(view.image.pixels.at<std::uint16_t>(0, mirrored ? 5 : 0), 0);
    EXPECT_EQ(view.mask.at<std::uint8_t>(0, mirrored ? 5 : 0), 0);
    EXPECT_EQ(view.mask.at<std::uint8_t>(0, mirrored ? 0 : 5), 255);
  }
}

TEST_F(ReadCase, SizesOfImageAndCameraThatDisagree) {
  expect_said("width_px: 6", "width_px: 7", "view 'lateral': the image has 6 x 4 pixels, but its camera is for 7 x 4");
  ItkGrid<std::uint8_t> mask{.size = {5, 4}, .samples = std::vector<std::uint8_t>(20, 255)};
  write_itk(folder / "mask.png", mask);
  put(folder / "case.yaml", kCase);
  EXPECT_SAYS(read(), "the mask has 5 x 4 pixels, the image 6 x 4");
}

TEST_F(ReadCase, FaultsOfOtherFilesAreShownAtTheKeyThatNamesThem) {
  put(folder / "frontal.yaml", with(kCamera, "width_px: 6", "width_px: six"));
  EXPECT_SAYS(read(), "case.yaml:6:13: a view: camera: ");
  EXPECT_SAYS(read(), "frontal.yaml:2:11: camera: width_px: expected a whole number, got 'six'");
  put(folder / "frontal.png", "no image");
  EXPECT_SAYS(read(), "frontal.png: is not a PNG file");
}

TEST_F(ReadCase, StartAndTruthForAllFragmentsOrNone) {
  expect_said("    register: false\n", "",
              "some of the fragments to register have a start; give it for all of them or for none");
  expect_said("[[1, 2, 3], [4, 5, 6.5]]", "[[1, 2, 3], [4, 5, 6.5]]\n    register: false",
              "every fragment has register: false");
  expect_said("seeds: [[0, 0, 1]]", "seeds: []", "fragment 'proximal': seeds: expected a list of points");
}

TEST_F(ReadCase, WantsTheFolder) {
  EXPECT_SAYS(case_at(folder / "case.yaml"),
              "expected the folder of a case, which holds case.yaml (name the folder, not a file in it)");
  EXPECT_SAYS(case_at(folder / "absent"), "there is no such folder");
  std::filesystem::remove(folder / "case.yaml");
  EXPECT_SAYS(read(), "case.yaml: there is no such file");
}

TEST_F(ReadCase, DamagedCaseFilesAreDiagnosed) {
  marrow::test::put(folder / "good.yaml", kCase);
  marrow::test::expect_damage_is_diagnosed(folder / "good.yaml", folder / "case.yaml", [&](const auto&) { read(); });
  EXPECT_NE(said(std::string(20000, '[')), "");
  EXPECT_NE(said("a: &a [*a]\n"), "");
}

// Each line of the file is damaged in turn. Either the case is read or a fault names case.yaml; nothing crashes.
TEST_F(ReadCase, MutationsAreReadOrDiagnosed) {
  std::uint32_t state = 1;
  const auto random = [&](std::size_t below) {
    state = state * 1664525u + 1013904223u;
    return std::size_t(state >> 8) % below;
  };
  for (int i = 0; i < 300; ++i) {
    std::string text = kCase;
    const std::size_t at = random(text.size());
    if (i % 3 == 0)
      text.erase(at, 1 + random(5));
    else if (i % 3 == 1)
      text[at] = ":-[]{}#&*!|>'\"%@`\t\n0x~"[random(22)];
    else
      text.insert(at, text.substr(random(text.size()), random(12)));
    const std::string message = said(text);
    EXPECT_TRUE(message.empty() || message.find("case.yaml") != std::string::npos) << text << message;
  }
}

}  // namespace case_test
