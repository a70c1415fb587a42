// SPDX-License-Identifier: Apache-2.0
// A pipeline file with the files that it extends: the lowest first, and each puts its own over it.
#include "marrow/runtime/pipeline/pipeline_text.hpp"

#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

class PipelineReader {
 public:
  PipelineReader(const fs::path& file, const PipelineReading& reading, const Catalogue& catalogue,
                 Diagnostics& diagnostics)
      : reading_(reading), catalogue_(catalogue), diagnostics_(diagnostics) {
    pipeline_.file = file;
  }

  WrittenPipeline read_body(const std::string& name, const YAML::Node& root) {
    is_body_ = true;
    pipeline_.name = name;
    StrictYaml yaml(pipeline_.file.string(), diagnostics_);
    read_keys(pipeline_.file, root, yaml);
    return finish(yaml.place(root));
  }

  WrittenPipeline read() {
    if (!read_file(pipeline_.file)) return {};
    return finish({pipeline_.file.string(), 1, 1});
  }

 private:
  /// Returns whether the file could be read as YAML.
  bool read_file(const fs::path& file) {
    layers_.push_back(file);
    pipeline_.files.push_back(file);
    StrictYaml yaml(file.string(), diagnostics_);
    const auto text = read_source(file, "the pipeline file", diagnostics_);
    if (!text) return false;
    const std::size_t before = diagnostics_.size();
    const YAML::Node root = yaml.parse(*text);
    if (diagnostics_.size() > before) return false;
    return read_keys(file, root, yaml);
  }

  bool read_keys(const fs::path& file, const YAML::Node& root, StrictYaml& yaml) {
    static const std::vector<std::string> kOfBody{"marrow", "name",  "help",   "only_inside",
                                                  "inputs", "nodes", "outputs"};
    static const std::vector<std::string> kOfFile{"marrow", "extends", "name",    "help", "only_inside",
                                                  "inputs", "nodes",   "outputs", "set"};
    const Place start = is_body_ ? yaml.place(root) : Place{file.string(), 1, 1};
    const fs::path folder = fs::absolute(file).parent_path();
    const std::vector<YamlEntry> entries = yaml.map(root, start, "the pipeline", is_body_ ? &kOfBody : &kOfFile);
    for (const YamlEntry& entry : entries)
      if (entry.key == "extends" && !read_below(entry, yaml)) return false;
    if (!is_body_) pipeline_.name.clear();
    PipelineLayer layer{yaml, diagnostics_, folder, pipeline_.inputs, ++layer_};
    std::vector<WrittenEntry> changes;
    std::set<std::string> given;
    for (const YamlEntry& entry : entries) {
      given.insert(entry.key);
      read_key(entry, layer);
      if (entry.key == "set") changes = changes_in(entry, layer);
    }
    apply_changes(pipeline_, std::move(changes), ++layer_, diagnostics_);
    if (root.IsMap() && !given.contains("marrow") && !is_body_)
      yaml.fault(start, "the key 'marrow' is missing", "begin the file with  marrow: 1");
    has_nodes_ |= given.contains("nodes");
    has_outputs_ |= given.contains("outputs");
    is_map_ = root.IsMap();
    return true;
  }

  void read_key(const YamlEntry& entry, const PipelineLayer& layer) {
    StrictYaml& yaml = layer.yaml;
    if (entry.key == "marrow") {
      const auto version = yaml.integer(entry.value, entry.place, "marrow");
      if (version && *version != 1)
        yaml.fault(entry.place, formatted("this file is of format {}, this program reads format 1", *version));
    }
    if (entry.key == "name") {
      pipeline_.name = yaml.text(entry.value, entry.place, "name").value_or("");
      is_named_ = true;
      if (entry.value.IsScalar()) check_file_name(diagnostics_, entry.place, pipeline_.name, "a pipeline's name");
    }
    if (entry.key == "help") pipeline_.help = yaml.text(entry.value, entry.place, "help").value_or("");
    if (entry.key == "only_inside")
      pipeline_.only_inside = yaml.boolean(entry.value, entry.place, "only_inside").value_or(false);
    if (entry.key == "inputs") put_inputs_over(*pipeline_.inputs, entry, layer, catalogue_);
    if (entry.key == "nodes")
      for (const YamlEntry& node : yaml.map(entry.value, entry.place, "nodes")) put_node_over(pipeline_, node, layer);
    if (entry.key == "outputs") put_over(pipeline_.outputs, entry, "outputs", layer);
  }

  /// Reads the file below this one. Returns whether that could be read.
  bool read_below(const YamlEntry& entry, StrictYaml& yaml) {
    const auto below = extended_file(yaml, entry.value, layers_);
    const bool is_read = below && read_file(*below);
    is_named_ = false;
    return is_read;
  }

  WrittenPipeline finish(const Place& start) {
    std::vector<WrittenEntry> overrides = reading_.changes;
    apply_changes(pipeline_, std::move(overrides), ++layer_, diagnostics_);
    if (is_map_) {
      check_whole(start);
      set_inputs(*pipeline_.inputs, reading_, diagnostics_);
      put_parts_in(pipeline_, reading_, catalogue_, diagnostics_);
    }
    return std::move(pipeline_);
  }

  void check_whole(const Place& start) {
    if (!is_named_ && !is_body_) name_after_file(start);
    if (!has_nodes_)
      diagnostics_.add(start, "the key 'nodes' is missing", "name the nodes of the pipeline under it");
    else if (pipeline_.nodes.empty() && diagnostics_.empty())
      diagnostics_.add(start, "the pipeline has no nodes", "name them under  nodes:");
    if (!has_outputs_)
      diagnostics_.add(start, "the key 'outputs' is missing",
                       "name what the pipeline computes, as  outputs: {name: node}");
    for (const WrittenNode& node : pipeline_.nodes) check_slash(node);
  }

  /// node/inner is the name of a node of a body or of a part. A file that a run wrote has the nodes of parts as its
  /// own.
  void check_slash(const WrittenNode& node) {
    for (std::size_t slash = node.id.find('/'); slash != std::string::npos; slash = node.id.find('/', slash + 1))
      for (const WrittenNode& other : pipeline_.nodes)
        if (other.id == node.id.substr(0, slash))
          diagnostics_.add(node.place, "the node's name " + in_quotes(node.id) + " has a slash",
                           "slashes are for nodes of a body or of a part, as in track/edges");
  }

  void name_after_file(const Place& start) {
    pipeline_.name = pipeline_.file == "-" ? "stdin" : pipeline_.file.stem().string();
    if (const std::string fault = fault_of_name(pipeline_.name); !fault.empty())
      diagnostics_.add(start,
                       "the pipeline takes its name from its file, and " + in_quotes(pipeline_.name) +
                           " cannot name a folder, " + fault,
                       "add  name: ...");
  }

  const PipelineReading& reading_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  WrittenPipeline pipeline_;
  std::vector<fs::path> layers_;  ///< the file, and those that it extends
  int layer_ = 0;
  bool is_body_ = false, is_map_ = false, is_named_ = false, has_nodes_ = false, has_outputs_ = false;
};

}  // namespace

WrittenPipeline read_written_body(const fs::path& file, const std::string& name, const YAML::Node& body,
                                  const PipelineReading& reading, const Catalogue& catalogue,
                                  Diagnostics& diagnostics) {
  return PipelineReader(file, reading, catalogue, diagnostics).read_body(name, body);
}

WrittenPipeline read_written_pipeline(const fs::path& file, const PipelineReading& reading, const Catalogue& catalogue,
                                      Diagnostics& diagnostics) {
  return PipelineReader(file, reading, catalogue, diagnostics).read();
}

}  // namespace marrow
