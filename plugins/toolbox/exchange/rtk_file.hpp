// SPDX-License-Identifier: Apache-2.0
#pragma once
// The names in RTK's file, for its reader and its writer.
#include <array>
#include <utility>

#include "marrow/toolbox/exchange/rtk_geometry.hpp"

namespace marrow::exchange {

/// The elements of RTK's file, and where their numbers go.
inline constexpr std::array<std::pair<const char*, double RtkProjection::*>, 9> kRtkElements{{
    {"SourceToIsocenterDistance", &RtkProjection::source_to_isocentre_mm},
    {"SourceToDetectorDistance", &RtkProjection::source_to_detector_mm},
    {"GantryAngle", &RtkProjection::gantry_deg},
    {"OutOfPlaneAngle", &RtkProjection::out_of_plane_deg},
    {"InPlaneAngle", &RtkProjection::in_plane_deg},
    {"SourceOffsetX", &RtkProjection::source_x_mm},
    {"SourceOffsetY", &RtkProjection::source_y_mm},
    {"ProjectionOffsetX", &RtkProjection::projection_x_mm},
    {"ProjectionOffsetY", &RtkProjection::projection_y_mm},
}};

}  // namespace marrow::exchange
