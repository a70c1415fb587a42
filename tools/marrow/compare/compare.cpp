// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <fstream>

#include "commands.hpp"
#include "compare/comparison.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;
using compare::Experiment;

/// Reads the experiment; prints all its faults where there are any.
bool load(const CompareRequest& request, const Catalogue& catalogue, Experiment& experiment) {
  Diagnostics diagnostics;
  experiment = compare::read_experiment(request.file, catalogue, diagnostics);
  if (diagnostics.empty()) return true;
  std::fprintf(stderr, "%s%zu error%s\n", diagnostics.text().c_str(), diagnostics.size(), diagnostics.size() == 1 ? "" : "s");
  return false;
}

fs::path folder_of(const CompareRequest& request, const Experiment& experiment) {
  return request.folder.empty() ? fs::path("runs") / "compare" / experiment.name : request.folder;
}

/// The folder of this experiment, new or to be continued. Throws Error for one that holds anything else.
void open_folder(const fs::path& folder, const Experiment& experiment) {
  std::error_code error;
  const bool is_ours = fs::exists(folder / "experiment.yaml", error);
  if (fs::exists(folder, error) && !is_ours && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error)))
    throw Error("the folder " + folder.string() + " holds something else than a comparison; choose another with --out, or remove it");
  fs::create_directories(folder / "cells", error);
  if (error) throw Error("cannot make the folder " + folder.string() + ": " + error.message() + "; choose another with --out");
  std::ofstream stream(folder / "experiment.yaml", std::ios::binary);
  stream << experiment.text;
  stream.close();
  if (!stream) throw Error("cannot write to " + folder.string() + "; is the disk full?");
}

}  // namespace

int compare_variants(const CompareRequest& asked) {
  CompareRequest request = asked;
  const Catalogue catalogue;
  Experiment experiment;
  if (!load(request, catalogue, experiment)) return 2;
  if (request.dry_run) {
    const Store store;
    can_keep_results(store.fault(), request.no_cache);
    print_plan(experiment, catalogue, request.no_cache ? nullptr : &store, folder_of(request, experiment));
    return 0;
  }
  const fs::path folder = folder_of(request, experiment);
  open_folder(folder, experiment);
  request.no_cache = request.no_cache || !can_keep_results(Store().prepare(), request.quiet);
  return run_comparison(request, catalogue, experiment, folder);
}

int run_cell(const CompareRequest& request, const std::string& id) {
  const Catalogue catalogue;
  Experiment experiment;
  if (!load(request, catalogue, experiment)) return 2;
  const auto cell = compare::cell_of(experiment, id);
  if (!cell) {
    std::vector<std::string> names;
    for (const CellIndex& one : compare::cells_of(experiment)) names.push_back(compare::cell_id(experiment, one));
    std::fprintf(stderr, "marrow: error: the experiment has no cell '%s'; %s\n", id.c_str(), suggestion(id, names).c_str());
    return 2;
  }
  const fs::path folder = folder_of(request, experiment);
  open_folder(folder, experiment);
  const Store store;
  const bool is_kept = !request.no_cache && can_keep_results(store.prepare(), false);
  CellRunner runner(experiment, catalogue, is_kept ? &store : nullptr, folder, request.threads);
  const CellRow row = runner.run(*cell);
  runner.write(row);
  if (row.failed.empty()) runner.draw(*cell);
  std::printf("%s\n", compare::to_json(row).c_str());
  return row.failed.empty() ? 0 : 1;
}

}  // namespace marrow::cli
