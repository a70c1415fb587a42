// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using What = PlannedNode::What;

/// What a run would do with a node, and why: "cached", "runs: ...".
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

/// " (femur.yaml:17, uses: mine.yaml:4)": where a node of another file is written, and what a third place changes.
/// Empty for a node of the pipeline's own file.
std::string origin_text(const PipelineNode& node, const Pipeline& pipeline) {
  std::string text = node.place.file == pipeline.file.string() ? "" : place_text(node.place, pipeline.file);
  const auto add = [&](const std::string& what, const Place& place) {
    if (place.line > 0 && place.file != node.place.file)  // the command line is at hand
      text += (text.empty() ? "" : ", ") + what + ": " + place_text(place, pipeline.file);
  };
  add("uses", node.uses_place);
  for (std::size_t i = 0; i < node.option_places.size(); ++i) add(node.info.options[i].name, node.option_places[i]);
  return text.empty() ? "" : " (" + text + ")";
}

struct PlannedWork {
  std::size_t counts[5] = {};
  double seconds = 0;
  std::size_t of(What what) const { return counts[int(what)]; }
};

PlannedWork work_of(const std::vector<PlannedNode>& planned) {
  PlannedWork work;
  for (const PlannedNode& node : planned) {
    ++work.counts[int(node.what)];
    work.seconds += node.seconds;
  }
  return work;
}

int plan(const PipelineRequest& request, std::uint64_t seed, bool as_json) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request, catalogue, pipeline, true)) return 2;
  return show_plan(pipeline, catalogue, seed, as_json);
}

}  // namespace

nlohmann::json json_of(const Pipeline& pipeline, const std::vector<PlannedNode>& planned) {
  static constexpr const char* kStates[] = {"not_needed", "cached", "function", "runs", "depends"};
  nlohmann::json nodes = nlohmann::json::object();
  for (std::size_t i = 0; i < planned.size(); ++i)
    nodes[pipeline.nodes[i].id] = {{"state", kStates[int(planned[i].what)]},
                                   {"text", planned_text(planned[i])},
                                   {"written", place_text(pipeline.nodes[i].place, pipeline.file)},
                                   {"seconds", planned[i].seconds}};
  const PlannedWork work = work_of(planned);
  return {{"nodes", nodes},
          {"cached", work.of(What::cached)},
          {"to_run", work.of(What::runs)},
          {"may_run", work.of(What::depends)},
          {"seconds", work.seconds}};
}

int show_plan(const Pipeline& pipeline, const Catalogue& catalogue, std::uint64_t seed, bool as_json) {
  for (const std::string& note : pipeline.notes) say_note(note);
  const Store store;
  can_keep_results(store.fault(), false);
  say_if_not_shared(store, false);
  RunSettings settings;
  settings.seed = seed;
  settings.store = &store;
  settings.remember = false;
  const std::vector<PlannedNode> planned = plan_pipeline(pipeline, catalogue, settings);
  if (as_json) {
    print_as_json(json_of(pipeline, planned));
    return 0;
  }
  std::size_t width = 16;
  for (const PipelineNode& node : pipeline.nodes) width = std::max(width, node.id.size());
  for (std::size_t i = 0; i < planned.size(); ++i)
    print_beside(formatted("{:<{}} {:<34}", pipeline.nodes[i].id, width, pipeline.nodes[i].info.name),
                 printable(planned_text(planned[i]) + origin_text(pipeline.nodes[i], pipeline)), width + 36);
  const PlannedWork work = work_of(planned);
  std::printf("\n%zu cached, %zu to run", work.of(What::cached), work.of(What::runs));
  if (work.of(What::depends)) std::printf(", %zu that may run", work.of(What::depends));
  if (work.seconds > 0) std::printf("; what runs took %.1f s the last time", work.seconds);
  std::printf("\n");
  return 0;
}

void add_plan(CLI::App& app, int& code) {
  struct Given {
    PipelineRequest pipeline;
    std::uint64_t seed = 1;
    bool as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("plan", "show what a run would compute, what it would read back, and why");
  add_pipeline_arguments(command, given->pipeline);
  show_default(add_whole_number(command, "--seed", given->seed, "seed of all randomness"), given->seed);
  add_shared_cache(command);
  command->add_flag("--json", given->as_json, "as JSON");
  command->callback([given, &code] { code = plan(given->pipeline, given->seed, given->as_json); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
