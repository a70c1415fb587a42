// SPDX-License-Identifier: Apache-2.0
#pragma once
// Colour photographs of opaque bodies by a simulated camera: light, shadow, lens and sensor.

#include "marrow/plugin.hpp"

namespace marrow::phantom {

/// A body with one paint. Both sides of its surface are opaque.
struct Painted {
  Mesh surface;                           ///< in frame "world"
  Eigen::Vector3d albedo{0.8, 0.8, 0.8};  ///< share of red, green and blue light that it reflects
  double gloss = 0;                       ///< strength of its highlights
  bool smooth = false;                    ///< normals change evenly over its triangles
};

/// A lamp so far away that its rays are parallel.
struct Lamp {
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  ///< direction to the lamp, in the world
  double strength = 1;
};

/// Where photographs are taken: lamps, even light from all sides, and a backdrop that has one colour.
struct Studio {
  std::vector<Lamp> lamps{{{-0.5, -0.6, 0.6}, 0.4}, {{0.8, -0.3, 0.5}, 0.2}};
  double ambient = 0.4;
  Eigen::Vector3d backdrop{0.04, 0.045, 0.05};
};

/// How a sensor turns light into numbers.
struct Sensor {
  double blur_px = 0.8;       ///< standard deviation of the lens's blur
  double gamma = 2.2;         ///< grey value = 255 light^(1 / gamma)
  double noise_levels = 2.5;  ///< standard deviation of the noise in grey values, in each colour
};
/// Declares the sensor's options at a node whose options are also those of a sensor.
template <class Options>
void declare_sensor(auto& node) {
  node.option("blur_px", &Options::blur_px, "standard deviation of the lens's blur", at_least(0), at_most(10))
      .option("gamma", &Options::gamma, "grey value = 255 light^(1 / gamma)", at_least(0.1), at_most(10), unit("1"))
      .option("noise_levels", &Options::noise_levels, "standard deviation of the noise, of 255 levels, in each colour",
              at_least(0), at_most(100), unit(""));
}

/// A camera on a rotary arm that stops at some angles, as it really is. The arm turns about the world's z axis; at 0
/// degrees the camera looks along +y, at 90 degrees along -x. It looks at the world's origin, with z upwards.
struct CameraArm {
  Calibration device;
  double distance_mm = 600;  ///< from the camera to the arm's axis
  std::vector<std::string> names;
  std::vector<double> angles_deg;  ///< of each stop
  double repeat_sd_deg = 0;        ///< standard deviation of the angle, each time that the arm stops

  using fields = Fields<&CameraArm::device, &CameraArm::distance_mm, &CameraArm::names, &CameraArm::angles_deg,
                        &CameraArm::repeat_sd_deg>;
};
/// The camera while the arm is at an angle.
Camera camera_at(const CameraArm& arm, double angle_deg);
/// The camera at a stop. `seed` draws by how much the arm misses the stop this time.
Camera camera_at_stop(const CameraArm& arm, std::size_t stop, std::uint64_t seed);

/// The photograph, CV_8UC3 in RGB order. The light from a point is its albedo times (ambient + the sum of strength
/// max(0, n . l) over the lamps that it sees), and a highlight (Blinn 1977). The lens distorts as `distortion` says.
/// Noise depends only on the seed. Throws Error if a body reaches behind the camera.
Picture photograph(const std::vector<Painted>& bodies, const Camera& camera, const RadialDistortion& distortion,
                   const Studio& studio, const Sensor& sensor, std::uint64_t seed);

/// A box with edges along the axes of its frame.
Mesh box(const RigidTransform& world_from_box, const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm);
/// A cylinder around the z axis of its frame, from `low_mm` to `high_mm`.
Mesh drum(const RigidTransform& world_from_drum, double radius_mm, double low_mm, double high_mm);

/// A chessboard: its black and its white parts, with a white margin as wide as a square. Inner corners are at x =
/// 0, square_mm, ... and y = 0, square_mm, ... in the plane z = 0; the pattern is seen from negative z. The square
/// with the corners (0, 0) and (square_mm, square_mm) is black.
std::vector<Painted> chessboard(const RigidTransform& world_from_board, int columns, int rows, double square_mm);

}  // namespace marrow::phantom

MARROW_VALUE_TYPE(marrow::phantom::CameraArm, "simulated_camera_arm", 1)
