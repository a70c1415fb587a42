// SPDX-License-Identifier: Apache-2.0
// `marrow new`: nodes and kinds are made by node_project.cpp, the others here.
#include <algorithm>
#include <cstdio>

#include "command_options.hpp"
#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "report/report.hpp"
#include "templates.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

struct NewRequest {
  std::string name, from;
  fs::path out;
  bool in_python = false;
};

/// What was made, and the next step. {} is replaced by its place, as a word of a shell.
struct Made {
  fs::path place;
  std::string next;
};
using Make = Made (*)(const NewRequest&);

/// A command `marrow new WHAT`, for further options.
struct NewCommand {
  CLI::App* app;
  std::shared_ptr<NewRequest> request;

  void add_from(const std::string& otherwise) const {
    request->from = otherwise;
    app->add_option("--from", request->from, "the file to start from: one of marrow's own by its name, or any file")
        ->capture_default_str();
  }
};

NewCommand add_what(CLI::App* command, const std::string& what, const std::string& help, const std::string& name_help,
                    Make make, int& code) {
  const NewCommand made{command->add_subcommand(what, help), std::make_shared<NewRequest>()};
  made.app->add_option("name", made.request->name, name_help)->required();
  made.app->add_option("-o,--out", made.request->out, "where to put it (default: here, under its name)")
      ->type_name("PATH");
  made.app->callback([request = made.request, make, &code] {
    const Made done = make(*request);
    std::string next = done.next;
    next.replace(next.find("{}"), 2, shell_path(done.place));
    std::printf("made %s\n%s\n", printable(done.place.string()).c_str(), next.c_str());
    code = 0;
  });
  return made;
}

/// The folders of marrow's own pipelines, one for each family. The YAML files of networks are no pipelines.
std::vector<fs::path> families() {
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(shared_files("pipelines")))
    if (const fs::path name = entry.path().filename();
        entry.is_directory() && name != "experiments" && name != "networks")
      found.push_back(entry.path());
  return found;
}

/// An existing file, or one of marrow's own in these folders, with or without .yaml.
fs::path file_named(const std::string& from, const std::vector<fs::path>& folders) {
  if (fs::is_regular_file(from)) return from;
  std::vector<std::string> known;
  for (const fs::path& folder : folders)
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      const fs::path& path = entry.path();
      if (path.extension() != ".yaml") continue;
      if (path.filename() == from || path.stem() == from) return path;
      known.push_back(path.stem().string());
    }
  std::sort(known.begin(), known.end());
  throw Error("--from '" + printable(from) + "': neither a file here nor one of marrow's own; " +
              suggestion(from, known));
}

fs::path copy(const std::string& name, const fs::path& from, const fs::path& file) {
  expect_name(name, "the name");
  const fs::path target = file.empty() ? fs::path(name + ".yaml") : file;
  expect_free(target);
  const fs::path folder = fs::absolute(target).parent_path();
  if (!fs::is_directory(folder)) throw Error(printable(folder.string()) + ": there is no such folder; make it first");
  write_text_file(target, moved_text(from, folder));
  return target;
}

/// A network that finds edges, its training, and a registration of simulated data that uses it.
fs::path network_folder(const std::string& name, const fs::path& folder) {
  expect_name(name, "new network: the name");
  Files files = filled_templates(
      shared_files("templates/network"),
      {{"@name@", name}, {"@pipeline@", shared_files("pipelines/femur/simulated-femur.yaml").string()}});
  auto description = files.extract("network.yaml");
  description.key() = name + ".yaml";
  files.insert(std::move(description));
  return write_project(folder, name, files);
}

fs::path new_case(const std::string& name, const fs::path& folder) {
  if (name.empty() || name.find('/') != std::string::npos)
    throw Error("new case '" + printable(name) + "': expected the name of a folder; its place is given with --out");
  return write_project(folder, name, filled_templates(shared_files("templates/case"), {}));
}

Made make_node(const NewRequest& r) {
  if (r.in_python) return {new_python_node(r.name, r.out), "{}/ci tests it, and tries it in a pipeline"};
  return {new_node(r.name, r.out), "{}/ci builds it, tests it, and tries it in a pipeline"};
}
Made make_kind(const NewRequest& r) {
  return {new_kind(r.name, r.out), "{}/ci builds it, tests it, and compares variants"};
}
Made make_network(const NewRequest& r) {
  return {network_folder(r.name, r.out), "{}/ci trains the network, and tries it in a pipeline"};
}
Made make_pipeline(const NewRequest& r) {
  return {copy(r.name, file_named(r.from, families()), r.out), "marrow check {}"};
}
Made make_experiment(const NewRequest& r) {
  return {copy(r.name, file_named(r.from, {shared_files("pipelines/experiments")}), r.out),
          "marrow compare {} --dry-run"};
}
Made make_case(const NewRequest& r) {
  return {new_case(r.name, r.out), "put the CT and the images there, and correct {}/case.yaml"};
}

}  // namespace

void add_new(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand(
      "new", "make the files of a new node, kind, network, pipeline, experiment or case, which work as they are");
  command->require_subcommand(1);
  const NewCommand node = add_what(
      command, "node", "a node in C++ or Python, with a test of a value, a pipeline that uses it and a comparison",
      "KIND.NAME", make_node, code);
  node.app->add_flag("--python", node.request->in_python, "in Python, which needs no build");
  add_what(command, "kind", "a kind with its checks, two nodes, a pipeline that uses it and a comparison", "NAME",
           make_kind, code);
  add_what(command, "network",
           "a network of your own: its training by PyTorch, its description and a pipeline that uses it", "NAME",
           make_network, code);
  add_what(command, "pipeline", "a pipeline, as a copy of one of marrow's own", "NAME", make_pipeline, code)
      .add_from("simulated-femur");
  add_what(command, "experiment", "an experiment for marrow compare, as a copy of one of marrow's own", "NAME",
           make_experiment, code)
      .add_from("demo");
  add_what(command, "case", "the folder of a patient, to which CT and images are added", "NAME", make_case, code);
}

}  // namespace marrow::cli
