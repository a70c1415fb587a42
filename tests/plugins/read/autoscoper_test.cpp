// SPDX-License-Identifier: Apache-2.0
// Trials of Autoscoper, which these tests write as its documentation describes them.
#include <gtest/gtest.h>

#include "marrow/toolbox/track/track_state.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace autoscoper_test {

using Eigen::Vector3d;
using marrow::test::ItkGrid;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;
using marrow::test::write_itk;

const std::string kCamera =
    "image size\n6,4\n\ncamera matrix\n10,0,3\n0,10,2\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\n"
    "translation\n0\n0\n600\n";
const std::string kTrial =
    "# two bones\nVersion 1.2\n\nmayaCam_csv Calibration/one.txt\nmayaCam_csv ./Calibration/two.txt\n"
    "CameraRootDir Frames/one/\nCameraRootDir Frames/two/\n"
    "VolumeFile Volumes/rad_cropped.tif\nVolumeFlip 0 0 0\nVoxelSize 0.5 0.75 2\n"
    "VolumeFile Volumes/mc3 cropped.tif\nVolumeFlip 1 0 1\nVoxelSize 1 1 1\n"
    "RenderResolution 512 512\nOptimizationOffsets 0.1 0.1 0.1 0.1 0.1 0.1\nTrackingFolder Tracking\n";
constexpr int kRows = 3;  // of a volume

/// A volume with the values base + 0, base + 1, ...
ItkGrid<std::uint16_t> volume_of(std::uint16_t base) {
  ItkGrid<std::uint16_t> grid{.size = {4, kRows, 2}};
  for (int i = 0; i < 4 * kRows * 2; ++i) grid.samples.push_back(std::uint16_t(base + i));
  return grid;
}

class ReadAutoscoper : public testing::Test {
 protected:
  ReadAutoscoper() {
    std::filesystem::create_directories(folder / "Volumes");
    put(folder / "Calibration/one.txt", kCamera);
    put(folder / "Calibration/two.txt", with(kCamera, "600", "700"));
    for (const char* camera : {"one", "two"}) {
      std::filesystem::create_directories(folder / "Frames" / camera);
      for (const auto& [name, value] : {std::pair{"0002", 2}, {"0003", 3}, {"0158", 158}})
        write_itk(folder / "Frames" / camera / ("cam01_UND." + std::string(name) + ".tif"),
                  ItkGrid<std::uint8_t>{.size = {6, 4}, .samples = std::vector<std::uint8_t>(24, std::uint8_t(value))});
    }
    write_itk(folder / "Volumes/rad_cropped.tif", volume_of(0));
    write_itk(folder / "Volumes/mc3 cropped.tif", volume_of(100));
    put(folder / "trial.cfg", kTrial);
    options = {{"path", (folder / "trial.cfg").string()}, {"bone", "rad"}, {"frame_name", "0158"}};
  }
  shipped::Outputs read(const marrow::Context& context = marrow::Context()) {
    return shipped::call("read.autoscoper", {}, options, context);
  }
  marrow::Volume ct() { return read().at("ct").as<marrow::Volume>(); }
  /// What it says of a trial, without the names of folders.
  std::string refusal(const std::string& trial) {
    put(folder / "trial.cfg", trial);
    return marrow::test::without_folder(shipped::refusal("read.autoscoper", {}, options), folder.path());
  }
  std::vector<std::string> warnings() {
    std::vector<std::string> said;
    marrow::Context::Hooks hooks;
    hooks.log = [&](std::string_view text, marrow::LogLevel level) {
      if (level == marrow::LogLevel::warning)
        said.push_back(marrow::test::without_folder(std::string(text), folder.path()));
    };
    read(marrow::Context(hooks));
    return said;
  }
  TemporaryFolder folder;
  shipped::Options options;
};

TEST_F(ReadAutoscoper, AFrameByTheNumberInItsNames) {
  const auto views = read().at("views").as_list<marrow::View>();
  EXPECT_EQ(views.names(), (std::vector<std::string>{"camera1", "camera2"}));
  EXPECT_EQ(views[0].image.pixels.at<std::uint8_t>(1, 2), 158);
  EXPECT_EQ(views[0].camera.camera_from_world.translation_mm.z(), 600);
  EXPECT_EQ(views[1].camera.camera_from_world.translation_mm.z(), 700);
  options["frame_name"] = "3";
  EXPECT_EQ(read().at("views").as_list<marrow::View>()[1].image.pixels.at<std::uint8_t>(0, 0), 3);
  options["frame_name"] = "4";
  EXPECT_EQ(refusal(kTrial), "/Frames/one: there is no image 4; the numbers in their names are 2 to 3, 158");
  options["frame_name"] = "first";
  EXPECT_EQ(refusal(kTrial),
            "frame_name: expected the number in the names of its images, such as 0158 or 158, got 'first'");
}

TEST_F(ReadAutoscoper, AVolumeWithVoxelSizeFlipsAndOffset) {
  const marrow::Volume radius = ct();
  EXPECT_EQ(radius.grid.size, (std::array<int, 3>{4, kRows, 2}));
  EXPECT_EQ(radius.grid.spacing_mm, Vector3d(0.5, 0.75, 2));
  EXPECT_EQ(radius.at(1, 2, 1), 1 + 4 * 2 + 4 * kRows);
  options["bone"] = "mc3";
  options["value_offset_hu"] = -1024.0;
  EXPECT_EQ(ct().at(0, 2, 0), 100 + 3 + 4 * 2 + 4 * kRows - 1024);  // x and z are reversed
}

TEST_F(ReadAutoscoper, TheBoneByAPartOfItsName) {
  options["bone"] = "cropped";
  EXPECT_EQ(refusal(kTrial),
            "/trial.cfg: 'cropped' is in the names of several volumes: rad_cropped, mc3 cropped; name one of them");
  options["bone"] = "ulna";
  EXPECT_EQ(refusal(kTrial), "/trial.cfg: no volume has 'ulna' in its name; there are rad_cropped, mc3 cropped");
  options["bone"] = "";
  EXPECT_EQ(refusal(kTrial),
            "/trial.cfg: has several volumes; name one by bone, in whole or in part: rad_cropped, mc3 cropped");
  put(folder / "trial.cfg",
      with(kTrial, "VolumeFile Volumes/mc3 cropped.tif\nVolumeFlip 1 0 1\nVoxelSize 1 1 1\n", ""));
  EXPECT_EQ(ct().grid.spacing_mm.z(), 2);
}

TEST_F(ReadAutoscoper, AllMissingFilesAtTheirLines) {
  std::filesystem::remove(folder / "Calibration/two.txt");
  std::filesystem::remove_all(folder / "Frames/one");
  std::filesystem::remove(folder / "Volumes/rad_cropped.tif");
  std::filesystem::remove(folder / "Volumes/mc3 cropped.tif");  // not asked for
  const std::string said = refusal(kTrial);
  for (const char* line : {"/trial.cfg:5:1: error: mayaCam_csv: /Calibration/two.txt is not there\n",
                           "/trial.cfg:6:1: error: CameraRootDir: /Frames/one is not there\n",
                           "/trial.cfg:8:1: error: VolumeFile: /Volumes/rad_cropped.tif is not there\n"})
    EXPECT_NE(said.find(line), std::string::npos) << line << said;
  EXPECT_EQ(said.find("mc3"), std::string::npos) << said;
}

TEST_F(ReadAutoscoper, PathsThatCannotBe) {
  const auto expect = [&](const std::string& from, const std::string& to, const std::string& line) {
    const std::string said = refusal(with(kTrial, from, to));
    EXPECT_NE(said.find(line), std::string::npos) << said;
  };
  expect("VolumeFile Volumes/rad", "VolumeFile /Volumes/rad", "a path from the trial's folder begins without a slash");
  expect("Frames/one/", "Calibration/one.txt", "CameraRootDir: /Calibration/one.txt is no folder");
  expect("Calibration/one.txt", "Frames/one", "mayaCam_csv: /Frames/one is a folder");
  expect("Calibration/one.txt", "C:/Data/one.txt", "trial.cfg:4:1: error: mayaCam_csv: is a path of another machine");
  const TemporaryFolder elsewhere;
  put(elsewhere / "one.txt", kCamera);
  expect("Calibration/one.txt", (elsewhere / "one.txt").string(), "one.txt lies outside of the trial's folder");
}

TEST_F(ReadAutoscoper, FaultsOfTheTrialAtTheirLines) {
  const auto expect = [&](const std::string& from, const std::string& to, const std::string& line) {
    const std::string said = refusal(with(kTrial, from, to));
    EXPECT_NE(said.find("/trial.cfg" + line), std::string::npos) << said;
  };
  expect("Version 1.2", "Version 2.0", ":2:1: error: Version: expected 1.0, 1.1 or 1.2, got '2.0'\n");
  expect("CameraRootDir Frames/two/\n", "", ": error: there are 2 of mayaCam_csv and 1 of CameraRootDir\n");
  expect("VoxelSize 1 1 1\n", "", ": error: there are 2 of VolumeFile and 1 of VoxelSize\n");
  expect("VolumeFlip 0 0 0\n", "", ": error: there are 2 of VolumeFile and 1 of VolumeFlip\n");
  expect("VoxelSize 1 1 1", "VoxelSize 1 1",
         ":13:1: error: VoxelSize: expected the voxel's lengths along x, y and z in mm, got '1 1'\n");
  expect("VoxelSize 1 1 1", "VoxelSize 1 0 1", ":13:1: error: VoxelSize: expected lengths above 0, got '1 0 1'\n");
  expect("VolumeFlip 1 0 1", "VolumeFlip 1 0 2",
         ":12:1: error: VolumeFlip: expected 0 or 1 for each of x, y and z, got '1 0 2'\n");
  expect("Version 1.2", "Version", ":2:1: error: Version: there is no value behind it\n");
  EXPECT_NE(refusal("Version 1.1\n").find("there is no mayaCam_csv"), std::string::npos);
}

TEST_F(ReadAutoscoper, LinesAsWindowsWritesThem) {
  std::string text = with(kTrial, "Volumes/rad", "Volumes\\rad");
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.replace(at, 1, "\r\n");
  put(folder / "trial.cfg", text);
  EXPECT_EQ(ct().grid.spacing_mm.x(), 0.5);
}

TEST_F(ReadAutoscoper, RemarksOnAKeyThatIsNotKnown) {
  EXPECT_TRUE(warnings().empty());
  put(folder / "trial.cfg", kTrial + "RenderResolutoin 512 512\n");
  EXPECT_EQ(warnings(), (std::vector<std::string>{"/trial.cfg:17: the key 'RenderResolutoin' is not known, so the "
                                                  "line does not count; did you mean 'RenderResolution'?"}));
}

TEST_F(ReadAutoscoper, RemarksOnAForgottenOffset) {
  ItkGrid<std::uint16_t> bone{.size = {10, 10, 10}, .samples = std::vector<std::uint16_t>(1000, 0)};
  for (int i = 300; i < 600; ++i) bone.samples[i] = std::uint16_t(900 + 5 * (i - 300));
  write_itk(folder / "Volumes/rad_cropped.tif", bone);
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_EQ(warnings()[0].find("/Volumes/rad_cropped.tif: the CT seems to hold HU + 1024, not Hounsfield units"), 0u)
      << warnings()[0];
  options["value_offset_hu"] = -1024.0;
  EXPECT_TRUE(warnings().empty());
}

/// Where Autoscoper has the centre of a voxel in its own coordinates of a bone, as its renderer samples it.
Vector3d in_autoscoper(int column, int row, int page, const Vector3d& voxel_mm) {
  return {(column + 0.5) * voxel_mm.x(), (kRows - row - 0.5) * voxel_mm.y(), -(page + 0.5) * voxel_mm.z()};
}

// A quarter turn about z and a shift: (x, y, z) becomes (-y + 1, x - 2.5, z + 300).
const std::string kQuarter = "0,-1,0,1,1,0,0,-2.5,0,0,1,300,0,0,0,1\n";
Vector3d quarter(const Vector3d& x) { return {-x.y() + 1, x.x() - 2.5, x.z() + 300}; }

TEST_F(ReadAutoscoper, TheStartFromAutoscopersOwnTrack) {
  put(folder / "rad.tra", std::string(15, ',') + "\n" + std::string(15, ',') + "\n" + kQuarter);
  options["start_file"] = (folder / "rad.tra").string();
  const shipped::Outputs out = read();  // frame 158 is the third one
  const auto start = out.at("start").as_list<marrow::Pose>();
  EXPECT_EQ(start.names(), std::vector<std::string>{"bone"});
  const marrow::Grid grid = out.at("ct").as<marrow::Volume>().grid;
  for (const Eigen::Vector3i& voxel : {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(3, 1, 1)})
    EXPECT_LT((start[0].world_from_model * grid.point_from_index(voxel.cast<double>()) -
               quarter(in_autoscoper(voxel.x(), voxel.y(), voxel.z(), {0.5, 0.75, 2})))
                  .norm(),
              1e-12);
  options["frame_name"] = "2";
  EXPECT_EQ(refusal(kTrial), "/rad.tra: has no pose in line 1, which is that of frame 2; track the bone there first");
}

TEST_F(ReadAutoscoper, TheStartFromAPoseFile) {
  put(folder / "start.yaml",
      "marrow-pose: 1\ntarget: world\nsource: ct\nrotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
      "translation_mm: [1, 2, 3]\n");
  EXPECT_TRUE(read().at("start").as_list<marrow::Pose>().empty());
  options["start_file"] = (folder / "start.yaml").string();
  EXPECT_EQ(read().at("start").as_list<marrow::Pose>()[0].world_from_model.translation_mm, Vector3d(1, 2, 3));
}

TEST_F(ReadAutoscoper, TheMeshInTheCoordinatesOfTheVolume) {
  EXPECT_TRUE(read().at("surface").as_list<marrow::Mesh>().empty());
  const std::vector<Eigen::Vector3i> voxels{{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const Eigen::Vector3i& voxel : voxels) {
    const Vector3d at = in_autoscoper(voxel.x(), voxel.y(), voxel.z(), {0.5, 0.75, 2});
    ply += std::to_string(at.x()) + " " + std::to_string(at.y()) + " " + std::to_string(at.z()) + "\n";
  }
  put(folder / "Models/rad.ply", ply + "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const std::string one = with(kTrial, "VolumeFile Volumes/mc3 cropped.tif\nVolumeFlip 1 0 1\nVoxelSize 1 1 1\n", "");
  put(folder / "trial.cfg", with(one, "VoxelSize 0.5 0.75 2\n", "VoxelSize 0.5 0.75 2\nMeshFile Models/rad.ply\n"));
  const auto surface = read().at("surface").as_list<marrow::Mesh>();
  ASSERT_EQ(surface.names(), std::vector<std::string>{"bone"});
  EXPECT_EQ(surface[0].frame, "ct");
  for (const Eigen::Vector3i& voxel : voxels) {
    const Vector3d expected = voxel.cast<double>().cwiseProduct(Vector3d(0.5, 0.75, 2));
    const auto& all = surface[0].vertices_mm;
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Vector3d& v) { return (v - expected).norm() < 1e-6; }))
        << expected.transpose();
  }
  std::filesystem::remove(folder / "Models/rad.ply");
  EXPECT_NE(marrow::test::without_folder(shipped::refusal("read.autoscoper", {}, options), folder.path())
                .find("trial.cfg:11:1: error: MeshFile: /Models/rad.ply is not there"),
            std::string::npos);
}

TEST_F(ReadAutoscoper, ATrackInAutoscopersCoordinatesAndBack) {
  put(folder / "rad.tra", kQuarter + std::string(15, ',') + "\n");
  const shipped::Inputs volume{{"volume", shipped::item(ct())}};
  const auto poses =
      shipped::call("read.tra", volume, {{"path", (folder / "rad.tra").string()}}).at("poses").as_list<marrow::Pose>();
  EXPECT_LT(
      (poses[0].world_from_model * Vector3d(0.5, 1.5, 2) - quarter(in_autoscoper(1, 2, 1, {0.5, 0.75, 2}))).norm(),
      1e-12);
  marrow::List<marrow::track::TrackState> states;
  marrow::track::TrackState state;
  state.now.world_from_model = poses[0].world_from_model;
  state.measured.emplace();
  states.add("0001", state);
  shipped::Inputs inputs = volume;
  inputs["states"] = shipped::list(states, "frame");
  const auto track = shipped::call("track.autoscoper", inputs).at("track").as<marrow::track::AutoscoperTrack>();
  EXPECT_LT((*track.world_from_bone.at(0) * Vector3d(10, 20, 30) - quarter({10, 20, 30})).norm(), 1e-12);
}

TEST_F(ReadAutoscoper, DamagedTrialsAreDiagnosed) {
  const std::size_t needed = kTrial.find("VoxelSize 1 1 1");
  for (const std::string& text : {std::string(), std::string("a text\n"), std::string(4096, '\0'), kTrial.substr(0, 30),
                                  kTrial.substr(0, needed / 2), kTrial.substr(0, needed)})
    EXPECT_EQ(refusal(text).find("/trial.cfg:"), 0u) << text.substr(0, 200) << refusal(text);
}

}  // namespace autoscoper_test
