// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "pipelines.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

namespace fs = std::filesystem;

struct Run {
  std::shared_ptr<const ReadPipeline> read;
  RunResult result;
  std::vector<std::pair<std::string, std::string>> warnings;  ///< the node with its item, and the text
  std::string folder;                                         ///< empty if nothing was written
  std::vector<RunFolder::Written> written;
  RunSettings settings;  ///< without what was only for the run itself
};

struct RunOptions {
  bool keep = true;                   ///< results of nodes, in the store
  std::optional<std::string> folder;  ///< "": runs/NAME, with a number if it exists
};

/// Hands events to a Python function. What it raises stops the run.
class Observer {
 public:
  Observer(py::object function, std::atomic<bool>& cancelled, Run& run)
      : function_(std::move(function)), cancelled_(cancelled), run_(run) {}

  /// From now on, events are kept in the log of a folder, too.
  void log_to(RunLog& log) { log_ = &log; }

  void operator()(const RunEvent& event) {
    keep_in_log(event);
    if (event.kind == RunEvent::Kind::warning) run_.warnings.emplace_back(place_of(event), event.text);
    if (function_.is_none() || fault_) return;
    static constexpr const char* kNames[] = {"started", "progress", "finished", "failed",  "skipped",
                                             "message", "warning",  "cached",   "waiting", "waited"};
    const py::gil_scoped_acquire acquire;
    try {
      py::dict told;
      told["event"] = kNames[int(event.kind)];
      told["node"] = event.node;
      told["item"] = event.item;
      told["text"] = event.text;
      told["fraction"] = event.fraction;
      told["seconds"] = event.seconds;
      told["level"] = level_name(event.level);
      function_(told);
    } catch (py::error_already_set& error) {
      fault_.emplace(std::move(error));
      cancelled_ = true;
    }
  }
  void rethrow() {
    if (fault_) throw py::error_already_set(*fault_);
  }

 private:
  static std::string place_of(const RunEvent& event) {
    return event.item.empty() ? event.node : event.node + " (" + event.item + ")";
  }
  void keep_in_log(const RunEvent& event) {
    if (!log_) return;
    if (event.kind == RunEvent::Kind::finished) {
      const std::string seconds = formatted("{:.3f} s", event.seconds);
      log_->keep(LogLevel::info, place_of(event), seconds);
    } else if (event.kind == RunEvent::Kind::failed) {
      log_->keep(event.level, "", event.text);
    } else if (event.kind != RunEvent::Kind::progress && !event.text.empty()) {
      log_->keep(event.level, place_of(event), event.text);
    }
  }

  py::object function_;
  std::atomic<bool>& cancelled_;
  Run& run_;
  RunLog* log_ = nullptr;
  std::optional<py::error_already_set> fault_;
};

/// Nothing if a program gave values: a file cannot make them again.
std::optional<RunRecipe> recipe_of(const Run& run) {
  if (!run.read->given.empty()) return std::nullopt;
  return recipe_of_run(run.read->pipeline, run.settings);
}

void write_folder(Run& run, RunFolder& folder) {
  const Catalogue& known = *run.read->known;
  run.written = folder.write_outputs(run.read->pipeline, run.result, known, recipe_of(run));
  folder.write_record(run.read->pipeline, run.result, run.settings, known, run.read->arguments, run.written);
  run.folder = fs::absolute(folder.path()).string();
}

std::unique_ptr<RunFolder> folder_of(const RunOptions& options, const Pipeline& pipeline) {
  if (!options.folder) return nullptr;
  expect_nothing_reads(pipeline, options.folder->empty() ? "runs" : *options.folder, "the output folder",
                       "choose another with folder=");
  if (options.folder->empty())
    return std::make_unique<RunFolder>(RunFolder::with_free_name(fs::path("runs") / pipeline.name, pipeline));
  return std::make_unique<RunFolder>(*options.folder, pipeline);
}

/// Only the outputs are kept: what led to them may be large.
void drop_other_values(Run& run) {
  std::vector<bool> is_output(run.result.nodes.size());
  for (const PipelineOutput& output : run.read->pipeline.outputs) is_output[std::size_t(output.source.node)] = true;
  for (std::size_t i = 0; i < is_output.size(); ++i)
    if (!is_output[i]) run.result.nodes[i].outputs.clear();
}

void run_into(Run& run, const RunOptions& options, RunSettings& settings, Observer& observer) {
  const Catalogue& known = *run.read->known;
  const std::unique_ptr<RunFolder> folder = folder_of(options, run.read->pipeline);
  if (folder) {
    observer.log_to(folder->log());
    for (const std::string& note : run.read->pipeline.notes) folder->log().keep(LogLevel::info, "", "note: " + note);
  }
  if (!run.read->is_one_node)
    for (std::string& note : notes_on_poses(run.read->pipeline)) {
      if (folder) folder->log().keep(LogLevel::info, "", "note: " + note);
      run.warnings.emplace_back("", std::move(note));
    }
  std::optional<Store> store;
  if (options.keep) {
    const std::string fault = store.emplace().prepare();
    if (fault.empty()) {
      settings.store = &*store;
      expect_nothing_reads(run.read->pipeline, store->folder(), "the store of results",
                           "set MARROW_CACHE to another folder, or give keep=False");
    }
    if (!fault.empty()) run.warnings.emplace_back("", "results are not kept: " + fault);
  }
  if (folder) folder->keep_failed_calls(settings, known);
  run.result = run_pipeline(run.read->pipeline, known, settings);
  run.settings.seed = settings.seed;
  run.settings.threads = settings.threads;
  if (folder) write_folder(run, *folder);
  if (settings.store)
    if (const std::string untidy = settings.store->tidy(settings.cancelled); !untidy.empty())
      run.warnings.emplace_back("", "the store of results is not tidied up: " + untidy);
  drop_other_values(run);
}

std::shared_ptr<Run> run(const std::shared_ptr<ReadPipeline>& read, const py::object& function, std::uint64_t seed,
                         int threads, bool keep, const std::optional<std::string>& folder) {
  auto made = std::make_shared<Run>();
  made->read = read;
  std::atomic<bool> cancelled{false};
  Observer observer(function, cancelled, *made);
  RunSettings settings;
  settings.seed = seed;
  settings.threads = threads;
  settings.cancelled = &cancelled;
  settings.given = read->given;
  settings.remember = read->given.empty();
  settings.observer = [&](const RunEvent& event) { observer(event); };
  const RunOptions options{keep, folder};
  do_interruptibly(cancelled, [&] { run_into(*made, options, settings, observer); });
  observer.rethrow();
  return made;
}

void write(Run& self, const std::string& folder) {
  const py::gil_scoped_release release;
  RunFolder made(folder, self.read->pipeline);
  write_folder(self, made);
}

py::object output_of(const Run& self, const std::string& name) {
  for (const PipelineOutput& output : self.read->pipeline.outputs)
    if (output.name == name) return python_of(value_of(self.result, output.source));
  throw py::key_error(name);
}

py::list nodes_of(const Run& self) {
  py::list nodes;
  for (std::size_t i = 0; i < self.result.nodes.size(); ++i) {
    const NodeRecord& record = self.result.nodes[i];
    const PipelineNode& node = self.read->pipeline.nodes[i];
    if (self.read->given.contains(node.id)) continue;
    py::dict one;
    one["name"] = node.id;
    one["uses"] = node.info.name;
    one["status"] = status_name(record.status);
    one["is_failed"] = record.status == NodeRecord::Status::failed;
    one["reason"] = record.reason;
    one["seconds"] = record.seconds;
    one["calls"] = record.calls;
    one["cached"] = record.cached;
    one["peak_memory_mb"] = record.peak_memory_mb;
    one["file"] = node.place.file;
    one["line"] = node.place.line;
    one["column"] = node.place.column;
    nodes.append(one);
  }
  return nodes;
}

py::list written_of(const Run& self) {
  py::list all;
  for (const RunFolder::Written& one : self.written)
    all.append(py::make_tuple(one.output, one.files, one.fault, one.absent));
  return all;
}

}  // namespace

void bind_runs(py::module_& module) {
  py::class_<Run, std::shared_ptr<Run>>(module, "Run")
      .def("output", &output_of)
      .def("write", &write)
      .def_property_readonly("outputs",
                             [](const Run& self) {
                               std::vector<std::string> names;
                               for (const PipelineOutput& output : self.read->pipeline.outputs)
                                 names.push_back(output.name);
                               return names;
                             })
      .def_property_readonly("nodes", &nodes_of)
      .def_property_readonly("seconds", [](const Run& self) { return self.result.seconds; })
      .def_property_readonly("failed", [](const Run& self) { return self.result.failed(); })
      .def_readonly("warnings", &Run::warnings)
      .def_readonly("folder", &Run::folder)
      .def_property_readonly("recipe",
                             [](const Run& self) {
                               const std::optional<RunRecipe> recipe = recipe_of(self);
                               return recipe ? std::optional(recipe->text()) : std::nullopt;
                             })
      .def_property_readonly("written", &written_of);
  module.def("run", &run, py::arg("pipeline"), py::arg("observer"), py::arg("seed"), py::arg("threads"),
             py::arg("keep"), py::arg("folder"));
}

void do_interruptibly(std::atomic<bool>& cancelled, const std::function<void()>& work) {
  constexpr std::chrono::milliseconds kBetweenLooks(50);
  constexpr int kLooksBeforeNotice = 20;
  std::mutex mutex;
  std::condition_variable end;
  bool is_done = false;
  std::exception_ptr fault;
  std::optional<py::error_already_set> interrupt;
  {
    const py::gil_scoped_release release;
    std::thread thread([&] {
      try {
        work();
      } catch (...) {
        fault = std::current_exception();
      }
      const std::scoped_lock lock(mutex);
      is_done = true;
      end.notify_all();
    });
    std::unique_lock lock(mutex);
    for (int looks = 0; !end.wait_for(lock, kBetweenLooks, [&] { return is_done; });) {
      if (interrupt && ++looks == kLooksBeforeNotice) {
        const py::gil_scoped_acquire acquire;
        PySys_WriteStderr("marrow: stopping; it waits until the node that runs has ended\n");
      }
      if (interrupt) continue;
      lock.unlock();
      {
        const py::gil_scoped_acquire acquire;
        if (PyErr_CheckSignals() != 0) {
          interrupt.emplace();
          cancelled = true;
        }
      }
      lock.lock();
    }
    lock.unlock();
    thread.join();
  }
  if (interrupt) throw py::error_already_set(*interrupt);
  if (fault) std::rethrow_exception(fault);
}

}  // namespace marrow::python
