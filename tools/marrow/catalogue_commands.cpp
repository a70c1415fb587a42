// SPDX-License-Identifier: Apache-2.0
// list, inspect, doctor, describe: what can be used, from manifests alone.
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/runtime/diagnostics.hpp"
#include "marrow/runtime/kinds.hpp"
#include "marrow/runtime/library.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

const char* type_name(OptionType type) {
  static constexpr const char* kNames[] = {"true/false", "integer",         "number",        "text",
                                           "path",       "list of numbers", "list of texts", "list of paths"};
  return kNames[int(type)];
}

std::string number_text(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

bool plain_scalar(const std::string& text) {
  return !text.empty() && text.find_first_of(":#{}[]&*!|>'\"%@`,$ ") == std::string::npos && text != "true" &&
         text != "false";
}

json option_json(const OptionInfo& option) {
  json j = {{"name", option.name},
            {"help", option.help},
            {"unit", option.unit},
            {"type", type_name(option.type)},
            {"required", option.required}};
  std::visit([&](const auto& value) { j["default"] = value; }, option.default_value);
  if (option.minimum) j["minimum"] = *option.minimum;
  if (option.maximum) j["maximum"] = *option.maximum;
  if (!option.choices.empty()) j["choices"] = option.choices;
  return j;
}

json node_json(const NodeInfo& node) {
  json j = {{"name", node.name},       {"summary", node.summary},  {"random", node.random},
            {"inputs", json::array()}, {"outputs", json::array()}, {"options", json::array()}};
  for (const PortInfo& port : node.inputs)
    j["inputs"].push_back({{"name", port.name},
                           {"type", port.type.id},
                           {"axis", port.axis},
                           {"optional", port.optional},
                           {"help", port.help}});
  for (const PortInfo& port : node.outputs)
    j["outputs"].push_back({{"name", port.name}, {"type", port.type.id}, {"axis", port.axis}, {"help", port.help}});
  for (const OptionInfo& option : node.options) j["options"].push_back(option_json(option));
  return j;
}

void print_ports(const char* title, const std::vector<PortInfo>& ports, bool inputs) {
  if (ports.empty()) return;
  std::printf("\n%s\n", title);
  for (const PortInfo& port : ports)
    std::printf("  %-14s %-28s %s%s\n", printable(port.name).c_str(), printable(port_text(port)).c_str(),
                inputs && port.optional ? "(optional) " : "", printable(port.help).c_str());
}

void print_snippet(const NodeInfo& node) {
  std::printf("  %s:\n    uses: %s  # %s\n", printable(node.name.substr(node.name.find('.') + 1)).c_str(),
              printable(node.name).c_str(), printable(node.summary).c_str());
  if (!node.inputs.empty()) {
    std::printf("    in:\n");
    for (const PortInfo& port : node.inputs)
      std::printf("      %s%s: %s  # %s%s: %s\n", port.optional ? "# " : "", printable(port.name).c_str(), "NODE",
                  port.optional ? "optional " : "", printable(port_text(port)).c_str(), printable(port.help).c_str());
  }
  if (node.options.empty()) return;
  std::printf("    with:\n");
  for (const OptionInfo& option : node.options)
    std::printf("      %s: %s  # %s (%s)\n", printable(option.name).c_str(),
                option.required ? "VALUE" : printable(yaml_text(option.default_value)).c_str(),
                printable(option.help).c_str(), printable(range_text(option)).c_str());
}

void print_node(const NodeInfo& node, const LibraryInfo& library) {
  std::printf("%s\n  %s\n", printable(node.name).c_str(), printable(node.summary).c_str());
  if (const Kind* kind = find_kind(node.kind()))
    std::printf("\nKind\n  %s: %s\n", kind->name.c_str(), kind->help.c_str());
  print_ports("Inputs", node.inputs, true);
  print_ports("Outputs", node.outputs, false);
  if (!node.options.empty()) std::printf("\nOptions\n");
  for (const OptionInfo& option : node.options) {
    std::printf("  %-26s %s\n", printable(option.name).c_str(), printable(option.help).c_str());
    std::printf("  %-26s %s; %s\n", "", printable(range_text(option)).c_str(),
                option.required ? "must be given" : printable("default " + yaml_text(option.default_value)).c_str());
  }
  if (node.random) std::printf("\nRandom: its result depends on the run's seed.\n");
  print_limits(node);
  std::printf("\nLibrary\n  %s\n  build id %s\n", printable(library.file.string()).c_str(),
              library.build_id.hex().c_str());
}

}  // namespace

std::string port_text(const PortInfo& port) {
  return port.axis.empty() ? port.type.id : "list of " + port.type.id + " over " + port.axis;
}

std::string yaml_text(const OptionValue& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, bool>)
          return v ? "true" : "false";
        else if constexpr (std::is_same_v<T, std::int64_t>)
          return std::to_string(v);
        else if constexpr (std::is_same_v<T, double>)
          return number_text(v);
        else if constexpr (std::is_same_v<T, std::string>)
          return plain_scalar(v) ? v : "\"" + v + "\"";
        else {
          std::string text;
          for (const auto& item : v) text += (text.empty() ? "" : ", ") + yaml_text(OptionValue(item));
          return "[" + text + "]";
        }
      },
      value);
}

/// A bound of an option's range; none where it is only what an int can hold.
std::optional<double> bound_told(const OptionInfo& option, std::optional<double> bound) {
  using Limits = std::numeric_limits<int>;
  const bool is_of_int = option.type == OptionType::integer && (bound == Limits::min() || bound == Limits::max());
  return is_of_int ? std::nullopt : bound;
}

std::string range_text(const OptionInfo& option) {
  if (!option.choices.empty()) {
    std::string text;
    for (const std::string& choice : option.choices) text += (text.empty() ? "one of: " : ", ") + choice;
    return text;
  }
  std::string text = type_name(option.type);
  if (option.length) text = std::to_string(option.length) + " numbers";
  const std::optional<double> least = bound_told(option, option.minimum), most = bound_told(option, option.maximum);
  if (least && most)
    text += ", " + number_text(*least) + " to " + number_text(*most);
  else if (least)
    text += ", at least " + number_text(*least);
  else if (most)
    text += ", at most " + number_text(*most);
  return option.unit.empty() ? text : text + " [" + option.unit + "]";
}

namespace {

int list(const std::string& kind, bool as_json) {
  const Catalogue catalogue;
  json all = json::array();
  std::string previous;
  int shown = 0;
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    if (!kind.empty() && node.kind() != kind) continue;
    ++shown;
    if (as_json) {
      all.push_back(node_json(node));
      continue;
    }
    if (node.kind() != previous) {
      const Kind* contract = find_kind(node.kind());
      std::printf("%s%s%s%s\n", previous.empty() ? "" : "\n", printable(node.kind()).c_str(), contract ? ": " : "",
                  contract ? contract->help.c_str() : "");
      previous = node.kind();
    }
    std::printf("  %-34s %s\n", printable(name).c_str(), printable(node.summary).c_str());
  }
  if (as_json) std::printf("%s\n", all.dump(1, ' ', false, json::error_handler_t::replace).c_str());
  if (!kind.empty() && shown == 0) {
    std::vector<std::string> kinds_known;
    for (const Kind& one : kinds()) kinds_known.push_back(one.name);
    std::fprintf(stderr, "marrow: error: no node of kind '%s'; %s\n", printable(kind).c_str(),
                 printable(suggestion(kind, kinds_known)).c_str());
    return 2;
  }
  if (!as_json)
    for (const LibraryInfo& library : catalogue.libraries())
      if (!library.refused.empty())
        std::fprintf(stderr, "marrow: note: %s was refused (see 'marrow doctor')\n",
                     printable(library.file.filename().string()).c_str());
  return 0;
}

int inspect(const std::string& name, bool yaml, bool as_json) {
  const Catalogue catalogue;
  const NodeInfo* node = catalogue.find(name);
  if (!node) {
    std::fprintf(stderr, "marrow: error: there is no node '%s'; %s\n", printable(name).c_str(),
                 printable(suggestion(name, catalogue.node_names())).c_str());
    return 2;
  }
  if (yaml)
    print_snippet(*node);
  else if (as_json)
    std::printf("%s\n", node_json(*node).dump(1, ' ', false, json::error_handler_t::replace).c_str());
  else
    print_node(*node, *catalogue.library_of(name));
  return 0;
}

int doctor(bool as_json) {
  const Catalogue catalogue;
  json all = {{"folders", json::array()}, {"libraries", json::array()}};
  int refused = 0;
  if (!as_json) std::printf("Folders searched, in this order (add some with MARROW_PLUGIN_PATH):\n");
  for (const auto& folder : catalogue.folders()) {
    const bool there = std::filesystem::is_directory(folder);
    all["folders"].push_back({{"path", folder.string()}, {"exists", there}});
    if (!as_json) std::printf("  %s%s\n", printable(folder.string()).c_str(), there ? "" : "  (does not exist)");
  }
  if (!as_json) std::printf("\nLibraries:\n");
  for (const LibraryInfo& library : catalogue.libraries()) {
    refused += !library.refused.empty();
    json nodes = json::array();
    std::string text;
    for (const NodeInfo& node : library.nodes) {
      nodes.push_back(node.name);
      const bool hidden = catalogue.library_of(node.name) != &library;
      text += (text.empty() ? "" : ", ") + node.name + (hidden ? " (hidden by an earlier library)" : "");
    }
    for (const WriterInfo& writer : library.writers) text += (text.empty() ? "writes " : ", writes ") + writer.type.id;
    all["libraries"].push_back({{"file", library.file.string()},
                                {"refused", library.refused},
                                {"note", library.note},
                                {"nodes", nodes},
                                {"build_id", library.build_id.hex()}});
    if (as_json) continue;
    if (library.refused.empty())
      std::printf("  good     %s: %s\n", printable(library.file.filename().string()).c_str(), printable(text).c_str());
    else
      std::printf("  REFUSED  %s: it %s\n", printable(library.file.string()).c_str(),
                  printable(library.refused).c_str());
    if (!library.note.empty()) std::printf("           note: %s\n", printable(library.note).c_str());
  }
  if (as_json)
    std::printf("%s\n", all.dump(1, ' ', false, json::error_handler_t::replace).c_str());
  else
    std::printf("\n%zu libraries, %d refused, %zu nodes\n", catalogue.libraries().size(), refused,
                catalogue.node_names().size());
  return refused ? 1 : 0;
}

int describe(const std::filesystem::path& file, bool write) {
  const LibraryInfo info = describe_library(file);
  if (!info.refused.empty()) {
    std::fprintf(stderr, "marrow: error: %s %s\n", printable(file.string()).c_str(), printable(info.refused).c_str());
    return 1;
  }
  if (write) {
    write_manifest(info);
    return 0;
  }
  json all = json::array();
  for (const NodeInfo& node : info.nodes) all.push_back(node_json(node));
  std::printf("%s\n", all.dump(1, ' ', false, json::error_handler_t::replace).c_str());
  return 0;
}

}  // namespace

void add_list(CLI::App& app, int& code) {
  const auto kind = std::make_shared<std::string>();
  const auto as_json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("list", "list the nodes that can be used");
  command->add_option("kind", *kind, "only this kind");
  command->add_flag("--json", *as_json, "as JSON");
  command->callback([kind, as_json, &code] { code = list(*kind, *as_json); });
  say_that_libraries_are_described(command);
}

void add_inspect(CLI::App& app, int& code) {
  struct Given {
    std::string node;
    bool yaml = false, as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("inspect", "show a node: inputs, outputs, options");
  command->add_option("node", given->node, "kind.name")->required();
  command->add_flag("--yaml", given->yaml, "print a snippet to paste into a pipeline");
  command->add_flag("--json", given->as_json, "as JSON");
  command->callback([given, &code] { code = inspect(given->node, given->yaml, given->as_json); });
  say_that_libraries_are_described(command);
}

void add_doctor(CLI::App& app, int& code) {
  const auto as_json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("doctor", "show the folders searched and the libraries found or refused, and why");
  command->add_flag("--json", *as_json, "as JSON");
  command->callback([as_json, &code] { code = doctor(*as_json); });
  say_that_libraries_are_described(command);
}

void add_describe(CLI::App& app, int& code) {
  const auto library = std::make_shared<std::filesystem::path>();
  const auto write = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("describe", "load one plugin library in a process of its own and print its manifest");
  command->add_option("library", *library, "the .so file")->required();
  command->add_flag("--write", *write, "write the manifest beside the library instead");
  command->callback([library, write, &code] { code = describe(*library, *write); });
}

}  // namespace marrow::cli
