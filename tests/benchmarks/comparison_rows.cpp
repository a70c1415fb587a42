// SPDX-License-Identifier: Apache-2.0
// Fills the folder of a comparison with made-up rows, as if all of its cells had run, so that report_cost.py can
// measure what tables and page cost. The keys of rows depend on the libraries of the program that makes them. So this
// is loaded into marrow itself, where it does its work before main():
//
//     MADE_UP_ROWS_OF=EXPERIMENT.yaml MADE_UP_ROWS_IN=FOLDER LD_PRELOAD=.../comparison_rows.so marrow
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "marrow/compare/cell.hpp"

namespace {

using namespace marrow;

/// A row as a registration gives it: most are near the truth, some far off. None has failed, because marrow would run
/// the cell again.
compare::CellRow made_up_row(const compare::Experiment& experiment, const compare::CellIndex& cell,
                             std::mt19937& draw) {
  std::uniform_real_distribution<double> share(0, 1);
  compare::CellRow row;
  compare::name_row(row, experiment, cell);
  row.initial_error = 20 * share(draw);
  const double error_mm = share(draw) < 0.9 ? 0.5 * std::exp(0.4 * share(draw)) : *row.initial_error + 2;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    row.values.emplace_back(error_mm * (0.5 + share(draw)));
    row.units.push_back("mm");
  }
  row.evaluations = int(1000 + 1000 * share(draw));
  for (const char* node : {"case", "bone", "model", "edges", "shaft", "start", "outline", "cost", "optimizer", "pose",
                           "errors", "verdict"})
    row.nodes[node] = {1, 1, share(draw)};
  return row;
}

void write_rows(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const compare::Experiment experiment = compare::read_experiment(file, catalogue, diagnostics);
  if (!diagnostics.empty()) {
    std::fprintf(stderr, "%s has faults: marrow compare %s --dry-run says which\n", file.c_str(), file.c_str());
    std::_Exit(2);
  }
  compare::CellRunner runner(experiment, catalogue, nullptr, folder, 1);
  runner.keep_dependencies();
  std::mt19937 draw(7);
  for (const compare::CellIndex& cell : compare::cells_of(experiment)) {
    compare::CellRow row = made_up_row(experiment, cell, draw);
    row.key = runner.key_of(cell);
    runner.write(cell, row);
  }
}

__attribute__((constructor)) void before_main() {
  const char *file = std::getenv("MADE_UP_ROWS_OF"), *folder = std::getenv("MADE_UP_ROWS_IN");
  if (!file || !folder) return;
  unsetenv("LD_PRELOAD");  // keys depend on it, too
  const std::filesystem::path experiment = file, out = folder;
  unsetenv("MADE_UP_ROWS_OF");
  write_rows(experiment, out);
  std::_Exit(0);
}

}  // namespace
