// SPDX-License-Identifier: Apache-2.0
#pragma once
// Projectors of nodes as they are shipped.
#include <marrow/domain/functions.hpp>
#include <marrow/domain/mesh.hpp>
#include <marrow/domain/volume.hpp>
#include <memory>
#include <string>
#include <utility>

#include "shipped.hpp"

namespace made {

/// The projector, which keeps the inputs that it was made from.
template <class Projector>
std::shared_ptr<const Projector> projector(const std::string& node, const shipped::Inputs& in,
                                           const shipped::Options& options = {}) {
  const auto kept =
      std::make_shared<std::pair<shipped::Inputs, shipped::Outputs>>(in, shipped::call(node, in, options));
  return {kept, &kept->second.at("projector").as<Projector>()};
}

inline std::shared_ptr<const marrow::RadiographProjector> radiographs(const std::string& node,
                                                                      const marrow::Volume& volume,
                                                                      const marrow::SignedField* field) {
  shipped::Inputs in{{"volume", shipped::item(volume)}};
  if (field) in["field"] = shipped::item(*field);
  return projector<marrow::RadiographProjector>(node, in);
}

inline std::shared_ptr<const marrow::OutlineProjector> outlines(const std::string& node, const marrow::Mesh& mesh,
                                                                const marrow::Volume* volume) {
  shipped::Inputs in{{"model", shipped::item(mesh)}};
  if (volume) in["volume"] = shipped::item(*volume);
  return projector<marrow::OutlineProjector>(node, in);
}

}  // namespace made
