// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/view_file.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/read/calibration_file.hpp"
#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/files/distortion_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace marrow::read {
namespace {

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
