// SPDX-License-Identifier: Apache-2.0
// A camera of straightened images, and the grid of a plate, as files of XMALab.
#include <marrow/plugin.hpp>
#include <optional>

#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/toolbox/exchange/xmalab_grid.hpp"

namespace {

using namespace marrow;
using exchange::XmalabCameraFile, exchange::XmalabGridFile;

struct Result {
  std::optional<XmalabCameraFile> camera_file;
  std::optional<XmalabGridFile> distorted, references, inlier;
};

Result xmalab(const Camera* camera, const View* view, const distortion::PlatePoints* points) {
  Result result;
  if (camera || view) result.camera_file = XmalabCameraFile{exchange::xmalab_camera(camera ? *camera : view->camera)};
  if (points) {
    result.distorted = XmalabGridFile{exchange::xmalab_distorted(*points)};
    result.references = XmalabGridFile{exchange::xmalab_references(*points)};
    result.inlier = XmalabGridFile{exchange::xmalab_inlier(*points)};
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.xmalab", xmalab)
      .summary("Gives a camera as XMALab's text, and the dots of a plate as its grid files")
      .in("camera", "the camera, of images without distortion")
      .in("view", "the view whose camera it is")
      .in("points", "the dots of camera.distortion_plate")
      .out("camera_file", &Result::camera_file, "image size, camera matrix, rotation and translation (MayaCam 2.0)")
      .out("distorted", &Result::distorted, "where each dot was seen: NAME_GridPointsDistorted.csv")
      .out("references", &Result::references, "where a straight image shows it: NAME_GridPointsReferences.csv")
      .out("inlier", &Result::inlier, "1 for a dot that is used, 0 for another: NAME_GridPointsInlier.csv")
      .relation(at_least_one({"in.camera", "in.view", "in.points"}));
  plugin.writer<XmalabCameraFile>(".txt", exchange::write_file, "camera of XMALab");
  plugin.writer<XmalabGridFile>(".csv", exchange::write_file, "a column of XMALab's grid");
}
