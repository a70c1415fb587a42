// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A parser must call this before it reads a file. If the process then crashes or is killed, the message names that
/// file. Has an effect only in a process that was started to read files. Safe to use from several threads.
void now_reading(const std::filesystem::path& file);

}  // namespace marrow
