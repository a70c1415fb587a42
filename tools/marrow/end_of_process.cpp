// SPDX-License-Identifier: Apache-2.0
// Functions of the C library that end the process without another word. Those of the program are found before those of
// the library, also by plugins. exit() and quick_exit() call what they were told to (runtime/plugin_code.cpp).
#include <unistd.h>
#include <cstdlib>

#include "marrow/runtime/process/plugin_code.hpp"

extern "C" {

void _exit(int code) { marrow::end_process(marrow::code_of_end(code)); }

void _Exit(int code) noexcept { marrow::end_process(marrow::code_of_end(code)); }
}
