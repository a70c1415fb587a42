// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/board_views.hpp"

namespace {

using namespace marrow;

struct Options : phantom::DeviceOptions, phantom::BoardPoses, phantom::Exposure {
  std::filesystem::path board;
};

struct Simulated {
  List<Image> images;
  List<Camera> cameras;
  Calibration calibration;
};

Simulated bead_board(const Options& options, Context& context) {
  const calibration::Board board = calibration::read_board_file(options.board);
  Simulated simulated;
  simulated.calibration = phantom::make_device(options);
  check_distortion(simulated.calibration.intrinsics, simulated.calibration.distortion, options.width_px,
                   options.height_px, "pincushion_percent");
  const auto poses = phantom::draw_board_poses(board, options, context.seed());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = formatted("view{}", i + 1);
    simulated.images.add(name, phantom::expose_board(board, simulated.calibration, poses[i], options,
                                                     marrow::Random(context.seed(), i)()));
    simulated.cameras.add(name, {options.width_px, options.height_px, simulated.calibration.intrinsics, poses[i]});
    context.progress(double(i + 1) / double(poses.size()), "views");
  }
  return simulated;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.bead_board", bead_board)
      .summary(
          "Simulates X-ray images of a two-sided bead board from a device with pincushion distortion, blur and quantum "
          "noise")
      .random()
      .out("images", &Simulated::images, "image of the board in each pose, with distortion", over("view"))
      .out("cameras", &Simulated::cameras, "exact camera of each view, without the distortion", over("view"))
      .out("true_calibration", &Simulated::calibration, "exact camera matrix and distortion")
      .option("board", &Options::board, "file with the positions of the board's beads (YAML, docs/case.md)", required())
      .option("views", &Options::views, "number of poses of the board, one view each", at_least(1), at_most(100))
      .option("width_px", &Options::width_px, "image width", at_least(64), at_most(4096))
      .option("height_px", &Options::height_px, "image height", at_least(64), at_most(4096))
      .option("pixel_mm", &Options::pixel_mm, "size of a pixel on the detector", at_least(0.01))
      .option("source_to_detector_mm", &Options::source_to_detector_mm, "distance from the source to the detector",
              at_least(100))
      .option("principal_offset_px", &Options::principal_offset_px,
              "offset of the principal point from the middle of the image, to the right and down")
      .option("pincushion_percent", &Options::pincushion_percent,
              "distortion at the middle of the right image edge, in percent of its distance from the principal point",
              at_least(0), at_most(40), unit("%"))
      .option("pincushion_share_r4", &Options::pincushion_share_r4,
              "part of this distortion that grows with the fourth power of the radius", at_least(0), at_most(1),
              unit("1"))
      .option("distance_mm", &Options::distance_mm, "distance from the source to the middle of the board", at_least(50))
      .option("tilt_deg", &Options::tilt_deg, "largest tilt of the board", at_least(0), at_most(60))
      .option("shift_mm", &Options::shift_mm, "largest shift of the board across the beam", at_least(0))
      .option("attenuation_per_mm", &Options::attenuation_per_mm,
              "attenuation coefficient of the beads (steel at 60 keV: 0.9)", at_least(0), unit("1/mm"))
      .option("photons", &Options::photons, "photons per pixel beside the beads; 0: no noise", at_least(0),
              unit("1/px"))
      .option("blur_px", &Options::blur_px, "standard deviation of the detector's blur", at_least(0), at_most(10))
      .option("vignetting", &Options::vignetting, "part of the brightness that the corners lose", at_least(0),
              at_most(0.95), unit("1"));
}
