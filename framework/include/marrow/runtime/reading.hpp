// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow {

/// To be called by whatever parses a file, before it begins: if the process crashes or is ended, the message then names
/// that file. Does nothing but in a process that was started to read. Safe to use from several threads.
void now_reading(const std::filesystem::path& file);

}  // namespace marrow
