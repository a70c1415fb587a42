// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands.hpp"
#include "difference/findings.hpp"

namespace marrow::cli {

int rerun(const RerunRequest& request) {
  RunRecord before = read_run(request.run);
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({request.run / "pipeline.yaml", {}, {}}, catalogue, pipeline, true)) return 2;
  expect_good_place(pipeline, request.folder, nullptr);
  RunFolder folder = request.folder.empty() ? RunFolder::with_free_name(
                                                  std::filesystem::path("runs") / (pipeline.name + "-rerun"), pipeline)
                                            : RunFolder(request.folder, pipeline);
  RunRequest how;
  how.seed = before.seed;
  how.threads = before.threads;
  how.file_limits = before.file_limits;
  if (request.file_limits.memory_mb > 0) how.file_limits.memory_mb = request.file_limits.memory_mb;
  if (request.file_limits.seconds > 0) how.file_limits.seconds = request.file_limits.seconds;
  how.quiet = request.quiet || request.json;
  // Without the store: what is read back proves nothing, and a result that came out otherwise must not replace the
  // first one.
  const RunOutcome outcome = execute(pipeline, catalogue, how, before.arguments, nullptr, folder);
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

}  // namespace marrow::cli
