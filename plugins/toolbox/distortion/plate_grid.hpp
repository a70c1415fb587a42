// SPDX-License-Identifier: Apache-2.0
#pragma once
// The grid in a set of spots: which of them are dots of a plate, and which dot each is.
#include <Eigen/Core>
#include <vector>

#include "marrow/toolbox/distortion/plate_dots.hpp"

namespace marrow::distortion {

/// square: rows and columns. hexagonal: each dot has six neighbours.
enum class Pattern { square, hexagonal };

/// A dot of the plate: its column and row in the grid, counted from any dot, and the spot that shows it. In a hexagonal
/// grid the rows are the lines at 60 degrees.
struct GridDot {
  int column = 0, row = 0, spot = 0;
};

/// Where a dot is on the plate, in units of the distance between neighbours. Rows and columns go round as u and v do.
Eigen::Vector2d place_on_plate(Pattern grid, int column, int row);

/// The largest part of the spots that is a grid. It grows from a dot to its neighbours, over single missing dots, and
/// then to dots beside known ones where a polynomial through all others expects them. Parts that an instrument
/// separates are joined where a polynomial through both tells how their rows continue, and left out elsewhere. A plate
/// may be turned, mirrored and tilted by up to 45 degrees. Empty if fewer than nine spots are a grid, or if neighbours
/// do not confirm it.
std::vector<GridDot> find_grid(const std::vector<Spot>& spots, Pattern grid);

/// The distance between neighbours: the median over the dots.
double spacing_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid);

/// How exactly the dots were located, as far as neighbours tell: the median distance of a dot from the middle of two
/// opposite neighbours. A smooth distortion hardly changes it.
double unevenness_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid);

}  // namespace marrow::distortion
