// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/domain/printable.hpp"
#include "projects.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

struct NewRequest {
  std::string name, from;
  fs::path out;
  bool in_python = false;
};

using Make = fs::path (*)(const NewRequest&);

/// Adds `marrow new WHAT`. `next` is printed after the place of what was made; {} stands for it.
CLI::App* add_what(CLI::App* command, const std::string& what, const std::string& help, const std::string& name_help,
                   const std::string& next, Make make, int& code) {
  const auto request = std::make_shared<NewRequest>();
  CLI::App* sub = command->add_subcommand(what, help);
  sub->add_option("name", request->name, name_help)->required();
  sub->add_option("--out", request->out, "where it is put; by default here, under its name");
  sub->callback([request, next, make, &code] {
    const std::string place = printable(make(*request).string());
    const std::string python = "{}/ci tests it, and compares it with marrow's own";  // there is nothing to build
    std::string text = "made " + place + "\n" + (request->in_python ? python : next);
    for (std::size_t at; (at = text.find("{}")) != std::string::npos;) text.replace(at, 2, place);
    std::printf("%s\n", text.c_str());
    code = 0;
  });
  if (what == "node") sub->add_flag("--python", request->in_python, "in Python, which needs no build");
  if (what == "pipeline" || what == "experiment") {
    request->from = what == "pipeline" ? "simulated-femur" : "demo";
    sub->add_option("--from", request->from, "the file to start from: one of marrow's own by its name, or any file")
        ->capture_default_str();
  }
  return sub;
}

}  // namespace

void add_new(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand(
      "new", "make the files of a new node, kind, pipeline, experiment or case, which work as they are");
  command->require_subcommand(1);
  add_what(
      command, "node", "a node in C++ or Python, with a test of a value, a pipeline that uses it and a comparison",
      "KIND.NAME", "{}/ci builds it, tests it, and compares it with marrow's own",
      [](const NewRequest& r) { return r.in_python ? new_python_node(r.name, r.out) : new_node(r.name, r.out); }, code);
  add_what(
      command, "kind", "a kind with its checks, a first node, a pipeline that uses it and a comparison", "NAME",
      "{}/ci builds it, tests it, and compares variants", [](const NewRequest& r) { return new_kind(r.name, r.out); },
      code);
  add_what(
      command, "pipeline", "a pipeline, as a copy of one of marrow's own", "NAME", "marrow check {}",
      [](const NewRequest& r) { return new_pipeline(r.name, r.from, r.out); }, code);
  add_what(
      command, "experiment", "an experiment for marrow compare, as a copy of one of marrow's own", "NAME",
      "marrow compare {} --dry-run", [](const NewRequest& r) { return new_experiment(r.name, r.from, r.out); }, code);
  add_what(
      command, "case", "the folder of a patient, to which CT and images are added", "NAME",
      "put the CT and the images there, and correct {}/case.yaml",
      [](const NewRequest& r) { return new_case(r.name, r.out); }, code);
}

}  // namespace marrow::cli
