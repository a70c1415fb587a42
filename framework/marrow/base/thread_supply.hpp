// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// How many of the `wanted` threads a run can start besides this one. At a limit of the system they are fewer, or none,
/// and TBB would end the program. If more than one can be started, one is left for the process that reads files.
int threads_to_be_had(int wanted);

}  // namespace marrow
