// SPDX-License-Identifier: Apache-2.0
// Images of a plate with holes or dots, seen by an image intensifier at several poses of its arm.
#include <tbb/parallel_for.h>
#include <Eigen/LU>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"

namespace {

using namespace marrow;

// An image intensifier that bends its images, and what it shows of a plate with holes or dots. The exact truth for
// tests of calibrations: it is no polynomial, and shares no code with them.

/// The exact distortion. A point at an ideal pixel is seen at seen_px(). Its curved face moves a point at the distance
/// r from its middle outwards to rho tan(r / rho), and the earth's magnetic field turns it about the middle, the rim by
/// `turn_rad` more than the middle. Iron nearby shifts what is near `iron_px`.
struct Intensifier {
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  double rim_px = 470;
  double pincushion_px = 20;  ///< by how much the rim is moved outwards; less than a third of rim_px
  double turn_rad = 0;        ///< positive is clockwise on the screen
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d iron_px = Eigen::Vector2d::Zero();
  double iron_shift_px = 0;

  Eigen::Vector2d seen_px(const Eigen::Vector2d& ideal_px) const {
    const Eigen::Vector2d off = ideal_px - middle_px;
    const double radius = off.norm(), s = radius * radius / (rim_px * rim_px);
    double growth = 1;
    if (pincushion_px != 0 && radius > 0) {
      const double rho = std::sqrt(rim_px * rim_px * rim_px / (3 * std::abs(pincushion_px)));
      const double within = std::min(radius / rho, 1.4);
      growth = pincushion_px > 0 ? std::tan(within) / within : std::atan(within) / within;
    }
    const double turn = turn_rad * (1 - std::exp(-2 * s)) / (1 - std::exp(-2.0));
    const Eigen::Vector2d turned(std::cos(turn) * off.x() - std::sin(turn) * off.y(),
                                 std::sin(turn) * off.x() + std::cos(turn) * off.y());
    const double near = (ideal_px - iron_px).squaredNorm() / (0.09 * rim_px * rim_px);
    return middle_px + shift_px + growth * turned + iron_shift_px * std::exp(-near) * Eigen::Vector2d(0.8, 0.6);
  }
};

/// The plate and how it is seen.
struct PlateScene {
  int width_px = 1024, height_px = 1024;
  bool is_hexagonal = false, has_bright_dots = true;
  double spacing_mm = 4.4, dot_mm = 1.9;
  double plate_transmission = 0.5;  ///< of the plate for bright holes, of a dot for dark ones
  Eigen::Matrix3d ideal_from_plate = Eigen::Matrix3d::Identity();  ///< homography from the plate (mm) to ideal pixels
  double field_px = 470;     ///< radius of the field that the beam reaches, about the image's middle
  double missing_share = 0;  ///< of the dots
  double covered_share = 0;  ///< of the plate, from one side of the field on
  double instrument_px = 0;  ///< width of a dark rod across the image
  double vignetting = 0.3;   ///< by which share the rim of the field is darker
  double unevenness = 0.2;   ///< by which share one side of the image is darker than the other
  double photons = 400;      ///< per pixel in open air; 0: no noise
  double blur_px = 1;
};

constexpr double kOpenAir = 40000;  ///< grey value, of 65535
constexpr int kSubsamples = 4;      ///< rays per pixel in each direction

/// The place of the straight image that a pixel shows: the fixed point of ideal + (pixel - seen(ideal)).
Eigen::Vector2d ideal_of(const Intensifier& intensifier, const Eigen::Vector2d& pixel) {
  Eigen::Vector2d ideal = pixel;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d off = pixel - intensifier.seen_px(ideal);
    ideal += 0.9 * off;
    if (off.squaredNorm() < 1e-20) break;
  }
  return ideal;
}

/// Whether a place of the plate, in mm, lies in a hole or dot.
class Holes {
 public:
  Holes(const PlateScene& scene, std::uint64_t seed) : scene_(scene), seed_(seed) {}
  bool at(const Eigen::Vector2d& plate_mm) const {
    const Eigen::Vector2d at = plate_mm / scene_.spacing_mm;
    const double row = scene_.is_hexagonal ? at.y() / kRow : at.y();
    for (int r = int(std::floor(row)); r <= int(std::floor(row)) + 1; ++r) {
      const double aside = scene_.is_hexagonal ? 0.5 * r : 0, column = std::round(at.x() - aside);
      const Eigen::Vector2d centre(column + aside, scene_.is_hexagonal ? kRow * r : double(r));
      if ((at - centre).norm() * scene_.spacing_mm < 0.5 * scene_.dot_mm) return !is_missing(int(column), r);
    }
    return false;
  }

 private:
  static constexpr double kRow = 0.8660254037844386;
  bool is_missing(int column, int row) const {
    return Random(seed_, std::uint64_t(std::uint32_t(column)) << 32 | std::uint32_t(row)).uniform() <
           scene_.missing_share;
  }
  const PlateScene& scene_;
  std::uint64_t seed_;
};

/// What passes at a place of the straight image.
double transmission_at(const PlateScene& scene, const Holes& holes, const Eigen::Matrix3d& plate_from_ideal,
                       const Eigen::Vector2d& ideal) {
  const Eigen::Vector2d middle(0.5 * (scene.width_px - 1), 0.5 * (scene.height_px - 1));
  const Eigen::Vector2d off = ideal - middle;
  double passed = 1;
  if (off.x() > (2 * scene.covered_share - 1) * scene.field_px) {
    const bool is_hole = holes.at((plate_from_ideal * ideal.homogeneous()).hnormalized());
    passed = is_hole == scene.has_bright_dots ? 1 : scene.plate_transmission;
  }
  // The rod lies obliquely, to the right of the middle.
  if (std::abs(0.8 * off.x() - 0.6 * off.y() - 0.25 * scene.field_px) < 0.5 * scene.instrument_px) passed *= 0.1;
  return passed;
}

double beam_at(const PlateScene& scene, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d off = pixel - 0.5 * Eigen::Vector2d(scene.width_px - 1, scene.height_px - 1);
  const double radius = off.norm() / scene.field_px;
  if (radius > 1) return 0.02;
  return (1 - scene.vignetting * radius * radius) * (1 - scene.unevenness * (0.5 + 0.5 * off.y() / scene.field_px));
}

void add_noise(cv::Mat1d& signal, double photons, std::uint64_t seed) {
  tbb::parallel_for(0, signal.rows, [&](int v) {
    for (int u = 0; u < signal.cols; ++u) {
      Random random(seed, std::uint64_t(v) << 32 | std::uint64_t(u));
      double& value = signal(v, u);
      value = double(std::poisson_distribution<std::int64_t>(photons * value)(random)) / photons;
    }
  });
}

/// A 16 bit image of the plate. Noise and missing dots depend only on the seed.
Image image_of_plate(const PlateScene& scene, const Intensifier& intensifier, std::uint64_t seed) {
  const int width = scene.width_px, height = scene.height_px;
  std::vector<Eigen::Vector2d> ideal(std::size_t(width) * std::size_t(height));
  tbb::parallel_for(0, height, [&](int v) {
    for (int u = 0; u < width; ++u) ideal[std::size_t(v * width + u)] = ideal_of(intensifier, {u, v});
  });
  const Eigen::Matrix3d plate_from_ideal = scene.ideal_from_plate.inverse();
  const Holes holes(scene, Random(seed, 0x686f6c6573)());
  cv::Mat1d signal(height, width, 0.0);
  tbb::parallel_for(0, height, [&](int v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d at = ideal[std::size_t(v * width + u)];
      const int right = std::min(u + 1, width - 1), below = std::min(v + 1, height - 1);
      const Eigen::Vector2d along_u = ideal[std::size_t(v * width + right)] - ideal[std::size_t(v * width + right - 1)],
                            along_v =
                                ideal[std::size_t(below * width + u)] - ideal[std::size_t((below - 1) * width + u)];
      double passed = 0;
      for (int a = 0; a < kSubsamples; ++a)
        for (int b = 0; b < kSubsamples; ++b)
          passed += transmission_at(
              scene, holes, plate_from_ideal,
              at + ((a + 0.5) / kSubsamples - 0.5) * along_u + ((b + 0.5) / kSubsamples - 0.5) * along_v);
      signal(v, u) = passed / (kSubsamples * kSubsamples) * beam_at(scene, {u, v});
    }
  });
  if (scene.blur_px > 0) cv::GaussianBlur(signal, signal, {0, 0}, scene.blur_px, scene.blur_px, cv::BORDER_REPLICATE);
  if (scene.photons > 0) add_noise(signal, scene.photons, Random(seed, 0x6e6f697365)());
  Image image;
  signal.convertTo(image.pixels, CV_16U, kOpenAir);
  return image;
}

/// Random points of the field: where the straight image shows them, and where they are seen. None of them is a dot.
distortion::PlatePoints true_points(const PlateScene& scene, const Intensifier& intensifier, int count,
                                    std::uint64_t seed) {
  distortion::PlatePoints points;
  points.width_px = scene.width_px;
  points.height_px = scene.height_px;
  const Eigen::Vector2d middle(0.5 * (scene.width_px - 1), 0.5 * (scene.height_px - 1));
  Random random(seed, 0x7472757468);
  while (int(points.used.size()) < count) {
    const double radius = scene.field_px * std::sqrt(random.uniform()), angle = 2 * kPi * random.uniform();
    const Eigen::Vector2d seen = middle + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    points.add(ideal_of(intensifier, seen), seen);
  }
  return points;
}

struct Options : PlateScene {
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
Intensifier intensifier_at(const Options& options, double angle_deg) {
  Intensifier result;
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
  PlateScene scene = options;
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
    const Intensifier intensifier = intensifier_at(options, options.angles_deg[i]);
    const std::string name = formatted("arm{:g}", options.angles_deg[i]);
    result.images.add(name, image_of_plate(scene, intensifier, random()));
    result.truth.add(name, true_points(scene, intensifier, options.truth_points, random()));
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
      .option("turn_deg", &Options::turn_deg,
              "S-shape: turn of the rim against the middle at the arm's angle 0, positive clockwise; it changes with "
              "the cosine of the angle")
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
