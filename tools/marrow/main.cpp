// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>

#include "commands.hpp"
#include "compare/comparison.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "number_options.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace {

using marrow::cli::add_amount;
using marrow::cli::add_whole_number;
using marrow::cli::show_default;

void add_pipeline_arguments(CLI::App* command, marrow::cli::PipelineRequest& request) {
  command->add_option("pipeline", request.file, "pipeline file (YAML)")->required();
  command->add_option("inputs", request.inputs, "values of the pipeline's inputs, as name=value");
  command
      ->add_option("--set", request.overrides,
                   "override, as node.option=value, node.uses=kind.name or node.in.port=reference")
      ->take_all()
      ->expected(1)
      ->type_name("NODE.OPTION=VALUE");
}

void add_file_limits(CLI::App* command, marrow::FileLimits& limits, const std::string& otherwise = "by its size") {
  const std::string end = " that reading a file may use (default: " + otherwise + ")";
  add_amount(command, "--file-memory", limits.memory_mb, "megabytes", "megabytes" + end);
  add_amount(command, "--file-seconds", limits.seconds, "seconds", "seconds of processor time" + end);
}

void add_compare_arguments(CLI::App* command, marrow::cli::CompareRequest& request) {
  command->add_option("experiment", request.file, "experiment file (YAML)")->required();
  command->add_option("--out", request.folder,
                      "folder of the comparison, new or to be continued (default: runs/compare/NAME)");
  show_default(add_whole_number(command, "--threads", request.threads, "threads of each cell", 1, 1024),
               request.threads);
  command->add_flag("--no-cache", request.no_cache, "neither read nor keep results of nodes");
  add_file_limits(command, request.file_limits);
}

int run_program(int argc, char** argv) {
  using namespace marrow::cli;
  CLI::App app{
      "marrow finds the 3D pose of bone fragments in X-ray images, by pipelines of plugins described in YAML."};
  app.require_subcommand(1);
  app.footer(
      "Plugins are looked for in the folders of MARROW_PLUGIN_PATH and beside the program's library; see 'marrow "
      "doctor'.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return CLI::FailureMessage::simple(
        failed, CLI::Error(error.get_name(), marrow::printable(error.what()), error.get_exit_code()));
  });
  int code = 0;

  RunRequest run_request;
  auto* run_command = app.add_subcommand("run", "run a pipeline and write a folder with its results");
  add_pipeline_arguments(run_command, run_request.pipeline);
  run_command->add_option("--out", run_request.folder,
                          "folder to write; new or empty (default: runs/NAME, or runs/NAME-2 ... where that is there)");
  show_default(add_whole_number(run_command, "--seed", run_request.seed, "seed of all randomness"), run_request.seed);
  add_whole_number(run_command, "--threads", run_request.threads, "threads to use (default: all)", 1, 1024);
  run_command->add_flag("--no-cache", run_request.no_cache, "neither read nor keep results of nodes");
  run_command->add_flag("--quiet", run_request.quiet, "print only errors");
  run_command->add_flag("--json", run_request.json, "print events as JSON, one a line");
  add_file_limits(run_command, run_request.file_limits);
  run_command->callback([&] { code = run(run_request); });

  CompareRequest compare_request;
  auto* compare_command =
      app.add_subcommand("compare", "run an experiment: variants of a pipeline on the same cases, and which is better");
  add_compare_arguments(compare_command, compare_request);
  add_whole_number(compare_command, "--jobs", compare_request.jobs,
                   "cells at once (default: as many as there are cores)", 1, 1024);
  show_default(add_amount(compare_command, "--time-limit", compare_request.time_limit_s, "seconds",
                          "seconds that one cell may take"),
               compare_request.time_limit_s);
  show_default(add_amount(compare_command, "--memory-limit", compare_request.memory_limit_mb, "megabytes",
                          "megabytes that one cell may use"),
               compare_request.memory_limit_mb);
  show_default(add_whole_number(compare_command, "--shown", compare_request.shown,
                                "cases and starts whose pictures go into the report", 0, 10000),
               compare_request.shown);
  compare_command->add_flag("--dry-run", compare_request.dry_run,
                            "say what there is to do, and how long that took before");
  compare_command->add_flag("--quiet", compare_request.quiet, "no progress");
  compare_command->callback([&] { code = compare_variants(compare_request); });

  CompareRequest cell_request;
  std::string cell_name;
  auto* cell_command = app.add_subcommand("cell", "run one cell of an experiment, as VARIANT/CASE/START");
  add_compare_arguments(cell_command, cell_request);
  cell_command->add_option("id", cell_name, "the cell")->required();
  cell_command->callback([&] { code = run_cell(cell_request, cell_name); });

  CompareRequest worker_request;
  auto* worker_command = app.add_subcommand("worker", "take cells from the standard input; started by compare");
  worker_command->group("");
  add_compare_arguments(worker_command, worker_request);
  worker_command->callback([&] { code = worker(worker_request); });

  RerunRequest rerun_request;
  auto* rerun_command = app.add_subcommand(
      "rerun", "repeat a run from its folder, computing everything anew, and say whether the results are the same");
  rerun_command->add_option("run", rerun_request.run, "folder of the run, or of a cell of a comparison")->required();
  rerun_command->add_option(
      "--out", rerun_request.folder,
      "folder to write; new or empty (default: runs/NAME-rerun, or runs/NAME-rerun-2 ... where that is there)");
  rerun_command->add_flag("--quiet", rerun_request.quiet, "no progress");
  rerun_command->add_flag("--json", rerun_request.json, "print the differences as JSON");
  add_file_limits(rerun_command, rerun_request.file_limits, "as the run had it");
  rerun_command->callback([&] { code = rerun(rerun_request); });

  std::filesystem::path first_run, second_run;
  bool diff_json = false;
  auto* diff_command = app.add_subcommand("diff", "say where two runs part, by how much and why");
  diff_command->add_option("first", first_run, "folder of a run, or of a cell of a comparison")->required();
  diff_command->add_option("second", second_run, "folder of the run to compare it with")->required();
  diff_command->add_flag("--json", diff_json, "as JSON");
  diff_command->callback([&] { code = diff(first_run, second_run, diff_json); });

  std::filesystem::path shown_run, shown_file;
  auto* show_command = app.add_subcommand("show", "write a page that shows a run: figures, pictures, 3D view");
  show_command->add_option("run", shown_run, "folder of the run")->required();
  show_command->add_option("--out", shown_file,
                           "HTML file to write; one that is there is replaced (default: RUN/report.html)");
  show_command->callback([&] { code = show(shown_run, shown_file); });

  PipelineRequest check_request;
  bool check_json = false;
  auto* check_command = app.add_subcommand("check", "check a pipeline and show every fault; runs nothing");
  add_pipeline_arguments(check_command, check_request);
  check_command->add_flag("--json", check_json, "print the faults as JSON");
  check_command->callback([&] { code = check(check_request, check_json); });

  PipelineRequest plan_request;
  std::uint64_t plan_seed = 1;
  auto* plan_command = app.add_subcommand("plan", "show what a run would compute, what it would read back, and why");
  add_pipeline_arguments(plan_command, plan_request);
  show_default(add_whole_number(plan_command, "--seed", plan_seed, "seed of all randomness"), plan_seed);
  plan_command->callback([&] { code = plan(plan_request, plan_seed); });

  std::string cache_key;
  double keep_gb = 10;
  auto* cache_command = app.add_subcommand(
      "cache", "look at the store of results (MARROW_CACHE, else ~/.cache/marrow/store), and tidy it up");
  cache_command->require_subcommand(1);
  cache_command->add_subcommand("info", "how much is kept, and of which nodes")->callback([&] { code = cache_info(); });
  auto* why_command = cache_command->add_subcommand("why", "what a kept result was made from");
  why_command
      ->add_option("key", cache_key,
                   "key of a result or of one of its outputs (run.json shows those), or its first digits")
      ->required();
  why_command->callback([&] { code = cache_why(cache_key); });
  auto* gc_command = cache_command->add_subcommand("gc", "remove the least recently used results");
  const auto take_keep_gb = [&](const std::string& text) {
    keep_gb = number("--keep-gb", text, 0, 1e6, "gigabytes", "; nothing is removed");
  };
  show_default(gc_command->add_option_function<std::string>("--keep-gb", take_keep_gb, "size to keep, in gigabytes")
                   ->type_name("NUMBER"),
               keep_gb);
  gc_command->callback([&] { code = cache_collect(keep_gb); });

  std::string kind;
  bool list_json = false;
  auto* list_command = app.add_subcommand("list", "list the nodes that can be used");
  list_command->add_option("kind", kind, "only this kind");
  list_command->add_flag("--json", list_json, "as JSON");
  list_command->callback([&] { code = list(kind, list_json); });

  std::string node;
  bool inspect_yaml = false, inspect_json = false;
  auto* inspect_command = app.add_subcommand("inspect", "show a node: inputs, outputs, options");
  inspect_command->add_option("node", node, "kind.name")->required();
  inspect_command->add_flag("--yaml", inspect_yaml, "print a snippet to paste into a pipeline");
  inspect_command->add_flag("--json", inspect_json, "as JSON");
  inspect_command->callback([&] { code = inspect(node, inspect_yaml, inspect_json); });

  PipelineRequest graph_request;
  bool dot = false;
  auto* graph_command =
      app.add_subcommand("graph", "show a pipeline's graph, with what is called for each view or fragment");
  add_pipeline_arguments(graph_command, graph_request);
  graph_command->add_flag("--dot", dot, "as a DOT file for Graphviz");
  graph_command->callback([&] { code = graph(graph_request, dot); });

  std::filesystem::path schema_file;
  auto* schema_command =
      app.add_subcommand("schema", "print the JSON Schema of pipelines, by which editors complete and check");
  schema_command->add_option("--out", schema_file, "write it to this file; one that is there is replaced");
  schema_command->callback([&] { code = schema(schema_file); });

  bool doctor_json = false;
  auto* doctor_command =
      app.add_subcommand("doctor", "show the folders searched and the libraries found or refused, and why");
  doctor_command->add_flag("--json", doctor_json, "as JSON");
  doctor_command->callback([&] { code = doctor(doctor_json); });

  std::vector<std::string> subjects, checks;
  auto* conformance_command =
      app.add_subcommand("conformance", "check that nodes do what every node of their kind must do");
  conformance_command->add_option("subject", subjects, "node, kind or library (.so file)")->required();
  conformance_command
      ->add_option("--check", checks, "only this of the checks that marrow inspect NODE lists; may be given again")
      ->allow_extra_args(false);
  conformance_command->callback([&] { code = run_conformance(subjects, checks); });

  auto* check_worker_command =
      app.add_subcommand("check-worker", "take checks from the standard input; started by conformance");
  check_worker_command->group("");
  std::filesystem::path files_folder;
  check_worker_command->add_option("folder", files_folder, "where checks may write files")->required();
  check_worker_command->callback([&] { code = check_worker(files_folder); });

  std::filesystem::path library;
  bool write = false;
  auto* describe_command =
      app.add_subcommand("describe", "load one plugin library in a process of its own and print its manifest");
  describe_command->add_option("library", library, "the .so file")->required();
  describe_command->add_flag("--write", write, "write the manifest beside the library instead");
  describe_command->callback([&] { code = describe(library, write); });

  for (CLI::App* command : {check_command, plan_command, list_command, inspect_command, graph_command, schema_command,
                            doctor_command, conformance_command})
    command->footer(
        "A plugin library that is not known yet is loaded once, in a process of its own, to be described; where nobody "
        "else may put one: see "
        "'marrow doctor' and MARROW_PLUGIN_PATH.");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = app.exit(error);
    return status == 0 ? 0 : 2;
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  marrow::cli::prepare_process();
  try {
    return marrow::cli::with_output_written(run_program(argc, argv));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "marrow: error: out of memory\n");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: error: %s\n", marrow::printable_lines(error.what()).c_str());
    return 2;
  }
}
