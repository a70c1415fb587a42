// SPDX-License-Identifier: Apache-2.0
// `marrow watch`: builds, runs and shows a pipeline again whenever something changes that its result depends on.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"
#include "watch/child.hpp"
#include "watch/files.hpp"
#include "watch/page.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

constexpr auto kPause = std::chrono::milliseconds(300);
constexpr int kWrongVerdict = 3;  // exit code of a run that made everything
constexpr int kStopped = 130;

struct WatchRequest {
  PipelineRequest pipeline;
  std::vector<fs::path> builds;
  fs::path folder;  ///< empty = runs/NAME-watch
};

/// The output of a program that failed. `what` says what it should have done.
std::string shown_fault(const std::string& what, const ChildEnd& end) {
  return formatted("{} (exit code {})\n\n{}", what, end.code, printable_lines(end.said));
}

class Watch {
 public:
  Watch(const WatchRequest& request, const std::atomic<bool>& stop) : request_(request), stop_(stop) {
    for (const fs::path& folder : request.builds) builds_.push_back(watched_build(folder));
    take_plugins_of_builds();
    folder_ =
        request.folder.empty() ? fs::path("runs") / (request.pipeline.file.stem().string() + "-watch") : request.folder;
    take_folder();
  }

  int run() {
    std::fprintf(stderr, "open in a browser: %s\n", printable(fs::absolute(folder_ / "index.html").string()).c_str());
    built_.resize(builds_.size());
    while (!stop_) {
      if (sources_changed()) build();
      if (!stop_ && state_.fault.empty()) run_once();
      if (!restart_) {
        tell("");
        std::fprintf(stderr, "waiting for a change; Ctrl-C ends\n");
      }
      while (!stop_ && !restart_ && !changed()) std::this_thread::sleep_for(kPause);
      restart_ = false;
      if (!stop_) state_.fault.clear();
    }
    std::fprintf(
        stderr, "%s; the last good result is in %s\n", stopped_text().c_str(),
        printable(state_.report.empty() ? "no folder yet" : (folder_ / state_.report).parent_path().string()).c_str());
    return kStopped;
  }

 private:
  /// Libraries that are built here are used, before those of the environment.
  void take_plugins_of_builds() const {
    std::string path;
    for (const WatchedBuild& build : builds_) path += build.folder.string() + ":";
    if (const char* others = std::getenv("MARROW_PLUGIN_PATH")) path += others;
    if (!builds_.empty()) setenv("MARROW_PLUGIN_PATH", path.c_str(), 1);
  }

  void take_folder() {
    if (fs::exists(folder_) && !fs::is_empty(folder_) && !fs::exists(folder_ / "state.js"))
      throw Error(printable(folder_.string()) +
                  ": it is there already, and not from marrow watch; name another folder with --out");
    fs::create_directories(folder_);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      if (entry.path().filename().string().starts_with("run-"))
        last_ = std::max(last_, std::atoi(entry.path().filename().c_str() + 4));
    write_page(folder_, request_.pipeline.file.stem().string());
    tell("starting");
  }

  void tell(const std::string& doing) {
    state_.doing = doing;
    write_state(folder_, state_);
  }

  bool sources_changed() {
    bool any = false;
    for (std::size_t i = 0; i < builds_.size(); ++i) any |= states_of_sources(builds_[i]) != built_[i];
    return any;
  }

  bool changed() { return sources_changed() || states_of(files_) != ran_with_; }

  /// Called while a program runs: whether what it works on is out of date.
  bool should_stop() {
    restart_ = !stop_ && changed();
    return stop_ || restart_;
  }

  void build() {
    for (std::size_t i = 0; i < builds_.size(); ++i) {
      const FileStates now = states_of_sources(builds_[i]);
      if (now == built_[i]) continue;
      built_[i] = now;
      const std::string folder = builds_[i].folder.string();
      tell("building " + printable(folder));
      const ChildEnd end =
          run_child({"cmake", "--build", folder}, [&] { return stop_ || states_of_sources(builds_[i]) != built_[i]; });
      if (end.stopped && !stop_) {
        restart_ = true;
        built_[i].clear();
      } else if (end.code != 0) {
        state_.fault = shown_fault("building " + folder + " failed", end);
        note_files();  // it waits for a change of these
        return;
      }
    }
  }

  void note_files() {
    WatchedFiles files = files_of(request_.pipeline);
    // A pipeline with a fault may hide some of its files, so the files that were known stay.
    files.paths.insert(files.paths.end(), files_.paths.begin(), files_.paths.end());
    std::sort(files.paths.begin(), files.paths.end());
    files.paths.erase(std::unique(files.paths.begin(), files.paths.end()), files.paths.end());
    files_ = files;
    ran_with_ = states_of(files_);
  }

  void run_once() {
    if (restart_) return;
    note_files();
    const fs::path run = folder_ / (formatted("run-{}", last_ + 1));
    tell("running " + printable(request_.pipeline.file.string()));
    std::vector<std::string> command{this_program().string(), "run", request_.pipeline.file.string()};
    command.insert(command.end(), request_.pipeline.inputs.begin(), request_.pipeline.inputs.end());
    for (const std::string& change : request_.pipeline.overrides) command.insert(command.end(), {"--set", change});
    for (const fs::path& file : request_.pipeline.settings)
      command.insert(command.end(), {"--set-file", file.string()});
    command.insert(command.end(), {"--out", run.string()});
    ChildEnd end = run_child(command, [&] { return should_stop(); });
    const bool is_good = end.code == 0 || end.code == kWrongVerdict;
    if (is_good && !end.stopped)
      end = run_child({this_program().string(), "show", run.string()}, [&] { return bool(stop_); });
    if (end.stopped || (end.code != 0 && end.code != kWrongVerdict)) {
      if (!end.stopped) state_.fault = shown_fault("the run failed", end);
      fs::remove_all(run);
      return;
    }
    const fs::path before = state_.report.empty() ? fs::path() : (folder_ / state_.report).parent_path();
    ++last_;
    state_.report = (run.filename() / "report.html").string();
    tell("");
    if (!before.empty()) fs::remove_all(before);
  }

  const WatchRequest& request_;
  const std::atomic<bool>& stop_;
  std::vector<WatchedBuild> builds_;
  std::vector<FileStates> built_;  ///< the sources that were built last
  WatchedFiles files_;
  FileStates ran_with_;
  fs::path folder_;
  int last_ = 0;  ///< number of the last run
  PageState state_;
  bool restart_ = false;
};

}  // namespace

void add_watch(CLI::App& app, int& code) {
  const auto request = std::make_shared<WatchRequest>();
  CLI::App* command = app.add_subcommand(
      "watch", "run a pipeline whenever it, its data or a plugin changes, and show the result in a page that updates");
  add_pipeline_arguments(command, request->pipeline);
  command
      ->add_option("--build", request->builds,
                   "a build folder of CMake: whenever its sources change, it is built, and its plugins are used")
      ->type_name("FOLDER");
  command->add_option("-o,--out", request->folder, "where page and results are put; default: runs/NAME-watch")
      ->type_name("FOLDER");
  command->callback([request, &code] {
    if (request->pipeline.file == "-")
      throw Error("- is the standard input, which does not change; give the path of a pipeline");
    expect_given(request->pipeline.file, Wanted::pipeline);
    code = Watch(*request, stop_on_signals()).run();
  });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
