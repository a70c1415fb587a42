// SPDX-License-Identifier: Apache-2.0
#include "dicom_grid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::files {
namespace {

// The largest distance of a slice from its place in an even grid. Positions that are rounded to one decimal may be this
// far off.
constexpr double kFarthestOff_mm = 0.1 + 1e-6;
constexpr double kMostTilt_deg = 45;  // gantries tilt by 30
constexpr double kWidest = 10;
constexpr float kAir_hu = -1000;

Eigen::Vector3d axis(const Samples& samples, int k) {
  return {samples.direction[k], samples.direction[3 + k], samples.direction[6 + k]};
}

Eigen::Vector3d origin(const Samples& samples) { return Eigen::Map<const Eigen::Vector3d>(samples.origin_mm.data()); }

double spacing_of(const std::vector<DicomSlice>& slices) {
  return (slices.back().position_mm - slices.front().position_mm) / double(slices.size() - 1);
}

/// Throws Error if two slices lie at the same place, or if one is missing between two. Where slices are closer than
/// 0.2 mm, check_places() alone would not notice a missing one.
void check_gaps(const std::string& what, const std::vector<DicomSlice>& slices) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < slices.size(); ++i) gaps.push_back(slices[i].position_mm - slices[i - 1].position_mm);
  // Not the mean of the two in the middle: if a slice is missing in one of two gaps, the short one is usual.
  std::vector<double> sorted = gaps;
  const auto middle = sorted.begin() + std::ptrdiff_t((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const std::string between = slices[i].name() + " and " + slices[i + 1].name();
    if (gaps[i] < 1e-3) throw Error(what + ": " + between + " lie at the same place; the series has a slice twice");
    if (gaps[i] > 1.5 * *middle + 1e-3)
      throw Error(
          formatted("{}: {:.4g} mm between {}, {:.4g} mm between most slices; a slice is missing or the series is "
                    "unevenly spaced",
                    what, gaps[i], between, *middle));
  }
}

/// A line through the offsets of all slices, because any single one may be rounded.
struct Line {
  Eigen::Vector2d start, step;
  double farthest(const std::vector<Eigen::Vector2d>& offsets) const {
    double most = 0;
    for (std::size_t i = 0; i < offsets.size(); ++i)
      most = std::max(most, (offsets[i] - start - double(i) * step).norm());
    return most;
  }
};

Line fitted(const std::vector<Eigen::Vector2d>& offsets, bool is_level) {
  const double count = double(offsets.size()), middle = (count - 1) / 2;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& one : offsets) mean += one / count;
  if (is_level) return {mean, slope};
  for (std::size_t i = 0; i < offsets.size(); ++i) slope += (double(i) - middle) * (offsets[i] - mean);
  slope /= count * (count * count - 1) / 12;
  return {mean - middle * slope, slope};
}

/// How far each slice lies from the first one along rows and columns. Each is checked against its place in the whole
/// grid, because small errors of single steps add up over a long bone.
std::vector<Eigen::Vector2d> sideways_mm(const std::string& what, const std::vector<DicomSlice>& slices) {
  const Samples& first = slices[0].samples;
  const double spacing_mm = spacing_of(slices);
  double farthest_mm = 0;
  std::vector<Eigen::Vector2d> sideways;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    const Eigen::Vector3d off = origin(slices[i].samples) - origin(first);
    sideways.emplace_back(off.dot(axis(first, 0)), off.dot(axis(first, 1)));
    farthest_mm = std::max(farthest_mm, std::abs(off.dot(axis(first, 2)) - spacing_mm * double(i)));
  }
  if (farthest_mm > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are unevenly spaced; some lie up to {:.4g} mm from where even ones of {:.4g} mm "
                  "would; resample the series to an even grid first",
                  what, farthest_mm, spacing_mm));
  return sideways;
}

/// Makes room for all slices of a tilted gantry.
void straighten(const std::string& what, const Eigen::Vector2d& step_mm, SliceGrid& grid) {
  Samples& geometry = grid.geometry;
  grid.tilt_deg = degrees(std::atan2(step_mm.norm(), geometry.spacing_mm[2]));
  if (grid.tilt_deg > kMostTilt_deg)
    throw Error(
        formatted("{}: the slices lie sheared by {:.4g} degrees, more than a gantry tilts; export the series "
                  "again",
                  what, grid.tilt_deg));
  for (int k = 0; k < 2; ++k) {
    grid.step_px[k] = step_mm[k] / geometry.spacing_mm[k];
    const double whole = grid.step_px[k] * (geometry.size[2] - 1);
    if (std::abs(whole) > kWidest * geometry.size[k])
      throw Error(
          formatted("{}: the last slice lies {:.4g} mm beside the first one, more than {:g} times its width; "
                    "export the series again",
                    what, std::abs(whole) * geometry.spacing_mm[k], kWidest));
    // A shift that is a whole number up to rounding needs no further pixel.
    grid.first_px[k] = std::min(0, int(std::floor(whole + 1e-3)));
    geometry.size[k] += int(std::ceil(std::abs(whole) - 1e-3));
    for (int axis = 0; axis < 3; ++axis)
      geometry.origin_mm[axis] += geometry.direction[3 * axis + k] * geometry.spacing_mm[k] * grid.first_px[k];
  }
}

}  // namespace

SliceGrid grid_of_slices(const std::string& what, const std::vector<DicomSlice>& slices) {
  check_gaps(what, slices);
  const std::vector<Eigen::Vector2d> sideways = sideways_mm(what, slices);
  SliceGrid grid;
  grid.geometry = slices[0].samples;
  grid.geometry.dimensions = 3;
  grid.geometry.size[2] = int(slices.size());
  grid.geometry.spacing_mm[2] = spacing_of(slices);
  if (fitted(sideways, true).farthest(sideways) <= kFarthestOff_mm) return grid;
  const Line line = fitted(sideways, false);
  if (const double off_mm = line.farthest(sideways); off_mm > kFarthestOff_mm)
    throw Error(
        formatted("{}: the slices are shifted sideways, up to {:.4g} mm from where a tilted gantry would put "
                  "them; export the series again, or resample it to a straight grid first",
                  what, off_mm));
  straighten(what, line.step, grid);
  return grid;
}

void put_slice(const SliceGrid& grid, const std::vector<float>& slice, const std::array<int, 3>& slice_size, int k,
               float* volume) {
  float* to = volume + std::size_t(k) * grid.slice_pixels();
  // Where the grid's first pixel lies in the slice: whole pixels and the rest, which is the same for all pixels.
  std::array<int, 2> whole;
  std::array<float, 2> rest;
  for (int axis = 0; axis < 2; ++axis) {
    const double at = grid.first_px[axis] - grid.step_px[axis] * k;
    whole[axis] = int(std::floor(at + 1e-6));
    rest[axis] = float(std::max(0.0, at - whole[axis]));
    if (rest[axis] < 1e-5f) rest[axis] = 0;
  }
  const auto value = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < slice_size[0] && y < slice_size[1]
               ? slice[std::size_t(y) * std::size_t(slice_size[0]) + std::size_t(x)]
               : kAir_hu;
  };
  for (int v = 0; v < grid.geometry.size[1]; ++v)
    for (int u = 0; u < grid.geometry.size[0]; ++u, ++to) {
      const int x = u + whole[0], y = v + whole[1];
      const auto in_row = [&](int row) {
        return rest[0] == 0 ? value(x, row) : (1 - rest[0]) * value(x, row) + rest[0] * value(x + 1, row);
      };
      *to = rest[1] == 0 ? in_row(y) : (1 - rest[1]) * in_row(y) + rest[1] * in_row(y + 1);
    }
}

}  // namespace marrow::files
