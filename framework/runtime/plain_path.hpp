// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow {

/// The path without '.' and, where that leaves its meaning alone, without '..': a folder that is there and is no link
/// goes together with the '..' after it. After a link, '..' stays, for the system goes up from where the link leads.
std::filesystem::path plain_path(const std::filesystem::path& path);

}  // namespace marrow
