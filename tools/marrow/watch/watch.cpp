// SPDX-License-Identifier: Apache-2.0
// `marrow watch`: builds, runs and shows a pipeline again whenever something changes that its result depends on.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "process.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

/// When each file was written last, and its size. Two states differ if anything was changed, added or removed.
using FileStates = std::map<std::filesystem::path, std::pair<std::filesystem::file_time_type, std::uintmax_t>>;

/// The files that a pipeline depends on. If it has a fault: those that could still be found.
struct WatchedFiles {
  std::vector<std::filesystem::path> paths;           ///< its file, those of its bodies, and what its options name
  std::vector<std::filesystem::path> plugin_folders;  ///< whose libraries are used
};

/// A CMake build folder and the sources from which it is built.
struct WatchedBuild {
  std::filesystem::path folder, sources;
};

void add(const fs::path& file, FileStates& states) {
  std::error_code gone;
  const fs::file_time_type written = fs::last_write_time(file, gone);
  if (gone) return;
  const std::uintmax_t size = fs::file_size(file, gone);
  if (!gone) states[file] = {written, size};
}

void add_below(const fs::path& folder, FileStates& states) {
  std::error_code gone;
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, gone), end;
       !gone && entry != end; entry.increment(gone))
    if (entry->is_regular_file(gone)) add(entry->path(), states);
}

void add_files(const Pipeline& pipeline, std::vector<fs::path>& files) {
  files.insert(files.end(), pipeline.files.begin(), pipeline.files.end());
  for (const PipelineNode& node : pipeline.nodes) {
    for (const std::string& path : paths_of(node)) files.push_back(path);
    if (node.repetition) add_files(node.repetition->alone, files);
  }
}

bool holds_sources(const fs::path& folder) {
  const std::string name = folder.filename().string();
  return !name.starts_with(".") && name != "runs" && name != "__pycache__" && !fs::exists(folder / "CMakeCache.txt");
}

WatchedFiles files_of(const PipelineRequest& request) {
  const Catalogue catalogue;
  WatchedFiles files{{request.file}, catalogue.folders()};
  files.paths.insert(files.paths.end(), request.settings.begin(), request.settings.end());
  Diagnostics diagnostics;
  add_files(read_pipeline(request.file, arguments_of(request), catalogue, diagnostics, false), files.paths);
  return files;
}

/// The states of the files, of all files below the folders, and of the libraries of plugins. Leaves out what does not
/// exist or cannot be read.
FileStates states_of(const WatchedFiles& files) {
  FileStates states;
  std::error_code gone;
  for (const fs::path& path : files.paths)
    if (fs::is_directory(path, gone))
      add_below(path, states);
    else
      add(path, states);
  for (const fs::path& folder : files.plugin_folders)
    for (fs::directory_iterator entry(folder, gone), end; !gone && entry != end; entry.increment(gone))
      if (entry->path().extension() == ".so" || entry->path().extension() == ".py") add(entry->path(), states);
  return states;
}

/// Throws Error if the folder is no build folder of CMake.
WatchedBuild watched_build(const fs::path& folder) {
  std::ifstream cache(folder / "CMakeCache.txt");
  const std::string key = "CMAKE_HOME_DIRECTORY:INTERNAL=";
  for (std::string line; std::getline(cache, line);)
    if (line.starts_with(key)) return {fs::absolute(folder), line.substr(key.size())};
  throw Error("--build " + printable(folder.string()) +
              ": it is no build folder of CMake, as it has no CMakeCache.txt; make it by: cmake -S SOURCES -B " +
              printable(folder.string()));
}

/// The states of the sources: everything below their folder except build folders, hidden ones and folders of runs.
FileStates states_of_sources(const WatchedBuild& build) {
  FileStates states;
  std::error_code gone;
  for (fs::recursive_directory_iterator entry(build.sources, fs::directory_options::skip_permission_denied, gone), end;
       !gone && entry != end; entry.increment(gone)) {
    if (entry->is_directory(gone) && !holds_sources(entry->path())) entry.disable_recursion_pending();
    if (entry->is_regular_file(gone)) add(entry->path(), states);
  }
  return states;
}

/// What an open page of `marrow watch` shows. It looks for a new state every second.
struct PageState {
  std::string report;  ///< the last good report, relative to the page; empty if there is none yet
  std::string doing;   ///< what is done now; empty: nothing, it waits for a change
  std::string fault;   ///< what the last try ended with; empty if it was good
};

/// A page that was opened from a disk may not read files, but it may load scripts. So the state is a script, which the
/// page loads again and again.
constexpr const char* kPage = R"(<!DOCTYPE html>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title></title>
<style>
  html, body { margin: 0; height: 100%; font: 14px system-ui, sans-serif; }
  body { display: flex; flex-direction: column; }
  #bar { padding: 6px 12px; background: #eef3f7; color: #223; }
  #fault { margin: 0; padding: 8px 12px; max-height: 40vh; overflow: auto; background: #fdecea; color: #7a1410;
    white-space: pre-wrap; font: 12px ui-monospace, monospace; }
  #fault:empty { display: none; }
  iframe { flex: 1; border: 0; width: 100%; }
  @media (prefers-color-scheme: dark) {
    #bar { background: #1d2730; color: #dde; }
    #fault { background: #3b1512; color: #f5b5ae; }
  }
</style>
<div id="bar" role="status">waiting for the first result</div>
<pre id="fault" role="alert"></pre>
<iframe title="report"></iframe>
<script>
  const title = TITLE, frame = document.querySelector('iframe'), bar = document.querySelector('#bar');
  let shown = '', seen = '', place = 0;
  document.title = title;
  frame.addEventListener('load', () => {
    try { frame.contentWindow.scrollTo(0, place); } catch (e) { /* the browser keeps the files apart */ }
  });
  function marrowState(state) {
    if (JSON.stringify(state) === seen) return;
    seen = JSON.stringify(state);
    bar.textContent = title + ': ' + (state.doing || (state.fault ? 'a fault; below is the last good result' :
      'up to date since ' + state.at)) ;
    document.querySelector('#fault').textContent = state.fault;
    document.title = (state.fault ? '✗ ' : state.doing ? '… ' : '✓ ') + title;
    if (state.report && state.report !== shown) {
      try { place = frame.contentWindow.scrollY; } catch (e) { place = 0; }
      shown = frame.src = state.report;
    }
  }
  function look() {
    const script = document.createElement('script');
    script.src = 'state.js?' + Date.now();
    script.onload = script.onerror = () => { script.remove(); setTimeout(look, 1000); };
    document.head.append(script);
  }
  look();
</script>
)";

/// Writes index.html into the folder of a watch.
void write_page(const std::filesystem::path& folder, const std::string& title) {
  std::string page = kPage;
  // The text of a script must not contain the end of the element.
  std::string name = nlohmann::json(title).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  for (std::size_t at = 0; (at = name.find('<', at)) != std::string::npos;) name.replace(at, 1, "\\u003c");
  page.replace(page.find("TITLE"), 5, name);
  write_text_file(folder / "index.html", page);
}

void write_state(const std::filesystem::path& folder, const PageState& state) {
  const std::time_t now = std::time(nullptr);
  char clock[16];
  std::strftime(clock, sizeof clock, "%H:%M:%S", std::localtime(&now));
  const nlohmann::json json = {{"report", state.report}, {"doing", state.doing}, {"fault", state.fault}, {"at", clock}};
  write_text_file(folder / "state.js",
                  "marrowState(" + json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + ")\n");
}

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
