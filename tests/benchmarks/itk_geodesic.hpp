// SPDX-License-Identifier: Apache-2.0
#pragma once
// ITK's geodesic active contour (Caselles, Kimmel and Sapiro, IJCV 1997) as a peer of segment.level_set. ITK's headers
// bring an Eigen of their own, so they stay in one file.
#include <array>
#include <string>
#include <vector>

namespace itk_peer {

/// Found by trial on the benchmark's distal fragment: of ten settings those of the best Dice.
struct Settings {
  double gradient_sigma_mm = 0.8;
  double sigmoid_middle_hu_per_mm = 30,
         sigmoid_width_hu_per_mm = 8;  ///< speed 0.5 there; from 0.73 to 0.27 within the width
  double start_radius_mm = 2;
  double propagation = 1, curvature = 0.2, advection = 2;
  int most_iterations = 400;
  double least_rms = 0.003;
  unsigned threads = 2;
};

struct Result {
  std::vector<float> field;  ///< negative inside
  double speed_image_s = 0, contour_s = 0;
  int iterations = 0;
};

std::string version();
/// The speed image is made once for all fragments; each fragment has a contour of its own.
std::vector<Result> geodesic_active_contours(const std::vector<float>& hu, const std::array<int, 3>& size,
                                             const std::array<double, 3>& spacing_mm,
                                             const std::vector<std::vector<std::array<int, 3>>>& seeds,
                                             const Settings& settings);

}  // namespace itk_peer
