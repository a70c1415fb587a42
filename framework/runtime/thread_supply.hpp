// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// Of `wanted` threads for a run, those that can be had beside this one: fewer at a limit of the system, where TBB
/// would end the program, or 0. Where more than one can be had, one is left for the process that reads files.
int threads_to_be_had(int wanted);

}  // namespace marrow
