// SPDX-License-Identifier: Apache-2.0
// Damaged files of every kind that is read: cut off at random places, bytes of the header flipped, sizes that lie. Of
// each kind a hundred copies are refused with an error that names them, or read, within 64 MB; files made to harm are
// in hostile_*_test.cpp.
#include <gtest/gtest.h>

#include <cstdio>

#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/files/calibration_file.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/points_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "plugins/read/case.cpp"
#include "read/damage.hpp"
#include "read/dicom_text.hpp"
#include "read/itk_files.hpp"

namespace {

using namespace marrow::test;
using marrow::files::VolumeReading;
using Path = std::filesystem::path;

constexpr int kCuts = 40, kFlips = 60;
/// What a reader may reserve for small files: the largest sample unpacks to 200 kB, and the libraries' own buffers are
/// some MB.
constexpr std::size_t kMemory = 64 << 20;

/// Reads damaged copies in a folder that may hold other, good files.
void expect_handled(const TemporaryFolder& folder, const Sample& sample, const std::function<void(const Path&)>& read) {
  std::map<Outcome, int> counts;
  const Path path = folder / sample.name;
  put(path, sample.bytes);
  std::string said;
  ASSERT_EQ(outcome_of([&] { read(path); }, path.filename(), kMemory, said), Outcome::accepted)
      << sample.name << " as it was: " << said;
  for (const Damaged& copy : damaged_copies(sample, kCuts, kFlips)) {
    put(path, copy.bytes);
    const Outcome outcome = outcome_of([&] { read(path); }, path.filename(), kMemory, said);
    ++counts[outcome];
    EXPECT_TRUE(outcome == Outcome::refused || (outcome == Outcome::accepted && !copy.must_be_refused))
        << sample.name << ", " << copy.how << ": " << name_of(outcome) << ": " << said;
    EXPECT_EQ(without_folder(said, folder.path()).find("0x"), std::string::npos) << said;
    EXPECT_EQ(said.find("std::"), std::string::npos) << said;
  }
  put(path, sample.bytes);
  std::printf("%-24s %3d refused, %3d read\n", sample.name.c_str(), counts[Outcome::refused],
              counts[Outcome::accepted]);
}

std::string little_bytes(std::uint64_t value, int width) {
  std::string bytes;
  for (int i = 0; i < width; ++i) bytes += char(value >> (8 * i));
  return bytes;
}

void image_at(const Path& path) { marrow::files::read_image_file(path); }
void volume_at(const Path& path) {
  VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  marrow::files::read_volume_file(path, reading);
}

ItkGrid<std::uint16_t> picture() {
  ItkGrid<std::uint16_t> grid{.size = {60, 40}};
  for (unsigned i = 0; i < 2400; ++i) grid.samples.push_back(std::uint16_t(i * 40503u));
  return grid;
}
ItkGrid<std::int16_t> stack() {
  ItkGrid<std::int16_t> grid{.size = {20, 16, 12}};
  for (unsigned i = 0; i < 20 * 16 * 12; ++i) grid.samples.push_back(std::int16_t(i * 7919u % 3000));
  return grid;
}

template <class T>
Sample written(const TemporaryFolder& folder, const std::string& name, const ItkGrid<T>& grid, bool compressed,
               std::size_t header, std::vector<std::pair<std::string, std::string>> lies = {}) {
  write_itk(folder / name, grid, compressed);
  Sample sample{name, bytes_of(folder / name), header, std::move(lies), false};
  sample.header_bytes = std::min(sample.header_bytes, sample.bytes.size());
  return sample;
}

TEST(Damaged, Png) {
  const TemporaryFolder folder;
  expect_handled(folder, written(folder, "a.png", picture(), true, 60), image_at);
}

TEST(Damaged, Tiff) {
  const TemporaryFolder folder;
  for (const bool compressed : {false, true}) {
    Sample sample = written(folder, compressed ? "packed.tif" : "a.tif", picture(), compressed, 0);
    // ITK writes the directory behind the pixels: the flips go there, by turning the file's last bytes into the header.
    sample.header_bytes = sample.bytes.size();
    const std::string width = std::string("\0\1\3\0\1\0\0\0\x3C\0", 10);  // ImageWidth, SHORT, 1, 60
    if (sample.bytes.find(width) != std::string::npos)
      sample.lies.push_back({width, std::string("\0\1\4\0\1\0\0\0\x60\xEA\0\0", 12).substr(0, 10)});
    expect_handled(folder, sample, image_at);
  }
}

TEST(Damaged, TiffStack) {
  const TemporaryFolder folder;
  ItkGrid<std::uint16_t> grid{.size = {20, 16, 12}, .samples = std::vector<std::uint16_t>(20 * 16 * 12, 7)};
  Sample sample = written(folder, "stack.tif", grid, false, 0);
  sample.header_bytes = sample.bytes.size();
  expect_handled(folder, sample, volume_at);
}

std::string tiff_pages(const std::vector<std::pair<int, int>>& sizes) {
  std::string bytes = "II" + little_bytes(42, 2) + little_bytes(8, 4);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto [width, height] = sizes[i];
    const std::uint64_t values = std::uint64_t(width) * std::uint64_t(height) * 2,
                        begin = bytes.size() + 2 + 12 * 9 + 4;
    const std::pair<int, std::uint64_t> tags[] = {{256, width}, {257, height}, {258, 16},     {259, 1},     {262, 1},
                                                  {273, begin}, {277, 1},      {278, height}, {279, values}};
    bytes += little_bytes(9, 2);
    for (const auto& [tag, value] : tags)
      bytes += little_bytes(std::uint64_t(tag), 2) + little_bytes(4, 2) + little_bytes(1, 4) + little_bytes(value, 4);
    bytes += little_bytes(i + 1 < sizes.size() ? begin + values : 0, 4) + std::string(values, 'x');
  }
  return bytes;
}

TEST(Damaged, TiffPagesOfDifferentSizes) {
  const TemporaryFolder folder;
  for (const auto& sizes :
       std::vector<std::vector<std::pair<int, int>>>{{{8, 8}, {200, 200}}, {{200, 200}, {8, 8}}, {{8, 8}, {8, 9}}}) {
    put(folder / "a.tif", tiff_pages(sizes));
    std::string said;
    EXPECT_EQ(outcome_of([&] { volume_at(folder / "a.tif"); }, "a.tif", kMemory, said), Outcome::refused) << said;
    EXPECT_NE(said.find("page 2 has another size"), std::string::npos) << said;
  }
  put(folder / "a.tif", tiff_pages({{8, 8}, {8, 8}}));
  EXPECT_NO_THROW(volume_at(folder / "a.tif"));
}

TEST(Damaged, MetaImage) {
  const TemporaryFolder folder;
  expect_handled(folder,
                 written(folder, "a.mha", stack(), false, 300,
                         {{"DimSize = 20 16 12", "DimSize = 20 16 99999"},
                          {"DimSize = 20 16 12", "DimSize = 50000 50000 50000"},
                          {"DimSize = 20 16 12", "DimSize = -20 16 12"},
                          {"DimSize = 20 16 12", "DimSize = 20 16"},
                          {"MET_SHORT", "MET_DOUBLE"},
                          {"NDims = 3", "NDims = 30000000"},
                          {"NDims = 3", "NDims = 11"},
                          {"NDims = 3", "NDims = 0"},
                          {"NDims = 3", "NDims = -3"},
                          {"BinaryData = True", "HeaderSize = 999999999\nBinaryData = True"},
                          {"BinaryData = True", "ElementNumberOfChannels = 100000000\nBinaryData = True"}}),
                 volume_at);
  expect_handled(folder,
                 written(folder, "packed.mha", stack(), true, 300,
                         {{"DimSize = 20 16 12", "DimSize = 20 16 4000"},
                          {"DimSize = 20 16 12", "DimSize = 50000 50000 50000"},
                          {"CompressedDataSize = ", "CompressedDataSize = 99999999"}}),
                 volume_at);
}

TEST(Damaged, MetaImageWithItsDataBeside) {
  const TemporaryFolder folder, other;
  write_itk(other / "a.mhd", stack());
  std::filesystem::copy(other / "a.raw", folder / "a.raw");
  const Sample sample{"a.mhd",
                      bytes_of(other / "a.mhd"),
                      300,
                      {{"DimSize = 20 16 12", "DimSize = 20 16 13"}, {"a.raw", "b.raw"}, {"a.raw", "../a.raw"}},
                      true};
  Sample cut = sample;
  cut.header_bytes = std::min(sample.bytes.size(), sample.header_bytes);
  expect_handled(folder, cut, [&](const Path&) {
    try {
      marrow::files::read_volume_file(folder.path(), {});
    } catch (const marrow::Error& error) {
      throw marrow::Error("a.mhd: " + std::string(error.what()));  // the error may name the data or the folder
    }
  });
}

TEST(Damaged, Nrrd) {
  const TemporaryFolder folder;
  expect_handled(folder,
                 written(folder, "a.nrrd", stack(), false, 250,
                         {{"sizes: 20 16 12", "sizes: 20 16 99999"},
                          {"sizes: 20 16 12", "sizes: 50000 50000 50000"},
                          {"sizes: 20 16 12", "sizes: 0 16 12"},
                          {"type: short", "type: double"},
                          {"dimension: 3", "dimension: 300"},
                          {"encoding: raw", "byte skip: 999999999\nencoding: raw"},
                          {"sizes: 20 16 12", "sizes: 20 16 12 12"},
                          {"encoding: raw", "encoding: ascii"},
                          {"sizes: 20 16 12", "sizes: 20 16 3000"}}),
                 volume_at);
  expect_handled(folder,
                 written(folder, "packed.nrrd", stack(), true, 250,
                         {{"sizes: 20 16 12", "sizes: 20 16 4000"}, {"sizes: 20 16 12", "sizes: 50000 50000 50000"}}),
                 volume_at);
}

TEST(Damaged, Nifti) {
  const TemporaryFolder folder;
  const auto dimensions = [](int x, int y, int z) {
    return little_bytes(3, 2) + little_bytes(std::uint64_t(x), 2) + little_bytes(std::uint64_t(y), 2) +
           little_bytes(std::uint64_t(z), 2);
  };
  expect_handled(folder,
                 written(folder, "a.nii", stack(), false, 352,
                         {{dimensions(20, 16, 12), dimensions(20, 16, 13)},
                          {dimensions(20, 16, 12), dimensions(32767, 32767, 32767)},
                          {dimensions(20, 16, 12), dimensions(-20, 16, 12)},
                          {dimensions(20, 16, 12), dimensions(0, 16, 12)},
                          {dimensions(20, 16, 12), little_bytes(9, 2) + dimensions(20, 16, 12).substr(2)},
                          {dimensions(20, 16, 12), little_bytes(0, 2) + dimensions(20, 16, 12).substr(2)}}),
                 volume_at);
  Sample packed = written(folder, "a.nii.gz", stack(), true, 352);
  packed.header_bytes = 200;
  expect_handled(folder, packed, volume_at);
}

std::string fluoroscopy_file(int width, int height) {
  Elements elements = fluoroscopy();
  elements[0x00280010] = "US:" + std::to_string(height);
  elements[0x00280011] = "US:" + std::to_string(width);
  elements[0x7FE00010] = "OW:" + std::string(std::size_t(width * height * 2), 'x');
  return dicom_file(elements);
}

TEST(Damaged, DicomImage) {
  const TemporaryFolder folder;
  Sample sample{"a.dcm", fluoroscopy_file(48, 32), 0, {}, false};
  sample.header_bytes = sample.bytes.size() - 48 * 32 * 2;
  const std::string rows = dicom_element(0x00280010, "US", little_bytes(32, 2));
  const std::string pixels = little_bytes(48 * 32 * 2, 4);
  sample.lies = {
      {rows, dicom_element(0x00280010, "US", little_bytes(60000, 2))},
      {pixels, little_bytes(0xFFFFFFF0u, 4)},
      {pixels, little_bytes(48 * 32 * 2 + 2, 4)},
      {dicom_element(0x00280100, "US", little_bytes(16, 2)), dicom_element(0x00280100, "US", little_bytes(64, 2))},
      {dicom_element(0x00280002, "US", little_bytes(1, 2)), dicom_element(0x00280002, "US", little_bytes(30000, 2))},
      {dicom_element(0x00280010, "US", little_bytes(32, 2)), dicom_element(0x00280008, "IS", "999999999 ") + rows},
      {rows, dicom_element(0x00280010, "US", little_bytes(0, 2))},
      {"CS" + little_bytes(2, 2) + "XA", "CS" + little_bytes(0xFFFE, 2) + "XA"}};
  expect_handled(folder, sample, image_at);
  // The camera needs the header alone, so a file whose pixels are damaged in themselves may pass.
  expect_handled(folder, sample, [](const Path& path) { marrow::files::read_xray_geometry(path, 1, {}); });
}

TEST(Damaged, DicomSeries) {
  const TemporaryFolder good, folder;
  for (int k = 0; k < 4; ++k) {
    DicomSlice slice;
    slice.width = slice.height = 32;
    slice.position = {0, 0, double(k)};
    slice.values.assign(1024, std::int16_t(k));
    write_dicom((k == 2 ? good : folder) / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  Sample sample{"s2.dcm", bytes_of(good / "s2.dcm"), 0, {}, false};
  sample.header_bytes = sample.bytes.size() - 2048;
  expect_handled(folder, sample, [&](const Path&) {
    try {
      marrow::files::read_volume_file(folder.path(), {});
    } catch (const marrow::Error& error) {
      throw marrow::Error("s2.dcm: " + std::string(error.what()));  // the error may name its neighbour or the folder
    }
  });
}

std::string stl_binary(std::uint32_t triangles) {
  std::string bytes(80, ' ');
  bytes += little_bytes(triangles, 4);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    float numbers[12] = {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, float(i)};
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    bytes += little_bytes(0, 2);
  }
  return bytes;
}

TEST(Damaged, Meshes) {
  const TemporaryFolder folder;
  const auto read = [](const Path& path) { marrow::files::read_mesh_file(path, 1); };
  expect_handled(folder,
                 {"a.stl",
                  stl_binary(100),
                  84,
                  {{little_bytes(100, 4), little_bytes(0xFFFFFFFFu, 4)}, {little_bytes(100, 4), little_bytes(101, 4)}},
                  false},
                 read);
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 "
      "2 3\n";
  expect_handled(folder,
                 {"a.ply",
                  text,
                  200,
                  {{"vertex 4", "vertex 4000000000"},
                   {"vertex 4", "vertex 5"},
                   {"face 4", "face 90000000"},
                   {"\n3 0 2 1", "\n4000000000 0 2 1"},
                   {"3 1 2 3", "3 1 2 9"}},
                  true},
                 read);
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 1\n"
      "property list uint uint vertex_indices\nend_header\n";
  for (float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f})
    binary.append(reinterpret_cast<const char*>(&value), 4);
  binary += little_bytes(3, 4) + little_bytes(0, 4) + little_bytes(1, 4) + little_bytes(2, 4);
  expect_handled(folder,
                 {"b.ply",
                  binary,
                  190,
                  {{little_bytes(3, 4) + little_bytes(0, 4) + little_bytes(1, 4),
                    little_bytes(0xFFFFFFFFu, 4) + little_bytes(0, 4) + little_bytes(1, 4)}},
                  false},
                 read);
}

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
                 [](const Path& path) { marrow::files::read_calibration_file(path); });
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
  const auto read = [&](const Path&) { read_case({folder / "case"}); };
  expect_handled(
      folder,
      [&] {
        Sample s = text_sample("case/case.yaml", text, {{"ct.mha", "../ct.mha"}, {"[[1, 2, 3]]", "[]"}});
        return s;
      }(),
      read);
}

}  // namespace
