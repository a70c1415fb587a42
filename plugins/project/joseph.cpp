// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/slices.hpp"

namespace {

using marrow::rays::AttenuationOptions;

/// In this file alone, so that `marrow run --profile` can show its calls.
class Joseph : public marrow::rays::JosephProjector {
 public:
  using JosephProjector::JosephProjector;
};

std::shared_ptr<const marrow::RadiographProjector> joseph(const marrow::Volume& volume,
                                                          const marrow::SignedField* field,
                                                          const AttenuationOptions& options) {
  return std::make_shared<Joseph>(attenuation_of(volume, field, options));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("project.joseph", joseph);
  marrow::rays::declare<AttenuationOptions>(
      node.summary("Radiographs by Joseph's method (IEEE Trans Med Imaging 1982): line integrals as sums over slices; "
                   "whole images are computed slice by slice")
          .trait("derivatives"));
}
