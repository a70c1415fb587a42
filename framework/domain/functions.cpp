// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/functions.hpp"

#include <oneapi/tbb/parallel_for.h>

#include "marrow/domain/error.hpp"

namespace marrow {
namespace {

[[noreturn]] void refuse_radiograph() {
  throw Error("the projector draws outlines only; wire one that makes radiographs of a volume");
}

}  // namespace

Projector::~Projector() = default;
std::vector<OutlinePoint> Projector::outline(const Camera&, const RigidTransform&, double) const {
  throw Error("the projector makes radiographs only; wire one that draws the outline of a mesh");
}
std::vector<float> Projector::radiograph(const Camera&, const RigidTransform&, const PixelGrid&) const {
  refuse_radiograph();
}
std::vector<float> Projector::radiograph(const Camera&, const RigidTransform&,
                                         const std::vector<Eigen::Vector2f>&) const {
  refuse_radiograph();
}
PixelGrid Projector::region(const Camera&, const RigidTransform&) const { refuse_radiograph(); }

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
