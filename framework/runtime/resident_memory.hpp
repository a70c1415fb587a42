// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace marrow {

/// Memory that this process has now. Asks for none, for it is called where none may be left.
double resident_memory_mb();

}  // namespace marrow
