// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// Resident memory of this process, in units of 1e6 bytes. Allocates no memory, because it is called when there may be
/// none left.
double resident_memory_mb();

}  // namespace marrow
