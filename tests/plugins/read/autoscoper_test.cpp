// SPDX-License-Identifier: Apache-2.0
// Trials of Autoscoper, which these tests write as its documentation describes them.
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace autoscoper_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector3i;

const std::string kTrial =
    "# two bones\nVersion 1.2\n\nmayaCam_csv Calibration/one.txt\nmayaCam_csv ./Calibration/two.txt\n"
    "CameraRootDir Frames/one/\nCameraRootDir Frames/two/\n"
    "VolumeFile Volumes/rad_cropped.tif\nVolumeFlip 0 0 0\nVoxelSize 0.5 0.75 2\n"
    "VolumeFile Volumes/mc3 cropped.tif\nVolumeFlip 1 0 1\nVoxelSize 1 1 1\n"
    "RenderResolution 512 512\nOptimizationOffsets 0.1 0.1 0.1 0.1 0.1 0.1\nTrackingFolder Tracking\n";
constexpr int kRows = 3;  // of a volume

class ReadAutoscoper : public InAFolder {
 protected:
  ReadAutoscoper() {
    std::filesystem::create_directories(folder / "Volumes");
    put(folder / "Calibration/one.txt", xmalab_camera(6, 4));
    put(folder / "Calibration/two.txt", xmalab_camera(6, 4, "700"));
    for (const char* camera : {"one", "two"}) {
      std::filesystem::create_directories(folder / "Frames" / camera);
      for (const auto& [name, value] : {std::pair{"0002", 2}, {"0003", 3}, {"0158", 158}})
        write_itk(folder / "Frames" / camera / ("cam01_UND." + std::string(name) + ".tif"),
                  filled<std::uint8_t>({6, 4}, value));
    }
    write_itk(folder / "Volumes/rad_cropped.tif", ramp<std::uint16_t>({4, kRows, 2}, 1));
    write_itk(folder / "Volumes/mc3 cropped.tif", ramp<std::uint16_t>({4, kRows, 2}, 1, 100));
    put(folder / "trial.cfg", kTrial);
    options = {{"path", (folder / "trial.cfg").string()}, {"bone", "rad"}, {"frame_name", "0158"}};
  }
  shipped::Outputs read(const Context& context = Context()) {
    return shipped::call("read.autoscoper", {}, options, context);
  }
  Volume ct() { return read().at("ct").as<Volume>(); }
  /// What it says of a trial, without the names of folders.
  std::string refusal(const std::string& trial) {
    put(folder / "trial.cfg", trial);
    return without_folder(shipped::refusal("read.autoscoper", {}, options), folder.path());
  }
  std::vector<std::string> warnings() {
    std::vector<std::string> said = said_by([&](const Context& context) { read(context); }, LogLevel::warning);
    for (std::string& line : said) line = without_folder(line, folder.path());
    return said;
  }
  shipped::Options options;
};

TEST_F(ReadAutoscoper, AFrameByTheNumberInItsNames) {
  const auto views = read().at("views").as_list<View>();
  EXPECT_EQ(views.names(), (std::vector<std::string>{"camera1", "camera2"}));
  EXPECT_EQ(views[0].image.pixels.at<std::uint8_t>(1, 2), 158);
  EXPECT_EQ(views[0].camera.camera_from_world.translation_mm.z(), 600);
  EXPECT_EQ(views[1].camera.camera_from_world.translation_mm.z(), 700);
  options["frame_name"] = "3";
  EXPECT_EQ(read().at("views").as_list<View>()[1].image.pixels.at<std::uint8_t>(0, 0), 3);
  options["frame_name"] = "4";
  EXPECT_EQ(refusal(kTrial), "/Frames/one: there is no image 4; the numbers in their names are 2 to 3, 158");
  options["frame_name"] = "first";
  EXPECT_EQ(refusal(kTrial),
            "frame_name: expected the number in the names of its images, such as 0158 or 158, got 'first'");
}

TEST_F(ReadAutoscoper, AVolumeWithVoxelSizeFlipsAndOffset) {
  const Volume radius = ct();
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
    EXPECT_HAS(said, line) << line << said;
  EXPECT_EQ(said.find("mc3"), std::string::npos) << said;
}

TEST_F(ReadAutoscoper, FaultsOfTheTrialAtTheirLines) {
  const TemporaryFolder elsewhere;
  put(elsewhere / "one.txt", xmalab_camera(6, 4));
  const std::size_t needed = kTrial.find("VoxelSize 1 1 1");
  expect_faults(
      folder / "trial.cfg", kTrial,
      {{"VolumeFile Volumes/rad", "VolumeFile /Volumes/rad", "a path from the trial's folder begins without a slash"},
       {"Frames/one/", "Calibration/one.txt", "CameraRootDir: /Calibration/one.txt is no folder"},
       {"Calibration/one.txt", "Frames/one", "mayaCam_csv: /Frames/one is a folder"},
       {"Calibration/one.txt", "C:/Data/one.txt", "trial.cfg:4:1: error: mayaCam_csv: is a path of another machine"},
       {"Calibration/one.txt", (elsewhere / "one.txt").string(), "one.txt lies outside of the trial's folder"},
       {"Version 1.2", "Version 2.0", "trial.cfg:2:1: error: Version: expected 1.0, 1.1 or 1.2, got '2.0'\n"},
       {"CameraRootDir Frames/two/\n", "", "trial.cfg: error: there are 2 of mayaCam_csv and 1 of CameraRootDir\n"},
       {"VoxelSize 1 1 1\n", "", "trial.cfg: error: there are 2 of VolumeFile and 1 of VoxelSize\n"},
       {"VolumeFlip 0 0 0\n", "", "trial.cfg: error: there are 2 of VolumeFile and 1 of VolumeFlip\n"},
       {"VoxelSize 1 1 1", "VoxelSize 1 1",
        "trial.cfg:13:1: error: VoxelSize: expected the voxel's lengths along x, y and z in mm, got '1 1'\n"},
       {"VoxelSize 1 1 1", "VoxelSize 1 0 1",
        "trial.cfg:13:1: error: VoxelSize: expected lengths above 0, got '1 0 1'\n"},
       {"VolumeFlip 1 0 1", "VolumeFlip 1 0 2",
        "trial.cfg:12:1: error: VolumeFlip: expected 0 or 1 for each of x, y and z, got '1 0 2'\n"},
       {"Version 1.2", "Version", "trial.cfg:2:1: error: Version: there is no value behind it\n"},
       {"", "Version 1.1\n", "there is no mayaCam_csv"},
       {"", "", "trial.cfg:"},
       {"", "a text\n", "trial.cfg:"},
       {"", std::string(4096, '\0'), "trial.cfg:"},
       {"", kTrial.substr(0, 30), "trial.cfg:"},
       {"", kTrial.substr(0, needed / 2), "trial.cfg:"},
       {"", kTrial.substr(0, needed), "trial.cfg:"}},
      [&](const auto&) { read(); });
}

TEST_F(ReadAutoscoper, LinesAsWindowsWritesThem) {
  put(folder / "trial.cfg", with_each(with(kTrial, "Volumes/rad", "Volumes\\rad"), "\n", "\r\n"));
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
  const auto start = out.at("start").as_list<Pose>();
  EXPECT_EQ(start.names(), std::vector<std::string>{"bone"});
  const Grid grid = out.at("ct").as<Volume>().grid;
  for (const Vector3i& voxel : {Vector3i(0, 0, 0), Vector3i(3, 1, 1)})
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
  EXPECT_TRUE(read().at("start").as_list<Pose>().empty());
  options["start_file"] = (folder / "start.yaml").string();
  EXPECT_EQ(read().at("start").as_list<Pose>()[0].world_from_model.translation_mm, Vector3d(1, 2, 3));
}

TEST_F(ReadAutoscoper, TheMeshInTheCoordinatesOfTheVolume) {
  EXPECT_TRUE(read().at("surface").as_list<Mesh>().empty());
  const std::vector<Vector3i> voxels{{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}};
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const Vector3i& voxel : voxels) {
    const Vector3d at = in_autoscoper(voxel.x(), voxel.y(), voxel.z(), {0.5, 0.75, 2});
    ply += std::to_string(at.x()) + " " + std::to_string(at.y()) + " " + std::to_string(at.z()) + "\n";
  }
  put(folder / "Models/rad.ply", ply + "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const std::string one = with(kTrial, "VolumeFile Volumes/mc3 cropped.tif\nVolumeFlip 1 0 1\nVoxelSize 1 1 1\n", "");
  put(folder / "trial.cfg", with(one, "VoxelSize 0.5 0.75 2\n", "VoxelSize 0.5 0.75 2\nMeshFile Models/rad.ply\n"));
  const auto surface = read().at("surface").as_list<Mesh>();
  ASSERT_EQ(surface.names(), std::vector<std::string>{"bone"});
  EXPECT_EQ(surface[0].frame, "ct");
  for (const Vector3i& voxel : voxels) {
    const Vector3d expected = voxel.cast<double>().cwiseProduct(Vector3d(0.5, 0.75, 2));
    const auto& all = surface[0].vertices_mm;
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Vector3d& v) { return (v - expected).norm() < 1e-6; }))
        << expected.transpose();
  }
  std::filesystem::remove(folder / "Models/rad.ply");
  EXPECT_HAS(without_folder(shipped::refusal("read.autoscoper", {}, options), folder.path()),
             "trial.cfg:11:1: error: MeshFile: /Models/rad.ply is not there");
}

TEST_F(ReadAutoscoper, ATrackInAutoscopersCoordinatesAndBack) {
  put(folder / "rad.tra", kQuarter + std::string(15, ',') + "\n");
  const shipped::Inputs volume{{"volume", shipped::item(ct())}};
  const auto poses =
      shipped::call("read.tra", volume, {{"path", (folder / "rad.tra").string()}}).at("poses").as_list<Pose>();
  EXPECT_LT(
      (poses[0].world_from_model * Vector3d(0.5, 1.5, 2) - quarter(in_autoscoper(1, 2, 1, {0.5, 0.75, 2}))).norm(),
      1e-12);
  List<track::TrackState> states;
  track::TrackState state;
  state.now.world_from_model = poses[0].world_from_model;
  state.measured.emplace();
  states.add("0001", state);
  shipped::Inputs inputs = volume;
  inputs["states"] = shipped::list(states, "frame");
  const auto track = shipped::call("track.autoscoper", inputs).at("track").as<track::AutoscoperTrack>();
  EXPECT_LT((*track.world_from_bone.at(0) * Vector3d(10, 20, 30) - quarter({10, 20, 30})).norm(), 1e-12);
}

}  // namespace autoscoper_test
