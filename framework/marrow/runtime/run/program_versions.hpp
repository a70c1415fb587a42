// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// Whether the option is a command that asks a program for its version: a list of texts with the name version_command.
/// What the command prints counts in the keys of the node's results.
bool asks_for_version(const OptionInfo& option);

/// What the command prints, without blanks at its end. It runs once in this process, and again if the file of the
/// program changes. Empty if the command is empty. Throws Error if it fails or prints nothing.
MARROW_EXPORT_TO_TESTS std::string version_printed(const std::vector<std::string>& command);

/// What the node's program says about its version; empty if it has none, or if the program does not answer.
std::string version_of_program(const PipelineNode& node);

}  // namespace marrow
