// SPDX-License-Identifier: Apache-2.0
// Images of a plate with holes or dots, seen by an image intensifier at several poses of its arm.
#include <Eigen/Geometry>
#include <marrow/plugin.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/simulate/bent_plate.hpp"

namespace {

using namespace marrow;

struct Options : simulate::PlateScene {
  std::string grid = "square", dots = "bright";
  double pixel_mm = 0.3, source_to_detector_mm = 1000;
  std::vector<double> angles_deg{0};
  double pincushion_px = 20, turn_deg = -0.5, shift_px = 1.5, iron_shift_px = 0;
  double tilt_deg = 0, plate_turn_deg = 7;
  int truth_points = 2000;
};

struct Result {
  List<Image> images;
  List<distortion::PlatePoints> truth;
};

/// The homography from the plate's plane, in mm, to the ideal image. The plate lies on the detector, tilted about an
/// oblique axis.
Eigen::Matrix3d ideal_from_plate(const Options& options, Random& random) {
  const double focal_px = options.source_to_detector_mm / options.pixel_mm;
  Eigen::Matrix3d intrinsics;
  intrinsics << focal_px, 0, 0.5 * (options.width_px - 1), 0, focal_px, 0.5 * (options.height_px - 1), 0, 0, 1;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(radians(options.tilt_deg), Eigen::Vector3d(0.6, 0.8, 0)) *
       Eigen::AngleAxisd(radians(options.plate_turn_deg + 3 * random.uniform()), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  Eigen::Matrix3d camera_from_plate;
  camera_from_plate << turn.col(0), turn.col(1),
      Eigen::Vector3d(options.spacing_mm * random.uniform(), options.spacing_mm * random.uniform(),
                      options.source_to_detector_mm);
  return intrinsics * camera_from_plate;
}

/// The earth's field along the intensifier's axis changes with the cosine of the arm's angle, and so does the turn. The
/// field across it shifts the image.
simulate::Intensifier intensifier_at(const Options& options, double angle_deg) {
  simulate::Intensifier result;
  const Eigen::Vector2d middle(0.5 * (options.width_px - 1), 0.5 * (options.height_px - 1));
  result.rim_px = options.field_px;
  result.middle_px = middle + options.field_px * Eigen::Vector2d(0.02, -0.015);
  result.pincushion_px = options.pincushion_px;
  result.turn_rad = radians(options.turn_deg) * std::cos(radians(angle_deg));
  result.shift_px = options.shift_px * std::sin(radians(angle_deg)) * Eigen::Vector2d(0.8, -0.6);
  result.iron_px = middle + options.field_px * Eigen::Vector2d(-0.5, 0.3);
  result.iron_shift_px = options.iron_shift_px;
  return result;
}

Result distortion_plate(const Options& options, Context& context) {
  simulate::PlateScene scene = options;
  scene.is_hexagonal = options.grid == "hexagonal";
  scene.has_bright_dots = options.dots == "bright";
  if (3 * std::abs(options.pincushion_px) > options.field_px)
    throw Error(
        formatted("simulate.distortion_plate: pincushion_px is {}, but must be less than a third of field_px, {}",
                  options.pincushion_px, options.field_px));
  Result result;
  for (std::size_t i = 0; i < options.angles_deg.size(); ++i) {
    context.check_cancelled();
    Random random(context.seed(), i);
    scene.ideal_from_plate = ideal_from_plate(options, random);
    const simulate::Intensifier intensifier = intensifier_at(options, options.angles_deg[i]);
    const std::string name = formatted("arm{:g}", options.angles_deg[i]);
    result.images.add(name, simulate::image_of_plate(scene, intensifier, random()));
    result.truth.add(name, simulate::true_points(scene, intensifier, options.truth_points, random()));
    context.progress(double(i + 1) / double(options.angles_deg.size()), "images");
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.distortion_plate", distortion_plate)
      .summary(
          "Images of a plate with holes or dots, seen by an image intensifier with pincushion and S-shaped distortion "
          "at several poses of its arm")
      .random()
      .out("images", &Result::images, "an image for each pose of the arm", over("view"))
      .out("true_points", &Result::truth, "random points of each image, and where a straight image shows them",
           over("view"))
      .option("angles_deg", &Options::angles_deg, "angles of the arm, one image each")
      .relation(at_least_one({"angles_deg"}))
      .relation(distinct("angles_deg"))
      .option("grid", &Options::grid, "grid of the plate", one_of({"square", "hexagonal"}))
      .option("dots", &Options::dots, "bright holes or dark dots", one_of({"bright", "dark"}))
      .option("dot_spacing_mm", &Options::spacing_mm, "distance between neighbours on the plate", at_least(0.1))
      .option("dot_mm", &Options::dot_mm, "diameter of a hole or dot", at_least(0.05))
      .option("plate_transmission", &Options::plate_transmission,
              "share of the beam that passes the plate, or a dark dot", at_least(0), at_most(1), unit("1"))
      .option("width_px", &Options::width_px, "image width", at_least(64), at_most(4096))
      .option("height_px", &Options::height_px, "image height", at_least(64), at_most(4096))
      .option("pixel_mm", &Options::pixel_mm, "size of a pixel", at_least(0.01))
      .option("source_to_detector_mm", &Options::source_to_detector_mm, "distance from the source to the plate",
              at_least(100))
      .option("field_px", &Options::field_px, "radius of the circular field", at_least(20))
      .option("pincushion_px", &Options::pincushion_px, "by how much the rim of the field is moved outwards")
      .option(
          "turn_deg", &Options::turn_deg,
          "S-shape: turn of the rim against the middle at the arm's angle 0, positive clockwise; it changes with the "
          "cosine of the angle")
      .option("shift_px", &Options::shift_px, "shift of the whole image at an angle of 90 degrees", at_least(0))
      .option("iron_shift_px", &Options::iron_shift_px, "local shift by iron nearby", at_least(0))
      .option("tilt_deg", &Options::tilt_deg, "tilt of the plate against the detector", at_least(0), at_most(60))
      .option("plate_turn_deg", &Options::plate_turn_deg, "turn of the plate's rows in the image")
      .option("missing_share", &Options::missing_share, "share of the dots that are missing", at_least(0), at_most(1),
              unit("1"))
      .option("covered_share", &Options::covered_share, "share of the field, from its left side on, without plate",
              at_least(0), at_most(1), unit("1"))
      .option("instrument_px", &Options::instrument_px, "width of a dark rod across the image; 0: none", at_least(0))
      .option("vignetting", &Options::vignetting, "by which share the field's rim is darker than its middle",
              at_least(0), at_most(0.95), unit("1"))
      .option("unevenness", &Options::unevenness, "by which share the lower side is darker than the upper", at_least(0),
              at_most(0.95), unit("1"))
      .option("photons", &Options::photons, "photons per pixel in open air; 0: no noise", at_least(0), unit("1/px"))
      .option("blur_px", &Options::blur_px, "standard deviation of the blur", at_least(0))
      .option("truth_points", &Options::truth_points, "number of random points of each image", at_least(10),
              at_most(100000));
}
