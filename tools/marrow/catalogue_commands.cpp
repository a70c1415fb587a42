// SPDX-License-Identifier: Apache-2.0
// The commands inspect, doctor and describe: they show what can be used. Only describe loads a library; the others read
// manifests.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "command_options.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/conformance.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

void print_ports(const char* title, const std::vector<PortInfo>& ports, bool inputs) {
  if (ports.empty()) return;
  std::printf("\n%s\n", title);
  for (const PortInfo& port : ports) {
    print_beside(formatted("  {:<14} {:<28}", printable(port.name), printable(port_text(port))),
                 (inputs && port.optional ? "(optional) " : "") + printable(port.help), 46);
    if (!port.figures.empty()) print_beside("", "figures: " + printable(joined(port.figures, ", ")), 17);
  }
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

void print_kind(const NodeInfo& node, const KindInfo* kind) {
  if (!kind) return;
  std::printf("\nKind\n  %s: %s\n", printable(kind->name).c_str(), printable(kind->summary).c_str());
  for (const TraitInfo& trait : kind->traits)
    if (contains(node.traits, trait.name)) print_beside(" ", printable(trait.name) + ": " + printable(trait.help), 2);
}

/// The figures that `marrow conformance` measures for a node, with their limits.
void print_checks(const NodeInfo& node, const KindInfo* kind) {
  if (!kind || kind->checks.empty()) return;
  std::printf("\nConformance (marrow conformance %s)\n", printable(node.name).c_str());
  for (const CheckInfo& check : kind->checks) {
    const std::string limit =
        check.unit.empty() ? "" : ": at most " + conformance::digits(check.limit) + " " + check.unit;
    print_beside("  " + printable(check.name), printable(check.what + limit), 29);
  }
}

void print_node(const NodeInfo& node, const LibraryInfo& library, const KindInfo* kind) {
  std::printf("%s\n", printable(node.name).c_str());
  print_beside(" ", printable(node.summary), 2);
  print_kind(node, kind);
  print_ports("Inputs", node.inputs, true);
  print_ports("Outputs", node.outputs, false);
  if (!node.options.empty()) std::printf("\nOptions\n");
  for (const OptionInfo& option : node.options) {
    print_beside("  " + printable(option.name), printable(option.help), 29);
    print_beside("",
                 printable(range_text(option) + "; " +
                           (option.required ? "must be given" : "default " + yaml_text(option.default_value))),
                 29);
    if (!option.replaces.empty()) print_beside("", printable(replaces_text(option)), 29);
  }
  if (node.random) std::printf("\nRandom: its result depends on the run's seed.\n");
  print_checks(node, kind);
  std::printf("\nLibrary\n  %s\n  build id %s\n", printable(library.file.string()).c_str(),
              library.build_id.hex().c_str());
}

int inspect(const std::string& name, bool yaml, bool as_json) {
  if (name.ends_with(".yaml") || name.ends_with(".yml")) {
    if (yaml) throw Error("--yaml prints a snippet for a node, and '" + printable(name) + "' is a pipeline");
    return inspect_pipeline(name, as_json);
  }
  const Catalogue catalogue;
  const NodeInfo* node = catalogue.find(name);
  if (!node) {
    std::fprintf(stderr, "marrow: error: there is no node '%s'; %s\n", printable(name).c_str(),
                 printable(catalogue.hint_for(name, catalogue.node_names())).c_str());
    return 2;
  }
  if (yaml)
    print_snippet(*node);
  else if (as_json)
    print_as_json(node_json(*node));
  else
    print_node(*node, *catalogue.library_of(name), catalogue.find_kind(node->kind()));
  return 0;
}

int doctor(bool as_json) {
  const Catalogue catalogue;
  json all = {{"folders", json::array()}, {"libraries", json::array()}, {"not_built", json::array()}};
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
    json kinds = json::array(), nodes = json::array();
    std::string text;
    for (const KindInfo& kind : library.kinds) {
      if (kind.is_suite) {
        text += (text.empty() ? "the suite of the kind " : ", the suite of the kind ") + kind.name;
        continue;
      }
      kinds.push_back(kind.name);
      const bool hidden = catalogue.library_of_kind(kind.name) != &library;
      text +=
          (text.empty() ? "the kind " : ", the kind ") + kind.name + (hidden ? " (hidden by an earlier library)" : "");
    }
    for (const NodeInfo& node : library.nodes) {
      nodes.push_back(node.name);
      const bool hidden = catalogue.library_of(node.name) != &library;
      text += (text.empty() ? "" : ", ") + node.name + (hidden ? " (hidden by an earlier library)" : "");
    }
    for (const WriterInfo& writer : library.writers) text += (text.empty() ? "writes " : ", writes ") + writer.type.id;
    all["libraries"].push_back({{"file", library.file.string()},
                                {"refused", library.refused},
                                {"note", library.note},
                                {"kinds", kinds},
                                {"nodes", nodes},
                                {"build_id", library.build_id.hex()}});
    if (as_json) continue;
    if (library.refused.empty())
      print_beside("  good", printable(library.file.filename().string() + ": " + text), 11);
    else
      print_beside("  REFUSED", printable(library.file.string() + ": it " + library.refused), 11);
    if (!library.note.empty()) print_beside("", "note: " + printable(library.note), 11);
  }
  for (const auto& [node, option] : catalogue.not_built())
    all["not_built"].push_back({{"node", node}, {"option", option}});
  if (!as_json && !catalogue.not_built().empty()) {
    std::printf("\nNot built (configure marrow with the option to have them):\n");
    for (const auto& [node, option] : catalogue.not_built())
      std::printf("  %s: %s\n", printable(node).c_str(), printable(option).c_str());
  }
  if (as_json)
    print_as_json(all);
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
  print_as_json(all);
  return 0;
}

}  // namespace

void add_inspect(CLI::App& app, int& code) {
  struct Given {
    std::string node;
    bool yaml = false, as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("inspect", "show a node or a pipeline: inputs, outputs, options");
  command->add_option("node", given->node, "kind.name, or a pipeline file (YAML)")->required()->type_name("NODE");
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
  CLI::App* command = app.add_subcommand("describe", "load one plugin library and print its manifest");
  command->add_option("library", *library, "the .so file, or a .py file with @marrow.node")
      ->required()
      ->type_name("FILE");
  command->add_flag("--write", *write, "write the manifest beside the library instead");
  command->callback([library, write, &code] { code = describe(*library, *write); });
}

}  // namespace marrow::cli
