// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/hash.hpp"

namespace marrow {

/// Of all outside of marrow and its libraries that may change the last digits of a result: what the processor can do,
/// since libraries choose their code by it, and the variables of the environment that make them choose other code.
Digest machine_digest();

}  // namespace marrow
