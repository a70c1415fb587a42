// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/hash.hpp"

namespace marrow {

/// Digest of everything outside of marrow and its libraries that may change the last digits of a result. It covers the
/// features of the processor, by which libraries choose their code, and the environment variables that change this
/// choice.
Digest machine_digest();

}  // namespace marrow
