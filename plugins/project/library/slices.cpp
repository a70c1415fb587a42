// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/slices.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>

#include "resample_row.hpp"

namespace marrow::rays {
namespace {

constexpr int kSpare = 32;       ///< floats after a row that the resampling may read
constexpr int kRowsAtOnce = 8;   ///< rows of the sheared image that one thread sums at a time: they fit in its cache
constexpr double kFinest = 0.5;  ///< finest step of the sheared image, in voxels at the volume's middle

/// Columns that may differ from 0.
struct Columns {
  int first = std::numeric_limits<int>::max(), last = -1;
  void add(const Columns& more) { first = std::min(first, more.first), last = std::max(last, more.last); }
};

/// What is summed over the slices: the attenuation, and for derivatives also its slopes along and across the rows,
/// times 1 - depth / middle: a point of a ray moves by this part of the source's displacement if the ray's point in the
/// volume's middle stays.
constexpr int kValues = 1, kValuesAndSlopes = 3;

/// The image before it is warped, on a grid of slopes. p is the slope along the rows and q that across the rows, both
/// in voxels per slice. It has one layer for each quantity that is summed.
struct Sheared {
  double p = 0, q = 0, step_p = 0, step_q = 0;
  int columns = 0, rows = 0;
  int layers = kValues;
  double middle = 1;  ///< of the volume, in slices from the source; negative if they count towards it
  std::vector<float> sums;
  std::vector<Columns> filled;  ///< of each row, the one before and the two after it

  std::size_t layer_size() const { return std::size_t(columns) * std::size_t(rows); }
  float* row(int row, int layer = 0) {
    return sums.data() + std::size_t(layer) * layer_size() + std::size_t(row) * std::size_t(columns);
  }

  /// Cubic convolution (Keys, IEEE Trans Acoust Speech Signal Process 1981). Bilinear values would be smoother half-way
  /// between the grid's points than on them, and a cost that compares them would be rough. 0 near the border: the grid
  /// is two steps larger than needed on each side.
  float at(double column, double row) const {
    const Cell cell = cell_of(column, row);
    return cell.at ? std::max(interpolated(cell, 0, cubic(cell.x), cubic(cell.y)), 0.0f) : 0;
  }

  /// The interpolated value, and its derivatives by p, by q, and by the position of the source along and across rows.
  struct Expansion {
    float value = 0, by_p = 0, by_q = 0, by_along = 0, by_across = 0;
  };
  Expansion expansion_at(double column, double row) const {
    const Cell cell = cell_of(column, row);
    if (!cell.at) return {};
    const std::array<float, 4> across = cubic(cell.x), down = cubic(cell.y);
    const float value = interpolated(cell, 0, across, down);
    if (!(value > 0)) return {};
    const float by_p = interpolated(cell, 0, cubic_slope(cell.x), down) / float(step_p),
                by_q = interpolated(cell, 0, across, cubic_slope(cell.y)) / float(step_q), nearer = 1 / float(middle);
    return {value, by_p, by_q, by_p * nearer + interpolated(cell, 1, across, down),
            by_q * nearer + interpolated(cell, 2, across, down)};
  }

 private:
  /// The first of the 4 x 4 points around a position; null where all of them are 0. (x, y) is the position after the
  /// second point.
  struct Cell {
    const float* at = nullptr;
    float x = 0, y = 0;
  };
  Cell cell_of(double column, double row) const {
    if (!(column >= 1 && row >= 1 && column < columns - 2 && row < rows - 2)) return {};
    const int c = int(column), r = int(row);
    const Columns& around = filled[std::size_t(r)];
    if (c + 2 < around.first || c - 1 > around.last) return {};
    return {sums.data() + std::size_t(r - 1) * std::size_t(columns) + std::size_t(c - 1), float(column - c),
            float(row - r)};
  }
  float interpolated(const Cell& cell, int layer, const std::array<float, 4>& across,
                     const std::array<float, 4>& down) const {
    const float* at = cell.at + std::size_t(layer) * layer_size();
    float sum = 0;
    for (std::size_t k = 0; k < 4; ++k, at += columns)
      sum += down[k] * (across[0] * at[0] + across[1] * at[1] + across[2] * at[2] + across[3] * at[3]);
    return sum;
  }
  /// The weights of the four points around a position, which lies x after the second, and their derivatives by x.
  static std::array<float, 4> cubic(float x) {
    const float y = 1 - x;
    return {-0.5f * x * y * y, 1 + x * x * (1.5f * x - 2.5f), 1 + y * y * (1.5f * y - 2.5f), -0.5f * y * x * x};
  }
  static std::array<float, 4> cubic_slope(float x) {
    const float y = 1 - x;
    return {-0.5f * y * (y - 2 * x), x * (4.5f * x - 5), -y * (4.5f * y - 5), -0.5f * x * (2 * y - x)};
  }
};

struct Range {
  double low = 1e300, high = -1e300;
  void add(double value) { low = std::min(low, value), high = std::max(high, value); }
};

/// Maps (u, v, 1) to a ray's direction in a stack: along a row, from row to row, from slice to slice.
Eigen::Matrix3d slopes_from_pixel(const Rays& rays, const Slices::Stack& stack) {
  Eigen::Matrix3d slopes;
  slopes << rays.direction_from_pixel.row(stack.axes[0]), rays.direction_from_pixel.row(stack.axes[2]),
      rays.direction_from_pixel.row(stack.axes[1]);
  return slopes;
}

/// The least integer that is not below a value. The library's function is a call on the oldest machines.
int ceiling(double value) {
  const int whole = int(value);
  return whole + (whole < value);
}

/// Adds slices to rows of the sheared image.
class RowSums {
 public:
  /// Notes in `filled` which columns of each row the slices reach.
  RowSums(const Slices::Stack& stack, const Eigen::Vector3d& source, Sheared& image, std::vector<Columns>& filled)
      : stack_(stack),
        source_(source),
        image_(image),
        filled_(filled),
        mixed_(std::size_t(stack.length + 3 + 2 * kSpare)),
        change_(image.layers == kValuesAndSlopes ? mixed_.size() : 0) {}

  void add(int slice, int first_row, int end_row) {
    const double depth = slice - source_[stack_.axes[1]];
    const Along along{source_[stack_.axes[0]] + image_.p * depth, image_.step_p * depth, 1 / (image_.step_p * depth),
                      float(depth)};
    for (int row = first_row; row < end_row; ++row) {
      const double line = source_[stack_.axes[2]] + (image_.q + image_.step_q * row) * depth;
      if (line > -1 && line < stack_.rows) add(slice, line, along, row);
    }
  }

 private:
  /// Positions of the sheared image's columns along the rows of a slice, in voxels.
  struct Along {
    double start, step, per_step;
    float depth;
  };

  void add(int slice, double line, const Along& along, int row) {
    const int below = -ceiling(-line);
    const bool has_below = below >= 0, has_above = below + 1 < stack_.rows;
    const Slices::Extent none, a = has_below ? stack_.extent(slice, below) : none,
                               b = has_above ? stack_.extent(slice, below + 1) : none;
    const int first = std::min(a.first, b.first), last = std::max(a.last, b.last);
    if (first > last) return;
    // The origin is one voxel before the first that attenuates.
    const double start = along.start - (first - 1), length = last - first + 2;
    double from = -start * along.per_step, to = (length - start) * along.per_step;
    if (from > to) std::swap(from, to);
    const int column = std::max(0, ceiling(from + 1e-4)), end = std::min(image_.columns - 1, -ceiling(1e-4 - to));
    if (column > end) return;
    filled_[std::size_t(row)].add({column, end});
    const auto position = float(start + along.step * column), step = float(along.step), weight = float(line - below);
    const std::int16_t* row_a = has_below ? stack_.row(slice, below) + first : nullptr;
    const std::int16_t* row_b = has_above ? stack_.row(slice, below + 1) + first : nullptr;
    float* mixed = mixed_.data() + kSpare;
    mixed[0] = 0;
    mix_rows(row_a, row_b, weight, last - first + 1, mixed + 1);
    mixed[last - first + 2] = mixed[last - first + 3] = 0;
    const int count = end - column + 1;
    if (image_.layers == kValues) return add_resampled(mixed, position, step, count, image_.row(row) + column);
    float* change = change_.data() + kSpare;
    change[0] = 0;
    subtract_rows(row_a, row_b, last - first + 1, change + 1);
    change[last - first + 2] = change[last - first + 3] = 0;
    add_resampled_slopes(mixed, change, position, step, count, 1 - along.depth / float(image_.middle),
                         {image_.row(row, 0) + column, image_.row(row, 1) + column, image_.row(row, 2) + column});
  }

  const Slices::Stack& stack_;
  const Eigen::Vector3d& source_;
  Sheared& image_;
  std::vector<Columns>& filled_;
  std::vector<float> mixed_, change_;
};

void sum_slices(const Slices::Stack& stack, const Rays& rays, Sheared& image) {
  image.sums.assign(image.layer_size() * std::size_t(image.layers), 0.0f);
  std::vector<Columns> filled(std::size_t(image.rows));
  const int blocks = (image.rows + kRowsAtOnce - 1) / kRowsAtOnce;
  tbb::parallel_for(0, blocks, [&](int block) {
    RowSums sums(stack, rays.source, image, filled);
    const int end = std::min(image.rows, (block + 1) * kRowsAtOnce);
    for (int slice = stack.first_slice; slice <= stack.last_slice; slice += stack.slice_step)
      sums.add(slice, block * kRowsAtOnce, end);
  });
  image.filled = filled;
  for (std::size_t row = 0; row < filled.size(); ++row)
    for (std::size_t other = row > 0 ? row - 1 : 0; other < std::min(row + 3, filled.size()); ++other)
      image.filled[row].add(filled[other]);
}

/// Slopes of rays whose points in the volume's middle have fixed places and distances, in voxels. Such a grid does not
/// change with a small motion, so a radiograph changes smoothly and has derivatives.
struct Lattice {
  double step, offset;

  /// At most `finest` apart: the next smaller one of eight steps an octave.
  Lattice(double finest, double source, double middle) : offset(source / middle) {
    const double voxels = std::max(finest * std::abs(middle), kFinest);
    constexpr double kTie = 1e-9;  // the last digits of a depth in another world must not decide
    step = std::exp2(std::floor(8 * std::log2(voxels) + kTie) / 8) / std::abs(middle);
  }
  /// Two steps before the last one that is not above a slope.
  double before(double slope) const { return (std::floor((slope + offset) / step) - 2) * step - offset; }
};

/// The grid of slopes that both the pixels and the volume cover. std::nullopt if slopes against this stack cannot
/// describe the rays.
std::optional<Sheared> sheared_grid(const Slices::Stack& stack, const Attenuation& attenuation, const Rays& rays,
                                    const PixelGrid& grid) {
  const Eigen::Matrix3d slopes = slopes_from_pixel(rays, stack);
  Range p, q;
  double step = 1e300;
  int sign = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d pixel = grid.pixel(corner & 1 ? grid.columns - 1 : 0, corner & 2 ? grid.rows - 1 : 0);
    const Eigen::Vector3d d = slopes * Eigen::Vector3d(pixel.x(), pixel.y(), 1);
    const Eigen::Vector3d mm(d.x() * rays.spacing_mm[stack.axes[0]], d.y() * rays.spacing_mm[stack.axes[2]],
                             d.z() * rays.spacing_mm[stack.axes[1]]);
    if (std::abs(mm.z()) < 0.4 * mm.norm()) return std::nullopt;
    if (sign == 0) sign = d.z() > 0 ? 1 : -1;
    if ((d.z() > 0 ? 1 : -1) != sign) return std::nullopt;
    p.add(d.x() / d.z());
    q.add(d.y() / d.z());
    // Derivative of the slopes by the pixel's coordinates. Its determinant is the area of a pixel, in slopes.
    Eigen::Matrix2d change;
    for (int k = 0; k < 2; ++k)
      change.row(k) = (slopes.block<1, 2>(k, 0) - d[k] / d.z() * slopes.block<1, 2>(2, 0)) / d.z();
    step = std::min(step, grid.step_px * std::sqrt(std::abs(change.determinant())));
  }
  const double source = rays.source[stack.axes[1]], near = stack.first_slice - source, far = stack.last_slice - source;
  if (near * far <= 0 || (near > 0 ? 1 : -1) != sign) return std::nullopt;
  Range volume_p, volume_q;
  for (const double depth : {near, far})
    for (const int side : {-1, 1}) {
      const auto edge = [&](int axis) {
        return (side < 0 ? attenuation.first[std::size_t(axis)] - 1 : attenuation.last[std::size_t(axis)] + 1) -
               rays.source[axis];
      };
      volume_p.add(edge(stack.axes[0]) / depth);
      volume_q.add(edge(stack.axes[2]) / depth);
    }
  Sheared image;
  image.middle = 0.5 * (near + far);
  const double ratio = std::sqrt(rays.spacing_mm[stack.axes[2]] / rays.spacing_mm[stack.axes[0]]);
  const Lattice columns(step * ratio, rays.source[stack.axes[0]], image.middle),
      rows(step / ratio, rays.source[stack.axes[2]], image.middle);
  image.step_p = columns.step;
  image.step_q = rows.step;
  image.p = columns.before(std::max(p.low, volume_p.low));
  image.q = rows.before(std::max(q.low, volume_q.low));
  image.columns = std::max(0, int(std::ceil((std::min(p.high, volume_p.high) - image.p) / image.step_p)) + 3);
  image.rows = std::max(0, int(std::ceil((std::min(q.high, volume_q.high) - image.q) / image.step_q)) + 3);
  return image;
}

std::vector<float> warped(const Sheared& image, const Slices::Stack& stack, const Rays& rays, const PixelGrid& grid) {
  const Eigen::Matrix3d slopes = slopes_from_pixel(rays, stack);
  const Eigen::Vector3d mm(rays.spacing_mm[stack.axes[0]], rays.spacing_mm[stack.axes[2]],
                           rays.spacing_mm[stack.axes[1]]);
  const double per_p = 1 / image.step_p, per_q = 1 / image.step_q;
  // Times the length of the ray from one slice to the next, in mm.
  const double thousandth = 1e-3 * stack.slice_step;
  std::vector<float> values(grid.count());
  tbb::parallel_for(0, grid.rows, [&](int row) {
    float* out = values.data() + std::size_t(row) * std::size_t(grid.columns);
    const Eigen::Vector2d pixel = grid.pixel(0, row);
    const Eigen::Vector3d first = slopes * Eigen::Vector3d(pixel.x(), pixel.y(), 1),
                          change = grid.step_px * slopes.col(0);
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector3d d = first + column * change;
      const double nearer = 1 / d.z(), p = d.x() * nearer, q = d.y() * nearer;
      const float sum = image.at((p - image.p) * per_p, (q - image.q) * per_q);
      if (sum != 0) out[column] = sum * float(Eigen::Vector3d(p * mm.x(), q * mm.y(), mm.z()).norm() * thousandth);
    }
  });
  return values;
}

/// The same as warped(), with derivatives.
void warp(const Sheared& image, const Slices::Stack& stack, const RayMotion& motion, const PixelGrid& grid,
          RadiographExpansion& expansion) {
  const SliceAxes axes{stack.axes[0], stack.axes[2], stack.axes[1]};
  const double per_p = 1 / image.step_p, per_q = 1 / image.step_q;
  tbb::parallel_for(0, grid.rows, [&](int row) {
    const Eigen::Vector2d pixel = grid.pixel(0, row);
    const Eigen::Vector3d first = motion.rays().direction(pixel.x(), pixel.y()),
                          change = grid.step_px * motion.rays().direction_from_pixel.col(0);
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector3d direction = first + column * change;
      const double nearer = 1 / direction[axes.across], p = direction[axes.first] * nearer,
                   q = direction[axes.second] * nearer;
      const Sheared::Expansion at = image.expansion_at((p - image.p) * per_p, (q - image.q) * per_q);
      if (at.value == 0) continue;
      const RayMotion::Change moved =
          motion.change({at.value, at.by_p, at.by_q, at.by_along, at.by_across}, axes, stack.slice_step, direction);
      const std::size_t i = std::size_t(row) * std::size_t(grid.columns) + std::size_t(column);
      expansion.values[i] = float(moved.value);
      for (std::size_t k = 0; k < 6; ++k) expansion.slopes[k][i] = float(moved.slopes[Eigen::Index(k)]);
    }
  });
}

Slices::Stack stack_of(std::array<int, 3> axes, const Grid& grid, const std::int16_t* values, std::size_t slice_stride,
                       std::size_t row_stride) {
  Slices::Stack stack;
  stack.axes = axes;
  stack.values = values;
  stack.length = grid.size[std::size_t(axes[0])];
  stack.slices = grid.size[std::size_t(axes[1])];
  stack.rows = grid.size[std::size_t(axes[2])];
  stack.slice_stride = slice_stride;
  stack.row_stride = row_stride;
  stack.extents.resize(std::size_t(stack.slices) * std::size_t(stack.rows));
  tbb::parallel_for(0, stack.slices, [&](int slice) {
    for (int row = 0; row < stack.rows; ++row) {
      const std::int16_t* line = stack.row(slice, row);
      int first = 0, last = stack.length - 1;
      while (first <= last && line[first] == 0) ++first;
      while (last > first && line[last] == 0) --last;
      if (first <= last)
        stack.extents[std::size_t(slice) * std::size_t(stack.rows) + std::size_t(row)] = {std::int16_t(first),
                                                                                          std::int16_t(last)};
    }
  });
  return stack;
}

}  // namespace

Slices::Slices(const Attenuation& attenuation) : attenuation_(attenuation), turned_(attenuation.thousandths.size()) {
  const Grid& grid = attenuation.grid;
  const auto [nx, ny, nz] = grid.size;
  const std::int16_t* values = attenuation.thousandths.data();
  tbb::parallel_for(0, nz, [&, nx = nx, ny = ny](int z) {
    for (int x = 0; x < nx; ++x)
      for (int y = 0; y < ny; ++y)
        turned_[(std::size_t(z) * std::size_t(nx) + std::size_t(x)) * std::size_t(ny) + std::size_t(y)] =
            values[grid.offset(x, y, z)];
  });
  const std::size_t x_stride = std::size_t(nx), plane = std::size_t(nx) * std::size_t(ny);
  stacks_[0] = stack_of({1, 0, 2}, grid, turned_.data(), std::size_t(ny), plane);
  stacks_[1] = stack_of({0, 1, 2}, grid, values, x_stride, plane);
  stacks_[2] = stack_of({0, 2, 1}, grid, values, plane, x_stride);
  for (std::size_t k = 0; k < 3; ++k) {
    stacks_[k].first_slice = attenuation.first[k];
    stacks_[k].last_slice = attenuation.last[k];
    stacks_[k].slice_step = attenuation.enough[k];
  }
}

const Slices::Stack& Slices::stack_for(const Rays& rays, const PixelGrid& grid) const {
  const Eigen::Vector2d middle = grid.pixel(grid.columns / 2, grid.rows / 2);
  int across = 0;
  rays.direction(middle.x(), middle.y()).cwiseProduct(rays.spacing_mm).cwiseAbs().maxCoeff(&across);
  return stacks_[std::size_t(across)];
}

std::optional<std::vector<float>> Slices::radiograph(const Rays& rays, const PixelGrid& grid) const {
  if (attenuation_.is_empty() || grid.count() == 0) return std::vector<float>(grid.count(), 0.0f);
  const Stack& stack = stack_for(rays, grid);
  std::optional<Sheared> image = sheared_grid(stack, attenuation_, rays, grid);
  if (!image) return std::nullopt;
  sum_slices(stack, rays, *image);
  return warped(*image, stack, rays, grid);
}

std::optional<RadiographExpansion> Slices::expansion(const RayMotion& motion, const PixelGrid& grid) const {
  RadiographExpansion expansion;
  expansion.values.assign(grid.count(), 0.0f);
  for (auto& slopes : expansion.slopes) slopes.assign(grid.count(), 0.0f);
  if (attenuation_.is_empty() || grid.count() == 0) return expansion;
  const Stack& stack = stack_for(motion.rays(), grid);
  std::optional<Sheared> image = sheared_grid(stack, attenuation_, motion.rays(), grid);
  if (!image) return std::nullopt;
  image->layers = kValuesAndSlopes;
  sum_slices(stack, motion.rays(), *image);
  warp(*image, stack, motion, grid, expansion);
  return expansion;
}

}  // namespace marrow::rays
