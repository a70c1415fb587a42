// SPDX-License-Identifier: Apache-2.0
// marrow conformance: runs the suite of a node's kind in a worker process. So if a node crashes or hangs, only this
// check fails.
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/plugin.hpp"
#include "marrow/runtime/node/option_yaml.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/process/worker.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

using conformance::Check;
using nlohmann::json;
using OptionValues = std::map<std::string, OptionValue>;

/// Values for the node's options, from the texts that --set gives by the options' names. Other names are left out.
/// Throws Error for a value that does not fit.
std::map<std::string, OptionValue> given_options(const NodeInfo& node, const nlohmann::json& texts) {
  std::map<std::string, OptionValue> values;
  for (const OptionInfo& option : node.options) {
    if (!texts.contains(option.name)) continue;
    const Place place{"--set " + option.name};
    Diagnostics faults;
    StrictYaml yaml(place, faults);
    const YAML::Node parsed = yaml.parse(texts.at(option.name).get<std::string>());
    std::optional<OptionValue> value;
    if (faults.empty())
      value = read_option(yaml, parsed, place, option, "option '" + option.name + "'",
                          [](const std::string& text, const Place&) { return std::optional(text); });
    if (!value) throw Error(faults.text());
    if (option.type == OptionType::path) *value = std::filesystem::absolute(std::get<std::string>(*value)).string();
    values[option.name] = std::move(*value);
  }
  return values;
}

constexpr double kMemory_mb = 8192;

/// Time limit of one check in seconds.
int time_limit_s() {
  const char* text = std::getenv("MARROW_CHECK_SECONDS");
  const int seconds = text ? std::atoi(text) : 0;
  return seconds > 0 ? seconds : 60;
}

struct Outcome {
  char verdict = '-';  ///< '+' passed, '-' failed, '~' does not apply
  std::string text;
};

/// In the worker: values from other nodes for inputs that the kind does not have, by port. These nodes get the inputs
/// of their own kind's suite. `kept` keeps these inputs alive, because the values may refer to them.
conformance::Inputs further_inputs(const Catalogue& catalogue, const NodeDefinition& node, const json& makers,
                                   std::vector<conformance::Inputs>& kept) {
  conformance::Inputs further;
  for (const auto& [name, maker] : makers.items()) {
    const std::vector<PortInfo>& ports = node.info.inputs;
    const auto port =
        std::find_if(ports.begin(), ports.end(), [&, n = name](const PortInfo& p) { return p.name == n; });
    const NodeInfo* made_by = catalogue.find(maker);
    if (port == ports.end()) throw Error("it has no input '" + name + "'");
    if (!made_by) throw Error("there is no node '" + maker.get<std::string>() + "'");
    const KindInfo* kind = catalogue.find_kind(made_by->kind());
    kept.push_back(kind && !kind->checks.empty() ? catalogue.load_suite(kind->name).sample() : conformance::Inputs{});
    const auto output = std::find_if(made_by->outputs.begin(), made_by->outputs.end(),
                                     [&](const PortInfo& p) { return p.type == port->type; });
    if (output == made_by->outputs.end())
      throw Error(made_by->name + " gives no " + port->type.id + " for the input '" + name + "'");
    further.set(name, conformance::Subject(catalogue.load(maker)).output(kept.back(), output->name));
  }
  return further;
}

/// In the worker: a text that begins with the verdict character.
std::string measured(const Catalogue& catalogue, const NodeDefinition& node, const json& makers,
                     const OptionValues& options, const Check& check) {
  try {
    std::vector<conformance::Inputs> kept;
    const conformance::Inputs further = further_inputs(catalogue, node, makers, kept);
    const double figure = check.measure(conformance::Subject(node, options, further));
    if (check.unit.empty()) return "+";
    const std::string text =
        conformance::digits(figure) + " " + check.unit + ", limit " + conformance::digits(check.limit);
    return (figure <= check.limit ? "+" : "-") + text;
  } catch (const conformance::NotApplicable& missing) {
    return std::string("~does not apply: ") + missing.what();
  } catch (...) {
    return "-" + reason_of_exception();
  }
}

/// Runs the checks of one node, one after the other, in a worker.
class Checks {
 public:
  Checks(std::string node, json makers, json options, const TemporaryFolder& files, const std::atomic<bool>& stopped)
      : node_(std::move(node)),
        makers_(std::move(makers)),
        options_(std::move(options)),
        files_(files),
        stopped_(stopped) {}

  Outcome run(std::size_t number) {
    const bool was_fresh = !worker_;
    WorkerEnd end = ask(number);
    // An earlier check may have damaged the process. So this check is tried again in a new process.
    if (end.died && !end.is_late && !was_fresh) end = ask(number);
    if (end.is_late) return {'-', formatted("it took longer than {} s", time_limit_s())};
    if (end.signal == SIGKILL) return {'-', "its process " + end.failed};
    if (end.signal) return {'-', std::string("it crashed: ") + strsignal(end.signal)};
    if (!end.failed.empty()) return {'-', end.failed};
    const std::string text = end.answer.get<std::string>();
    return {text.at(0), text.substr(1)};
  }

 private:
  WorkerEnd ask(std::size_t number) {
    if (!worker_)
      worker_ =
          std::make_unique<Worker>(WorkerSettings{{this_program().string(), "check-worker", files_.path().string()}});
    worker_->ask({{"do", "check"}, {"node", node_}, {"in", makers_}, {"set", options_}, {"check", number}});
    const WorkerEnd end = worker_->wait({double(time_limit_s()), kMemory_mb}, &stopped_, nullptr);
    if (stopped_.load()) throw Cancelled();  // Ctrl-C in a terminal ends the worker too
    if (end.died) worker_.reset();
    return end;
  }

  std::string node_;
  json makers_;   ///< for inputs that the kind does not have: names of nodes, by port
  json options_;  ///< texts by names
  const TemporaryFolder& files_;
  const std::atomic<bool>& stopped_;
  std::unique_ptr<Worker> worker_;
};

/// The names of all nodes that are meant by the name of a node, of a kind or of a library's file.
std::vector<std::string> nodes_of(const Catalogue& catalogue, const std::string& what) {
  const auto is_meant = [&](const LibraryInfo& library) {
    std::error_code error;
    return library.file.filename() == what || std::filesystem::equivalent(library.file, what, error);
  };
  std::vector<std::string> names;
  for (const std::string& name : catalogue.node_names())
    if (name == what || name.substr(0, name.find('.')) == what || is_meant(*catalogue.library_of(name)))
      names.push_back(name);
  for (const LibraryInfo& library : catalogue.libraries()) {
    if (!library.refused.empty() && is_meant(library))
      throw Error("the library " + library.file.string() + " is not used: " + library.refused);
  }
  if (names.empty())
    throw Error("there is no node, kind or library '" + what + "'; " +
                catalogue.hint_for(what, catalogue.node_names()) + "; marrow doctor shows the folders searched");
  return names;
}

int check_worker(const std::filesystem::path& files_folder) {
  conformance::set_files_folder(files_folder);
  const Catalogue catalogue;
  return serve_worker({{"check", [&](const json& request, WorkerReports&) {
                          const std::string name = request.at("node");
                          const NodeDefinition& node = catalogue.load(name);
                          const conformance::Suite& suite = catalogue.load_suite(node.info.kind());
                          OptionValues options = given_options(node.info, request.at("set"));
                          if (suite.options) options.merge(suite.options());
                          return json(measured(catalogue, node, request.at("in"), options,
                                               conformance::checks_of(suite).at(request.at("check"))));
                        }}});
}

/// If a library is named by its file, adds its folder to the folders that this process and its workers search.
void search_folders_of(const std::vector<std::string>& subjects) {
  for (const std::string& subject : subjects) {
    std::error_code error;
    const std::filesystem::path file(subject);
    if ((file.extension() != ".so" && file.extension() != ".py") || !std::filesystem::exists(file, error)) continue;
    const char* searched = std::getenv("MARROW_PLUGIN_PATH");
    const std::string folder = std::filesystem::absolute(file).parent_path().string();
    setenv("MARROW_PLUGIN_PATH", (searched && *searched ? folder + ":" + searched : folder).c_str(), 1);
  }
}

/// The checks in the suite of a node's kind. Empty if there is no suite.
std::vector<CheckInfo> checks_for(const std::string& node, const Catalogue& catalogue) {
  const KindInfo* kind = catalogue.find_kind(catalogue.find(node)->kind());
  return kind ? kind->checks : std::vector<CheckInfo>{};
}

/// Throws Error if a wanted check is in no suite of the nodes.
void expect_known(const std::vector<std::string>& wanted, const Catalogue& catalogue,
                  const std::vector<std::string>& nodes) {
  std::vector<std::string> known;
  for (const std::string& node : nodes)
    for (const CheckInfo& check : checks_for(node, catalogue))
      if (!contains(known, check.name)) known.push_back(check.name);
  for (const std::string& name : wanted)
    if (!contains(known, name)) throw Error("there is no check '" + name + "'; " + suggestion(name, known));
}

/// Runs the wanted checks of a node, or all if none are named, and counts their verdicts. If none applies to a node
/// that was asked for by its name, that counts as a failure.
void check_node(const std::string& node, const std::vector<CheckInfo>& all, const std::vector<std::string>& wanted,
                bool is_named, Checks& checks, std::map<char, int>& count) {
  std::printf("%s\n", node.c_str());
  const int before = count['+'] + count['-'];
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!wanted.empty() && !contains(wanted, all[i].name)) continue;
    const Outcome outcome = checks.run(i);
    ++count[outcome.verdict];
    std::printf("  %s %-26s %s\n",
                outcome.verdict == '+'   ? "pass"
                : outcome.verdict == '~' ? "n/a "
                                         : "FAIL",
                all[i].name.c_str(), outcome.text.c_str());
    std::fflush(stdout);
  }
  if (!is_named || count['+'] + count['-'] > before) return;
  ++count['-'];
  std::printf("  FAIL nothing was checked\n");
}

struct ConformanceRequest {
  std::vector<std::string> subjects, checks, inputs, options;
};

/// The texts of --set by the names of options. Throws Error if none of the nodes has one of them.
json options_of(const std::vector<std::string>& given, const Catalogue& catalogue,
                const std::vector<std::string>& nodes) {
  std::vector<std::string> known;
  for (const std::string& node : nodes)
    for (const OptionInfo& option : catalogue.find(node)->options) known.push_back(option.name);
  json options = json::object();
  for (const auto& [name, text] : pairs_of(given, "option=value")) {
    if (!contains(known, name)) throw Error("there is no option '" + name + "'; " + suggestion(name, known));
    options[name] = text;
  }
  return options;
}

int run_conformance(const ConformanceRequest& request) try {
  const std::vector<std::string>&subjects = request.subjects, &wanted = request.checks;
  json makers = json::object();  // of inputs that the kind does not have: the names of nodes, by port
  for (const auto& [port, node] : pairs_of(request.inputs, "port=kind.name")) makers[port] = node;
  search_folders_of(subjects);
  const Catalogue catalogue;
  const std::atomic<bool>& stopped = stop_on_signals();
  std::vector<std::string> nodes;
  for (const std::string& subject : subjects)
    for (const std::string& node : nodes_of(catalogue, subject)) nodes.push_back(node);
  expect_known(wanted, catalogue, nodes);
  const json options = options_of(request.options, catalogue, nodes);
  const TemporaryFolder files(new_temporary_folder("conformance"));
  std::map<char, int> count;
  for (const std::string& node : nodes) {
    if (const std::vector<CheckInfo> all = checks_for(node, catalogue); !all.empty()) {
      Checks checks(node, makers, options, files, stopped);
      check_node(node, all, wanted, contains(subjects, node), checks, count);
      continue;
    }
    const std::string kind = catalogue.find(node)->kind();
    ++count['-'];
    std::printf("%s\n  FAIL nothing was checked: %s\n", printable(node).c_str(),
                printable(catalogue.find_kind(kind) ? "the kind '" + kind + "' has no suite"
                                                    : "no library brings the kind '" + kind + "'")
                    .c_str());
  }
  std::printf("%d passed, %d do not apply, %d failed\n", count['+'], count['~'], count['-']);
  return count['-'] ? 1 : 0;
} catch (const Cancelled&) {
  std::fprintf(stderr, "marrow: %s\n", stopped_text().c_str());
  return 130;
}

}  // namespace

void add_conformance(CLI::App& app, int& code) {
  const auto request = std::make_shared<ConformanceRequest>();
  CLI::App* command = app.add_subcommand("conformance", "check that nodes do what every node of their kind must do");
  command->add_option("subject", request->subjects, "node, kind or library (.so file)")->required()->type_name("NODE");
  command
      ->add_option("--check", request->checks,
                   "only this of the checks that marrow inspect NODE lists; may be given again")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--in", request->inputs,
          "port=kind.name: for an input that the kind does not have, the node that makes it; may be given again")
      ->allow_extra_args(false);
  command
      ->add_option("--set", request->options,
                   "option=value: for all of the nodes that have this option; may be given again")
      ->allow_extra_args(false);
  command->callback([request, &code] { code = run_conformance(*request); });
  say_that_libraries_are_described(command);
}

void add_check_worker(CLI::App& app, int& code) {
  const auto folder = std::make_shared<std::filesystem::path>();
  CLI::App* command = app.add_subcommand("check-worker", "take checks from the standard input; started by conformance");
  command->group("");
  command->add_option("folder", *folder, "where checks may write files")->required();
  command->callback([folder, &code] { code = check_worker(*folder); });
}

}  // namespace marrow::cli
