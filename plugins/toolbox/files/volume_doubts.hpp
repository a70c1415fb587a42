// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/volume.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::files {

/// Warns if a CT that was read with this `value_offset_hu` from `path` seems to hold HU + 1024, or + 1000, and not
/// Hounsfield units. No value of such a CT is below 0. If it holds a bone alone, hardly any value above 0 lies below
/// 500. If it holds a whole patient, soft tissue lies about 1024, and hardly any value lies between that and air. An
/// offset that was given, or a map of labels, whose values stay far below those of bone, raises no doubt.
void warn_of_offset(const Volume& volume, const std::filesystem::path& path, double value_offset_hu,
                    const Context& context);

}  // namespace marrow::files
