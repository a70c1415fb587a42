// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/camera_file.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/read/projections.hpp"
#include "marrow/toolbox/exchange/jointtrack_camera.hpp"
#include "marrow/toolbox/exchange/maya_camera.hpp"
#include "marrow/toolbox/exchange/plastimatch_camera.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/length_units.hpp"

namespace marrow::read {
namespace {

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

}  // namespace marrow::read
