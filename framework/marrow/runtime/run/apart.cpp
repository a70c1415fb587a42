// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/apart.hpp"

#include <signal.h>

#include <cmath>
#include <condition_variable>
#include <thread>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/abi.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "marrow/runtime/run/run_log.hpp"

namespace marrow {
namespace {

using nlohmann::json;

/// A sanitizer makes everything several times slower and larger.
constexpr double kSlower = abi_stamp().sanitizers ? 20 : 1;
constexpr double kMostMemory_mb = 4096;

bool has_function(const std::vector<PortInfo>& ports) {
  return std::any_of(ports.begin(), ports.end(), [](const PortInfo& port) { return port.type.is_function; });
}

double bytes_named_by(const PipelineNode& node) {
  double bytes = 0;
  std::error_code error;
  for (const std::string& path : paths_of(node))
    for (const NamedFile& file : files_named_by(path))
      if (file.is_there) bytes += double(std::filesystem::file_size(file.file, error));
  return bytes;
}

json request_of(const Catalogue& catalogue, const PipelineNode& node, bool has_inputs, const Context::Hooks& hooks,
                const CallLimits& limits) {
  const LibraryInfo& library = *catalogue.library_of(node.info.name);
  json request = {{"do", "call"},
                  {"library", json_of_bytes(library.file.string())},
                  {"manifest", library_json(library)},
                  {"node", node.info.name},
                  {"options", json::array()},
                  {"has_inputs", has_inputs},
                  {"seed", hooks.seed},
                  {"threads", limits.threads},
                  {"memory_mb", kSlower > 1 ? 0 : limits.memory_mb},
                  {"processor_s", limits.processor_s}};
  for (std::size_t i = 0; i < node.options.size(); ++i)
    request["options"].push_back({{"name", node.info.options[i].name}, {"value", json_of_option(node.options[i])}});
  return request;
}

/// The file that was being read: what the worker said last, else what the node's options name.
std::string file_of(const PipelineNode& node, const Worker& worker) {
  if (!worker.at().empty()) return worker.at();
  const std::vector<std::string> paths = paths_of(node);
  return paths.at(0) + (paths.size() > 1 ? formatted(" or another of its {} files", paths.size()) : "");
}

/// Finds the Content of marrow's own types, and of the other types of a node's outputs.
ContentOf content_of_outputs(const Catalogue& catalogue, const PipelineNode& node) {
  return [&](const TypeInfo& type) -> const Content* {
    if (const Content* content = content_of_own(type)) return content;
    for (const PortInfo& port : catalogue.load(node.info.name).info.outputs)
      if (port.type == type) return port.type.content;
    return nullptr;
  };
}

/// The processes that read files for this one. If the system does not start another one, start() waits until one of
/// them has ended. A process or thread that has just ended may still count for a moment, so start() tries several times
/// even if no other process is running.
class Readers {
 public:
  std::unique_ptr<Worker> start(const WorkerSettings& settings, const std::atomic<bool>* cancelled) {
    std::unique_lock lock(mutex_);
    for (int alone = 0;;) {
      const long ended = ended_;
      ++running_;
      lock.unlock();
      try {
        return std::make_unique<Worker>(settings);
      } catch (const NoProcess&) {
        lock.lock();
        --running_;
        const bool is_alone = running_ == 0 && ended_ == ended;
        if (is_alone && ++alone == kMostTries) {
          note_call_without_process();
          throw;
        }
        one_ended_.notify_all();
      } catch (...) {
        end(nullptr);
        throw;
      }
      if (running_ == 0) one_ended_.wait_for(lock, std::chrono::milliseconds(20));
      while (running_ > 0 && ended_ == ended) {
        if (cancelled && cancelled->load()) throw Cancelled();
        one_ended_.wait_for(lock, std::chrono::milliseconds(50));
      }
    }
  }
  void end(std::unique_ptr<Worker> worker) {
    worker.reset();
    const std::scoped_lock lock(mutex_);
    --running_;
    ++ended_;
    one_ended_.notify_all();
  }

 private:
  static constexpr int kMostTries = 25;
  std::mutex mutex_;
  std::condition_variable one_ended_;
  int running_ = 0;  ///< running, or about to start
  long ended_ = 0;
};

class Reader {
 public:
  Reader(const WorkerSettings& settings, const std::atomic<bool>* cancelled)
      : worker_(all().start(settings, cancelled)) {}
  ~Reader() { all().end(std::move(worker_)); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  Worker& worker() { return *worker_; }

 private:
  static Readers& all() {
    static Readers readers;
    return readers;
  }
  std::unique_ptr<Worker> worker_;
};

/// How a process ended, without the place, because the sentence already names it.
std::string without_place(std::string end, const std::string& place) {
  const std::string where = " in " + place, subject = "its process";
  if (const std::size_t found = end.find(where); found != end.npos) end.erase(found, where.size());
  if (end.starts_with(subject + " ")) end.erase(0, subject.size() + 1);
  return end;
}

}  // namespace

json json_of_option(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return json_of_bytes(*text);
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  if (!texts) return json_of(value);
  json list = json::array();
  for (const std::string& text : *texts) list.push_back(json_of_bytes(text));
  return list;
}

void pass_on(const json& report, const Context& context) {
  const std::string what = report.value("say", ""), text = report.value("text", "");
  if (what == "progress") {
    const json fraction = report.value("fraction", json());  // a number that is not finite is sent as null
    if (!fraction.is_number()) throw Error("it reports a progress that is not finite; expected a number from 0 to 1");
    context.progress(fraction.get<double>(), text);
  }
  for (const LogLevel level : {LogLevel::debug, LogLevel::info, LogLevel::warning})
    if (what == level_name(level)) context.log(level, text);
}

std::vector<Value> handed_over(Worker& worker, const SharedMemory& made, const ContentOf& content_of) {
  constexpr double kShareLimit_s = 600;
  try {
    return read_values(made.descriptor(), worker.process(), content_of);
  } catch (const NoAccess&) {
    worker.ask({{"do", "share"}});
    const WorkerEnd end = worker.wait({kShareLimit_s}, nullptr, nullptr);
    if (!end.failed.empty()) throw Error("the process that was started for it " + end.failed);
    return read_values(made.descriptor(), worker.process(), content_of);
  }
}

void expect_outputs(const std::vector<Value>& values, const std::vector<PortInfo>& outputs) {
  if (values.size() != outputs.size())
    throw Error(formatted("the process that was started for it handed over {} values, expected {}", values.size(),
                          outputs.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(values[i].type == outputs[i].type) || (!values[i].is_absent() && values[i].axis != outputs[i].axis))
      throw Error("the process that was started for it handed over a '" + values[i].type.id + "', expected a '" +
                  outputs[i].type.id + "'");
}

std::string failure_of(const std::string& file, const WorkerEnd& end, const CallLimits& limits) {
  if (end.is_out_of_memory)
    return formatted(
        "{}: to read it takes more than {} MB of memory, which is more than a file of its size should; where the file "
        "is good, raise the limit with --file-memory",
        file, std::lround(limits.memory_mb));
  if (end.signal == SIGXCPU)
    return formatted(
        "{}: to read it takes more than {:.3g} s, which is more than a file of its size should; where the file is "
        "good, raise the limit with --file-seconds",
        file, limits.processor_s);
  if (end.signal == SIGKILL)
    return file + ": it was not read to its end: " + killed_from_outside("the process that read it") +
           "; nothing is known against the file";
  if (end.signal)
    return file + ": to read it crashed the process that was started for it (" + strsignal(end.signal) +
           "); the file is damaged, or of a kind that its reader cannot take: copy or export it again";
  if (end.is_late)
    return formatted(
        "{}: to read it takes more than {:.3g} s by the clock, which is more than a file of its size should; where the "
        "machine has much other work, try again, or raise the limit with --file-seconds",
        file, limits.seconds);
  if (end.died)
    return file + ": could not be read: the process that was started for it " + without_place(end.failed, file);
  return end.failed;
}

bool runs_apart(const PipelineNode& node) {
  return node.apart != Apart::no && !paths_of(node).empty() && !has_function(node.info.inputs) &&
         !has_function(node.info.outputs);
}

CallLimits limits_of(const PipelineNode& node, double bytes, const RunSettings& settings) {
  const double megabytes = bytes / 1e6;
  CallLimits limits;
  const double most_mb = std::max(kMostMemory_mb, 256 + 8 * megabytes);
  if (node.apart == Apart::parses) {
    // The usual compressions do not shrink an image with content to less than a thousandth.
    limits.memory_mb = std::min(most_mb, 192 + 1024 * megabytes);
    limits.processor_s = 1.5 + megabytes;
  } else {
    limits.memory_mb = most_mb;
    limits.processor_s = 600 + megabytes;
    limits.threads = settings.threads > 0 ? settings.threads : int(std::max(1u, std::thread::hardware_concurrency()));
  }
  if (settings.file_limits.memory_mb > 0) limits.memory_mb = settings.file_limits.memory_mb;
  if (settings.file_limits.seconds > 0) limits.processor_s = settings.file_limits.seconds;
  limits.memory_mb *= kSlower;
  limits.processor_s *= kSlower;
  limits.seconds = 30 + 10 * limits.processor_s;  // wall time, on a machine that has other work
  return limits;
}

std::vector<Value> call_apart(const Catalogue& catalogue, const PipelineNode& node, const std::vector<Value>& inputs,
                              const Context::Hooks& hooks, const RunSettings& settings) {
  const SharedMemory given, made;
  write_values(given.descriptor(), inputs, false);
  given.seal();
  const CallLimits limits = limits_of(node, bytes_named_by(node) + double(bytes_in(given.descriptor())), settings);
  Reader reader({{worker_program().string()}, {given.descriptor(), made.descriptor()}, true}, hooks.cancelled);
  Worker& worker = reader.worker();
  worker.ask(request_of(catalogue, node, !inputs.empty(), hooks, limits));
  const WorkerEnd end = worker.wait({limits.seconds, 2 * limits.memory_mb}, hooks.cancelled,
                                    [context = Context(hooks)](const json& report) { pass_on(report, context); });
  if (!end.failed.empty()) throw Error(failure_of(file_of(node, worker), end, limits));
  std::vector<Value> outputs = handed_over(worker, made, content_of_outputs(catalogue, node));
  expect_outputs(outputs, node.info.outputs);
  return outputs;
}

}  // namespace marrow
