// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/camera_file.hpp"

#include <numeric>

#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/exchange/jointtrack.hpp"
#include "marrow/toolbox/exchange/rtk_geometry.hpp"
#include "marrow/toolbox/exchange/xreg_file.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::read {
namespace {

/// How many projections a file of several holds. Throws Error as the readers of the two formats do.
std::size_t count_projections(const std::filesystem::path& path) {
  return projections_in(path) == Projections::rtk ? exchange::read_rtk(path).size() : exchange::read_xreg(path).size();
}

void check_needed(const std::filesystem::path& path, const CameraReading& reading, CameraFormat format) {
  const bool is_rtk = format == CameraFormat::rtk, has_projections = is_rtk || format == CameraFormat::xreg;
  const auto check = [&](bool is_given, bool is_needed, const char* name) {
    if (is_given && !is_needed)
      throw Error(path.string() + ": " + name + " is not for this format of cameras; leave it out");
  };
  check(reading.projection >= 0, has_projections, "projection");
  check(!reading.size.pixel_mm.empty(), is_rtk, "pixel_mm");
  check(!reading.size.corner_mm.empty(), is_rtk, "corner_mm");
  check(reading.mirror != exchange::Mirror::none, has_projections, "mirror");
  if (reading.scale != 1 && format == CameraFormat::own)
    throw Error(path.string() + ": scale is not for marrow's cameras, whose lengths are in mm; leave it out");
}

int only_projection(const std::filesystem::path& path) {
  const std::size_t count = count_projections(path);
  if (count == 1) return 0;
  throw Error(formatted("{}: has {} projections; say by its number, counted from 0, which one is meant (projection)",
                        path.string(), count));
}

/// The cameras of the projections with these numbers, or of all. `camera(one, what)` makes one.
template <class Projection, class MakeCamera>
std::vector<Camera> cameras_of(const std::vector<Projection>& all, std::vector<int> numbers, const std::string& what,
                               MakeCamera camera) {
  if (numbers.empty()) {
    numbers.resize(all.size());
    std::iota(numbers.begin(), numbers.end(), 0);
  }
  std::vector<Camera> cameras;
  for (const int number : numbers) {
    if (number < 0 || std::size_t(number) >= all.size())
      throw Error(
          formatted("{}: has {} projections, counted from 0; there is no projection {}", what, all.size(), number));
    cameras.push_back(camera(all[std::size_t(number)], formatted("{}: projection {}", what, number)));
  }
  return cameras;
}

/// Some formats do not give the size of the images: then it is taken from the image.
files::CameraInFile camera_in_file(const ViewSource& source, const Image& image, const Context& context) {
  CameraReading reading{
      source.projection, {{}, source.pixel_mm, source.corner_mm}, exchange::Mirror::none, source.scale};
  const CameraFormat format = camera_format(source.camera_file);
  if (format == CameraFormat::rtk || format == CameraFormat::xreg) reading.mirror = exchange::mirror_of(source.mirror);
  if (format == CameraFormat::rtk || format == CameraFormat::plastimatch || format == CameraFormat::jointtrack)
    reading.size.size_px = {double(image.width()), double(image.height())};
  const files::CameraInFile found = read_camera(source.camera_file, reading);
  if (const std::string doubt = doubt_about_unit(source.camera_file, found.camera, source.scale); !doubt.empty())
    context.warn("view '" + source.name + "': " + doubt);
  return found;
}

[[noreturn]] void throw_two_distortions(const std::string& view, const std::filesystem::path& first,
                                        const std::filesystem::path& second) {
  throw Error("view '" + view + "': both " + first.string() + " and " + second.string() +
              " give a distortion, which can be removed only once; delete it from one of them");
}

}  // namespace

CameraFormat camera_format(const std::filesystem::path& path) {
  const std::string end = files::in_small_letters(path.extension().string());
  if (end == ".yaml" || end == ".yml") return CameraFormat::own;
  const Projections projections = projections_in(path);
  if (projections == Projections::rtk) return CameraFormat::rtk;
  if (projections == Projections::xreg) return CameraFormat::xreg;
  if (exchange::is_maya_camera(path)) return CameraFormat::maya;
  if (exchange::is_jointtrack_camera(path)) return CameraFormat::jointtrack;
  return exchange::is_plastimatch_camera(path) ? CameraFormat::plastimatch : CameraFormat::xmalab;
}

files::CameraInFile read_camera(const std::filesystem::path& path, const CameraReading& reading) {
  const CameraFormat format = camera_format(path);
  check_needed(path, reading, format);
  files::CameraInFile found;
  if (format == CameraFormat::rtk || format == CameraFormat::xreg) {
    const int number = reading.projection >= 0 ? reading.projection : only_projection(path);
    found.camera = read_projections(path, {number}, reading.size, reading.mirror, reading.scale)[0];
  } else {
    if (format == CameraFormat::plastimatch)
      found.camera = exchange::read_plastimatch_camera(path, reading.size);
    else if (format == CameraFormat::maya)
      found.camera = exchange::read_maya_camera(path);
    else if (format == CameraFormat::jointtrack)
      found.camera = exchange::read_jointtrack_camera(path, reading.size);
    else
      found = files::read_camera_file(path);
    found.camera.camera_from_world.translation_mm *= reading.scale;
  }
  if (reading.size.size_px.empty()) return found;
  const Eigen::Vector2i size = size_px(reading.size, path.string());
  if (size.x() != found.camera.width_px || size.y() != found.camera.height_px)
    throw Error(formatted("{}: this camera is of images of {} x {} pixels, but the image has {} x {}", path.string(),
                          found.camera.width_px, found.camera.height_px, size.x(), size.y()));
  return found;
}

std::string doubt_about_unit(const std::filesystem::path& path, const Camera& camera, double scale) {
  if (camera_format(path) == CameraFormat::own) return {};
  const std::string doubt = files::doubt_about_distance(camera, scale);
  return doubt.empty() ? doubt : path.string() + ": " + doubt;
}

Projections projections_in(const std::filesystem::path& path) {
  const std::string end = files::in_small_letters(path.extension().string());
  return end == ".xml" ? Projections::rtk : end == ".h5" || end == ".hdf5" ? Projections::xreg : Projections::none;
}

int projection_number(double number, const std::string& what) {
  if (!(number >= 0 && number <= 1e6) || number != double(int(number)))
    throw Error(formatted("{}: projections: expected whole numbers from 0, got {:f}", what, number));
  return int(number);
}

std::vector<Camera> read_projections(const std::filesystem::path& path, const std::vector<int>& numbers,
                                     const exchange::ImageSize& size, exchange::Mirror mirror, double scale) {
  if (projections_in(path) == Projections::none)
    throw Error(path.string() + ": expected RTK's geometry (.xml) or xReg's projection data (.h5)");
  exchange::ImageSize in_file = size;  // in the file's unit, as RTK's distances are
  for (double& side : in_file.pixel_mm) side /= scale;
  for (double& place : in_file.corner_mm) place /= scale;
  std::vector<Camera> cameras = projections_in(path) == Projections::rtk
                                    ? cameras_of(exchange::read_rtk(path), numbers, path.string(),
                                                 [&](const exchange::RtkProjection& one, const std::string& what) {
                                                   return camera_of(one, in_file, mirror, what);
                                                 })
                                    : cameras_of(exchange::read_xreg(path), numbers, path.string(),
                                                 [&](const exchange::XregProjection& one, const std::string& what) {
                                                   return camera_of(one, mirror, what);
                                                 });
  for (Camera& camera : cameras) camera.camera_from_world.translation_mm *= scale;
  return cameras;
}

using files::YamlMap;

Calibration read_calibration_file(const std::filesystem::path& path) {
  files::YamlFile file(path);
  const YamlMap map(
      file, file.root(), "calibration",
      {"marrow-calibration", "width_px", "height_px", "intrinsics", "radial_distortion", "deviation", "residual_px"});
  check_version(map, "marrow-calibration");
  Calibration calibration;
  const auto width = map.integer("width_px"), height = map.integer("height_px");
  const auto intrinsics = map.matrix("intrinsics", 3, 3);
  const auto distortion = map.vector3("radial_distortion");
  if (map.has("residual_px")) calibration.residual_px = map.number("residual_px").value_or(0);
  if (map.has("deviation")) {
    const YamlMap deviation(file, map.node("deviation"), "deviation",
                            {"focal_px", "principal_px", "radial_distortion"});
    const auto pair = [&](const std::string& key) {
      const auto row = deviation.numbers(key, 2);
      return row ? Eigen::Vector2d((*row)[0], (*row)[1]) : Eigen::Vector2d(0, 0);
    };
    calibration.focal_deviation_px = pair("focal_px");
    calibration.principal_deviation_px = pair("principal_px");
    if (const auto terms = deviation.vector3("radial_distortion"))
      for (int i = 0; i < 3; ++i) calibration.distortion_deviation[std::size_t(i)] = (*terms)[i];
  }
  file.finish();
  calibration.width_px = *width;
  calibration.height_px = *height;
  calibration.intrinsics = *intrinsics;
  for (int i = 0; i < 3; ++i) calibration.distortion.k[std::size_t(i)] = (*distortion)[i];
  Camera camera{*width, *height, *intrinsics, {}};
  camera.camera_from_world = {"camera", "world", Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  check_camera(camera, path.string());
  check_distortion(*intrinsics, calibration.distortion, *width, *height, path.string());
  return calibration;
}

const Camera& camera_of_view(const std::string& view, const List<Camera>& cameras) {
  if (const Camera* camera = cameras.find(view)) return *camera;
  std::string known;
  for (const std::string& name : cameras.names()) known += (known.empty() ? "'" : ", '") + name + "'";
  throw Error("view '" + view + "' has no camera of that name; there are " + known);
}

ViewCamera read_view_camera(const ViewSource& source, const Image& image, const Context& context) {
  ViewCamera camera;
  if (source.camera &&
      (source.projection >= 0 || !source.pixel_mm.empty() || !source.corner_mm.empty() || source.scale != 1))
    throw Error(
        "view '" + source.name +
        "': its camera is wired; projection, pixel_mm, corner_mm and scale are for a camera file: leave them out");
  if (source.camera)
    camera.camera.camera = *source.camera;
  else
    camera.camera = camera_in_file(source, image, context);
  if (!source.calibration.empty()) {
    camera.calibration = read::read_calibration_file(source.calibration);
    camera.camera.deviations.focal_percent.reset();  // that of the camera file's matrix, which is replaced
    camera.camera.deviations.centre_px.reset();
  }
  const bool in_calibration = camera.calibration && !camera.calibration->distortion.is_none();
  if (camera.camera.is_distorted() && camera.calibration)
    throw_two_distortions(source.name, source.camera_file, source.calibration);
  if (source.distortion.empty()) return camera;
  if (camera.camera.is_distorted()) throw_two_distortions(source.name, source.camera_file, source.distortion);
  if (in_calibration) throw_two_distortions(source.name, source.calibration, source.distortion);
  camera.camera.measured = files::read_distortion_file(source.distortion);
  return camera;
}

View view_of(const std::string& name, Image image, const ViewCamera& camera) {
  View view;
  view.name = name;
  view.image = std::move(image);
  view.camera = camera.camera.camera;
  check_view(view);
  if (camera.calibration) apply_calibration(view, *camera.calibration);
  files::straighten(view, camera.camera);
  return view;
}

ViewAsStated read_view_files(const ViewSource& source, const Context& context) {
  check_item_name("view", source.name);
  Image image = files::turned_over(files::read_image_file(source.image, source.frame), source.mirror);
  const ViewCamera camera = read_view_camera(source, image, context);
  return {view_of(source.name, std::move(image), camera), camera.camera.deviations};
}

}  // namespace marrow::read
