// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/base/regular_file.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The build id that the linker writes into each ELF file as a note, or an empty text if there is none or the file is
/// damaged.
std::string build_note(const RegularFile& file);

}  // namespace marrow
