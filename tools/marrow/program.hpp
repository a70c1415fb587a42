// SPDX-License-Identifier: Apache-2.0
#pragma once
// A program with commands: what main() of `marrow` and of its workbench share.
#include <initializer_list>

namespace CLI {
class App;
}

namespace marrow::cli {

/// Runs the command that the words of the command line name, and returns the exit code. Each of `commands` adds one,
/// see commands.hpp. What a command throws is printed as an error.
int run_program(int argc, char** argv, std::initializer_list<void (*)(CLI::App& app, int& code)> commands);

}  // namespace marrow::cli
