// SPDX-License-Identifier: Apache-2.0
// The worker's side of a call that runs in its own process.
#include <oneapi/tbb/global_control.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <opencv2/core/utility.hpp>

#include "marrow/plugin.hpp"
#include "marrow/runtime/plugins/manifest.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "marrow/runtime/run/apart.hpp"
#include "marrow/runtime/run/run_log.hpp"

namespace marrow {
namespace {

using nlohmann::json;

constexpr int kGivenDescriptor = 3, kMadeDescriptor = 4;

/// The reports of the one call for which this process exists.
std::atomic<WorkerReports*> current_reports{nullptr};
/// What the call made. It is kept until the process ends, because the parent reads it from this memory.
std::vector<Value> made;

/// Sets the limits of this process. Beyond the memory limit, allocations fail; beyond the time limit, the process is
/// ended. Processor time that was used up to here, for example to load the library, does not count.
void set_limits(double memory_mb, double processor_s) {
  const auto set = [](auto what, double most) {
    rlimit limit{};
    getrlimit(what, &limit);
    limit.rlim_cur = std::min(limit.rlim_max, rlim_t(most));
    setrlimit(what, &limit);
  };
  set(RLIMIT_CORE, 0);
  if (memory_mb > 0) {
    set(RLIMIT_DATA, memory_mb * 1e6);
    set(RLIMIT_FSIZE, memory_mb * 1e6);
  }
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + 1e-6 * double(time.tv_usec); };
  set(RLIMIT_CPU, std::ceil(seconds(used.ru_utime) + seconds(used.ru_stime) + processor_s));
}

OptionValue option_value(const json& value, OptionType type) {
  switch (type) {
    case OptionType::boolean:
      return value.get<bool>();
    case OptionType::integer:
      return value.get<std::int64_t>();
    case OptionType::number:
      return value.get<double>();
    case OptionType::text:
    case OptionType::path:
      return bytes_of_json(value);
    case OptionType::numbers:
      return value.get<std::vector<double>>();
    default:
      break;
  }
  std::vector<std::string> texts;
  for (const json& text : value) texts.push_back(bytes_of_json(text));
  return texts;
}

const NodeDefinition& find_node(const Plugin& plugin, const std::string& name) {
  for (const NodeDefinition& node : plugin.nodes)
    if (node.info.name == name) return node;
  throw Error("the library does not hold the node '" + name + "' any more; run it again");
}

std::shared_ptr<void> options_of(const NodeDefinition& node, const json& options) {
  std::shared_ptr<void> result = node.make_options();
  if (options.size() != node.info.options.size())
    throw Error("the library has other options than a moment ago; run it again");
  for (std::size_t i = 0; i < options.size(); ++i) {
    const OptionInfo& info = node.info.options[i];
    if (options[i].at("name") != info.name)
      throw Error("the library has other options than a moment ago; run it again");
    node.set_option[i](result.get(), option_value(options[i].at("value"), info.type));
  }
  return result;
}

Context::Hooks hooks_of(const json& request, WorkerReports& reports) {
  Context::Hooks hooks;
  hooks.seed = request.at("seed");
  hooks.progress = [&](double fraction, std::string_view what) {
    reports.say({{"say", "progress"}, {"fraction", fraction}, {"text", what}});
  };
  hooks.log = [&](std::string_view text, LogLevel level) { reports.say({{"say", level_name(level)}, {"text", text}}); };
  return hooks;
}

}  // namespace

void now_reading(const std::filesystem::path& file) {
  if (WorkerReports* reports = current_reports.load()) reports->at(file.string());
}

json answer_call(const json& request, WorkerReports& reports) {
  LibraryInfo library = library_from_json(request.at("manifest"));
  library.file = bytes_of_json(request.at("library"));
  const std::unique_ptr<Plugin> plugin = load_library(library);
  const NodeDefinition& node = find_node(*plugin, request.at("node"));
  const std::shared_ptr<void> options = options_of(node, request.at("options"));
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    request.at("threads").get<std::size_t>());
  cv::setNumThreads(1);
  std::vector<Value> inputs;
  if (request.at("has_inputs")) {
    inputs = read_values(kGivenDescriptor, 0, [&](const TypeInfo& type) -> const Content* {
      for (const PortInfo& port : node.info.inputs)
        if (port.type == type) return port.type.content;
      return nullptr;
    });
  }
  if (inputs.size() != node.info.inputs.size())
    throw Error("the library has other inputs than a moment ago; run it again");
  set_limits(request.at("memory_mb"), request.at("processor_s"));
  current_reports = &reports;
  Context context(hooks_of(request, reports));
  made = node.call(inputs, options.get(), context);
  write_values(kMadeDescriptor, made, true);
  current_reports = nullptr;
  return made.size();
}

json answer_share(const json&, WorkerReports&) {
  if (ftruncate(kMadeDescriptor, 0) != 0 || lseek(kMadeDescriptor, 0, SEEK_SET) != 0)
    throw Error("cannot share its memory");
  write_values(kMadeDescriptor, made, false);
  return made.size();
}

}  // namespace marrow
