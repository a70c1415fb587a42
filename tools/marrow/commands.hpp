// SPDX-License-Identifier: Apache-2.0
#pragma once
// The commands of the program, and what they share. Exit codes: 0 done, 1 a node or a library failed, 2 the request or
// a file is at fault, 130 stopped by Ctrl-C.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/runtime/executor.hpp"
#include "marrow/runtime/pipeline.hpp"
#include "marrow/runtime/run_folder.hpp"

namespace CLI {
class App;
}

namespace marrow::cli {

struct PipelineRequest {
  std::filesystem::path file;
  std::vector<std::string> inputs;     ///< name=value
  std::vector<std::string> overrides;  ///< node.option=value
};

struct RunRequest {
  PipelineRequest pipeline;
  std::filesystem::path folder;  ///< empty = runs/NAME, with a number where that is taken
  std::uint64_t seed = 1;
  int threads = 0;
  bool no_cache = false;
  LogLevel log_level = LogLevel::info;  ///< the least that is shown
  bool quiet = false;                   ///< only errors are shown
  bool json = false;
  FileLimits file_limits;
};

struct RerunRequest {
  std::filesystem::path run;     ///< folder of the run that is repeated
  std::filesystem::path folder;  ///< empty = runs/NAME-rerun, with a number where that is taken
  LogLevel log_level = LogLevel::info;
  bool quiet = false;
  bool json = false;
  FileLimits file_limits;  ///< instead of those of the run
};

/// Each adds one command to the program: its options, its help and what it does. That sets `code`.
void add_run(CLI::App& app, int& code);
void add_compare(CLI::App& app, int& code);
void add_cell(CLI::App& app, int& code);
void add_worker(CLI::App& app, int& code);
void add_rerun(CLI::App& app, int& code);
void add_diff(CLI::App& app, int& code);
void add_show(CLI::App& app, int& code);
void add_check(CLI::App& app, int& code);
void add_plan(CLI::App& app, int& code);
void add_cache(CLI::App& app, int& code);
void add_list(CLI::App& app, int& code);
void add_inspect(CLI::App& app, int& code);
void add_graph(CLI::App& app, int& code);
void add_schema(CLI::App& app, int& code);
void add_doctor(CLI::App& app, int& code);
void add_conformance(CLI::App& app, int& code);
void add_check_worker(CLI::App& app, int& code);
void add_describe(CLI::App& app, int& code);

/// Whether results can be kept. Says why not, unless `quiet`.
bool can_keep_results(const std::string& fault_of_store, bool quiet);
/// Splits name=value texts. Throws Error for one without '='.
PipelineArguments arguments_of(const PipelineRequest& request);
/// Reads the pipeline; prints all its faults and returns false when there are any.
bool load(const PipelineRequest& request, const Catalogue& catalogue, Pipeline& pipeline, bool inputs_required,
          bool json = false);

struct RunOutcome {
  RunResult result;
  std::vector<RunFolder::Written> written;
  bool is_faulty = false;  ///< a node failed, or an output was not written
};
/// Runs a pipeline into a folder, showing what goes on as the request wishes; its threads and seed count, not its
/// pipeline.
RunOutcome execute(const Pipeline& pipeline, const Catalogue& catalogue, const RunRequest& request,
                   const PipelineArguments& arguments, const Store* store, RunFolder& folder);

/// That the pipeline reads no folder to which the run writes; an empty one is below runs/. Throws Error.
void expect_good_place(const Pipeline& pipeline, const std::filesystem::path& folder, const Store* store);

/// Prints what a person wants to see of results at once: poses and figures of merit.
void print_results(const Pipeline& pipeline, const RunResult& result);

}  // namespace marrow::cli
