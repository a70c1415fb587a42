// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdlib>

#include "marrow/runtime/plugins/catalogue.hpp"
#include "target.hpp"

namespace marrow::fuzz {

/// The nodes that pipelines may use here: those of the small plugin for tests of the runtime.
inline const Catalogue& nodes() {
  // The index of libraries is kept in a folder of this process.
  static const Catalogue known = [] {
    setenv("XDG_CACHE_HOME", folder().c_str(), 1);
    return Catalogue({MARROW_FUZZ_PLUGINS});
  }();
  if (known.node_names().empty())
    throw std::runtime_error("there are no nodes in " MARROW_FUZZ_PLUGINS ": " +
                             (known.libraries().empty() ? "no library" : known.libraries()[0].refused));
  return known;
}

}  // namespace marrow::fuzz
