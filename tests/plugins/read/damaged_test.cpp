// SPDX-License-Identifier: Apache-2.0
// Files of each format are cut off at random places, bytes of their headers are flipped, or their sizes are wrong. A
// hundred copies of each must be read, or refused with an error that names the file, within 64 MB.
#include "marrow/camera/points_file.hpp"
#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/meshes.hpp"
#include "tests/plugins/read/reading.hpp"

namespace damaged_test {

using namespace marrow;
using namespace marrow::test;
using Path = std::filesystem::path;

namespace files = files;

ItkGrid<std::uint16_t> picture() {
  ItkGrid<std::uint16_t> grid = filled<std::uint16_t>({60, 40}, 0);
  for (unsigned i = 0; i < 2400; ++i) grid.samples[i] = std::uint16_t(i * 40503u);
  return grid;
}

ItkGrid<std::int16_t> stack() {
  ItkGrid<std::int16_t> grid = filled<std::int16_t>({20, 16, 12}, 0);
  for (unsigned i = 0; i < 20 * 16 * 12; ++i) grid.samples[i] = std::int16_t(i * 7919u % 3000);
  return grid;
}

void image_at(const Path& path) { files::read_image_file(path); }

void volume_at(const Path& path) {
  files::VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  files::read_volume_file(path, reading);
}

class Damaged : public InAFolder {
 protected:
  void expect_all(const std::vector<Sample>& samples, const std::function<void(const Path&)>& read) {
    for (const Sample& sample : samples) expect_handled(folder, sample, read);
  }
  /// The error may name the folder, or a file beside the damaged one.
  std::function<void(const Path&)> volume_in_folder() const {
    return [this](const Path& path) {
      try {
        files::read_volume_file(folder.path(), {});
      } catch (const Error& error) {
        throw Error(path.filename().string() + ": " + error.what());
      }
    };
  }
};

TEST_F(Damaged, Images) {
  // ITK writes the directory of a TIFF behind the pixels, so the whole file counts as the header.
  const std::string plain = itk_bytes(".tif", picture()), packed = itk_bytes(".tif", picture(), true);
  const auto width = [](const std::string& kind_and_value) { return std::string("\0\1", 2) + kind_and_value; };
  const std::string right = width(std::string("\3\0\1\0\0\0\x3C\0", 8)), wrong = width({"\4\0\1\0\0\0\x60\xEA", 8});
  const auto lies = [&](const std::string& bytes) {
    return bytes.find(right) == std::string::npos ? std::vector<std::pair<std::string, std::string>>{}
                                                  : std::vector{std::pair{right, wrong}};
  };
  expect_all({{"a.png", itk_bytes(".png", picture(), true), 60},
              {"a.tif", plain, plain.size(), lies(plain)},
              {"packed.tif", packed, packed.size(), lies(packed)}},
             image_at);
}

TEST_F(Damaged, DicomImages) {
  const auto element = [](std::uint32_t tag, std::uint32_t value) {
    return dicom_element(tag, "US", little(value, 2));
  };
  const std::string file = dicom_file(
      but(fluoroscopy(),
          {{0x00280010, "US:32"}, {0x00280011, "US:48"}, {0x7FE00010, "OW:" + std::string(48 * 32 * 2, 'x')}}));
  const std::string rows = element(0x00280010, 32), length = little(48 * 32 * 2, 4);
  const Sample sample{"a.dcm",
                      file,
                      file.size() - 48 * 32 * 2,
                      {{rows, element(0x00280010, 60000)},
                       {rows, element(0x00280010, 0)},
                       {rows, dicom_element(0x00280008, "IS", "999999999 ") + rows},
                       {length, little(0xFFFFFFF0u, 4)},
                       {length, little(48 * 32 * 2 + 2, 4)},
                       {element(0x00280100, 16), element(0x00280100, 64)},
                       {element(0x00280002, 1), element(0x00280002, 30000)},
                       {"CS" + little(2, 2) + "XA", "CS" + little(0xFFFE, 2) + "XA"}}};
  expect_handled(folder, sample, image_at);
  // The camera needs only the header, so a file with damaged pixels may be accepted.
  expect_handled(folder, sample, [](const Path& path) { files::read_xray_geometry(path, 1, {}); });
}

TEST_F(Damaged, Volumes) {
  const std::string meta = "DimSize = 20 16 12", nrrd = "sizes: 20 16 12", binary = "BinaryData = True";
  const auto nifti = [](int count, int x, int z) {
    return little(std::uint64_t(count), 2) + little(std::uint64_t(x), 2) + little(16, 2) + little(std::uint64_t(z), 2);
  };
  const std::string right = nifti(3, 20, 12), tif = itk_bytes(".tif", filled<std::uint16_t>({20, 16, 12}, 7));
  const auto of = [](const char* extension, bool compressed = false) {
    return itk_bytes(extension, stack(), compressed);
  };
  expect_all(
      {{"stack.tif", tif, tif.size()},
       {"a.mha",
        of(".mha"),
        300,
        {{meta, "DimSize = 20 16 99999"},
         {meta, "DimSize = 50000 50000 50000"},
         {meta, "DimSize = 2000000000 2000000000 2000000000"},
         {meta, "DimSize = -20 16 12"},
         {meta, "DimSize = 0 16 12"},
         {meta, "DimSize = 20 16"},
         {"MET_SHORT", "MET_DOUBLE"},
         {"NDims = 3", "NDims = 30000000"},
         {"NDims = 3", "NDims = 11"},
         {"NDims = 3", "NDims = 0"},
         {"NDims = 3", "NDims = -3"},
         {binary, "HeaderSize = 999999999\n" + binary},
         {binary, "ElementNumberOfChannels = 100000000\n" + binary}}},
       {"packed.mha",
        of(".mha", true),
        300,
        {{meta, "DimSize = 20 16 4000"},
         {meta, "DimSize = 50000 50000 50000"},
         {"CompressedDataSize = ", "CompressedDataSize = 99999999"}}},
       {"a.nrrd",
        of(".nrrd"),
        250,
        {{nrrd, "sizes: 20 16 99999"},
         {nrrd, "sizes: 50000 50000 50000"},
         {nrrd, "sizes: 0 16 12"},
         {nrrd, "sizes: 20 16 12 12"},
         {nrrd, "sizes: 20 16 3000"},
         {"type: short", "type: double"},
         {"dimension: 3", "dimension: 300"},
         {"encoding: raw", "byte skip: 999999999\nencoding: raw"},
         {"encoding: raw", "encoding: ascii"}}},
       {"packed.nrrd", of(".nrrd", true), 250, {{nrrd, "sizes: 20 16 4000"}, {nrrd, "sizes: 50000 50000 50000"}}},
       {"a.nii",
        of(".nii"),
        352,
        {{right, nifti(3, 20, 13)},
         {right, little(3, 2) + little(32767, 2) + little(32767, 2) + little(32767, 2)},
         {right, nifti(3, -20, 12)},
         {right, nifti(3, 0, 12)},
         {right, nifti(9, 20, 12)},
         {right, nifti(0, 20, 12)}}},
       {"a.nii.gz", of(".nii.gz", true), 200}},
      volume_at);
}

TEST_F(Damaged, AHeaderWithItsDataBeside) {
  const TemporaryFolder other;
  write_itk(other / "a.mhd", stack());
  put(folder / "a.raw", bytes_of(other / "a.raw"));
  const std::string header = bytes_of(other / "a.mhd");
  expect_handled(folder,
                 {"a.mhd",
                  header,
                  std::min<std::size_t>(header.size(), 300),
                  {{"DimSize = 20 16 12", "DimSize = 20 16 13"}, {"a.raw", "b.raw"}, {"a.raw", "../a.raw"}},
                  true},
                 volume_in_folder());
}

TEST_F(Damaged, ASliceOfASeries) {
  std::string bytes;
  for (int k = 0; k < 4; ++k) {
    DicomSlice slice;
    slice.width = slice.height = 32;
    slice.position = {0, 0, double(k)};
    slice.values.assign(1024, std::int16_t(k));
    write_dicom(folder / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  for (const char* name : {"s0.dcm", "s2.dcm"}) {
    const std::string slice = bytes_of(folder / name);
    expect_handled(folder, {name, slice, slice.size() - 2048}, volume_in_folder());
  }
}

TEST_F(Damaged, Meshes) {
  const std::string binary = ply_binary(false, true), count = little(3, 4) + little(0, 4) + little(2, 4);
  const auto read = [](const Path& path) { files::read_mesh_file(path, 1); };
  expect_all({{"a.stl", stl_binary(), 84, {{little(4, 4), little(0xFFFFFFFFu, 4)}, {little(4, 4), little(5, 4)}}},
              {"text.stl", stl_text(), 200, {}, true},
              {"a.ply",
               ply_text(),
               200,
               {{"vertex 4", "vertex 4000000000"},
                {"vertex 4", "vertex 5"},
                {"face 4", "face 90000000"},
                {"\n3 0 2 1", "\n4000000000 0 2 1"},
                {"3 1 2 3", "3 1 2 9"}},
               true},
              {"b.ply", binary, 190, {{count, little(0xFFFFFFFFu, 4) + count.substr(4)}}}},
             read);
}

const std::string kCamera =
    "marrow-camera: 1\nwidth_px: 640\nheight_px: 480\nintrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, 1]]\n"
    "radial_distortion: [0.1, 0, 0]\ncamera_from_world: {target: camera, source: world, rotation: [[1, 0, 0], [0, 1, "
    "0], [0, 0, 1]], translation_mm: [1, 2, 900]}\n";

TEST_F(Damaged, Texts) {
  const auto shipped_file = [](const char* name) { return bytes_of(Path(MARROW_SOURCE_DIR) / "pipelines" / name); };
  const auto expect = [&](const std::string& name, const std::string& text,
                          const std::vector<std::pair<std::string, std::string>>& lies, auto read) {
    expect_handled(folder, {name, text, text.size(), lies, true}, [&](const Path& path) { read(path); },
                   {.as_text = true});
  };
  const auto camera = [](const Path& path) { files::read_camera_file(path); };
  expect(
      "camera.yaml", kCamera,
      {{"640", "64000000000000"}, {"[1000, 0, 320]", "[1000, 0]"}, {"900", ".nan"}, {"900", "1e999"}, {"640", "-640"}},
      camera);
  expect("camera.txt",
         "image size\n640,480\n\ncamera matrix\n1000,0,320\n0,1001,240\n0,0,1\n\nrotation\n0,-1,0\n1,0,0\n0,0,1\n\n"
         "translation\n1\n-2.5\n900\n\n",
         {{"640,480", "64000000,480"}, {"1000,0,320", "1000,0,320,7"}, {"0,-1,0", "0,-1,nan"}}, camera);
  expect("calibration.yaml",
         "marrow-calibration: 1\nwidth_px: 640\nheight_px: 480\nintrinsics: [[1000, 0, 320], [0, 1001, 240], [0, 0, "
         "1]]\nradial_distortion: [0.1, 0, 0]\n",
         {{"640", "1e10"}, {"[0.1, 0, 0]", "[-100, 0, 0]"}}, read::read_calibration_file);
  expect("board.yaml", shipped_file("calibration/board.yaml"),
         {{"[-23, -47.5, 0]", "[-23, -47.5]"}, {"diameter_mm: 3", "diameter_mm: 1e30"}}, calibration::read_board_file);
  expect("points.yaml", shipped_file("wrist/beads-0002.points.yaml"), {{"[859.48, 1293.81]", "[859.48, 1293.81, 1]"}},
         files::read_points_file);
  expect("pose.yaml", shipped_file("wrist/radius-0002.pose.yaml"), {{"target: world", "target: ct"}},
         files::read_pose_file);
  expect("seeds.yaml", shipped_file("wrist/radius.seeds.yaml"), {{"[12.68, 31.3038, 18.75]", "[12.68, inf, 18.75]"}},
         files::read_seeds_file);
}

TEST_F(Damaged, YamlBombs) {
  std::string aliases = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string number = std::to_string(i), before = "*a" + std::to_string(i - 1);
    aliases += "a" + number + ": &a" + number + " [" + before;
    for (int k = 0; k < 9; ++k) aliases += ", " + before;
    aliases += "]\n";
  }
  std::vector<Fault> bombs;
  for (const std::string& text : {aliases, "intrinsics: " + std::string(100000, '['), "x: " + std::string(100000, '{'),
                                  std::string(200000, '-'), "? " + std::string(50000, '?')})
    bombs.push_back({"", text, "c.yaml"});
  expect_faults(
      folder / "c.yaml", kCamera, bombs, [](const Path& path) { files::read_camera_file(path); }, 64 << 20);
}

TEST_F(Damaged, Cases) {
  std::filesystem::create_directory(folder / "case");
  write_itk(folder / "case/ct.mha", stack());
  write_itk(folder / "case/a.png", picture());
  put(folder / "case/a.yaml", with(with(with(kCamera, "640", "60"), "480", "40"), "[0.1, 0, 0]", "[0, 0, 0]"));
  const std::string text =
      "marrow-case: 1\nct: ct.mha\nviews:\n  - {name: frontal, image: a.png, camera: a.yaml}\nfragments:\n  distal: "
      "{seeds: [[1, 2, 3]], register: true}\n";
  const std::vector<std::pair<std::string, std::string>> lies{{"ct.mha", "../ct.mha"}, {"[[1, 2, 3]]", "[]"}};
  expect_handled(folder, {"case/case.yaml", text, text.size(), lies, true},
                 [](const Path& path) { case_at(path.parent_path()); }, {.changes = 300, .as_text = true});
}

TEST_F(Damaged, RealFiles) {
  const Damages few{.cuts = 0, .changes = 0, .memory = 256 << 20};
  const auto try_file = [&](const std::string& name, const auto& read) {
    const Path path = real_data(name);
    if (path.empty()) return;
    const std::string bytes = bytes_of(path);
    expect_handled(folder, {path.filename(), bytes, bytes.size()}, read, few);
  };
  try_file("wrist/images/xr_rad_uln_cam01_UND.0158.tif", image_at);
  try_file("wrist/volumes/rad_dcm_cropped.tif", volume_at);
  std::filesystem::remove_all(folder.path());
  MARROW_NEED_DATA(pelvis, "pelvis_dicom");
  for (const char* name : {"vhf.1000.dcm", "vhf.1002.dcm", "vhf.1003.dcm"}) put(folder / name, bytes_of(pelvis / name));
  try_file("pelvis_dicom/vhf.1001.dcm", volume_in_folder());
}

// The files that an audit found to crash or stall the readers, where they are at hand.
TEST_F(Damaged, FilesOfTheAudit) {
  MARROW_NEED_DATA(audit, "damaged");
  for (const auto& entry : std::filesystem::directory_iterator(audit)) {
    const Path path = entry.path();
    if (path.extension() == ".dcm") EXPECT_REFUSED(image_at(path), path.filename(), "");
    if (path.extension() == ".nrrd") EXPECT_REFUSED(files::read_volume_file(path, {}), path.filename(), "");
  }
}

}  // namespace damaged_test
