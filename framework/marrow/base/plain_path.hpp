// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The path without '.', and without '..' if this does not change its meaning. A '..' is removed together with the
/// folder before it, if that folder exists and is not a link. After a link, '..' stays, because the system goes up from
/// the target of the link.
std::filesystem::path plain_path(const std::filesystem::path& path);

}  // namespace marrow
