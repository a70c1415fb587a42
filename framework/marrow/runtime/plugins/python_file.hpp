// SPDX-License-Identifier: Apache-2.0
#pragma once
// Python files that declare nodes, as if they were plugin libraries.
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "marrow/plugin.hpp"
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

/// Whether the file's name ends in .py and it holds a decorator of nodes, such as @marrow.node. False in a process of a
/// Python node, which would otherwise start another one, and so on.
bool is_python_plugin(const std::filesystem::path& file);

/// Describes a file by a Python process with limits of time and memory. `linked` has the interpreter, the modules and
/// libraries that the process loaded from outside of the standard library, and the libraries of its kinds. `digest` is
/// made from the file, from all of these, and from python_settings(). The description may be a refusal. Throws Error,
/// with a text that begins with a verb, if there is no Python or the file is not trusted.
LibraryInfo describe_python_file(const std::filesystem::path& file);

/// The same from the user's cache of descriptions, unless one of these files has changed, with the build id.
LibraryInfo python_file_info(const std::filesystem::path& file, const Digest& framework);

/// The nodes of a file. Their calls start Python processes. Throws Error if the file is not as `described`.
std::unique_ptr<Plugin> load_python_file(const LibraryInfo& described);

/// Digest of a Python file and of all files that it loads. Throws Error if one of the files is gone.
Digest digest_of_python(const LibraryInfo& described);

/// Adds to `more_loaded`, and to the kept description, what a process has loaded in addition. From then on
/// is_fully_described() is false for `described`, because its build id does not cover what was added.
void add_to_description(const LibraryInfo& described, const nlohmann::json& answer, std::set<std::string>& more_loaded);
bool is_fully_described(const LibraryInfo& described);

}  // namespace marrow
