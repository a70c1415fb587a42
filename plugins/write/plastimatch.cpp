// SPDX-License-Identifier: Apache-2.0
// A camera as plastimatch's projection matrix.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/cameras.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

using namespace marrow;
using exchange::PlastimatchFile;

struct Options {
  std::vector<double> pixel_mm;
};

PlastimatchFile plastimatch(const Camera* camera, const View* view, const Options& options) {
  if (!camera && !view) throw Error("the node that is wired to 'camera' or 'view' gave none");
  return {exchange::plastimatch_camera(camera ? *camera : view->camera,
                                       exchange::pixel_mm(options.pixel_mm, "write.plastimatch"))};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.plastimatch", plastimatch)
      .summary("Gives a camera as a projection matrix of plastimatch (.txt)")
      .in("camera", "the camera")
      .in("view", "the view whose camera it is")
      .out("matrix", "the projection matrix, and its factors")
      .option(
          "pixel_mm", &Options::pixel_mm,
          "width and height of a pixel on the detector, from which its distance follows; one number for square pixels",
          required())
      .relation(exactly_one({"in.camera", "in.view"}));
  plugin.writer<PlastimatchFile>(".txt", exchange::write_file, "projection matrix of plastimatch");
}
