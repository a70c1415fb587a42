// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "regular_file.hpp"

namespace marrow {

/// The build id that the linker writes into each ELF file as a note, or an empty text if there is none or the file is
/// damaged.
std::string build_note(const RegularFile& file);

}  // namespace marrow
