// SPDX-License-Identifier: Apache-2.0
// `marrow data check`: whether a file of a public data set means what its reader takes it to mean. The shipped pipeline
// pipelines/public/check-....yaml for this kind of file says so.
#include <cstdio>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"
#include "new/templates.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// The pipeline that checks such a file.
fs::path pipeline_for(const fs::path& file) {
  std::error_code failure;
  if (!fs::exists(file, failure)) throw Error(printable(file.string()) + ": there is no such file");
  const std::string end = file.extension().string();
  if (end == ".h5" || end == ".hdf5") return shared_files("pipelines/public/check-deepfluoro.yaml");
  if (end == ".yaml" || end == ".yml") return shared_files("pipelines/public/check-utrecht.yaml");
  throw Error(
      printable(file.string()) +
      ": expected a DeepFluoro file (.h5), or the description of Utrecht's data (.yaml), see docs/public-data.md");
}

int check(const fs::path& file) {
  PipelineRequest request{pipeline_for(file), {"file=" + file.string()}, {}};
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request, catalogue, pipeline, true)) return 2;
  RunSettings settings;
  settings.cancelled = &stop_on_signals();
  settings.observer = [](const RunEvent& event) {
    if (event.kind == RunEvent::Kind::message || event.kind == RunEvent::Kind::warning)
      std::printf("%s\n", printable_lines(event.text).c_str());
    if (event.kind == RunEvent::Kind::failed)
      std::fprintf(stderr, "marrow: error: %s\n", printable_lines(event.text).c_str());
  };
  const RunResult result = run_pipeline(pipeline, catalogue, settings);
  if (result.cancelled()) return 130;
  if (result.failed()) return 1;
  print_results(pipeline, result);
  return 0;
}

}  // namespace

void add_data(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("data", "look at files of public data sets");
  command->require_subcommand(1);
  CLI::App* checked = command->add_subcommand(
      "check", "project the landmarks of a data set with its cameras, and say whether all signs fit");
  const auto file = std::make_shared<fs::path>();
  checked->add_option("file", *file, "a DeepFluoro file (.h5), or a description of Utrecht's data (.yaml)")
      ->required()
      ->type_name("FILE");
  checked->callback([file, &code] { code = check(*file); });
}

}  // namespace marrow::cli
