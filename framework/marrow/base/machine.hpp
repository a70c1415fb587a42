// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT marrow {

/// Digest of everything outside of marrow and its libraries that may change the last digits of a result. It covers the
/// features of the processor, by which libraries choose their code, and the environment variables that change this
/// choice.
Digest machine_digest();

/// The widest instruction set of this machine that libraries may choose at run time.
std::string cpu_level();

/// How many of the `wanted` threads a run can start besides this one. A limit of the system may allow fewer or none;
/// TBB would then end the program. If more than one can be started, one is left for the process that reads files.
int threads_to_be_had(int wanted);

}  // namespace marrow
