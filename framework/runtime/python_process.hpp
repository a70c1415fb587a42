// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where Python is, and how a process is started that holds the nodes of a Python file.
#include <filesystem>

#include "marrow/runtime/worker.hpp"

namespace marrow {

/// The interpreter that runs nodes written in Python: MARROW_PYTHON, or /usr/bin/python3. Throws Error, with a text
/// that begins with a verb, if there is none.
std::filesystem::path python_interpreter();

/// The folder that holds marrow's Python package. Throws Error, with a text that begins with a verb, if there is none.
std::filesystem::path python_package_folder();

/// A process that holds the nodes of `file`. It answers "describe", "load", "call" and "share"
/// (python/marrow/plugin.py). Its descriptor 3 is the open file `made`, through which it hands values over. Hashes of
/// texts have no random seed there, and numerical libraries use one thread.
WorkerSettings python_process(const std::filesystem::path& file, int made);

}  // namespace marrow
