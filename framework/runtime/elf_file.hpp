// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "regular_file.hpp"

namespace marrow {

/// Throws Error, which begins with a verb, for a file that is no whole ELF library for this machine: such a file would
/// make the dynamic loader fail obscurely or crash.
void check_elf(const RegularFile& file);

}  // namespace marrow
