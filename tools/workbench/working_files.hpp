// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files in .marrow/drafts with parts of a draft that pipelines read: masks, cameras, points. A file is named after the
// digest of its content, so it never changes.
#include <filesystem>
#include <string>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// Writes the text to .marrow/drafts/NAME-DIGEST.ENDING, with the digest of the text, and returns the path.
std::filesystem::path working_file(const OpenedFolder& folder, const std::string& name, const std::string& ending,
                                   const std::string& text);

/// Removes files that were not used in the last day and that no step of a draft names: undo may lead back to any step.
/// If a draft cannot be read, all files stay.
void remove_unused_working_files(const OpenedFolder& folder);

}  // namespace marrow::workbench
