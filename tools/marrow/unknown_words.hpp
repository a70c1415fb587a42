// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace marrow::cli {

/// The first word of the command line that stands where a command is expected and is none, with the nearest one. Empty
/// if there is no such word.
std::string unknown_command(const CLI::App& app, const std::vector<std::string>& arguments);
/// The first option that its command does not have, with the nearest one. `app` has read the command line. Empty if
/// there is no such option.
std::string unknown_option(const CLI::App& app);

}  // namespace marrow::cli
