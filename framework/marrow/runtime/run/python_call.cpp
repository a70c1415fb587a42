// SPDX-License-Identifier: Apache-2.0
// Calls of nodes written in Python, in processes that stay for the next call.
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/plugins/python_file.hpp"
#include "marrow/runtime/plugins/python_functions.hpp"
#include "marrow/runtime/plugins/trust.hpp"
#include "marrow/runtime/run/apart.hpp"
#include "marrow/runtime/run/run_log.hpp"

namespace marrow {

/// A process that holds the nodes of one Python file, and the memory through which it hands values over.
struct PythonProcess {
  SharedMemory made;
  ReplyPipe replies;
  Worker worker;
  nlohmann::json limits;  ///< of each node: {"seconds": ..., "memory_mb": ...}
  explicit PythonProcess(const std::filesystem::path& file)
      : worker(python_process(file, made.descriptor(), replies.read_end())) {
    replies.close_read_end();
  }
};

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kLoadLimit_s = 20, kStopLimit_s = 2, kReplyLimit_s = 0.3;

/// The inputs as a request has them. `kept` keeps what the request names until the call has ended.
json json_of_input(const Value& value, PythonArguments& kept) {
  if (value.is_list()) {
    json items = json::array();
    for (const Value& item : value.items) items.push_back(json_of_input(item, kept));
    return {{"axis", value.axis}, {"names", value.names}, {"items", items}};
  }
  if (value.is_absent()) return nullptr;
  if (value.type.is_function) return kept.functions->add(value);
  const std::shared_ptr<const SharedInput> shared = SharedInputs::all().share(value);
  kept.memory.push_back(shared);
  return {{"type", value.type.id},
          {"memory", formatted("/proc/{}/fd/{}", getpid(), shared->memory.descriptor())},
          {"number", shared->number},
          {"samples_bytes", shared->samples_bytes}};
}

/// Asks the process to end, so that it can clean up, and ends it if it does not. A process that waits for a reply
/// learns that none comes.
void stop(PythonProcess& process) {
  Worker& worker = process.worker;
  kill(worker.process(), SIGTERM);
  using Seconds = std::chrono::duration<double>;
  const auto start = std::chrono::steady_clock::now();
  while (!worker.is_dead() && std::chrono::steady_clock::now() - start < Seconds(kStopLimit_s)) {
    pollfd polled{worker.descriptor(), POLLIN, 0};
    poll(&polled, 1, 20);
    if (worker.take(nullptr)) break;
    if (std::chrono::steady_clock::now() - start > Seconds(kReplyLimit_s)) process.replies.close();
  }
  worker.close();
}

/// A job of a process, and what it asks meanwhile. While it waits for a reply, it can be asked something itself: an
/// optimizer among its inputs asks for values of the node's function.
class Conversation {
 public:
  using Answer = std::function<json(const json& question, const AskProcess& ask_process)>;

  Conversation(PythonProcess& process, const WorkerLimits& limits, Context& context, Answer answer)
      : process_(process), limits_(limits), context_(context), answer_(std::move(answer)) {}

  /// Waits for the end of the job, and replies to all questions. Ends the process if a reply cannot be given, or if the
  /// call is cancelled, and throws why.
  WorkerEnd wait() {
    try {
      for (;;) reply_to(question());
    } catch (const Ended&) {
      return *end_;
    } catch (...) {
      if (!process_.worker.is_dead()) stop(process_);
      throw;
    }
  }

 private:
  struct Ended {};

  /// The next question of the process. Throws Ended at the end of the job.
  json question() {
    Worker& worker = process_.worker;
    while (!end_) {
      context_.check_cancelled();
      std::optional<json> asked;
      pollfd polled{worker.descriptor(), POLLIN, 0};
      poll(&polled, 1, 20);
      end_ = worker.take([&](const json& report) {
        if (report.value("say", json()) == "ask")
          asked = report;  // it says nothing further before it has the reply
        else
          pass_on(report, context_);
      });
      if (!end_ && asked) return *asked;
      if (!end_) end_ = worker.check(limits_);
    }
    throw Ended();
  }

  void reply_to(const json& question) {
    process_.replies.send(answer_(question, [this](const json& own) { return ask(own); }));
  }

  /// Asks the process something in place of a reply. It may ask further things before it answers.
  json ask(json own) {
    const std::scoped_lock lock(asking_);
    const int number = own["ask"] = ++asked_;
    process_.replies.send(own);
    for (;;) {
      const json next = question();
      if (!next.contains("answer")) {
        reply_to(next);
      } else if (next.value("to", 0) != number) {
        throw Error("it ran two minimisations at the same time; run one after the other");
      } else {
        return next["answer"];
      }
    }
  }

  PythonProcess& process_;
  const WorkerLimits limits_;
  Context& context_;
  const Answer answer_;
  std::optional<WorkerEnd> end_;
  std::recursive_mutex asking_;
  int asked_ = 0;
};

[[noreturn]] json answer_nothing(const json&, const AskProcess&) { throw Error("it asked for something unexpectedly"); }

/// How the node is declared in its file.
std::string decorator_of(const NodeInfo& node) {
  const TypeInfo type = makes_function(node) ? node.outputs[0].type : TypeInfo{};
  return type == TypeInfo::of<Cost>()                  ? "@marrow.cost"
         : type == TypeInfo::of<Optimizer>()           ? "@marrow.optimizer"
         : type == TypeInfo::of<RadiographProjector>() ? "@marrow.projector"
                                                       : "@marrow.node";
}

/// Why a call failed, in one sentence.
std::string failure_of_call(const fs::path& file, const NodeInfo& node, const WorkerEnd& end,
                            const WorkerLimits& limits) {
  const std::string name = file.filename().string(),
                    ended = " and its process was ended; if it needs more, give it more in " + decorator_of(node);
  if (end.is_late) return formatted("{} took longer than {:.6g} s,{}(..., seconds=...)", name, limits.seconds, ended);
  if (end.is_out_of_memory && end.died)
    return formatted("{} used more than {:.6g} MB of memory,{}(..., memory_mb=...)", name, limits.memory_mb, ended);
  if (end.signal == SIGKILL) return killed_from_outside("the process of " + name);
  if (end.signal) return name + " crashed its process (" + strsignal(end.signal) + "); the next call starts a new one";
  if (end.died && end.failed.starts_with("ended"))
    return name + " ended its process; a node must return or raise an exception";
  if (end.died) return name + ": " + end.failed + " and was ended";
  return end.failed;
}

/// The node with Contents for its types, which a description does not have.
NodeInfo with_contents(NodeInfo node) {
  for (std::vector<PortInfo>* ports : {&node.inputs, &node.outputs})
    for (PortInfo& port : *ports) {
      if (ports == &node.outputs && makes_function(node)) continue;
      if (ports == &node.inputs && can_be_asked(port.type)) continue;
      port.type.content = content_of_own(port.type);
      if (!port.type.content) throw Error("has a port of type '" + port.type.id + "', which Python does not know");
    }
  return node;
}

}  // namespace

PythonArguments::PythonArguments(const std::vector<Value>& given, const std::vector<OptionValue>& values) {
  for (const Value& input : given) inputs.push_back(json_of_input(input, *this));
  for (const OptionValue& value : values) options.push_back(json_of_option(value));
}

PythonNodes::PythonNodes(LibraryInfo described) : described_(std::move(described)) {}
PythonNodes::~PythonNodes() = default;

json PythonNodes::ask(const NodeInfo& node, json request, const PythonArguments& arguments, Context& context,
                      std::vector<Value>* outputs, const Reply& reply) {
  std::unique_ptr<PythonProcess> process = take(context);
  WorkerLimits limits;
  limits.seconds = process->limits.at(node.name).at("seconds");
  limits.memory_mb = process->limits.at(node.name).at("memory_mb");
  std::vector<std::uint64_t> kept = SharedInputs::all().numbers();
  for (const auto& one : arguments.memory) {
    limits.memory_mb += 2e-6 * double(one->bytes);
    kept.push_back(one->number);
  }
  request["node"] = node.name;
  request["inputs"] = arguments.inputs;
  request["options"] = arguments.options;
  request["kept"] = kept;
  process->worker.ask(std::move(request));
  const auto answer = [&](const json& question, const AskProcess& ask_process) {
    if (question.contains("function")) return arguments.functions->reply(question, ask_process);
    return reply ? reply(question) : answer_nothing(question, ask_process);
  };
  const WorkerEnd end = Conversation(*process, limits, context, answer).wait();
  if (!end.failed.empty()) {
    if (!end.died) give_back(std::move(process));
    throw Error(failure_of_call(described_.file, node, end, limits));
  }
  // The call has changed something that all calls in its process share. So the process is ended.
  if (end.answer.contains("spoilt")) throw Error(end.answer.at("spoilt").get<std::string>());
  if (outputs) *outputs = handed_over(process->worker, process->made, content_of_own);
  learn(end.answer);
  give_back(std::move(process));
  return end.answer;
}

std::unique_ptr<PythonProcess> PythonNodes::take(Context& context) {
  {
    const std::scoped_lock lock(mutex_);
    while (!idle_.empty()) {
      std::unique_ptr<PythonProcess> process = std::move(idle_.back());
      idle_.pop_back();
      process->worker.take(nullptr);  // notices that it has ended meanwhile
      if (!process->worker.is_dead() && !process->worker.is_ending()) return process;
    }
  }
  auto process = std::make_unique<PythonProcess>(trusted_path(described_.file));
  process->worker.ask({{"do", "load"}});
  const WorkerEnd end = Conversation(*process, {kLoadLimit_s}, context, answer_nothing).wait();
  if (!end.failed.empty()) throw Error(described_.file.string() + " cannot be loaded: " + end.failed);
  process->limits = end.answer.at("limits");
  for (const NodeInfo& node : described_.nodes)
    if (!process->limits.contains(node.name)) throw Error(changed());
  learn(end.answer);
  return process;
}

void PythonNodes::give_back(std::unique_ptr<PythonProcess> process) {
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(process));
}

std::string PythonNodes::changed() const {
  return described_.file.string() + " or a module that it imports was changed since this program began; start it again";
}

/// Notes the files that a process has loaded, if the description does not name them.
void PythonNodes::learn(const json& answer) {
  if (answer.at("files").empty()) return;  // nothing since its last answer
  const std::scoped_lock lock(mutex_);
  if (digest_of_python(described_) != described_.digest) throw Error(changed());
  add_to_description(described_, answer, undescribed_);
}

std::unique_ptr<Plugin> load_python_file(const LibraryInfo& described) {
  auto plugin = std::make_unique<Plugin>();
  const auto nodes = std::make_shared<PythonNodes>(described);
  for (const NodeInfo& info : described.nodes) {
    NodeDefinition& node = plugin->nodes.emplace_back();
    node.info = with_contents(info);
    node.make_options = [options = node.info.options]() -> std::shared_ptr<void> {
      auto values = std::make_shared<std::vector<OptionValue>>();
      for (const OptionInfo& option : options) values->push_back(option.default_value);
      return values;
    };
    for (std::size_t i = 0; i < node.info.options.size(); ++i)
      node.set_option.push_back([i](void* options, const OptionValue& value) {
        (*static_cast<std::vector<OptionValue>*>(options))[i] = value;
      });
    node.call = [nodes, info = node.info](const std::vector<Value>& inputs, const void* options, Context& context) {
      const auto& values = *static_cast<const std::vector<OptionValue>*>(options);
      if (makes_function(info))
        return std::vector<Value>{value_of_function(info, PythonFunction(nodes, info, inputs, values), context)};
      std::vector<Value> outputs;
      nodes->ask(info, {{"do", "call"}, {"seed", context.seed()}}, PythonArguments(inputs, values), context, &outputs);
      expect_outputs(outputs, info.outputs);
      return outputs;
    };
  }
  return plugin;
}

}  // namespace marrow
