// SPDX-License-Identifier: Apache-2.0
// `marrow replay`: makes one failed call of a run again, alone.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/run/failed_calls.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using Kind = RunEvent::Kind;

namespace fs = std::filesystem;

std::vector<std::string> command_of(const std::string& debugger, const fs::path& folder) {
  const std::string name = fs::path(debugger).filename().string();
  std::vector<std::string> command{debugger};
  bool can_stop = true;
  if (name == "gdb")
    command.insert(command.end(), {"-q", "-ex", "set breakpoint pending on", "-ex", "run", "--args"});
  else if (name == "lldb")
    command.insert(command.end(), {"-o", "run", "--"});
  else
    can_stop = false;  // SIGTRAP would end what no debugger holds
  command.insert(command.end(), {this_program().string(), "replay", folder.string(), "--in-this-process"});
  if (can_stop) command.push_back("--stop");
  return command;
}

/// The line for a shell that replays a failed call under a debugger.
std::string debugger_line(const std::string& debugger, const fs::path& folder) {
  return "marrow replay " + shell_path(folder) + " --debugger " + shell_word(debugger);
}

/// Replaces this process by the debugger, which replays the call. gdb and lldb stop right before it; any other program
/// gets the command as its arguments. Throws Error if the debugger cannot be started.
void start_under_debugger(const std::string& debugger, const fs::path& folder) {
  std::vector<std::string> command = command_of(debugger, folder);
  std::vector<char*> words;
  for (std::string& word : command) words.push_back(word.data());
  words.push_back(nullptr);
  std::fflush(stdout);
  for (const int ignored : {SIGPIPE, SIGXFSZ}) std::signal(ignored, SIG_DFL);
  ::execvp(words[0], words.data());
  throw Error("the debugger '" + debugger + "' cannot be started: " + std::strerror(errno) +
              "; install it, or name another with --debugger");
}

struct ReplayRequest {
  fs::path folder;
  std::string debugger;
  bool in_this_process = false;
  bool stops_before = false;
  bool no_cache = false;
  LogLevel log_level = LogLevel::info;
};

/// The folder of one failed call: `given`, or the only one below it. Throws Error if there are several.
fs::path failed_call_in(const fs::path& given) {
  std::error_code error;
  if (!fs::is_directory(given, error)) throw Error(given.string() + " is not a folder; give that of a failed call");
  if (fs::exists(given / "call.json", error)) return given;
  const bool is_run = fs::exists(given / "pipeline.yaml", error);
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(is_run ? given / "failed" : given, error))
    if (entry.path().filename() == "call.json") found.push_back(entry.path().parent_path());
  std::sort(found.begin(), found.end());
  if (found.empty() && is_run) throw Error("no call of a node failed in the run in " + given.string());
  if (found.size() < 2) return found.empty() ? given : found[0];
  constexpr std::size_t kShown = 10;
  std::string text = formatted("{} calls failed in {}; give one of them:", found.size(), given.string());
  for (std::size_t i = 0; i < std::min(found.size(), kShown); ++i) text += "\n  " + found[i].string();
  throw Error(text + (found.size() > kShown ? "\n  ..." : ""));
}

std::string title_of(const RecordedCall& call) {
  return "node " + in_quotes(call.path) + " (" + printable(call.uses) + ")" +
         (call.place.empty() ? "" : " for " + printable(call.place));
}

bool are_same(const std::vector<RecordedInput>& before, const std::vector<RecordedInput>& now) {
  return std::equal(before.begin(), before.end(), now.begin(), now.end(), [](const auto& first, const auto& second) {
    return first.place == second.place && first.key == second.key;
  });
}

/// Says whether the call gets what it got in the run.
void print_inputs(const RecordedCall& call, const PipelineNode& node, const std::vector<Value>& inputs) {
  if (!call.has_inputs || inputs.empty()) return;
  bool are_all_same = true;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const PortInfo& port = node.info.inputs[i];
    const auto before = call.inputs.find(port.name);
    if (before != call.inputs.end() && are_same(before->second, items_of_input(inputs[i]))) continue;
    are_all_same = false;
    std::printf("  input '%s' is not what it was in the run: %s\n", port.name.c_str(),
                port.type.is_function ? "a plugin that makes it has been rebuilt since"
                                      : "what makes it gave something else this time");
  }
  if (are_all_same) std::printf("  its inputs are the same as in the run\n");
  std::fflush(stdout);
}

void print_outputs(const PipelineNode& node, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::string& name = node.info.outputs[i].name;
    std::printf("  %s: %s%s\n", name.c_str(), outputs[i].type.id.c_str(),
                outputs[i].is_absent() ? ", absent"
                : outputs[i].is_list() ? formatted(", {} items", outputs[i].items.size()).c_str()
                                       : "");
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) print_value(node.info.outputs[i].name, outputs[i]);
}

/// The events of the run that leads to the call. Failures are collected: one of another call matters only if it keeps
/// the call from being made.
class ReplayEvents {
 public:
  ReplayEvents(const RecordedCall& call, LogLevel least) : call_(call), least_(least) {}

  void operator()(const RunEvent& event) {
    const bool is_it = event.node == call_.path && event.item == call_.place;
    if (event.kind == Kind::failed && !is_it) other_failures += (other_failures.empty() ? "" : "\n") + event.text;
    if (event.kind == Kind::finished && !is_it && least_ <= LogLevel::info)
      say(place_of(event), formatted("made again, {:.3f} s", event.seconds));
    if ((event.kind == Kind::message || event.kind == Kind::warning) && event.level >= least_)
      say(place_of(event), (event.kind == Kind::warning ? "warning: " : "") + event.text);
  }
  std::string other_failures;

 private:
  static void say(const std::string& where, const std::string& text) {
    std::fprintf(stderr, "%s: %s\n", printable(where).c_str(), printable_lines(text).c_str());
  }
  const RecordedCall& call_;
  LogLevel least_;
};

/// Says what came of the call, and returns the exit code.
int print_outcome(const RecordedCall& call, const PipelineNode& node, const Replay::Outcome& outcome,
                  const fs::path& folder) {
  const bool is_failed = outcome.status == NodeRecord::Status::failed;
  if (!is_failed) {
    std::printf("done after %.3f s; in the run it failed: %s\n", outcome.seconds, printable_lines(call.reason).c_str());
    print_outputs(node, outcome.outputs);
    return 0;
  }
  const bool is_same = outcome.reason == call.reason;
  std::printf("failed again, with %s error: %s\n", is_same ? "the same" : "another",
              printable_lines(outcome.reason).c_str());
  if (!is_same) std::printf("in the run it was: %s\n", printable_lines(call.reason).c_str());
  std::printf("under a debugger:  %s\n", debugger_line("gdb", folder).c_str());
  return 1;
}

int replay(const ReplayRequest& request) {
  const fs::path folder = failed_call_in(request.folder);
  const RecordedCall call = read_failed_call(folder);
  if (!request.debugger.empty()) start_under_debugger(request.debugger, folder);
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({call.run / "pipeline.yaml", {}, {}}, catalogue, pipeline, true)) return 2;
  std::optional<Replay::Outcome> outcome;
  const PipelineNode* called = nullptr;
  const Replay replay{
      call.within,
      call.node,
      call.item,
      call.call_seed ? std::optional(call.call_seed) : std::nullopt,
      request.in_this_process,
      request.stops_before,
      call.kept,
      [&](const PipelineNode& node, const std::vector<Value>& inputs) { print_inputs(call, node, inputs); },
      [&](const PipelineNode& node, const Replay::Outcome& end) {
        outcome = end;
        called = &node;
      }};
  ReplayEvents events(call, request.log_level);
  const Store store;
  RunSettings settings;
  settings.seed = call.seed;
  settings.threads = call.threads;
  settings.file_limits = call.file_limits;
  settings.cancelled = &stop_on_signals();
  settings.remember = false;
  settings.replay = &replay;
  settings.observer = [&](const RunEvent& event) { events(event); };
  if (!request.no_cache && can_keep_results(store.prepare(), false)) settings.store = &store;
  keep_only_replayed(pipeline, settings);
  std::printf("%s\n", title_of(call).c_str());
  std::fflush(stdout);
  const RunResult result = run_pipeline(pipeline, catalogue, settings);
  if (outcome && outcome->status != NodeRecord::Status::cancelled)
    return print_outcome(call, *called, *outcome, folder);
  if (result.cancelled()) {
    std::fprintf(stderr, "marrow: %s\n", stopped_text().c_str());
    return 130;
  }
  throw Error("it could not be called: " + (events.other_failures.empty()
                                                ? "the node has no such item or pass any more, or an input of it is "
                                                  "absent; run the pipeline again"
                                                : events.other_failures));
}

}  // namespace

void add_replay(CLI::App& app, int& code) {
  const auto request = std::make_shared<ReplayRequest>();
  CLI::App* command = app.add_subcommand(
      "replay", "call a node that failed again, alone, with the inputs, options and seed that it had");
  command
      ->add_option("folder", request->folder,
                   "folder of the failed call, RUN/failed/NODE/ITEM; or of the run, if only one call failed")
      ->required();
  command
      ->add_option("--debugger", request->debugger,
                   "start it under this debugger, which stops right before the call: gdb, lldb or another program")
      ->type_name("PROGRAM");
  command->add_flag("--in-this-process", request->in_this_process,
                    "call it in this process also if it is a node that parses files, which usually gets its own");
  command->add_flag("--stop", request->stops_before, "for debuggers")->group("");
  command->add_flag("--no-cache", request->no_cache, "make all that it needs again");
  add_log_level(command, request->log_level);
  command->callback([request, &code] { code = replay(*request); });
}

}  // namespace marrow::cli
