// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "difference/findings.hpp"
#include "fruitless_run.hpp"

namespace marrow::cli {
namespace {

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
  const Findings findings = find_differences(std::move(before), read_run(folder.path()), values);
  if (request.json)
    std::printf("%s\n", json_of(findings).dump(1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  else
    print(findings);
  return findings.identical() && !outcome.is_faulty ? 0 : 1;
}

}  // namespace

void add_rerun(CLI::App& app, int& code) {
  const auto request = std::make_shared<RerunRequest>();
  CLI::App* command = app.add_subcommand(
      "rerun", "repeat a run from its folder, computing everything anew, and say whether the results are the same");
  command->add_option("run", request->run, "folder of the run, or of a cell of a comparison")->required();
  command->add_option(
      "--out", request->folder,
      "folder to write; new or empty (default: runs/NAME-rerun, or runs/NAME-rerun-2 ... where that is there)");
  add_log_level(command, request->log_level);
  command->add_flag("--quiet", request->quiet, "no progress");
  command->add_flag("--json", request->json, "print the differences as JSON");
  add_file_limits(command, request->file_limits, "as the run had it");
  command->callback([request, &code] { code = rerun(*request); });
}

}  // namespace marrow::cli
