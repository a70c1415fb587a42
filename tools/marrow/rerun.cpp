// SPDX-License-Identifier: Apache-2.0
// `marrow diff` and `marrow rerun`: whether two runs have the same results.
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "difference/findings.hpp"
#include "fruitless_run.hpp"

namespace marrow::cli {
namespace {

/// The exit code: 0 if the results are the same, else 1.
int print_findings(const Findings& findings, bool as_json) {
  if (as_json)
    print_as_json(json_of(findings));
  else
    print(findings);
  return findings.identical() ? 0 : 1;
}

int diff(const std::filesystem::path& before, const std::filesystem::path& now, bool as_json) {
  KnownValues values;
  return print_findings(find_differences(read_run(before), read_run(now), values), as_json);
}

int rerun(const RerunRequest& request) {
  RunRecord before = read_run(request.run);
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({request.run / "pipeline.yaml", {}, {}}, catalogue, pipeline, true)) return 2;
  expect_good_place(pipeline, request.folder, nullptr);
  const std::filesystem::path runs = "runs";
  FolderOfItsOwn own(runs);
  RunFolder folder = request.folder.empty() ? RunFolder::with_free_name(runs / (pipeline.name + "-rerun"), pipeline)
                                            : RunFolder(request.folder, pipeline);
  if (request.folder.empty()) own.take(folder.path());
  RunRequest how;
  how.seed = before.seed;
  how.threads = before.threads;
  how.file_limits = before.file_limits;
  if (request.file_limits.memory_mb > 0) how.file_limits.memory_mb = request.file_limits.memory_mb;
  if (request.file_limits.seconds > 0) how.file_limits.seconds = request.file_limits.seconds;
  how.log_level = request.log_level;
  how.quiet = request.quiet || request.json;
  // The store is not used: a result that is read back proves nothing, and a different result must not replace the
  // first.
  const RunOutcome outcome = execute(pipeline, catalogue, how, before.arguments, nullptr, folder);
  own.keep_if_fruitful(pipeline, outcome);
  if (outcome.result.cancelled()) return 130;
  KnownValues values;
  for (const NodeRecord& node : outcome.result.nodes)
    for (const Value& output : node.outputs) values.add(output);
  const int code = print_findings(find_differences(std::move(before), read_run(folder.path()), values), request.json);
  return outcome.is_faulty ? 1 : code;
}

}  // namespace

void add_diff(CLI::App& app, int& code) {
  struct Given {
    std::filesystem::path first, second;
    bool as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("diff", "say where two runs begin to differ, by how much, and why");
  command->add_option("first", given->first, "folder of a run, or of a cell of a comparison")
      ->required()
      ->type_name("FOLDER");
  command->add_option("second", given->second, "folder of the run to compare it with")->required()->type_name("FOLDER");
  command->add_flag("--json", given->as_json, "as JSON");
  command->callback([given, &code] { code = diff(given->first, given->second, given->as_json); });
}

void add_rerun(CLI::App& app, int& code) {
  const auto request = std::make_shared<RerunRequest>();
  CLI::App* command = app.add_subcommand(
      "rerun", "repeat a run from its folder without stored results, and say whether its results are the same");
  command->add_option("run", request->run, "folder of the run, or of a cell of a comparison")
      ->required()
      ->type_name("FOLDER");
  command
      ->add_option("-o,--out", request->folder,
                   "folder to write; new or empty (default: runs/NAME-rerun, or runs/NAME-rerun-2 ... if that exists)")
      ->type_name("FOLDER");
  add_log_level(command, request->log_level);
  command->add_flag("-q,--quiet", request->quiet, "no progress");
  command->add_flag("--json", request->json, "print the differences as JSON");
  add_file_limits(command, request->file_limits, "as the run had it");
  command->callback([request, &code] { code = rerun(*request); });
}

}  // namespace marrow::cli
