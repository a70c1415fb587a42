// SPDX-License-Identifier: Apache-2.0
#pragma once
// The blades and the iris that limit the beam.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

namespace marrow::phantom {

/// The share of the beam that passes at each pixel of a view, with half shadows; empty if `level` is off. `level` is
/// off, mild, usual or bad (docs/simulation.md). The places of the blades depend on the seed and the view's number.
cv::Mat1d passed_by_collimator(const cv::Size& size, const std::string& level, std::uint64_t collimator_seed,
                               std::size_t view);

}  // namespace marrow::phantom
