// SPDX-License-Identifier: Apache-2.0
// Checks for nodes that read one file. Files that are no data of theirs must be refused with their name. A file that
// this suite writes in a common format, whose values are known, must be read as it is.
#include <algorithm>
#include <fstream>
#include <marrow/plugin.hpp>
#include <opencv2/core.hpp>
#include <random>

#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {
namespace {

namespace fs = std::filesystem;

fs::path written(const std::string& name, const std::string& bytes) {
  const fs::path file = files_folder() / name;
  std::ofstream stream(file, std::ios::binary);
  stream << bytes;
  stream.close();
  if (!stream) throw Error("cannot write " + file.string());
  return file;
}

/// The node with the file as its option `path`.
Subject reading(const Subject& subject, const fs::path& file) {
  const NodeInfo& node = subject.info();
  const auto path = std::find_if(node.options.begin(), node.options.end(), [](const OptionInfo& one) {
    return one.name == "path" && one.type == OptionType::path;
  });
  if (path == node.options.end()) throw NotApplicable("it has no option 'path' that names a file");
  return subject.with("path", file);
}

std::string noise() {
  std::mt19937 random(3);
  std::string bytes;
  for (int i = 0; i < 4096; ++i) bytes += char(random());
  return bytes;
}

/// Files that hold nothing that could be read, and files whose headers promise more than there is.
std::vector<fs::path> damaged_files() {
  const fs::path folder = files_folder() / "folder.yaml";
  fs::create_directories(folder);
  std::vector<fs::path> files{folder, files_folder() / "missing.yaml", written("empty.yaml", ""),
                              written("of-another-kind.yaml", "marrow-nothing: 1\n")};
  for (const char* ending : {"yaml", "txt", "ply", "png", "nrrd"}) {
    files.push_back(written(std::string("one-byte.") + ending, "x"));
    files.push_back(written(std::string("noise.") + ending, noise()));
  }
  files.push_back(written("huge.ply",
                          "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
                          "property float y\nproperty float z\nend_header\n"));
  files.push_back(written("huge.nrrd",
                          "NRRD0004\ntype: short\ndimension: 3\nsizes: 100000 100000 100000\nspacings: 1 1 1\n"
                          "encoding: raw\n\n"));
  files.push_back(written("huge.stl", std::string(80, ' ') + std::string("\xff\xff\xff\xff", 4)));
  return files;
}

double not_refused(const Subject& subject) {
  double count = 0;
  std::string first;
  for (const fs::path& file : damaged_files()) {
    const Result result = reading(subject, file).call({});
    const bool is_named = result.refusal && result.refusal->find(file.filename().string()) != std::string::npos;
    if (result.refusal && is_named) expect_reason(*result.refusal);
    if (!is_named && first.empty())
      first = file.filename().string() + (result.refusal ? " is refused without its name: " + *result.refusal
                                                         : " is taken, although it holds nothing");
    count += !is_named;
  }
  if (count > 0) throw Failure(formatted("{:.0f} files are not refused by their names: {}", count, first));
  return 0;
}

/// What the node reads from a file that this suite wrote. If it refuses the file, it reads another format.
template <class T>
T read_back(const Subject& subject, const fs::path& file) {
  const std::vector<PortInfo>& ports = subject.info().outputs;
  const auto port = std::find_if(ports.begin(), ports.end(),
                                 [](const PortInfo& one) { return one.type == TypeInfo::of<T>() && one.axis.empty(); });
  if (port == ports.end()) throw NotApplicable("it gives no " + TypeInfo::of<T>().id);
  const Result result = reading(subject, file).call({});
  if (result.refusal) throw NotApplicable("it reads another format: " + *result.refusal);
  return result.outputs[std::size_t(port - ports.begin())].as<T>();
}

double mesh_off_mm(const Subject& subject) {
  const Mesh truth = analytic::mesh_of({{{3, -2, 40}, {8, 10, 30}}});
  std::string ply = formatted(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face "
      "{}\nproperty list uchar int vertex_indices\nend_header\n",
      truth.vertices_mm.size(), truth.triangles.size());
  for (const Eigen::Vector3d& vertex : truth.vertices_mm)
    ply += formatted("{:.6f} {:.6f} {:.6f}\n", vertex.x(), vertex.y(), vertex.z());
  for (const auto& corners : truth.triangles) ply += formatted("3 {} {} {}\n", corners[0], corners[1], corners[2]);
  const Mesh found = read_back<Mesh>(subject, written("truth.ply", ply));
  expect(found.triangles.size() == truth.triangles.size(),
         formatted("{} triangles are read of {}", found.triangles.size(), truth.triangles.size()));
  double most = 0;
  for (std::size_t t = 0; t < truth.triangles.size(); ++t) {
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();
    for (int corner = 0; corner < 3; ++corner)
      apart += truth.vertices_mm[truth.triangles[t][std::size_t(corner)]] -
               found.vertices_mm[found.triangles[t][std::size_t(corner)]];
    most = std::max(most, apart.norm() / 3);
  }
  return most;
}

double pose_off_mm(const Subject& subject) {
  const Pose found = read_back<Pose>(
      subject, written("truth.yaml",
                       "marrow-pose: 1\ntarget: world\nsource: ct\nmatrix:\n  - [0, -1, 0, 12.5]\n  - [1, 0, 0, -7]\n"
                       "  - [0, 0, 1, 300.25]\n  - [0, 0, 0, 1]\n"));
  const Eigen::Vector3d point = found.world_from_model * Eigen::Vector3d(10, 20, 30);
  return (point - Eigen::Vector3d(12.5 - 20, -7 + 10, 300.25 + 30)).norm();
}

double image_off(const Subject& subject) {
  cv::Mat_<std::uint16_t> truth(24, 40);
  std::string mha =
      "ObjectType = Image\nNDims = 2\nDimSize = 40 24\nElementType = MET_USHORT\nElementSpacing = 1 1\n"
      "ElementByteOrderMSB = False\nElementDataFile = LOCAL\n";
  for (int v = 0; v < truth.rows; ++v)
    for (int u = 0; u < truth.cols; ++u) {
      truth(v, u) = std::uint16_t(1000 + 700 * v + 13 * u);
      mha += char(truth(v, u) & 0xff), mha += char(truth(v, u) >> 8);
    }
  const Image found = read_back<Image>(subject, written("truth.mha", mha));
  expect(found.pixels.size() == truth.size(), "the image has another size");
  cv::Mat_<float> read;
  found.pixels.convertTo(read, CV_32F);
  return cv::norm(read, cv::Mat_<float>(truth), cv::NORM_INF);
}

double volume_off_hu(const Subject& subject) {
  std::string nrrd =
      "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 4 3\n"
      "space directions: (0.5,0,0) (0,0.75,0) (0,0,2)\nspace origin: (-10,20,-30)\nendian: little\nencoding: raw\n\n";
  for (int i = 0; i < 5 * 4 * 3; ++i) {
    const auto value = std::int16_t(37 * i - 1000);
    nrrd += char(value & 0xff), nrrd += char(value >> 8);
  }
  const Volume found = read_back<Volume>(subject, written("truth.nrrd", nrrd));
  expect(found.values.size() == 60, formatted("{} voxels are read of 60", found.values.size()));
  expect((found.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 2)).norm() < 1e-9 &&
             (found.grid.origin_mm - Eigen::Vector3d(-10, 20, -30)).norm() < 1e-9,
         "the grid lies elsewhere, or its voxels have another size");
  double most = 0;
  for (int i = 0; i < 60; ++i) most = std::max(most, std::abs(double(found.values[std::size_t(i)]) - (37 * i - 1000)));
  return most;
}

Suite read_suite() {
  Suite suite;
  suite.accuracy = {
      {{"damaged", "files that are missing, empty, damaged or of another kind, and are not refused by their names", 0,
        "files"},
       not_refused},
      {{"mesh", "the surface of a PLY file from what is written there", 1e-4, "mm"}, mesh_off_mm},
      {{"pose", "the pose of a file of marrow's from what is written there", 1e-9, "mm"}, pose_off_mm},
      {{"image", "the pixels of a MetaImage of 16 bits from what is written there", 0, "grey values"}, image_off},
      {{"volume", "the samples of an NRRD file from what is written there", 0, "HU"}, volume_off_hu}};
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("read", marrow::conformance::read_suite()); }
