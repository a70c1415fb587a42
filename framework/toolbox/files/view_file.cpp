// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/view_file.hpp"

#include "marrow/domain/error.hpp"
#include "marrow/domain/names.hpp"
#include "marrow/toolbox/files/calibration_file.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/volume_file.hpp"

namespace marrow::files {

View read_view_files(const ViewSource& source) {
  check_item_name("view", source.name);
  View view;
  view.name = source.name;
  view.image = read_image_file(source.image, source.frame);
  DistortedCamera camera;
  if (source.camera)
    camera.camera = *source.camera;
  else
    camera = read_camera_file(source.camera_file);
  view.camera = camera.camera;
  check_view(view);
  if (!source.calibration.empty()) {
    if (!camera.distortion.is_none())
      throw Error("view '" + source.name + "': both " + source.camera_file.string() + " and " +
                  source.calibration.string() +
                  " tell of a distortion; it is removed only once: take it out of one of them");
    apply_calibration(view, read_calibration_file(source.calibration));
  } else if (!camera.distortion.is_none()) {
    remove_distortion(view, camera.distortion);
  }
  return view;
}

}  // namespace marrow::files
