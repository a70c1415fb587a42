// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/mesh.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace case_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;

const std::string kLateral = R"(  - name: lateral
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
)";
const std::string kCase = R"(marrow-case: 1
ct: ct.mha
views:
  - name: frontal
    image: frontal.png
    camera: frontal.yaml
)" + kLateral + R"(    mask: mask.png
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
class ReadCase : public InAFolder {
 protected:
  ReadCase() {
    write_itk(folder / "ct.mha", filled<std::int16_t>({3, 3, 3}, 40));
    for (const char* name : {"frontal.png", "lateral.png"})
      write_itk(folder / name, filled<std::uint16_t>({6, 4}, 5000));
    write_itk(folder / "mask.png", filled<std::uint8_t>({6, 4}, 255));
    put(folder / "frontal.yaml", kCamera);
    put(folder / "case.yaml", kCase);
  }
  Case read() { return case_at(folder.path()); }
  Case read(const std::string& text) {
    put(folder / "case.yaml", text);
    return read();
  }
  void expect_faulty(const std::vector<Fault>& faults) {
    expect_faults(folder / "case.yaml", kCase, faults, [](const auto& path) { case_at(path.parent_path()); });
  }
};

TEST_F(ReadCase, AllParts) {
  const Case value = read();
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
  EXPECT_EQ(value.seeds[1].points_mm[1], Vector3d(4, 5, 6.5));
  ASSERT_EQ(value.start.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.start[0].world_from_model.translation_mm, Vector3d(1, 2, 3));
  ASSERT_EQ(value.truth.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.truth[0].world_from_model.translation_mm, Vector3d(4, 5, 6));
  const Case without = read(kCase.substr(0, kCase.find("    start:")));
  EXPECT_TRUE(without.start.empty() && without.truth.empty());
}

const std::string kPose = R"(marrow-pose: 1
target: world
source: ct
matrix: [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1]]
)";

TEST_F(ReadCase, StartsOfAnotherFolderTakeThePlaceOfItsOwn) {
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
  put(starts / "distal.yaml", kPose);
  const Case value = case_at(folder.path(), starts.path());
  ASSERT_EQ(value.start.names(), std::vector<std::string>{"distal"});
  EXPECT_EQ(value.start[0].world_from_model.translation_mm, Vector3d(7, 8, 9));
  EXPECT_EQ(value.truth[0].world_from_model.translation_mm, Vector3d(4, 5, 6));
  put(folder / "case.yaml", with(kCase, "  distal:", "  \"a/b%\":"));
  put(starts / "a%2Fb%25.yaml", kPose);
  EXPECT_EQ(case_at(folder.path(), starts.path()).start.names(), std::vector<std::string>{"a/b%"});
}

TEST_F(ReadCase, CtWithWhatItsFileDoesNotSay) {
  const Case value = read(
      with(kCase, "ct: ct.mha", "ct: {file: ct.mha, voxel_size_mm: [1, 2, 3], value_offset_hu: -1024, flip: [z]}"));
  EXPECT_EQ(value.ct.grid.spacing_mm, Vector3d(1, 2, 3));
  EXPECT_EQ(value.ct.values[0], 40 - 1024);
}

// After a lossy compression, zeros of a mask may have other values.
TEST_F(ReadCase, AMaskIsStoredWithoutLoss) {
  put(folder / "mask.png", dicom_file(but(fluoroscopy(), {{0x00282110, "CS:01"}})));  // LossyImageCompression
  EXPECT_SAYS(read(),
              "mask: was compressed with loss (JPEG or the like), so its zeros may have changed; save the mask as PNG");
}

TEST_F(ReadCase, EveryFaultIsShownAtItsPlaceAndAllTogether) {
  std::string text = with(kCase, "ct: ct.mha", "ct: ct.mah");
  text = with(text, "    image: frontal.png", "    imagge: frontal.png");
  text = with(with(text, "register: false", "register: no"), "[4, 5, 6.5]", "[4, five, 6.5]");
  for (const char* expected :
       {"case.yaml:2:5: case: ct: there is no 'ct.mah' in the case's folder\n    ct: ct.mah",
        "case.yaml:5:5: a view: unknown key 'imagge'; did you mean 'image'?\n        imagge: frontal.png",
        "a view: key 'image' is missing", "register: expected true or false, got 'no'",
        "seeds: expected a point [x, y, z] in mm"})
    EXPECT_SAYS(read(text), expected);
}

TEST_F(ReadCase, StrictYaml) {
  const std::string one = "marrow-case: 1", ct = "ct: ct.mha", width = "width_px: 6";
  expect_faulty({{one, "marrow-case: 2",
                  "case.yaml:1:14: case: marrow-case: this program reads version 1, the file is of version 2"},
                 {one + "\n", "", "key 'marrow-case' is missing"},
                 {ct, ct + "\n" + ct, "case.yaml:3:1: 'ct' is given twice in case; the first is at line 2"},
                 {width, "width_px: \"6\"", "width_px: expected a whole number, got the quoted text \"6\""},
                 {width, "width_px: 0x6", "width_px: expected a whole number, got '0x6'"},
                 {width, "width_px: 7", "view 'lateral': the image has 6 x 4 pixels, but its camera is for 7 x 4"},
                 {"[1, 2, 3], [4", "[1, .inf, 3], [4", "expected a point [x, y, z] in mm"},
                 {"views:\n", "views: {}\nother:\n", "views: expected a list of views"},
                 {"fragments:\n", "fragments: []\nfragment:\n", "fragments: expected at least one fragment by name"},
                 {"name: lateral", "name: frontal", "name: two views are named 'frontal'"},
                 {"  - name: frontal", "  - name: [frontal]", "name: expected a text, got a list of 1"},
                 {ct, "ct: [ct.mha", "not YAML: "},
                 {one, one + "\n<<: {a: 1}", "merge keys (<<) are not supported; repeat the entries"},
                 {"", std::string(20000, '['), "case.yaml"},
                 {"", "a: &a [*a]\n", "case.yaml"},
                 {"    register: false\n", "",
                  "some of the fragments to register have a start; give it for all of them or for none"},
                 {"6.5]]", "6.5]]\n    register: false", "every fragment has register: false"},
                 {"seeds: [[0, 0, 1]]", "seeds: []", "fragment 'proximal': seeds: expected a list of points"}});
}

TEST_F(ReadCase, TransformsSayTheirFramesAndAreRigid) {
  const std::string turn = "rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", end = "[0, 0, 0, 1]]}";
  expect_faulty({{"start: {target: world", "start: {target: ct", "target: expected the frame 'world', got 'ct'"},
                 {"start: {target: world, ", "start: {", "start: key 'target' is missing"},
                 {turn, with(turn, "[0, 0, 1]", "[0, 0, -1]"), "rotation: not a rotation"},
                 {end, "[0, 0, 0, 2]]}", "matrix: the last row of a rigid transform is [0, 0, 0, 1]"},
                 {end, "[0, 0, 0, 1]], rotation: 1}", "'matrix' already gives it"},
                 {"translation_mm: [1, 2, 3]}", "translation_mm: [1, 2]}",
                  "translation_mm: expected 3 numbers [x, y, z], got a list of 2"}});
}

TEST_F(ReadCase, NothingOutsideTheFolderIsOpened) {
  const TemporaryFolder elsewhere;
  put(elsewhere / "ct.mha", bytes_of(folder / "ct.mha"));
  std::filesystem::create_symlink(elsewhere / "ct.mha", folder / "link.mha");
  expect_faulty({{"ct: ct.mha", "ct: ../ct.mha", "'../ct.mha' lies outside the case's folder"},
                 {"ct: ct.mha", "ct: /etc/passwd", "lies outside the case's folder"},
                 {"ct: ct.mha", "ct: a/../../ct.mha", "lies outside the case's folder"},
                 {"ct: ct.mha", "ct: link.mha", "is a link to a place outside the case's folder"}});
}

// The wrong side would be masked.
TEST_F(ReadCase, TheMaskIsMirroredWithItsImage) {
  ItkGrid<std::uint8_t> mask = filled<std::uint8_t>({6, 4}, 255);
  mask.samples[0] = 0;
  write_itk(folder / "mask.png", mask);
  put(folder / "case.yaml", with(kCase, "image: lateral.png", "image: lateral.dcm"));
  for (const bool mirrored : {false, true}) {
    put(folder / "lateral.dcm", dicom_file(but(fluoroscopy(), {{0x00200020, mirrored ? "CS:L\\F" : "CS:R\\F"}})));
    const View view = read().views[1];
    EXPECT_EQ(view.image.pixels.at<std::uint16_t>(0, mirrored ? 5 : 0), 0);
    EXPECT_EQ(view.mask.at<std::uint8_t>(0, mirrored ? 5 : 0), 0);
    EXPECT_EQ(view.mask.at<std::uint8_t>(0, mirrored ? 0 : 5), 255);
  }
}

TEST_F(ReadCase, FaultsOfOtherFilesAreShownAtTheKeyThatNamesThem) {
  write_itk(folder / "mask.png", filled<std::uint8_t>({5, 4}, 255));
  EXPECT_SAYS(read(), "the mask has 5 x 4 pixels, the image 6 x 4");
  put(folder / "frontal.yaml", with(kCamera, "width_px: 6", "width_px: six"));
  EXPECT_SAYS(read(), "case.yaml:6:13: a view: camera: ");
  EXPECT_SAYS(read(), "frontal.yaml:2:11: camera: width_px: expected a whole number, got 'six'");
  put(folder / "frontal.png", "no image");
  EXPECT_SAYS(read(), "frontal.png: is not a PNG file");
}

TEST_F(ReadCase, WantsTheFolder) {
  EXPECT_SAYS(case_at(folder / "case.yaml"),
              "expected the folder of a case, which holds case.yaml (name the folder, not a file in it)");
  EXPECT_SAYS(case_at(folder / "absent"), "there is no such folder");
  std::filesystem::remove(folder / "case.yaml");
  EXPECT_SAYS(read(), "case.yaml: there is no such file");
}

// ---- fragments that are given by labels or surfaces instead of seeds

class CaseFragments : public ReadCase {
 protected:
  CaseFragments() {
    write_itk(folder / "ct.mha", filled<std::int16_t>({4, 4, 4}, 40));
    ItkGrid<std::uint8_t> labels = filled<std::uint8_t>({4, 4, 4}, 0);
    labels.samples[21] = labels.samples[22] = 11;
    labels.samples[42] = 12;
    write_itk(folder / "labels.nii.gz", labels);
    put(folder / "tibia.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  }
  shipped::Outputs read(const std::string& text) {
    put(folder / "case.yaml", "marrow-case: 1\n" + text + "views:\n" + kLateral);
    return shipped::call("read.case", {}, {{"path", folder.path().string()}});
  }
  List<Mesh> surface(const std::string& text) { return read(text).at("surface").as_list<Mesh>(); }
};

const std::string kLabelled =
    "ct: ct.mha\nlabels: labels.nii.gz\nfragments:\n  tibia: {label: 11}\n  fibula: {label: 12, register: false}\n";

TEST_F(CaseFragments, LabelsGiveTheMaskOfEachRegisteredFragment) {
  const shipped::Outputs outputs = read(kLabelled);
  const auto label = outputs.at("label").as_list<Volume>();
  ASSERT_EQ(label.names(), std::vector<std::string>{"tibia"});
  EXPECT_EQ(std::count(label[0].values.begin(), label[0].values.end(), 1.0f), 2);
  EXPECT_TRUE(outputs.at("seeds").as_list<Seeds>().empty());
  EXPECT_TRUE(outputs.at("surface").as_list<Mesh>().empty());
  EXPECT_FALSE(outputs.at("ct").is_absent());
}

TEST_F(CaseFragments, ASurfaceNeedsNoCtAndMayBeInCm) {
  EXPECT_TRUE(read("fragments: {tibia: {surface: tibia.obj}}\n").at("ct").is_absent());
  const auto in_mm = surface("fragments: {tibia: {surface: tibia.obj}}\n");
  ASSERT_EQ(in_mm.names(), std::vector<std::string>{"tibia"});
  EXPECT_NEAR(enclosed_volume_mm3(in_mm[0]), 1000.0 / 6, 1e-6);
  const auto in_cm = surface("fragments: {tibia: {surface: {file: tibia.obj, scale: 10}}}\n");
  EXPECT_NEAR(enclosed_volume_mm3(in_cm[0]), 1e6 / 6, 1e-3);
}

TEST_F(CaseFragments, FaultsStandAtTheirKeys) {
  const std::string ways = "give one of seeds (points inside), label (with `labels` of the case) and surface (a file)";
  EXPECT_SAYS(read("ct: ct.mha\nfragments: {tibia: {register: true}}\n"), "fragment 'tibia': " + ways);
  EXPECT_SAYS(read("ct: ct.mha\nfragments: {tibia: {seeds: [[1, 2, 3]], surface: tibia.obj}}\n"),
              ways + ", not seeds and surface");
  EXPECT_SAYS(read(with(kLabelled, "label: 12", "seeds: [[1, 2, 3]]")),
              "some are given by label, some by seeds; give all of them in the same way");
  EXPECT_SAYS(read(with(kLabelled, "labels: labels.nii.gz\n", "")),
              "label: the case names no file of labels; add `labels: FILE` beside `ct`");
  EXPECT_SAYS(read("ct: ct.mha\nlabels: labels.nii.gz\nfragments: {tibia: {seeds: [[1, 2, 3]]}}\n"),
              "labels: no fragment has a label of this file; give it as `NAME: {label: NUMBER_OR_NAME}`");
  for (const char* label : {"label: 11", "label: 12"})
    EXPECT_SAYS(read(with(kLabelled, label, "label: 13")), "labels.nii.gz: has no label 13; it has 11, 12");
  EXPECT_SAYS(read(with(kLabelled, "labels.nii.gz", "label.nii.gz")), "labels: there is no 'label.nii.gz'");
  EXPECT_SAYS(read("fragments: {tibia: {surface: /tmp/tibia.obj}}\n"), "lies outside the case's folder");
  EXPECT_SAYS(read("fragments: {tibia: {surface: {file: tibia.obj, scale: 0}}}\n"),
              "scale: expected a factor of at least 1e-6, such as 10 for cm");
  EXPECT_SAYS(read("fragments: {tibia: {seeds: [[1, 2, 3]]}}\n"), "'ct' is missing");
}

}  // namespace case_test
