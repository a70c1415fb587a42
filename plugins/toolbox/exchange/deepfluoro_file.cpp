// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/deepfluoro_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hdf5.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::exchange {
namespace {

const std::string kParameters = "proj-params";
constexpr std::size_t kMostVoxels = 1'000'000'000;

template <int Size>
Eigen::Matrix<double, Size, Size> matrix(const Hdf5Reader& file, const std::string& key) {
  const std::vector<double> values = file.numbers(key, std::size_t(Size * Size));
  return Eigen::Map<const Eigen::Matrix<double, Size, Size, Eigen::RowMajor>>(values.data());
}

/// A rigid motion. Its rotation is made exact, because the file has few digits.
Eigen::Matrix4d motion(const Hdf5Reader& file, const std::string& key, bool inverse) {
  Eigen::Matrix4d motion = matrix<4>(file, key);
  const auto rotation = rotation_near(motion.topLeftCorner<3, 3>());
  if (!rotation || (motion.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    file.refuse(key, "expected a rotation and a translation as a 4x4 matrix; the file is damaged");
  motion.topLeftCorner<3, 3>() = *rotation;
  motion.row(3) = Eigen::RowVector4d(0, 0, 0, 1);
  return inverse ? Eigen::Matrix4d(motion.inverse()) : motion;
}

Eigen::Vector3d vector3(const Hdf5Reader& file, const std::string& key) {
  const std::vector<double> values = file.numbers(key, 3);
  return {values[0], values[1], values[2]};
}

int side_px(const Hdf5Reader& file, const std::string& key) {
  const double side = file.number(key);
  if (!(side >= 1 && side <= 65536) || side != std::floor(side))
    file.refuse(key, formatted("expected 1 to 65536 pixels, got {:f}", side));
  return int(side);
}

/// Words of which a label's name must have all of one line to belong to the bone.
std::vector<std::vector<std::string>> words_of(const std::string& bone) {
  if (bone == "pelvis") return {{"pelvis"}, {"sacrum"}, {"vertebra"}};
  return {{bone.substr(0, bone.find('-')), "femur"}};
}

bool is_of(const std::string& label, const std::string& bone) {
  std::string small = label;
  std::transform(small.begin(), small.end(), small.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto has = [&](const std::string& word) { return small.find(word) != std::string::npos; };
  const auto lines = words_of(bone);
  return std::any_of(lines.begin(), lines.end(), [&](const std::vector<std::string>& words) {
    return std::all_of(words.begin(), words.end(), has);
  });
}

std::string group_of(const DeepfluoroImage& image) { return image.specimen + "/projections/" + image.name; }

}  // namespace

DeepfluoroFile::DeepfluoroFile(const std::filesystem::path& path) : file_(new Hdf5Reader(path)) {
  for (const std::string& specimen : file_->names_in("/"))
    for (const std::string& name : file_->names_in(specimen + "/projections")) images_.push_back({specimen, name});
  if (images_.empty() || !file_->has(kParameters))
    throw Error(
        path.string() +
        ": expected the file of full resolution of the DeepFluoro data set, with 'proj-params' and groups such as "
        "17-1882/projections/000");
}

DeepfluoroFile::~DeepfluoroFile() = default;

std::vector<std::string> DeepfluoroFile::specimens() const {
  std::vector<std::string> names;
  for (const DeepfluoroImage& image : images_)
    if (names.empty() || names.back() != image.specimen) names.push_back(image.specimen);
  return names;
}

Volume DeepfluoroFile::ct(const std::string& specimen) const {
  const std::string group = specimen + "/vol/";
  const std::vector<std::size_t> shape = file_->shape(group + "pixels");
  if (shape.size() != 3) file_->refuse(group + "pixels", "expected three axes, got " + formatted("{}", shape.size()));
  Volume ct;
  double voxels = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    voxels *= double(shape[2 - k]);  // the last axis runs fastest: columns
    ct.grid.size[k] = int(std::min<std::size_t>(shape[2 - k], 1'000'000));
  }
  if (!(voxels >= 1 && voxels <= double(kMostVoxels)))
    file_->refuse(group + "pixels", formatted("expected 1 to {} voxels, got {:.0f}", kMostVoxels, voxels));
  ct.grid.spacing_mm = vector3(*file_, group + "spacing");
  ct.grid.origin_mm = vector3(*file_, group + "origin");
  const auto direction = rotation_near(matrix<3>(*file_, group + "dir-mat"));
  if (!direction) file_->refuse(group + "dir-mat", "expected a rotation; the file is damaged");
  ct.grid.direction = *direction;
  ct.values = file_->floats(group + "pixels", ct.grid.count());
  check_volume(ct, group);
  return ct;
}

std::vector<std::uint8_t> DeepfluoroFile::labelled(const std::string& specimen, const std::string& bone,
                                                   const Grid& grid) const {
  const std::string definitions = specimen + "/vol-seg/labels-def";
  std::vector<float> wanted;
  std::string known;
  for (const std::string& number : file_->names_in(definitions)) {
    const std::string name = file_->text(definitions + "/" + number);
    if (is_of(name, bone)) wanted.push_back(float(std::atoi(number.c_str())));
    known += (known.empty() ? "" : ", ") + printable(name.substr(0, 60));
  }
  if (wanted.empty())
    file_->refuse(definitions, "no label is of the bone '" + bone + "'; there are " + (known.empty() ? "none" : known));
  const std::vector<float> labels = file_->floats(specimen + "/vol-seg/image/pixels", grid.count());
  std::vector<std::uint8_t> inside(labels.size());
  for (std::size_t i = 0; i < labels.size(); ++i)
    inside[i] = std::find(wanted.begin(), wanted.end(), labels[i]) != wanted.end();
  return inside;
}

std::vector<Landmarks::Point> DeepfluoroFile::landmarks(const std::string& specimen) const {
  const std::string group = specimen + "/vol-landmarks";
  std::vector<Landmarks::Point> points;
  for (const std::string& name : file_->names_in(group)) points.push_back({name, vector3(*file_, group + "/" + name)});
  return points;
}

DeepfluoroView DeepfluoroFile::view(const DeepfluoroImage& image, const std::string& bone,
                                    const DeepfluoroReading& reading) const {
  const std::string group = group_of(image);
  const Eigen::Matrix4d camera_from_world = motion(*file_, kParameters + "/extrinsic", reading.inverse_extrinsic),
                        ct_from_world =
                            motion(*file_, group + "/gt-poses/cam-to-" + bone + "-vol", reading.inverse_pose);
  const Eigen::Matrix4d in_camera = camera_from_world * ct_from_world.inverse();
  // What lies in front of the source has negative z in the file's camera, so the third coordinate's sign is turned.
  const Eigen::Matrix<double, 3, 4> pixel_from_ct =
      -matrix<3>(*file_, kParameters + "/intrinsic") * in_camera.topRows<3>();
  const Eigen::Vector2i size(side_px(*file_, kParameters + "/num-cols"), side_px(*file_, kParameters + "/num-rows"));
  DeepfluoroView view;
  view.mirror = pixel_from_ct.leftCols<3>().determinant() < 0 ? Mirror::left_right : Mirror::none;
  view.camera = camera_of(pixel_from_ct, size, view.mirror, "image " + image.specimen + "/" + image.name);
  for (const std::string& name : file_->names_in(group + "/gt-landmarks")) {
    std::vector<double> pixel = file_->numbers(group + "/gt-landmarks/" + name, 2);
    if (reading.rows_first) std::swap(pixel[0], pixel[1]);
    view.landmarks.push_back({name, mirrored({pixel[0], pixel[1]}, view.mirror, size.x(), size.y())});
  }
  return view;
}

bool DeepfluoroFile::shows(const DeepfluoroImage& image, const std::string& bone) const {
  const std::string key = group_of(image) + "/gt-poses/" + bone + "-good-fov";
  return !file_->has(key) || file_->number(key) != 0;
}

Image DeepfluoroFile::pixels(const DeepfluoroImage& image, const DeepfluoroView& view) const {
  const Camera& camera = view.camera;
  const std::string key = group_of(image) + "/image/pixels";
  const std::vector<std::size_t> shape = file_->shape(key);
  if (shape != std::vector<std::size_t>{std::size_t(camera.height_px), std::size_t(camera.width_px)})
    file_->refuse(
        key, formatted("expected {} rows of {} pixels, as 'proj-params' has them", camera.height_px, camera.width_px));
  std::vector<float> values = file_->floats(key, shape[0] * shape[1]);
  Image result{cv::Mat(camera.height_px, camera.width_px, CV_32F, values.data()).clone()};
  if (view.mirror == Mirror::left_right) cv::flip(result.pixels, result.pixels, 1);
  return result;
}

}  // namespace marrow::exchange
