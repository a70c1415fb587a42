// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/functions.hpp"

#include <oneapi/tbb/parallel_for.h>

namespace marrow {
OutlineProjector::~OutlineProjector() = default;
RadiographProjector::~RadiographProjector() = default;
Cost::~Cost() = default;
Optimizer::~Optimizer() = default;

std::optional<RadiographExpansion> RadiographProjector::expansion(const Camera&, const RigidTransform&,
                                                                  const FragmentFrame&, const PixelGrid&) const {
  return std::nullopt;
}

std::shared_ptr<const RadiographProjector> RadiographProjector::smoothed(double) const { return nullptr; }

std::vector<double> Cost::values(const std::vector<RigidTransform>& poses) const {
  std::vector<double> results(poses.size());
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) { results[i] = value(poses[i]); });
  return results;
}

std::optional<Cost::Expansion> Cost::expansion(const RigidTransform&, const FragmentFrame&) const {
  return std::nullopt;
}
std::vector<double> Cost::without_each_block(const RigidTransform&) const { return {}; }
std::vector<Cost::Expansion> Cost::expansion_without_each_block(const RigidTransform&, const FragmentFrame&) const {
  return {};
}
std::size_t Cost::view_count() const { return 0; }
double Cost::value_in_view(std::size_t, const RigidTransform& world_from_model) const {
  return value(world_from_model);
}
std::string Cost::nothing_compared(const RigidTransform&) const { return {}; }
std::vector<std::string> Cost::silent_views(const RigidTransform&) const { return {}; }

}  // namespace marrow
