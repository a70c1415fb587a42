// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// How many of the `wanted` threads a run can start besides this one. A limit of the system may allow fewer or none;
/// TBB would then end the program. If more than one can be started, one is left for the process that reads files.
int threads_to_be_had(int wanted);

}  // namespace marrow
