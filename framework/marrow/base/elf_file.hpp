// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/base/regular_file.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// Throws Error, with a text that begins with a verb, if the file is not a whole ELF library for this machine. With
/// such a file, the dynamic loader would fail with an unclear message or crash.
void check_elf(const RegularFile& file);

/// The build id that the linker writes into each ELF file as a note; empty if there is none or the file is damaged.
std::string build_note(const RegularFile& file);

}  // namespace marrow
