// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "around_run.hpp"
#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;
using Kind = RunEvent::Kind;

/// Shows the events of a run: one line for each finished step, and one line for the current step that is rewritten.
class RunProgress {
 public:
  RunProgress(const RunRequest& request, RunFolder& folder)
      : request_(request), log_(folder.log()), is_terminal_(isatty(STDERR_FILENO)) {
    log_.show_from(silent() ? LogLevel::error : request.log_level);
  }

  void operator()(const RunEvent& event) {
    const std::string where = printable(place_of(event));
    if (request_.json) print_json(event);
    switch (event.kind) {
      case Kind::finished:
        line(is_short_step_of_body(event) ? LogLevel::debug : LogLevel::info, where, seconds_text(event.seconds));
        break;
      case Kind::skipped:
        line(LogLevel::info, where, "skipped: " + event.text);
        break;
      case Kind::failed:
        line(event.level, "", event.text);
        break;
      case Kind::warning:
        line(LogLevel::warning, where, event.text);
        break;
      case Kind::waiting:
      case Kind::waited:
        if (!event.text.empty()) line(LogLevel::info, where, event.text);
        break;
      case Kind::message:
        line(event.level, where, event.text);
        break;
      case Kind::progress:
        moving_line(where, event);
        break;
      case Kind::started:
      case Kind::cached:
        break;
    }
  }

  void clear() {
    if (is_terminal_) std::fprintf(stderr, "\r\033[K");
  }

 private:
  bool silent() const { return request_.quiet || request_.json; }

  /// A body may be run a thousand times: its short steps would bury everything else.
  static bool is_short_step_of_body(const RunEvent& event) {
    constexpr double kShort_s = 0.5;
    return event.node.find('/') != std::string::npos && event.seconds < kShort_s;
  }

  static std::string seconds_text(double seconds) { return formatted("{:.3f} s", seconds); }

  void line(LogLevel level, const std::string& where, const std::string& text) {
    if (log_.shows(level)) clear();
    log_.write(level, where, text);
  }

  /// Shows the current progress: on a terminal at most ten times a second, otherwise every five seconds.
  void moving_line(const std::string& where, const RunEvent& event) {
    const auto now = std::chrono::steady_clock::now();
    if (!log_.shows(LogLevel::info) ||
        now - last_ < (is_terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000)))
      return;
    last_ = now;
    clear();
    std::fprintf(stderr, "  %-32s %3.0f %% %s%s", where.c_str(), 100 * event.fraction, printable(event.text).c_str(),
                 is_terminal_ ? "" : "\n");
  }

  static void print_json(const RunEvent& event) {
    print_as_json(json_of(event), -1);
    std::fflush(stdout);
  }

  const RunRequest& request_;
  RunLog& log_;
  bool is_terminal_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Keeps the text that Ctrl-C shows (say_when_stopped): what a run still waits for, and how to end it at once.
class StopNotice {
 public:
  StopNotice() = default;
  ~StopNotice() { say_when_stopped(""); }
  StopNotice(const StopNotice&) = delete;
  StopNotice& operator=(const StopNotice&) = delete;

  /// To be told of all events of the run. Safe to use from several threads.
  void operator()(const RunEvent& event) {
    const std::string where = place_of(event);
    const bool has_ended = event.kind == RunEvent::Kind::finished || event.kind == RunEvent::Kind::failed;
    if (event.kind != RunEvent::Kind::started && !has_ended) return;
    const std::scoped_lock lock(mutex_);
    if (!has_ended)
      running_.insert(where);
    else if (const auto found = running_.find(where); found != running_.end())
      running_.erase(found);
    std::string names;
    for (const std::string& one : running_) names += (names.empty() ? "" : ", ") + one;
    say_when_stopped(names.empty() ? ""
                                   : "marrow: stopping; it waits for what is running: " + printable(names) +
                                         ". A second Ctrl-C ends it at once");
  }

 private:
  std::mutex mutex_;
  std::multiset<std::string> running_;
};

std::string status_text(const NodeRecord& record) {
  if (record.status != NodeRecord::Status::done || !record.cached) return status_name(record.status);
  return record.calls ? formatted("done, {} cached", record.cached)
                      : formatted("cached (took {:.3f} s)", record.cached_seconds);
}

/// The characters that the longest name of a node takes, with those of bodies. `path`: "", or the node and a slash.
std::size_t width_of_names(const Pipeline& pipeline, const std::string& path) {
  std::size_t width = 16;
  for (const PipelineNode& node : pipeline.nodes) {
    width = std::max(width, path.size() + node.id.size());
    if (node.repetition) width = std::max(width, width_of_names(node.repetition->alone, path + node.id + "/"));
  }
  return width;
}

/// One line for each node, then those of its body. `path`: "", or the node and a slash.
void print_nodes(const Pipeline& pipeline, const std::vector<NodeRecord>& records, const std::string& path,
                 std::size_t width) {
  for (std::size_t i = 0; i < pipeline.nodes.size() && i < records.size(); ++i) {
    const NodeRecord& record = records[i];
    if (record.status == NodeRecord::Status::not_needed || record.was_stopped()) continue;
    // The reason of a failure was printed when the node failed.
    const bool is_told =
        record.status == NodeRecord::Status::failed || record.status == NodeRecord::Status::failed_alone;
    const std::string reason = is_told ? "" : printable_lines(record.reason);
    print_beside(formatted("{:<{}} {:<34} {:>9.3f} {:>6} ", path + pipeline.nodes[i].id, width,
                           pipeline.nodes[i].info.name, record.seconds, record.calls),
                 status_text(record) + (reason.empty() ? "" : ": " + reason), width + 54);
    if (record.stopped > 0) std::printf("%-*s %s\n", int(width), "", not_run_text(record.stopped).c_str());
    if (!record.passes) continue;
    const std::size_t passes = record.passes->passes.size();
    std::printf("%-*s %zu %s%s%s\n", int(width), "", passes, passes == 1 ? "pass" : "passes",
                record.passes->end.empty() ? "" : "; ", printable(record.passes->end).c_str());
    print_nodes(pipeline.nodes[i].repetition->alone, record.passes->nodes, path + pipeline.nodes[i].id + "/", width);
  }
}

/// How to make the failed calls again. The first say enough.
void print_failed_calls(const RunFolder& folder) {
  constexpr std::size_t kMost = 3;
  const std::vector<std::string> failed = folder.failed_calls();
  if (failed.empty()) return;
  std::printf("what failed can be called again alone:\n");
  for (std::size_t i = 0; i < std::min(failed.size(), kMost); ++i)
    std::printf("  marrow replay %s\n", shell_path(folder.path() / failed[i]).c_str());
  if (failed.size() > kMost)
    std::printf("  and %zu more below %s\n", failed.size() - kMost, shell_path(folder.path() / "failed").c_str());
}

/// `folder`: empty if it was not kept.
void print_summary(const Pipeline& pipeline, const RunResult& result, const std::vector<RunFolder::Written>& written,
                   const std::string& folder) {
  std::printf("\n");
  print_verdicts(verdicts_of(pipeline, result));
  const std::size_t width = width_of_names(pipeline, "");
  std::printf("%-*s %-34s %9s %6s  %s\n", int(width), "node", "uses", "seconds", "calls", "status");
  print_nodes(pipeline, result.nodes, "", width);
  std::printf("%-*s %-34s %9.3f\n\n", int(width), "all", "", result.seconds);
  print_results(pipeline, result);
  if (folder.empty())
    std::printf("nothing was made, so no folder of results is kept\n");
  else
    std::printf("results in %s\n", printable(folder).c_str());
  for (const RunFolder::Written& output : written) {
    for (const std::string& file : output.files) std::printf("  %s\n", printable(file).c_str());
    if (!output.fault.empty()) std::printf("  %s: %s\n", output.output.c_str(), printable_lines(output.fault).c_str());
    if (!output.absent.empty())
      std::printf("  %s: %s because %s\n", output.output.c_str(),
                  output.files.empty() ? "not there" : "not there as a whole", printable_lines(output.absent).c_str());
  }
  print_lacking_outputs(pipeline, result);
}

void print_json_summary(const Pipeline& pipeline, const RunResult& result,
                        const std::vector<RunFolder::Written>& written, const std::string& folder,
                        const std::vector<std::string>& failed_calls) {
  for (const NamedVerdict& one : verdicts_of(pipeline, result)) {
    json verdict = json_of(one);
    verdict["event"] = "verdict";
    print_as_json(verdict, -1);
  }
  json files = json::object(), absent = json::object();
  for (const RunFolder::Written& output : written) {
    files[output.output] = output.files;
    if (!output.absent.empty()) absent[output.output] = output.absent;
  }
  for (const auto& [reason, outputs] : lacking_outputs(pipeline, result))
    for (const std::string& output : outputs) absent[output] = reason;
  json end = {{"event", "ended"},
              {"status", result.cancelled() ? "cancelled"
                         : result.failed()  ? "failed"
                                            : "done"},
              {"seconds", result.seconds},
              {"folder", folder},
              {"files", files},
              {"absent", absent}};
  if (!folder.empty() && !failed_calls.empty()) end["failed_calls"] = failed_calls;
  print_as_json(end, -1);
}

}  // namespace

RunOutcome execute(const Pipeline& pipeline, const Catalogue& catalogue, const RunRequest& request,
                   const PipelineArguments& arguments, const Store* store, RunFolder& folder) {
  RunProgress progress(request, folder);
  RunSettings settings;
  settings.seed = request.seed;
  settings.threads = request.threads;
  settings.file_limits = request.file_limits;
  settings.cancelled = &stop_on_signals();
  StopNotice stop_notice;
  settings.observer = [&](const RunEvent& event) {
    stop_notice(event);
    progress(event);
  };
  const auto note = [&](const std::string& text) {
    folder.log().keep(LogLevel::info, "", "note: " + text);
    if (!request.quiet) say_note(text);
  };
  for (const std::string& text : pipeline.notes) note(text);
  const std::string fault = store ? store->prepare() : "";
  if (!fault.empty())
    note("results are not kept: " + fault);
  else
    settings.store = store;
  folder.keep_failed_calls(settings, catalogue);
  const ProfileOfRun profile(request.profile, settings);
  RunOutcome outcome;
  outcome.result = run_pipeline(pipeline, catalogue, settings);
  progress.clear();
  {
    const Profile::Bar bar(settings.profile, Profile::Kind::output, "", "", "writes the outputs");
    outcome.written = folder.write_outputs(pipeline, outcome.result, catalogue, recipe_of_run(pipeline, settings));
  }
  folder.write_record(pipeline, outcome.result, settings, catalogue, arguments, outcome.written);
  const std::string untidy = settings.store ? settings.store->tidy(settings.cancelled) : "";
  if (!untidy.empty()) note("the store of results is not tidied up: " + untidy);
  outcome.is_faulty = !profile.write(pipeline.name, folder, note) || outcome.result.failed();
  for (const RunFolder::Written& output : outcome.written) {
    if (output.fault.empty()) continue;
    if (!output.fault.starts_with("not made"))
      std::fprintf(stderr, "marrow: error: output '%s': %s\n", output.output.c_str(),
                   printable_lines(output.fault).c_str());
    outcome.is_faulty = true;
  }
  if (outcome.result.cancelled())
    std::fprintf(stderr, "marrow: %s; what was done is in %s\n", stopped_text().c_str(),
                 printable(folder.path().string()).c_str());
  const std::string log_fault = folder.log().fault();
  if (!log_fault.empty()) std::fprintf(stderr, "marrow: warning: %s\n", printable(log_fault).c_str());
  return outcome;
}

namespace {

bool has_wrong_pose(const std::vector<NamedVerdict>& verdicts) {
  return std::any_of(verdicts.begin(), verdicts.end(),
                     [](const NamedVerdict& one) { return one.verdict.judgement == Judgement::wrong; });
}

/// Leaves only these outputs, and the verdicts on their poses. Then only the nodes that they need run. False, with a
/// message, if one is not known.
bool keep_only(Pipeline& pipeline, const std::vector<std::string>& names) {
  if (names.empty()) return true;
  try {
    keep_outputs(pipeline, names);
    return true;
  } catch (const Error& error) {
    std::fprintf(stderr, "marrow: error: --only: %s\n", printable(error.what()).c_str());
    return false;
  }
}

int run(const RunRequest& request) {
  const std::atomic<bool>& is_stopped = stop_on_signals();
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request.pipeline, catalogue, pipeline, true) || !keep_only(pipeline, request.only)) return 2;
  for (std::string& note : notes_on_poses(pipeline)) pipeline.notes.push_back(std::move(note));
  expect_files_can_hold(pipeline, catalogue);
  if (is_stopped) {
    std::fprintf(stderr, "marrow: %s before anything was made\n", stopped_text().c_str());
    return 130;
  }
  const Store store;
  expect_good_place(pipeline, request.folder, request.no_cache ? nullptr : &store);
  if (!request.profile.empty()) expect_place_of_profile(pipeline, request.profile);
  if (request.dry_run) return show_plan(pipeline, catalogue, request.seed, request.json);
  const std::filesystem::path runs = "runs";
  FolderOfItsOwn own(runs);
  RunFolder folder = request.folder.empty() ? RunFolder::with_free_name(runs / pipeline.name, pipeline)
                                            : RunFolder(request.folder, pipeline);
  if (request.folder.empty()) own.take(folder.path());
  const RunOutcome outcome = execute(pipeline, catalogue, request, arguments_of(request.pipeline),
                                     request.no_cache ? nullptr : &store, folder);
  const std::string kept = own.keep_if_fruitful(pipeline, outcome) ? folder.path().string() : "";
  if (request.json)
    print_json_summary(pipeline, outcome.result, outcome.written, kept, folder.failed_calls());
  else if (!request.quiet)
    print_summary(pipeline, outcome.result, outcome.written, kept);
  if (!request.json && !request.quiet && !kept.empty()) print_failed_calls(folder);
  if (outcome.result.cancelled()) return 130;
  if (outcome.is_faulty) return 1;
  return has_wrong_pose(verdicts_of(pipeline, outcome.result)) ? 3 : 0;
}

}  // namespace

void add_run(CLI::App& app, int& code) {
  const auto request = std::make_shared<RunRequest>();
  CLI::App* command = app.add_subcommand("run", "run a pipeline and write a folder with its results");
  add_pipeline_arguments(command, request->pipeline);
  command
      ->add_option("-o,--out", request->folder,
                   "folder to write; new or empty (default: runs/NAME, or runs/NAME-2 ... if that exists)")
      ->type_name("FOLDER");
  command
      ->add_option("--only", request->only,
                   "compute and write only this output, and the verdicts on its poses; may be given several times")
      ->allow_extra_args(false)
      ->type_name("OUTPUT");
  show_default(add_whole_number(command, "--seed", request->seed, "seed of all randomness"), request->seed);
  add_whole_number(command, "--threads", request->threads, "threads to use (default: all)", 1, 1024);
  CLI::Option* no_cache = command->add_flag("--no-cache", request->no_cache, "neither read nor keep results of nodes");
  CLI::Option* profile = command->add_option(
      "--profile", request->profile,
      "write to this JSON file where the time went (Chrome's trace format); the page of 'marrow show' draws it");
  profile->type_name("FILE");
  command->add_flag("-n,--dry-run", request->dry_run, "run nothing: say what 'marrow plan' says")
      ->excludes(no_cache)
      ->excludes(profile);
  add_shared_cache(command);
  add_log_level(command, request->log_level);
  command->add_flag("-q,--quiet", request->quiet, "print only errors");
  command->add_flag("--json", request->json, "print events as JSON, one a line; with -n the plan");
  add_file_limits(command, request->file_limits);
  command->callback([request, &code] { code = run(*request); });
}

}  // namespace marrow::cli
