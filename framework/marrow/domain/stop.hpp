// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

/// Whether a repetition ends after this pass.
struct Stop {
  bool stops = false;
  std::string reason;  ///< in words, also of a pass that does not stop; may be empty

  using fields = Fields<&Stop::stops, &Stop::reason>;
};

}  // namespace marrow
