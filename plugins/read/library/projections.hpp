// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/exchange/camera_matrix.hpp"

namespace marrow::read {

/// Files that hold the cameras of several projections, by the end of their names: RTK's geometry (.xml) and xReg's
/// projection data (.h5, .hdf5).
enum class Projections { none, rtk, xreg };
Projections projections_in(const std::filesystem::path& path);

/// Converts the number in an option to that of a projection. Throws Error, with `what` in front, unless it is a whole
/// number from 0.
int projection_number(double number, const std::string& what);

/// How many projections such a file holds. Throws Error as the readers of the two formats do.
std::size_t count_projections(const std::filesystem::path& path);

/// The cameras of the projections with these numbers, from 0; of all if `numbers` is empty. `size` is only for RTK.
/// `scale` converts the file's unit to mm. Throws Error as the readers of the two formats do, and if there is no such
/// projection.
std::vector<Camera> read_projections(const std::filesystem::path& path, const std::vector<int>& numbers,
                                     const exchange::ImageSize& size, exchange::Mirror mirror, double scale);

}  // namespace marrow::read
