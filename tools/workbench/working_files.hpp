// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files in .marrow/drafts that pipelines read in the place of what a draft holds: masks, cameras, points. Each is named
// after the digest of its content, so it never changes.
#include <filesystem>
#include <string>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// Writes the text to .marrow/drafts/NAME-DIGEST.ENDING, where the digest is that of the text, and returns this place.
std::filesystem::path working_file(const OpenedFolder& folder, const std::string& name, const std::string& ending,
                                   const std::string& text);

/// Removes those that were not asked for in the last day and that no step of a draft names: undo may lead back to each.
/// If a draft cannot be read, all stay.
void remove_unused_working_files(const OpenedFolder& folder);

}  // namespace marrow::workbench
