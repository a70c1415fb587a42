// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/regular_file.hpp"

namespace marrow {

/// Throws Error, with a text that begins with a verb, if the file is not a whole ELF library for this machine. With
/// such a file, the dynamic loader would fail with an unclear message or crash.
void check_elf(const RegularFile& file);

}  // namespace marrow
