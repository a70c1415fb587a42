// SPDX-License-Identifier: Apache-2.0
#pragma once
// The commands of the program, a file each. Each returns the exit code: 0 done, 1 a node or a library failed, 2 the
// request or a file is at fault, 130 stopped by Ctrl-C.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/runtime/executor.hpp"
#include "marrow/runtime/pipeline.hpp"
#include "marrow/runtime/run_folder.hpp"

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
  bool quiet = false;
  bool json = false;
  FileLimits file_limits;
};

struct RerunRequest {
  std::filesystem::path run;     ///< folder of the run that is repeated
  std::filesystem::path folder;  ///< empty = runs/NAME-rerun, with a number where that is taken
  bool quiet = false;
  bool json = false;
  FileLimits file_limits;  ///< instead of those of the run
};

int run(const RunRequest& request);
/// 0: the same pipeline and seed gave the same results; 1: they did not, or a node failed.
int rerun(const RerunRequest& request);
/// 0: the runs came out the same; 1: they did not.
int diff(const std::filesystem::path& before, const std::filesystem::path& now, bool as_json);
int plan(const PipelineRequest& request, std::uint64_t seed);
int cache_info();
int cache_why(const std::string& key);
int cache_collect(double keep_gb);
int check(const PipelineRequest& request, bool json);
int list(const std::string& kind, bool json);
int inspect(const std::string& node, bool yaml, bool json);
int graph(const PipelineRequest& request, bool dot);
int schema(const std::filesystem::path& file);
int doctor(bool json);
/// Nodes, kinds or libraries; each node must pass the checks of its kind that are named, or all where none are.
int run_conformance(const std::vector<std::string>& subjects, const std::vector<std::string>& checks);
/// Takes single checks from the standard input; started by conformance.
int check_worker(const std::filesystem::path& files_folder);
/// The checks that a node of this kind must pass, with their limits.
void print_limits(const NodeInfo& node);
int describe(const std::filesystem::path& library, bool write);

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

/// "edge_map", "list of view over view".
std::string port_text(const PortInfo& port);
/// An option's default as it is written in YAML.
std::string yaml_text(const OptionValue& value);
/// "number, 0 to 100 px", "one of: a, b".
std::string range_text(const OptionInfo& option);

/// Prints what a person wants to see of results at once: poses and figures of merit.
void print_results(const Pipeline& pipeline, const RunResult& result);

}  // namespace marrow::cli
