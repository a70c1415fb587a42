// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/domain/fields.hpp"

namespace marrow {

/// Whether a repetition ends after this pass.
struct Stop {
  bool stops = false;
  std::string reason;  ///< in words, also of a pass that does not stop; may be empty

  using fields = Fields<&Stop::stops, &Stop::reason>;
};

}  // namespace marrow
