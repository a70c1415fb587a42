// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// How many of the `wanted` threads a run can have besides this one. At a limit of the system they are fewer, or 0; TBB
/// would end the program there. If more than one can be had, one is left free for the process that reads files.
int threads_to_be_had(int wanted);

}  // namespace marrow
