// SPDX-License-Identifier: Apache-2.0
// The command list: shows all nodes that can be used, those that fit a place in a pipeline, or the kinds.
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

/// The sentence in which a node with the trait "device" says which device it would compute on, or why there is none
/// (docs/plugins.md). Empty for other nodes, whose libraries are not loaded. Throws Error if the library cannot be
/// loaded.
std::string device_text(const std::string& node, const Catalogue& catalogue) {
  const std::vector<std::string>& traits = catalogue.find(node)->traits;
  if (std::find(traits.begin(), traits.end(), "device") == traits.end()) return "";
  catalogue.load(node);
  const std::filesystem::path file = std::filesystem::canonical(catalogue.library_of(node)->file);
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD);
  const auto ask = library ? reinterpret_cast<const char* (*)()>(dlsym(library, "marrow_device")) : nullptr;
  return ask ? ask() : "it does not say which device is there: its library has no function marrow_device";
}

struct ListRequest {
  std::string kind;
  std::vector<std::string> fits;  ///< FILE and NODE
  std::vector<std::string> overrides;
  bool kinds = false;
  bool as_json = false;
};

void note_refused(const Catalogue& catalogue) {
  for (const LibraryInfo& library : catalogue.libraries())
    if (!library.refused.empty())
      std::fprintf(stderr, "marrow: note: %s was refused (see 'marrow doctor')\n",
                   printable(library.file.filename().string()).c_str());
}

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
      const KindInfo* contract = catalogue.find_kind(node.kind());
      std::printf("%s", previous.empty() ? "" : "\n");
      print_beside("", printable(node.kind()) + (contract ? ": " + printable(contract->summary) : ""), 0);
      previous = node.kind();
    }
    print_beside("  " + printable(name), printable(node.summary), 37);
  }
  if (as_json) print_as_json(all);
  if (!kind.empty() && shown == 0) {
    const KindInfo* known = catalogue.find_kind(kind);
    std::fprintf(stderr, "marrow: error: no node of kind '%s'%s\n", printable(kind).c_str(),
                 known ? "" : printable("; " + suggestion(kind, catalogue.kind_names())).c_str());
    return 2;
  }
  if (!as_json) note_refused(catalogue);
  return 0;
}

int list_kinds(bool as_json) {
  const Catalogue catalogue;
  json all = json::array();
  for (const std::string& name : catalogue.kind_names()) {
    KindInfo kind;
    kind.name = name;
    kind.summary = "no library brings this kind, so its nodes have no contract";
    if (const KindInfo* known = catalogue.find_kind(name)) kind = *known;
    all.push_back(kind_json(kind));
    if (!as_json) print_beside("  " + printable(name), printable(kind.summary), 17);
  }
  if (as_json) print_as_json(all);
  if (!as_json) note_refused(catalogue);
  return 0;
}

void print_fits(const std::vector<Fit>& fits, const Catalogue& catalogue) {
  const auto section = [&](const char* title, const auto& is_in, const std::vector<std::string> Fit::*lines) {
    bool is_first = true;
    for (const Fit& fit : fits) {
      if (!is_in(fit)) continue;
      if (is_first) std::printf("\n%s\n", title);
      is_first = false;
      print_beside("  " + printable(fit.node), printable(catalogue.find(fit.node)->summary), 37);
      for (const std::string& line : fit.*lines) print_beside("   ", printable(line), 4);
      if (const std::string device = device_text(fit.node, catalogue); !device.empty())
        print_beside("   ", printable(device), 4);
    }
  };
  section(
      "Fits", [](const Fit& fit) { return fit.faults.empty() && fit.missing.empty(); }, &Fit::missing);
  section(
      "Fits when more is given", [](const Fit& fit) { return fit.faults.empty() && !fit.missing.empty(); },
      &Fit::missing);
  section(
      "Does not fit", [](const Fit& fit) { return !fit.faults.empty(); }, &Fit::faults);
}

int list_fits(const ListRequest& request) {
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const std::string &file = request.fits[0], &id = request.fits[1];
  expect_given(file, Wanted::pipeline);
  const std::vector<Fit> fits =
      nodes_in_place_of(id, file, arguments_of({file, {}, request.overrides}), catalogue, diagnostics);
  if (!diagnostics.empty()) {
    print_faults(diagnostics);
    return 2;
  }
  if (request.as_json) {
    json all = json::array();
    for (const Fit& fit : fits) {
      all.push_back(fit_json(fit));
      if (const std::string device = device_text(fit.node, catalogue); !device.empty()) all.back()["device"] = device;
    }
    print_as_json(all);
    return 0;
  }
  std::printf("In place of '%s' in %s\n", printable(id).c_str(), printable(file).c_str());
  print_fits(fits, catalogue);
  if (fits.empty()) std::printf("no other node of its kind is known, and none of another kind fits\n");
  return 0;
}

}  // namespace

void add_list(CLI::App& app, int& code) {
  const auto request = std::make_shared<ListRequest>();
  CLI::App* command = app.add_subcommand("list", "list the nodes that can be used");
  command->add_option("kind", request->kind, "only this kind")->type_name("KIND");
  command
      ->add_option("--fits", request->fits,
                   "FILE NODE: the nodes that could replace this node of a pipeline, and what they need")
      ->type_name("FILE NODE")
      ->expected(2);
  command
      ->add_option(
          "--set", request->overrides,
          "node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference in that pipeline")
      ->allow_extra_args(false);
  command->add_flag("--kinds", request->kinds, "the kinds instead of the nodes; as JSON with ports, traits and checks")
      ->excludes("kind", "--fits");
  command->add_flag("--json", request->as_json, "as JSON");
  command->callback([request, &code] {
    code = request->kinds          ? list_kinds(request->as_json)
           : request->fits.empty() ? list(request->kind, request->as_json)
                                   : list_fits(*request);
  });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
