// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The framework's own shared library, which contains this function.
std::filesystem::path framework_file();

}  // namespace marrow
