// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT marrow {

/// Digest of everything outside of marrow and its libraries that may change the last digits of a result. It covers the
/// features of the processor, by which libraries choose their code, and the environment variables that change this
/// choice.
Digest machine_digest();

/// The widest instruction set of this machine that libraries may choose at run time.
std::string cpu_level();

}  // namespace marrow
