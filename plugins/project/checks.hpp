// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the checks of projectors share: bodies, and the projectors that a node makes. The types of its outputs say
// whether they draw outlines or radiographs.
#include <cmath>

#include "marrow/conformance.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {

// Bodies that are known exactly, in one pose, seen from four sides.
constexpr int kSize_px = 160;
constexpr double kDensity = 1.5;  ///< attenuation of the bodies relative to water: 500 HU

Camera camera_at(double angle_deg);
const std::vector<double>& angles();
RigidTransform pose();

analytic::Body ball();
/// An ellipsoid with rotated axes.
analytic::Body egg();
Grid fine_grid();

Inputs inputs_of(Volume volume, SignedField field, Mesh mesh);
Inputs inputs_of(const analytic::Body& body);

template <class Projector>
bool is_of(const PortInfo& port) {
  return port.type.id == TypeInfo::of<Projector>().id && port.axis.empty();
}

/// All projectors of a type among a node's outputs. Throws Failure if one is missing.
template <class Projector>
std::vector<const Projector*> projectors_in(const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  std::vector<const Projector*> found;
  for (std::size_t i = 0; i < ports.size(); ++i) {
    if (!is_of<Projector>(ports[i])) continue;
    expect(outputs.at(i).data != nullptr, "it gives no " + ports[i].name);
    found.push_back(&outputs[i].as<Projector>());
  }
  return found;
}

/// A node's outputs together with its inputs, because its projectors may refer to the inputs.
class Made {
 public:
  /// Throws Failure if the node refuses its inputs.
  Made(const Subject& subject, Inputs inputs) : ports_(subject.info().outputs), inputs_(std::move(inputs)) {
    Result result = subject.call(inputs_);
    if (result.refusal) throw Failure("it refuses: " + *result.refusal);
    outputs_ = std::move(result.outputs);
  }
  template <class Projector>
  std::vector<const Projector*> all() const {
    return projectors_in<Projector>(ports_, outputs_);
  }

 private:
  const std::vector<PortInfo>& ports_;
  Inputs inputs_;
  std::vector<Value> outputs_;
};

/// The largest figure over all projectors of a type that a node makes. Throws NotApplicable with the reason if it makes
/// none.
template <class Projector>
double largest_of(const Subject& subject, Inputs inputs, const std::string& reason,
                  const std::function<double(const Projector&)>& figure) {
  bool makes_some = false;
  for (const PortInfo& port : subject.info().outputs) makes_some = makes_some || is_of<Projector>(port);
  if (!makes_some) throw NotApplicable(reason);
  const Made made(subject, std::move(inputs));
  double most = 0;
  for (const Projector* projector : made.all<Projector>()) {
    const double one = figure(*projector);
    if (std::isnan(one) || one > most) most = one;
  }
  return most;
}

/// Throws Failure if the points are not a valid outline in this camera's image.
void check_outline(const std::vector<OutlinePoint>& points, const Camera& camera);

/// Compares outlines with the silhouette of an ellipsoid.
std::vector<Check> outline_checks();

/// All pixels of the images.
PixelGrid whole();
/// Throws Failure if the number of values is not the number of pixels.
std::vector<float> radiograph_of(const RadiographProjector& projector, const Camera& camera, const PixelGrid& grid,
                                 const RigidTransform& at = pose());

/// Compares radiographs with the chords of a ball, a box and an octahedron.
std::vector<Check> radiograph_checks();

/// Of projectors whose radiographs have derivatives.
std::vector<Check> derivative_checks();

}  // namespace marrow::conformance
