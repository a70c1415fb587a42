// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace CLI {
class App;
}

namespace marrow::workbench {

/// Adds the command `open` with its options, its help and its callback, which sets `code` to the exit code.
void add_open(CLI::App& app, int& code);

}  // namespace marrow::workbench
