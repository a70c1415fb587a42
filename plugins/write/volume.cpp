// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/write/picture_out.hpp"

namespace {

void volume(const marrow::Volume& volume, const std::string& path) {
  marrow::check_volume(volume, path);
  marrow::files::write_atomically(
      path, [&](const auto& temporary) { marrow::write::write_grid(temporary, volume.grid, volume.values); });
}

void signed_field(const marrow::SignedField& field, const std::string& path) {
  marrow::files::write_atomically(
      path, [&](const auto& temporary) { marrow::write::write_grid(temporary, field.grid, field.values_mm); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::Volume>(".mha", volume, "MetaImage of Hounsfield units, compressed");
  plugin.writer<marrow::SignedField>(".mha", signed_field, "MetaImage of signed distances in mm, compressed");
}
