// SPDX-License-Identifier: Apache-2.0
// marrow-workbench: the program behind `marrow open`.
#include "commands.hpp"
#include "workbench/workbench.hpp"

int main(int argc, char** argv) {
  return marrow::cli::run_program(argc, argv, {marrow::workbench::add_open, marrow::cli::add_manual});
}
