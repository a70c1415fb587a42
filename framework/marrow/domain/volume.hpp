// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "marrow/domain/mesh.hpp"

namespace MARROW_EXPORT marrow {

/// The places of a volume's samples: point = origin_mm + direction * (index .* spacing_mm), in the frame named `frame`.
/// Index (0, 0, 0) is the centre of the first voxel (ITK's convention). The columns of `direction` are the orthonormal
/// axes of the grid in that frame.
struct Grid {
  std::array<int, 3> size{0, 0, 0};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  std::string frame = "ct";

  std::size_t count() const { return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]); }
  /// Index of a voxel in the list of values: x runs fastest, then y, then z.
  std::size_t offset(int x, int y, int z) const { return (std::size_t(z) * size[1] + y) * size[0] + x; }
  bool contains(int x, int y, int z) const {
    return x >= 0 && y >= 0 && z >= 0 && x < size[0] && y < size[1] && z < size[2];
  }
  /// A template only so that it is compiled where it is used, not wherever this header is included.
  template <class = void>
  Eigen::Vector3d point_from_index(const Eigen::Vector3d& index) const {
    return origin_mm + direction * index.cwiseProduct(spacing_mm);
  }
  template <class = void>
  Eigen::Vector3d index_from_point(const Eigen::Vector3d& point_mm) const {
    return (direction.transpose() * (point_mm - origin_mm)).cwiseQuotient(spacing_mm);
  }

  using fields = Fields<&Grid::size, &Grid::spacing_mm, &Grid::origin_mm, &Grid::direction, &Grid::frame>;
};

/// A CT volume in Hounsfield units. values.size() == grid.count(). NaN is never valid: readers refuse it.
struct Volume {
  Grid grid;
  std::vector<float> values;
  float at(int x, int y, int z) const { return values[grid.offset(x, y, z)]; }
  using fields = Fields<&Volume::grid, &Volume::values>;
};

/// A level set: signed distance in mm to the surface of one fragment, negative inside, sampled on the CT's grid. Away
/// from the surface the value may be clamped (narrow band), but its sign is always right.
struct SignedField {
  Grid grid;
  std::vector<float> values_mm;
  float at(int x, int y, int z) const { return values_mm[grid.offset(x, y, z)]; }
  using fields = Fields<&SignedField::grid, &SignedField::values_mm>;
};

/// Trilinear interpolation at a fractional index. The index is clamped to the grid.
float sample_trilinear(const Grid& grid, const std::vector<float>& values, const Eigen::Vector3d& index);

/// Throws Error unless sizes are positive, spacings are 0.001 to 100 mm, coordinates of the origin are at most 1 km,
/// directions are orthonormal, and values are complete and finite. `what` names the volume in the message.
void check_volume(const Volume& volume, const std::string& what);

/// Points inside one fragment, in the frame of the CT. A segmenter grows the fragment from them.
struct Seeds {
  std::string fragment;
  std::vector<Eigen::Vector3d> points_mm;
  /// False for a fragment that is segmented only to separate it from the others. It is not part of the result.
  bool wanted = true;
  using fields = Fields<&Seeds::fragment, &Seeds::points_mm, &Seeds::wanted>;
};

/// Throws Error unless both grids have the same frame and size, and voxels of the same index are at most a hundredth of
/// a voxel apart. The message calls the grids the field and the volume.
void check_same_grid(const Grid& field, const Grid& volume);

/// Throws Error unless mesh and grid have the same frame, and at least half of the vertices are inside the grid. `what`
/// and `of` name them in the message: "the mesh", "the volume".
void check_lies_in(const Mesh& mesh, const Grid& grid, const std::string& what, const std::string& of);

}  // namespace marrow
