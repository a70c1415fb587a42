// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <optional>

struct AVFrame;

namespace marrow::read_sequence {

/// A decoded frame as grey levels from black to white: of 8 bits, or of 16 if it has more than 8. A frame of 12 bits
/// has levels from 0 to 4095. std::nullopt for a kind of pixels that is not read.
std::optional<cv::Mat> grey_of(const AVFrame& frame);

}  // namespace marrow::read_sequence
