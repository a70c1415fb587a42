// SPDX-License-Identifier: Apache-2.0
#pragma once
// Templates of files, which are installed in share/marrow, and the projects made from them.
#include <filesystem>
#include <map>
#include <string>

namespace marrow::cli {

/// Files of a new project by their relative paths. A file named `ci` becomes a program.
using Files = std::map<std::filesystem::path, std::string>;
/// What takes the place of each text.
using Replacements = std::map<std::string, std::string>;

/// share/marrow of this program. Throws Error if `below` is not in it.
std::filesystem::path shared_files(const std::filesystem::path& below);

/// The text with each key replaced by its value, the longest keys first.
std::string replaced(std::string text, const Replacements& replacements);

/// All files of a folder of templates, with replacements in their texts. `gitignore` becomes `.gitignore`.
Files filled_templates(const std::filesystem::path& folder, const Replacements& replacements);

/// Throws Error if the place is taken.
void expect_free(const std::filesystem::path& place);

/// Writes all files into a new folder, or nothing: the `wanted` one, or if that is empty, `otherwise`. Returns the
/// folder. Throws Error if it exists already, or cannot be written.
std::filesystem::path write_project(const std::filesystem::path& wanted, const std::string& otherwise,
                                    const Files& files);

/// The text of the file `from`, for a copy of it in `folder`: relative paths of files and folders that exist, such as
/// `../femur.yaml`, are changed so that they lead there from the new place.
std::string moved_text(const std::filesystem::path& from, const std::filesystem::path& folder);

/// Throws Error unless the text is a name: small letters, digits and '_', beginning with a letter. `what` begins the
/// message.
void expect_name(const std::string& name, const std::string& what);

// New nodes and kinds. Each function throws Error if the request cannot be met; then nothing is written.

}  // namespace marrow::cli
