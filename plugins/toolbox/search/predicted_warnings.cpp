// SPDX-License-Identifier: Apache-2.0
// What a predicted covariance says to people.
#include <algorithm>
#include <array>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "predicted_covariance.hpp"

namespace marrow::search {
namespace {

/// The six axes in words. Only of a bone's own axes is known which is the long one.
std::array<std::string, 6> names_of_axes(const FragmentFrame& frame) {
  if (frame.is_anatomical)
    return {"rotation about the frontal axis",    "rotation about the lateral axis",    "axial rotation",
            "translation along the frontal axis", "translation along the lateral axis", "axial translation"};
  return {"rotation about the x axis",    "rotation about the y axis",    "rotation about the z axis",
          "translation along the x axis", "translation along the y axis", "translation along the z axis"};
}

/// A sentence if the rotation about a direction between the axes is less certain than about all of them, as that about
/// a bone's long axis may be, and less than `most_deg`. Else empty.
std::string warning_between_axes(const Matrix6d& covariance, double most_deg) {
  constexpr double kLonger = 1.1;
  const SymmetricEigen<3> eigen = eigen_of_symmetric<3>(covariance.topLeftCorner<3, 3>());
  const double worst_deg = degrees(std::sqrt(std::max(0.0, eigen.values[2]))),
               of_axes_deg = degrees(std::sqrt(covariance.diagonal().head<3>().maxCoeff()));
  if (worst_deg <= std::max(most_deg, kLonger * of_axes_deg)) return "";
  const Eigen::Vector3d along = eigen.vectors.col(2) * (eigen.vectors.col(2).sum() < 0 ? -1 : 1);
  return formatted(
      "rotation about the direction ({:.3g}, {:.3g}, {:.3g}) is poorly determined by these images: its predicted "
      "standard deviation is {:.3g} degrees",
      along.x(), along.y(), along.z(), worst_deg);
}

}  // namespace

std::vector<std::string> PredictedCovariance::warnings(double most_deg, double most_mm) const {
  const std::array<std::string, 6> axes = names_of_axes(frame_);
  if (has_few_blocks_)
    return {
        "all that the images say about the pose lies in one or two small parts of them, so its deviations are not "
        "known"};
  std::vector<std::string> warnings;
  for (int axis = 0; axis < 6 && covariance_; ++axis) {
    const bool turn = axis < 3;
    const double sd = std::sqrt((*covariance_)(axis, axis)), shown = turn ? degrees(sd) : sd;
    if (shown <= (turn ? most_deg : most_mm)) continue;
    if (undetermined_[std::size_t(axis)])
      warnings.push_back(formatted("{} is not determined by these images: the cost hardly changes within {:.3g}{}",
                                   axes[std::size_t(axis)], kMostStep, turn ? " degrees" : " mm"));
    else
      warnings.push_back(
          formatted("{} is poorly determined by these images: its predicted standard deviation is {:.3g}{}",
                    axes[std::size_t(axis)], shown, turn ? " degrees" : " mm"));
  }
  if (!frame_.is_anatomical && covariance_)
    if (std::string between = warning_between_axes(*covariance_, most_deg); !between.empty())
      warnings.push_back(std::move(between));
  return warnings;
}

}  // namespace marrow::search
