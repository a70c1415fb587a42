// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for costs: two simulated views of a body with a known pose, three ellipsoids in soft tissue,
// with blur and noise, and the edges of these images.
#include <functional>
#include <memory>
#include <utility>

#include "marrow/conformance.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

constexpr int kSize_px = 240;

RigidTransform truth();
/// The true pose, rotated by `turn_deg` about the body's middle and shifted by `shift_mm`.
RigidTransform off_truth(const Eigen::Vector3d& turn_deg, const Eigen::Vector3d& shift_mm);
RigidTransform off_truth(int axis, double by);

analytic::Body bone();
analytic::Body other_bone();
/// Always the same object, because a cost recognises its own projector among those of all fragments.
std::shared_ptr<const analytic::BodyProjector> bone_projector();

/// Variants of the images.
struct Scene {
  bool with_other = false;
  double gain = 1, offset = 0;  ///< applied to the line integrals
  double noise = 1;
};

/// All inputs of the kind, except those about other fragments. `change` may change a view and its edges.
Inputs inputs_of(const Scene& scene, const std::function<void(View&, EdgeMap&)>& change = nullptr);

/// The node's cost together with the inputs that it refers to.
class Made {
 public:
  Made(const Subject& subject, Inputs inputs) : inputs_(std::move(inputs)), value_(subject.output(inputs_, "cost")) {}
  const Cost& operator*() const { return value_.as<Cost>(); }
  const Cost* operator->() const { return &value_.as<Cost>(); }

 private:
  Inputs inputs_;
  Value value_;
};
Made made(const Subject& subject, const Scene& scene = {});

}  // namespace marrow::conformance
