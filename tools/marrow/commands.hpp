// SPDX-License-Identifier: Apache-2.0
#pragma once
// The commands of the program, and what they share. Exit codes: 0 success, 1 a node or a library failed, 2 fault in the
// request or in a file, 3 from `run` if nothing failed but a verdict is `wrong`, 130 stopped by Ctrl-C.
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "marrow/runtime/run/run_folder.hpp"
#include "marrow/runtime/run/verdicts.hpp"

namespace CLI {
class App;
}

namespace marrow::cli {

struct PipelineRequest {
  std::filesystem::path file;
  std::vector<std::string> inputs;     ///< name=value
  std::vector<std::string> overrides;  ///< node.option=value
  std::vector<std::filesystem::path> settings =
      {};  ///< files with values of inputs and overrides; both of the above count more
};

struct RunRequest {
  PipelineRequest pipeline;
  std::filesystem::path folder;        ///< empty = runs/NAME, with a number if it exists
  std::vector<std::string> only;       ///< the outputs to compute; empty = all
  std::filesystem::path profile = {};  ///< the file to write the profile to; empty = none
  std::uint64_t seed = 1;
  int threads = 0;
  bool no_cache = false;
  bool dry_run = false;                 ///< only say what would run
  LogLevel log_level = LogLevel::info;  ///< the lowest level that is shown
  bool quiet = false;                   ///< only errors are shown
  bool json = false;
  FileLimits file_limits;
};

struct RerunRequest {
  std::filesystem::path run;     ///< folder of the run to repeat
  std::filesystem::path folder;  ///< empty = runs/NAME-rerun, with a number if it exists
  LogLevel log_level = LogLevel::info;
  bool quiet = false;
  bool json = false;
  FileLimits file_limits;  ///< replace the limits of the run
};

/// Each function adds one command to the program: its options, its help and its callback, which sets `code` to the exit
/// code.
void add_run(CLI::App& app, int& code);
void add_compare(CLI::App& app, int& code);
void add_cell(CLI::App& app, int& code);
void add_chunk(CLI::App& app, int& code);
void add_worker(CLI::App& app, int& code);
void add_rerun(CLI::App& app, int& code);
void add_replay(CLI::App& app, int& code);
void add_diff(CLI::App& app, int& code);
void add_curves(CLI::App& app, int& code);
void add_data(CLI::App& app, int& code);
void add_show(CLI::App& app, int& code);
void add_check(CLI::App& app, int& code);
void add_plan(CLI::App& app, int& code);
void add_cache(CLI::App& app, int& code);
void add_recipe(CLI::App& app, int& code);
void add_list(CLI::App& app, int& code);
void add_inspect(CLI::App& app, int& code);
void add_watch(CLI::App& app, int& code);
void add_open(CLI::App& app, int& code);
void add_new(CLI::App& app, int& code);
void add_export(CLI::App& app, int& code);
void add_graph(CLI::App& app, int& code);
void add_schema(CLI::App& app, int& code);
void add_doctor(CLI::App& app, int& code);
void add_conformance(CLI::App& app, int& code);
void add_check_worker(CLI::App& app, int& code);
void add_describe(CLI::App& app, int& code);
void add_completion(CLI::App& app, int& code);
void add_manual(CLI::App& app, int& code);
void add_version(CLI::App& app, int& code);

/// Runs the command that the words of the command line name, and returns the exit code. Each of `commands` adds one,
/// see commands.hpp. What a command throws is printed as an error.
int run_program(int argc, char** argv, std::initializer_list<void (*)(CLI::App& app, int& code)> commands);

/// "marrow 1.2.3".
std::string version_text();

/// What a command wants to be given.
enum class Wanted { pipeline, experiment, run };

/// Throws Error if the path names something of marrow that is not the wanted thing. The error says what it is and what
/// to do with it. All other paths pass: their reader says what is wrong.
void expect_given(const std::filesystem::path& given, Wanted wanted);

/// "edges (frontal)": the node of an event, and the item if there is one.
std::string place_of(const RunEvent& event);
/// An event of a run as `marrow run --json` prints it, and as the pages of `marrow open` get it: {event, node}, and of
/// {item, text, level, fraction, seconds} those that it has.
nlohmann::json json_of(const RunEvent& event);

/// Prints a note on the standard error, on one line.
void say_note(const std::string& text);
/// Prints a JSON document, or with `indent` -1 a line of JSON.
void print_as_json(const nlohmann::json& value, int indent = 1);
/// Whether results can be kept in the store. If not, prints why, unless `quiet`.
bool can_keep_results(const std::string& fault_of_store, bool quiet);
/// Prints why the shared store behind a store cannot be used, if it has one, unless `quiet`.
void say_if_not_shared(const Store& store, bool quiet);
/// Prints the first fault of the shared store, once.
void say_complaint(const Store& store);
/// Splits texts of the form name=value. Throws Error for one without '=' or without a name; `form` says what is
/// expected.
std::vector<std::pair<std::string, std::string>> pairs_of(const std::vector<std::string>& texts, const char* form);
/// [{file, line, column, message, hint}]
nlohmann::json faults_json(const Diagnostics& diagnostics);
/// Prints all faults and their number to the standard error stream.
void print_faults(const Diagnostics& diagnostics);
/// The values of inputs and the overrides of a request. Throws Error for a text without '=' and for faults of a file
/// with settings.
PipelineArguments arguments_of(const PipelineRequest& request);
/// Reads the pipeline. If it has faults, prints all of them and returns false.
bool load(const PipelineRequest& request, const Catalogue& catalogue, Pipeline& pipeline, bool inputs_required);

/// Prints what a pipeline is for, takes and gives. Returns the exit code.
int inspect_pipeline(const std::filesystem::path& file, bool as_json);

/// Prints the pipeline whole, with the place of each node and value. Returns the exit code.
int print_resolved(const PipelineRequest& request);

struct RunOutcome {
  RunResult result;
  std::vector<RunFolder::Written> written;
  bool is_faulty = false;  ///< a node failed, or an output was not written
};
/// Runs `pipeline` into a folder and shows the progress as the request wants. Ignores the pipeline of the request.
RunOutcome execute(const Pipeline& pipeline, const Catalogue& catalogue, const RunRequest& request,
                   const PipelineArguments& arguments, const Store* store, RunFolder& folder);

/// Throws Error if the pipeline reads a folder to which the run writes. An empty `folder` means a folder below runs/.
void expect_good_place(const Pipeline& pipeline, const std::filesystem::path& folder, const Store* store);

/// Throws Error if no file can hold an output. A pipeline that only the program itself runs may have such outputs; a
/// run into a folder cannot write them.
void expect_files_can_hold(const Pipeline& pipeline, const Catalogue& catalogue);

/// Prints the verdict on each pose, with reasons and remedies; coloured on a terminal.
void print_verdicts(const std::vector<NamedVerdict>& verdicts);

/// What a run would do with each node, and how often each of these things: {nodes: {ID: {state, text, seconds}},
/// cached, to_run, may_run, seconds}. `planned` is in the order of the pipeline's nodes.
nlohmann::json json_of(const Pipeline& pipeline, const std::vector<PlannedNode>& planned);
/// Prints what a run would do with each node, and returns the exit code.
int show_plan(const Pipeline& pipeline, const Catalogue& catalogue, std::uint64_t seed, bool as_json);

/// Prints a value, or the items of a list, if it is a pose or figures of merit.
void print_value(const std::string& name, const Value& value);
/// Prints the most important results: poses and figures of merit.
void print_results(const Pipeline& pipeline, const RunResult& result);

// The description of a node and of a kind, as JSON and in words.

nlohmann::json node_json(const NodeInfo& node);
/// The contract of a kind, with the limits of its checks.
nlohmann::json kind_json(const KindInfo& kind);
/// {node, fits: "yes", "with more" or "no", missing, faults}
nlohmann::json fit_json(const Fit& fit);
/// "edge_map", "list of view over view".
std::string port_text(const PortInfo& port);
std::string port_text(const KindPort& port);
/// The default of an option, as YAML.
std::string yaml_text(const OptionValue& value);
/// "number, 0 to 100 px", "one of: a, b".
std::string range_text(const OptionInfo& option);
/// What the option replaces, in words; empty if nothing.
std::string replaces_text(const OptionInfo& option);
/// "'low' is not above 'high'".
std::string relation_text(const RelationInfo& relation);

// A pipeline as a drawing: bodies are drawn beside the nodes that run them.

struct DrawnNode {
  std::string id;    ///< of a node of a body: "node/node of the body"
  std::string body;  ///< the node whose body it is in; empty outside of bodies
  const PipelineNode* node = nullptr;
  bool is_needed = true;  ///< it feeds an output
};

struct DrawnEdge {
  std::string from, to, port;
  bool is_function = false;
  bool is_of_pass_before = false;  ///< it hands on what the pass before made
};

struct DrawnGraph {
  std::vector<DrawnNode> nodes;
  std::vector<DrawnEdge> edges;
};

/// With `only_needed`, nodes that feed no output are left out. The pipeline must outlive the result.
DrawnGraph drawn_graph(const Pipeline& pipeline, bool only_needed);

/// How a body is run, in words: "each frame in turn", "at most 8 passes, until done".
std::string passes_text(const Repetition& repetition);

}  // namespace marrow::cli
