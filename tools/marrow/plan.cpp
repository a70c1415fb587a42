// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using What = PlannedNode::What;

}  // namespace

std::string planned_text(const PlannedNode& node) {
  switch (node.what) {
    case What::not_needed:
      return "not needed";
    case What::cached:
      return "cached";
    case What::function:
      return "a function, made again when a node that runs needs it";
    case What::runs:
      return "runs: " + node.why;
    case What::depends:
      break;
  }
  return "runs unless '" + joined({node.waits_for.begin(), node.waits_for.end()}, "', '") +
         (node.waits_for.size() == 1 ? "' comes" : "' come") + " out unchanged";
}

namespace {

int plan(const PipelineRequest& request, std::uint64_t seed) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request, catalogue, pipeline, true)) return 2;
  for (const std::string& note : pipeline.notes) say_note(note);
  const Store store;
  can_keep_results(store.fault(), false);
  say_if_not_shared(store, false);
  RunSettings settings;
  settings.seed = seed;
  settings.store = &store;
  settings.remember = false;
  const std::vector<PlannedNode> planned = plan_pipeline(pipeline, catalogue, settings);
  int counts[5] = {};
  double seconds = 0;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    std::printf("%-16s %-34s %s\n", pipeline.nodes[i].id.c_str(), pipeline.nodes[i].info.name.c_str(),
                printable(planned_text(planned[i])).c_str());
    ++counts[int(planned[i].what)];
    seconds += planned[i].seconds;
  }
  std::printf("\n%d cached, %d to run", counts[int(What::cached)], counts[int(What::runs)]);
  if (counts[int(What::depends)]) std::printf(", %d that may run", counts[int(What::depends)]);
  if (seconds > 0) std::printf("; what runs took %.1f s the last time", seconds);
  std::printf("\n");
  return 0;
}

}  // namespace

void add_plan(CLI::App& app, int& code) {
  const auto request = std::make_shared<PipelineRequest>();
  const auto seed = std::make_shared<std::uint64_t>(1);
  CLI::App* command = app.add_subcommand("plan", "show what a run would compute, what it would read back, and why");
  add_pipeline_arguments(command, *request);
  show_default(add_whole_number(command, "--seed", *seed, "seed of all randomness"), *seed);
  add_shared_cache(command);
  command->callback([request, seed, &code] { code = plan(*request, *seed); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
