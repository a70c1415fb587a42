// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/functions.hpp"

#include <oneapi/tbb/parallel_for.h>

namespace marrow {
OutlineProjector::~OutlineProjector() = default;
RadiographProjector::~RadiographProjector() = default;
Cost::~Cost() = default;
Optimizer::~Optimizer() = default;

std::vector<double> Cost::values(const std::vector<RigidTransform>& poses) const {
  std::vector<double> results(poses.size());
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) { results[i] = value(poses[i]); });
  return results;
}

std::optional<Cost::Expansion> Cost::expansion(const RigidTransform&, const FragmentFrame&) const {
  return std::nullopt;
}
std::optional<double> Cost::likelihood_factor(const RigidTransform&) const { return std::nullopt; }

}  // namespace marrow
