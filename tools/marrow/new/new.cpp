// SPDX-License-Identifier: Apache-2.0
// `marrow new`: nodes and kinds are made by node_project.cpp, the others here.
//
// New nodes and kinds: a folder with source, test, pipeline and comparison, from the templates of the kind.
#include <algorithm>
#include <cstdio>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/yaml.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "report/report.hpp"
#include "templates.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

/// my_node -> MyNode
std::string capitalised(const std::string& name) {
  std::string result;
  bool begins = true;
  for (const char c : name) {
    if (c != '_') result += begins ? char(std::toupper(c)) : c;
    begins = c == '_';
  }
  return result;
}

std::vector<std::string> kinds_with_templates() {
  std::vector<std::string> kinds;
  for (const fs::directory_entry& entry : fs::directory_iterator(shared_files("nodes")))
    kinds.push_back(entry.path().filename().string());
  std::sort(kinds.begin(), kinds.end());
  return kinds;
}

void expect_template(const std::string& kind, const Catalogue& catalogue) {
  const std::vector<std::string> kinds = kinds_with_templates();
  if (contains(kinds, kind)) return;
  const std::vector<std::string> known = catalogue.kind_names();
  if (!contains(known, kind))
    throw Error("no library brings the kind '" + kind + "'; make it by: marrow new kind " + kind + "; or " +
                suggestion(kind, known));
  throw Error("the kind '" + kind + "' has no template; there are templates of " + joined(kinds, ", ") +
              ". Copy a node of this kind, or the example-plugin of the documentation");
}

/// Where the line of a node begins in the text of a pipeline.
std::size_t line_of_node(const std::string& pipeline, const std::string& place) {
  const std::size_t at = pipeline.find("\n  " + place + ":");
  if (at == std::string::npos) throw Error("the template's pipeline has no node '" + place + "'");
  return at + 1;
}

constexpr const char* kPipeline = "femur/simulated-femur.yaml";

std::string shared_pipeline(const std::string& name) {
  return read_text_file(shared_files(fs::path("pipelines") / name), kMostSourceBytes);
}

/// The name of the node that the pipeline uses at `place`.
std::string node_at(const std::string& pipeline, const std::string& place) {
  const std::string key = "uses: ";
  const std::size_t begin = pipeline.find(key, line_of_node(pipeline, place)) + key.size();
  return pipeline.substr(begin, pipeline.find_first_of(",}\n", begin) - begin);
}

/// What `ci` does at last, and how the README says it.
struct LastStep {
  std::string command, text, row;
};

/// A comparison, or where there are no figures to compare, a run.
LastStep last_step(bool is_compared, const std::string& replaced) {
  if (!is_compared) return {"marrow run pipeline.yaml", "runs it in a pipeline", ""};
  return {"marrow compare compare.yaml", "compares it with " + replaced,
          "| `compare.yaml` | the node beside " + replaced + ", case by case |\n"};
}

/// A node to be made: its names, and the node that it replaces in the pipeline.
struct NewNode {
  std::string name, kind, own, file, origin, place, pipeline, before, link;
  bool brings_pipeline = false;  ///< whether the templates of its kind have a file pipeline.yaml
  LastStep last;
  fs::path from;  ///< the templates of its kind

  explicit NewNode(const std::string& wanted) : name(wanted) {
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos) throw Error("new node '" + name + "': expected KIND.NAME, such as edges.mine");
    kind = name.substr(0, dot), own = name.substr(dot + 1), file = kind + "_" + own;
    expect_name(kind, "new node: the kind");
    expect_name(own, "new node: the name");
    const Catalogue catalogue;
    if (catalogue.find(name)) throw Error("a node '" + name + "' exists already; choose another name");
    expect_template(kind, catalogue);
    from = shared_files("nodes") / kind;
    const YAML::Node about = parse_yaml(read_text_file(from / "template.yaml", kMostSourceBytes));
    origin = about["node"].as<std::string>(), place = about["place"].as<std::string>();
    for (const YAML::Node& library : about["link"]) link += (link.empty() ? " LINK " : " ") + library.as<std::string>();
    pipeline = about["pipeline"] ? about["pipeline"].as<std::string>() : kPipeline;
    brings_pipeline = bool(about["replaces"]);
    before = brings_pipeline ? about["replaces"].as<std::string>() : node_at(shared_pipeline(pipeline), place);
    last = last_step(!about["compare"] || about["compare"].as<bool>(), before);
  }

  /// The files of a folder of templates, and a pipeline with the new node in it. Files that the kind's templates bring
  /// take the place of these.
  Files files_from(const fs::path& templates) const {
    const Replacements names{{"@node@", name},
                             {"@name@", own},
                             {"@kind@", kind},
                             {"@folder@", file},
                             {"@link@", link},
                             {"@place@", place},
                             {"@pipeline@", shared_files(fs::path("pipelines") / pipeline).string()},
                             {"@replaced@", before},
                             {"@origin@", origin},
                             {"@last_command@", last.command},
                             {"@last_step@", last.text},
                             {"@row_of_compare@\n", last.row}};
    Files files = filled_templates(templates, names);
    if (last.row.empty()) files.erase("compare.yaml");
    if (!brings_pipeline) files["pipeline.yaml"] = pipeline_with_node();
    for (const fs::path& own_files :
         {from / "files", templates.filename() == "python-node" ? from / "python/files" : ""})
      if (fs::is_directory(own_files))
        for (auto& [file_name, text] : filled_templates(own_files, names)) files[file_name] = text;
    return files;
  }

  std::string pipeline_with_node() const {
    std::string text = shared_pipeline(pipeline);
    const std::size_t at = text.find("uses: " + before, line_of_node(text, place));
    return text.replace(at, 6 + before.size(), "uses: " + name);
  }
};

/// Makes a folder with a node KIND.NAME, its test and a comparison. Empty `folder`: KIND_NAME here. Returns the folder.
fs::path new_node(const std::string& name, const fs::path& folder) {
  const NewNode node(name);
  Files files = node.files_from(shared_files("templates/node"));
  files[node.file + ".cpp"] = replaced(read_text_file(node.from / "node.cpp", kMostSourceBytes), {{node.origin, name}});
  files["test.cpp"] = replaced(read_text_file(node.from / "test.cpp", kMostSourceBytes),
                               {{node.kind + ".new_node", name}, {"NewNode", capitalised(node.own)}});
  return write_project(folder, node.file, files);
}

/// The same with a node in Python, which needs no build.
fs::path new_python_node(const std::string& name, const fs::path& folder) {
  const NewNode node(name);
  Files files = node.files_from(shared_files("templates/python-node"));
  const Replacements names{{"new_node_file", node.file},  // the longest is replaced first
                           {node.kind + ".new_node", name},
                           {"new_node", node.file},
                           {"NewNode", capitalised(node.own)}};
  files[node.file + ".py"] = replaced(read_text_file(node.from / "python/node.py", kMostSourceBytes), names);
  files["test.py"] = replaced(read_text_file(node.from / "python/test.py", kMostSourceBytes), names);
  return write_project(folder, node.file, files);
}

/// Makes a folder with a kind, its checks and two nodes, as docs/example-kind has them.
fs::path new_kind(const std::string& name, const fs::path& folder) {
  expect_name(name, "new kind:");
  if (contains(Catalogue().kind_names(), name))
    throw Error("a kind '" + name + "' exists already; a node of it: marrow new node " + name + ".mine");
  Files files = filled_templates(shared_files("templates/kind"),
                                 {{"@kind@", name}, {"new_kind", name}, {"NewKind", capitalised(name)}});
  for (const char* source : {"kind.cpp", "nodes.cpp"})
    files[source] =
        replaced(read_text_file(shared_files("example-kind") / source, kMostSourceBytes), {{"denoise", name}});
  // The views go through the new node before their edges are looked for.
  std::string pipeline = shared_pipeline(kPipeline);
  const std::size_t edges = line_of_node(pipeline, "edges");
  const std::string wire = "view: case.views";
  pipeline.replace(pipeline.find(wire, edges), wire.size(), "view: filtered");
  pipeline.insert(edges, "  filtered:  {uses: " + name + ".median, in: {view: case.views}}\n");
  files["pipeline.yaml"] = pipeline;
  return write_project(folder, name, files);
}

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
