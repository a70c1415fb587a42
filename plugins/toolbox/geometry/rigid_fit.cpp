// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/rigid_fit.hpp"

#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

namespace marrow::geometry {
namespace {

Eigen::Vector3d centre_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / double(points.size());
}

/// Squared extents of the points in ascending order (eigenvalues) and their directions (eigenvectors).
SymmetricEigen<3> principal(const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d centre = centre_of(points);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) scatter += (point - centre) * (point - centre).transpose();
  return eigen_of_symmetric(scatter);
}

double root_mean_square_mm(const Eigen::Matrix3d& map, const std::vector<Eigen::Vector3d>& from,
                           const std::vector<Eigen::Vector3d>& to) {
  const Eigen::Vector3d from_centre = centre_of(from), to_centre = centre_of(to);
  double sum = 0;
  for (std::size_t i = 0; i < from.size(); ++i)
    sum += (map * (from[i] - from_centre) - (to[i] - to_centre)).squaredNorm();
  return std::sqrt(sum / double(from.size()));
}

}  // namespace

Eigen::Vector3d plane_normal(const std::vector<Eigen::Vector3d>& points_mm) {
  return principal(points_mm).vectors.col(0);
}

bool lie_on_a_line(const std::vector<Eigen::Vector3d>& points_mm) {
  constexpr double kThinnest = 0.01;  // width of the points over their length
  const Eigen::Vector3d squares = principal(points_mm).values;
  return !(squares[1] > kThinnest * kThinnest * squares[2]);
}

void check_spread(const std::vector<Eigen::Vector3d>& points_mm, const std::string& what) {
  if (points_mm.size() < 3)
    throw Error(formatted("{} are {}, but a pose takes three at least", what, points_mm.size()));
  if (lie_on_a_line(points_mm))
    throw Error(what + " lie on one line, so the rotation about it is not determined; add one aside of it");
}

RigidTransform fit_rigid(const std::vector<Eigen::Vector3d>& from_mm, const std::vector<Eigen::Vector3d>& to_mm,
                         const std::string& what) {
  check_spread(from_mm, what + " in the CT");
  check_spread(to_mm, what + " in the world");
  const Eigen::Vector3d from_centre = centre_of(from_mm), to_centre = centre_of(to_mm);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from_mm.size(); ++i)
    covariance += (to_mm[i] - to_centre) * (from_mm[i] - from_centre).transpose();
  const Eigen::Matrix3d orthogonal = nearest_orthogonal(covariance);
  RigidTransform fit;
  fit.source = "ct";
  fit.rotation = nearest_rotation(covariance);
  fit.translation_mm = to_centre - fit.rotation * from_centre;
  if (orthogonal.determinant() < 0) {
    // For points near one plane noise alone can give a reflection, but not one that fits so much better.
    const double turned = root_mean_square_mm(fit.rotation, from_mm, to_mm),
                 mirrored = root_mean_square_mm(orthogonal, from_mm, to_mm);
    const double size = root_mean_square_mm(Eigen::Matrix3d::Zero(), from_mm, to_mm);
    if (turned > 0.05 * size && mirrored < 0.2 * turned)
      throw Error(
          formatted("{} are the mirror image of those in the CT: a reflection leaves {:.3g} mm, a rotation {:.3g} mm; "
                    "check for an axis of the wrong sign, or a left-handed frame",
                    what, mirrored, turned));
  }
  return fit;
}

Eigen::Matrix<double, 3, 6> point_by_motion(const FragmentFrame& frame, const Eigen::Vector3d& model_mm) {
  const Eigen::Vector3d arm = model_mm - frame.origin_mm;
  Eigen::Matrix<double, 3, 6> derivatives;
  derivatives << cross_matrix(-arm) * frame.axes, frame.axes;  // r x arm = -arm x r
  return derivatives;
}

}  // namespace marrow::geometry
