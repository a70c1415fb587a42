// SPDX-License-Identifier: Apache-2.0
// New nodes and kinds: a folder with source, test, pipeline and comparison, from the templates of the kind.
#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/base/yaml.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"
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

/// The kinds whose folder of templates has `below`; all of them if that is empty.
std::vector<std::string> kinds_with_templates(const fs::path& below = {}) {
  std::vector<std::string> kinds;
  for (const fs::directory_entry& entry : fs::directory_iterator(shared_files("nodes")))
    if (fs::exists(entry.path() / below)) kinds.push_back(entry.path().filename().string());
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

std::string whole_pipeline() {
  return read_text_file(shared_files("pipelines/femur/simulated-femur.yaml"), kMostSourceBytes);
}

/// The name of the node that the pipeline uses at `place`.
std::string node_at(const std::string& pipeline, const std::string& place) {
  const std::string key = "uses: ";
  const std::size_t begin = pipeline.find(key, line_of_node(pipeline, place)) + key.size();
  return pipeline.substr(begin, pipeline.find_first_of(",}\n", begin) - begin);
}

/// A node to be made: its names, and the node that it replaces in the pipeline.
struct NewNode {
  std::string name, kind, own, file, origin, place, before, link;
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
    before = node_at(whole_pipeline(), place);
  }

  /// The files of a folder of templates, and a pipeline with the new node in it.
  Files files_from(const fs::path& templates) const {
    Files files = filled_templates(templates, {{"@node@", name},
                                               {"@name@", own},
                                               {"@kind@", kind},
                                               {"@folder@", file},
                                               {"@link@", link},
                                               {"@place@", place},
                                               {"@replaced@", before},
                                               {"@origin@", origin}});
    std::string pipeline = whole_pipeline();
    const std::size_t at = pipeline.find("uses: " + before, line_of_node(pipeline, place));
    files["pipeline.yaml"] = pipeline.replace(at, 6 + before.size(), "uses: " + name);
    return files;
  }
};

}  // namespace

fs::path new_node(const std::string& name, const fs::path& folder) {
  const NewNode node(name);
  Files files = node.files_from(shared_files("templates/node"));
  files[node.file + ".cpp"] = replaced(read_text_file(node.from / "node.cpp", kMostSourceBytes), {{node.origin, name}});
  files["test.cpp"] = replaced(read_text_file(node.from / "test.cpp", kMostSourceBytes),
                               {{node.kind + ".new_node", name}, {"NewNode", capitalised(node.own)}});
  return write_project(folder, node.file, files);
}

fs::path new_python_node(const std::string& name, const fs::path& folder) {
  const NewNode node(name);
  if (!fs::exists(node.from / "python"))
    throw Error("the kind '" + node.kind +
                "' has no template in Python; leave out --python for one in C++, or take one of " +
                joined(kinds_with_templates("python"), ", "));
  Files files = node.files_from(shared_files("templates/python-node"));
  const Replacements names{{"new_node_file", node.file},  // the longest is replaced first
                           {node.kind + ".new_node", name},
                           {"new_node", node.file},
                           {"NewNode", capitalised(node.own)}};
  files[node.file + ".py"] = replaced(read_text_file(node.from / "python/node.py", kMostSourceBytes), names);
  files["test.py"] = replaced(read_text_file(node.from / "python/test.py", kMostSourceBytes), names);
  return write_project(folder, node.file, files);
}

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
  std::string pipeline = whole_pipeline();
  const std::size_t edges = line_of_node(pipeline, "edges");
  const std::string wire = "view: case.views";
  pipeline.replace(pipeline.find(wire, edges), wire.size(), "view: filtered");
  pipeline.insert(edges, "  filtered:  {uses: " + name + ".median, in: {view: case.views}}\n");
  files["pipeline.yaml"] = pipeline;
  return write_project(folder, name, files);
}

}  // namespace marrow::cli
