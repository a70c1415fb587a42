// SPDX-License-Identifier: Apache-2.0
// New nodes and kinds: a folder with source, test, pipeline and comparison, from the templates of the kind.
#include <algorithm>

#include "marrow/domain/error.hpp"
#include "marrow/domain/names.hpp"
#include "marrow/domain/yaml.hpp"
#include "marrow/runtime/catalogue.hpp"
#include "projects.hpp"
#include "runtime/text_file.hpp"
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
  if (std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) return;
  std::string list;
  for (const std::string& one : kinds) list += (list.empty() ? "" : ", ") + one;
  const std::vector<std::string> known = catalogue.kind_names();
  if (std::find(known.begin(), known.end(), kind) == known.end())
    throw Error("no library brings the kind '" + kind + "'; make it by: marrow new kind " + kind + "; or " +
                suggestion(kind, known));
  throw Error("the kind '" + kind + "' has no template, because it has no checks; there are templates of " + list +
              ". Copy a node of this kind, or the example-plugin of the documentation");
}

/// Where the line of a node begins in the text of a pipeline.
std::size_t line_of_node(const std::string& pipeline, const std::string& place) {
  const std::size_t at = pipeline.find("\n  " + place + ":");
  if (at == std::string::npos) throw Error("the template's pipeline has no node '" + place + "'");
  return at + 1;
}

std::string whole_pipeline() {
  return read_text_file(shared_files("pipelines/simulated-femur.yaml"), kMostSourceBytes);
}

/// The name of the node that the pipeline uses at `place`.
std::string node_at(const std::string& pipeline, const std::string& place) {
  const std::string key = "uses: ";
  const std::size_t begin = pipeline.find(key, line_of_node(pipeline, place)) + key.size();
  return pipeline.substr(begin, pipeline.find_first_of(",}\n", begin) - begin);
}

}  // namespace

fs::path new_node(const std::string& name, const fs::path& folder) {
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos) throw Error("new node '" + name + "': expected KIND.NAME, such as edges.mine");
  const std::string kind = name.substr(0, dot), own = name.substr(dot + 1), file = kind + "_" + own;
  expect_name(kind, "new node: the kind");
  expect_name(own, "new node: the name");
  const Catalogue catalogue;
  if (catalogue.find(name)) throw Error("a node '" + name + "' exists already; choose another name");
  expect_template(kind, catalogue);
  const fs::path from = shared_files("nodes") / kind;
  const YAML::Node about = parse_yaml(read_text_file(from / "template.yaml", kMostSourceBytes));
  const std::string origin = about["node"].as<std::string>(), place = about["place"].as<std::string>();
  std::string link;
  for (const YAML::Node& library : about["link"]) link += (link.empty() ? " LINK " : " ") + library.as<std::string>();
  std::string pipeline = whole_pipeline();
  const std::string before = node_at(pipeline, place);
  Files files = filled_templates(shared_files("templates/node"), {{"@node@", name},
                                                                  {"@name@", own},
                                                                  {"@kind@", kind},
                                                                  {"@folder@", file},
                                                                  {"@link@", link},
                                                                  {"@place@", place},
                                                                  {"@replaced@", before},
                                                                  {"@origin@", origin}});
  files[file + ".cpp"] = replaced(read_text_file(from / "node.cpp", kMostSourceBytes), {{origin, name}});
  files["test.cpp"] = replaced(read_text_file(from / "test.cpp", kMostSourceBytes),
                               {{kind + ".new_node", name}, {"NewNode", capitalised(own)}});
  files["pipeline.yaml"] = pipeline.replace(pipeline.find("uses: " + before, line_of_node(pipeline, place)),
                                            6 + before.size(), "uses: " + name);
  const fs::path target = folder.empty() ? fs::path(file) : folder;
  write_project(target, files);
  return target;
}

fs::path new_kind(const std::string& name, const fs::path& folder) {
  expect_name(name, "new kind:");
  const std::vector<std::string> known = Catalogue().kind_names();
  if (std::find(known.begin(), known.end(), name) != known.end())
    throw Error("a kind '" + name + "' exists already; a node of it: marrow new node " + name + ".mine");
  Files files = filled_templates(shared_files("templates/kind"),
                                 {{"@kind@", name}, {"new_kind", name}, {"NewKind", capitalised(name)}});
  // The views go through the new node before their edges are looked for.
  std::string pipeline = whole_pipeline();
  const std::size_t edges = line_of_node(pipeline, "edges");
  const std::string wire = "view: case.views";
  pipeline.replace(pipeline.find(wire, edges), wire.size(), "view: filtered");
  pipeline.insert(edges, "  filtered:  {uses: " + name + ".median, in: {view: case.views}}\n");
  files["pipeline.yaml"] = pipeline;
  const fs::path target = folder.empty() ? fs::path(name) : folder;
  write_project(target, files);
  return target;
}

}  // namespace marrow::cli
