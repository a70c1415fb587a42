// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/view_file.hpp"

#include "marrow/domain/error.hpp"
#include "marrow/domain/names.hpp"
#include "marrow/toolbox/files/calibration_file.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace marrow::files {

const Camera& camera_of(const std::string& view, const List<Camera>& cameras) {
  if (const Camera* camera = cameras.find(view)) return *camera;
  std::string known;
  for (const std::string& name : cameras.names()) known += (known.empty() ? "'" : ", '") + name + "'";
  throw Error("view '" + view + "' has no camera of that name; there are " + known);
}

ViewCamera read_view_camera(const ViewSource& source) {
  ViewCamera camera;
  if (source.camera)
    camera.camera.camera = *source.camera;
  else
    camera.camera = read_camera_file(source.camera_file);
  if (source.calibration.empty()) return camera;
  if (!camera.camera.distortion.is_none())
    throw Error("view '" + source.name + "': both " + source.camera_file.string() + " and " +
                source.calibration.string() +
                " tell of a distortion; it is removed only once: take it out of one of them");
  camera.calibration = read_calibration_file(source.calibration);
  return camera;
}

View view_of(const std::string& name, Image image, const ViewCamera& camera) {
  View view;
  view.name = name;
  view.image = std::move(image);
  view.camera = camera.camera.camera;
  check_view(view);
  if (camera.calibration)
    apply_calibration(view, *camera.calibration);
  else if (!camera.camera.distortion.is_none())
    remove_distortion(view, camera.camera.distortion);
  return view;
}

View read_view_files(const ViewSource& source) {
  check_item_name("view", source.name);
  Image image = turned_over(read_image_file(source.image, source.frame), source.mirror);
  return view_of(source.name, std::move(image), read_view_camera(source));
}

}  // namespace marrow::files
