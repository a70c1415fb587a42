// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

/// A triangle surface. Triangles are counter-clockwise seen from outside, so normals point outward.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::string frame = "ct";

  using fields = Fields<&Mesh::vertices_mm, &Mesh::triangles, &Mesh::frame>;
};

/// Throws Error if there are no triangles, an index is out of range, a vertex is not finite or has a coordinate of more
/// than 1 km, or the surface has no area. `what` names the mesh in the message.
void check_mesh(const Mesh& mesh, const std::string& what);

/// True if each edge is shared by exactly two triangles that run along it in opposite directions.
bool is_closed(const Mesh& mesh);

/// True if a mesh is closed and the triangles around each vertex form a single fan. Then no two parts of the surface
/// touch in a single point.
bool is_manifold(const Mesh& mesh);

/// Throws Error unless check_mesh() accepts the mesh, it is closed and its normals point outward.
void check_closed_surface(const Mesh& mesh, const std::string& what);

/// Volume enclosed by a closed surface (divergence theorem). It is positive if normals point outward.
double enclosed_volume_mm3(const Mesh& mesh);
double surface_area_mm2(const Mesh& mesh);

/// `count` points in a fixed pattern (not random), spread evenly by area over the surface. They serve as target points
/// of an mTRE. Throws Error if the surface has no area.
std::vector<Eigen::Vector3d> sample_surface(const Mesh& mesh, std::size_t count);

/// The anatomical axes of a long-bone fragment, in the frame of its mesh. All of marrow's tables use them. Origin: the
/// area-weighted centroid of the surface. Column 2 of `axes`: the long axis, which is the principal axis of the
/// surface, with the sign that agrees with the frame's +z. Column 0: the frontal axis, which is the frame's +x made
/// orthogonal to the long axis (+y if the long axis is close to x). A rotation about it is seen in the lateral view.
/// Column 1: the lateral axis, which completes a right-handed frame. The chapter calls rotations about columns 0, 1, 2
/// Rx, Ry, Rz.
struct FragmentFrame {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  /// Whether origin and axes are the ones described above. Otherwise they are others, such as those of the CT, and no
  /// text may call one of them "the long axis" or a shift "shortening".
  bool is_anatomical = false;
  using fields = Fields<&FragmentFrame::origin_mm, &FragmentFrame::axes, &FragmentFrame::is_anatomical>;
};
/// Throws Error as check_mesh() does.
FragmentFrame fragment_frame(const Mesh& mesh);

}  // namespace marrow
