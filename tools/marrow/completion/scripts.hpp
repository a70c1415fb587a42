// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace marrow::cli {

/// The shells that have a script: bash, fish, zsh.
std::vector<std::string> shells();

/// The script by which the shell completes marrow's words. It asks `marrow complete`.
std::string completion_script(const std::string& shell);

}  // namespace marrow::cli
