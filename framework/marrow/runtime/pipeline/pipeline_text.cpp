// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_text.hpp"

#include <algorithm>

#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_path.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/option_yaml.hpp"
#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

class PipelineReader {
 public:
  PipelineReader(const fs::path& file, const PipelineArguments& arguments, Diagnostics& diagnostics,
                 bool inputs_required)
      : arguments_(arguments),
        diagnostics_(diagnostics),
        inputs_required_(inputs_required),
        yaml_(file.string(), diagnostics) {
    pipeline_.file = file;
    folder_ = fs::absolute(file).parent_path();
  }

  WrittenPipeline read_body(const std::string& name, const YAML::Node& root) {
    is_body_ = true;
    pipeline_.name = name;
    return read_root(root);
  }

  WrittenPipeline read() {
    const auto text = read_source(pipeline_.file, "the pipeline file", diagnostics_);
    if (!text) return pipeline_;
    const YAML::Node root = yaml_.parse(*text);
    return diagnostics_.empty() ? read_root(root) : pipeline_;
  }

 private:
  WrittenPipeline read_root(const YAML::Node& root) {
    read_keys(root);
    for (const Override& one : arguments_.overrides) apply_override(one.key, one.value, one.place);
    return pipeline_;
  }

  void read_keys(const YAML::Node& root) {
    static const std::vector<std::string> kKeys{"marrow", "name", "help", "only_inside", "inputs", "nodes", "outputs"};
    const Place start = is_body_ ? yaml_.place(root) : Place{pipeline_.file.string(), 1, 1};
    bool versioned = false, has_name = false, has_nodes = false, has_outputs = false;
    for (const YamlEntry& entry : yaml_.map(root, start, "the pipeline", &kKeys)) {
      if (entry.key == "marrow") {
        versioned = true;
        const auto version = yaml_.integer(entry.value, entry.place, "marrow");
        if (version && *version != 1)
          yaml_.fault(entry.place, formatted("this file is of format {}, this program reads format 1", *version));
      }
      if (entry.key == "name") {
        has_name = true;
        pipeline_.name = yaml_.text(entry.value, entry.place, "name").value_or("");
        if (entry.value.IsScalar()) check_file_name(diagnostics_, entry.place, pipeline_.name, "a pipeline's name");
      }
      if (entry.key == "help") pipeline_.help = yaml_.text(entry.value, entry.place, "help").value_or("");
      if (entry.key == "only_inside")
        pipeline_.only_inside = yaml_.boolean(entry.value, entry.place, "only_inside").value_or(false);
      if (entry.key == "inputs") read_inputs(entry);
      if (entry.key == "nodes") {
        has_nodes = true;
        for (const YamlEntry& node : yaml_.map(entry.value, entry.place, "nodes")) read_node(node);
      }
      if (entry.key == "outputs") {
        has_outputs = true;
        for (const YamlEntry& output : yaml_.map(entry.value, entry.place, "outputs"))
          pipeline_.outputs.push_back({output.key, {output.place, output.value, folder_}});
      }
    }
    if (!root.IsMap()) return;
    if (!has_name && !is_body_) name_after_file(start);
    if (!versioned && !is_body_) yaml_.fault(start, "the key 'marrow' is missing", "begin the file with  marrow: 1");
    if (!has_nodes)
      yaml_.fault(start, "the key 'nodes' is missing", "name the nodes of the pipeline under it");
    else if (pipeline_.nodes.empty() && diagnostics_.empty())
      yaml_.fault(start, "the pipeline has no nodes", "name them under  nodes:");
    if (!has_outputs)
      yaml_.fault(start, "the key 'outputs' is missing",
                  "name what the pipeline is to compute, as  outputs: {name: node}");
    check_given_inputs();
  }

  void name_after_file(const Place& start) {
    pipeline_.name = pipeline_.file.stem().string();
    if (const std::string fault = fault_of_name(pipeline_.name); !fault.empty())
      yaml_.fault(start,
                  "the pipeline takes its name from its file, and " + in_quotes(pipeline_.name) +
                      " cannot name a folder, " + fault,
                  "add  name: ...");
  }

  void read_inputs(const YamlEntry& section) {
    static const std::vector<std::string> kKeys{"type", "default", "help"};
    static const std::vector<std::string> kTypes{"path", "text", "number", "integer", "boolean"};
    for (const YamlEntry& input : yaml_.map(section.value, section.place, "inputs")) {
      declared_.push_back(input.key);
      pipeline_.input_places[input.key] = input.place;
      OptionInfo info;
      info.type = OptionType::text;
      WrittenValue value;
      bool given = false, may_be_empty = false;
      const auto give = [&](const Place& place, const YAML::Node& node, const fs::path& folder) {
        given = true;
        value.place = place;
        value.value.reset(node);
        value.folder = folder;
      };
      for (const YamlEntry& entry : yaml_.map(input.value, input.place, "input " + in_quotes(input.key), &kKeys)) {
        if (entry.key == "help") yaml_.text(entry.value, entry.place, "help");
        if (entry.key == "default") {
          give(entry.place, entry.value, folder_);
          may_be_empty = entry.value.IsScalar() && entry.value.Scalar().empty();
        }
        if (entry.key != "type") continue;
        const auto type = yaml_.text(entry.value, entry.place, "type");
        if (!type) continue;
        if (!contains(kTypes, *type))
          yaml_.fault(entry.place, "unknown type " + in_quotes(*type) + " of input " + in_quotes(input.key),
                      suggestion(*type, kTypes));
        if (*type == "path") info.type = OptionType::path;
        if (*type == "number") info.type = OptionType::number;
        if (*type == "integer") info.type = OptionType::integer;
        if (*type == "boolean") info.type = OptionType::boolean;
      }
      for (const InputValue& one : arguments_.inputs)
        if (one.name == input.key) give(place_of(one), YAML::Node(one.value), folder_of(one.place));
      set_input(input, info, given ? &value : nullptr, may_be_empty);
    }
  }

  /// `may_be_empty`: its default is an empty text, so an empty path is a good value.
  void set_input(const YamlEntry& input, const OptionInfo& info, const WrittenValue* value, bool may_be_empty) {
    if (!value) {
      pipeline_.missing_inputs.push_back(input.key);
      if (inputs_required_)
        yaml_.fault(input.place, "input " + in_quotes(input.key) + " has no value",
                    "give it as  " + input.key + "=VALUE");
      return;
    }
    const auto no_names = [](const std::string& text, const Place&) { return std::optional(text); };
    if (!read_option(yaml_, value->value, value->place, info, "input " + in_quotes(input.key), no_names)) return;
    std::string text = value->value.Scalar();
    if (info.type == OptionType::path && text.empty() && !may_be_empty)
      yaml_.fault(value->place, "input " + in_quotes(input.key) + " is an empty path",
                  "name a file or a folder; the folder in which you are is  .");
    if (info.type == OptionType::path && !text.empty()) text = plain_path(value->folder / text).string();
    pipeline_.inputs[input.key] = text;
  }

  void check_given_inputs() {
    for (const InputValue& one : arguments_.inputs)
      if (!contains(declared_, one.name))
        diagnostics_.add(place_of(one), "the pipeline has no input " + in_quotes(one.name),
                         suggestion(one.name, declared_));
  }

  static Place place_of(const InputValue& one) {
    return one.place.file.empty() ? Place{one.name + "=" + one.value} : one.place;
  }
  static fs::path folder_of(const Place& written) {
    return written.file.empty() ? fs::current_path() : fs::absolute(written.file).parent_path();
  }

  void read_node(const YamlEntry& entry) {
    static const std::vector<std::string> kKeys{"uses", "with",  "in",      "may_fail", "repeat",
                                                "over", "carry", "at_most", "until",    "if_pass_fails"};
    WrittenNode node;
    node.id = entry.key;
    node.place = entry.place;
    node.uses_place = entry.place;
    if (entry.key.find('.') != std::string::npos)
      yaml_.fault(entry.place, "the node's name " + in_quotes(entry.key) + " has a dot",
                  "dots are for outputs, as in case.views");
    if (entry.key.find('/') != std::string::npos)
      yaml_.fault(entry.place, "the node's name " + in_quotes(entry.key) + " has a slash",
                  "slashes are for nodes of a body, as in track/edges");
    if (entry.key.empty()) yaml_.fault(entry.place, "a node has no name", "write it as  name: {uses: kind.name}");
    bool has_uses = false;
    for (const YamlEntry& part : yaml_.map(entry.value, entry.place, "node " + in_quotes(entry.key), &kKeys)) {
      if (part.key == "uses") {
        has_uses = !part.value.IsScalar() || !part.value.Scalar().empty();
        node.uses_place = yaml_.place(part.value);
        node.uses = yaml_.text(part.value, part.place, "uses").value_or("");
      } else if (part.key == "may_fail") {
        node.may_fail = yaml_.boolean(part.value, part.place, may_fail_of(node.id)).value_or(false);
      } else if (part.key != "with" && part.key != "in") {
        read_repetition(node, part);
      } else {
        auto& target = part.key == "with" ? node.options : node.wires;
        for (const YamlEntry& item :
             yaml_.map(part.value, part.place, in_quotes(part.key) + " of node " + in_quotes(node.id)))
          target.push_back({item.key, {item.place, item.value, folder_}});
      }
    }
    if (node.repetition) {
      check_repetition(node, has_uses);
    } else if (!has_uses && entry.value.IsMap()) {
      yaml_.fault(entry.place, "node " + in_quotes(entry.key) + " does not say what it uses", "add  uses: kind.name");
    }
    pipeline_.nodes.push_back(std::move(node));
  }

  void read_repetition(WrittenNode& node, const YamlEntry& part) {
    if (!node.repetition) node.repetition.emplace();
    WrittenRepetition& repetition = *node.repetition;
    const std::string what = in_quotes(part.key) + " of node " + in_quotes(node.id);
    if (part.key == "repeat") {
      repetition.body = {yaml_.place(part.value), part.value, folder_};
    } else if (part.key == "over") {
      repetition.over_place = part.place;
      repetition.over = yaml_.text(part.value, part.place, what).value_or("");
    } else if (part.key == "until") {
      repetition.until_place = part.place;
      repetition.until = yaml_.text(part.value, part.place, what).value_or("");
    } else if (part.key == "carry") {
      for (const YamlEntry& item : yaml_.map(part.value, part.place, what))
        repetition.carry.push_back({item.key, {item.place, item.value, folder_}});
    } else if (part.key == "at_most") {
      repetition.at_most_place = part.place;
      set_at_most(repetition, yaml_.integer(part.value, part.place, what));
    } else {
      set_if_pass_fails(repetition, part.place, yaml_.text(part.value, part.place, what));
    }
  }

  void set_at_most(WrittenRepetition& repetition, const std::optional<std::int64_t>& passes) {
    constexpr std::int64_t kMostPasses = 1'000'000;
    if (passes && (*passes < 1 || *passes > kMostPasses))
      diagnostics_.add(repetition.at_most_place,
                       formatted("'at_most' is {}, but must be a number of passes from 1 to 1000000", *passes));
    else if (passes)
      repetition.at_most = int(*passes);
  }

  void set_if_pass_fails(WrittenRepetition& repetition, const Place& place, const std::optional<std::string>& what) {
    static const std::vector<std::string> kChoices{"end", "go_on"};
    if (what && !contains(kChoices, *what))
      diagnostics_.add(place, "'if_pass_fails' is " + in_quotes(*what) + ", but must be end or go_on",
                       suggestion(*what, kChoices));
    repetition.goes_on = what == "go_on";
  }

  void check_repetition(const WrittenNode& node, bool has_uses) {
    const WrittenRepetition& repetition = *node.repetition;
    const std::string who = "node " + in_quotes(node.id);
    if (has_uses)
      yaml_.fault(node.place, who + " has both 'uses' and a body", "leave out one of  uses:  and  repeat:");
    else if (!repetition.body.value.IsDefined() || repetition.body.value.IsNull())
      yaml_.fault(node.place, who + " does not say what it repeats",
                  "add  repeat: FILE  with the body, a pipeline file");
    else if (repetition.over.empty() && repetition.at_most == 0 && !repetition.over_place.line)
      yaml_.fault(node.place, who + " may never end: it goes over no axis and has no limit of passes",
                  "add  over: AXIS,  or  at_most: PASSES");
  }

  static std::string may_fail_of(const std::string& node) { return "'may_fail' of node " + in_quotes(node); }

  void apply_override(const std::string& key, const std::string& text, const Place& written) {
    const Place place = written.file.empty() ? Place{"--set " + key + "=" + text} : written;
    StrictYaml yaml(place, diagnostics_);
    const std::size_t dot = key.find('.');
    std::vector<std::string> ids;
    for (const WrittenNode& node : pipeline_.nodes) ids.push_back(node.id);
    const auto node = std::find_if(pipeline_.nodes.begin(), pipeline_.nodes.end(),
                                   [&](const WrittenNode& one) { return one.id == key.substr(0, dot); });
    if (dot == std::string::npos || dot + 1 == key.size()) {
      diagnostics_.add(place,
                       "an override is node.option=value, node.uses=kind.name, node.may_fail=true or "
                       "node.in.port=reference");
      return;
    }
    if (node == pipeline_.nodes.end()) {
      diagnostics_.add(place, "the pipeline has no node " + in_quotes(key.substr(0, dot)),
                       suggestion(key.substr(0, dot), ids));
      return;
    }
    const std::string what = key.substr(dot + 1);
    if (node->repetition && set_repetition(*node, what, text, place, written)) return;
    if (node->repetition && what == "uses") {
      diagnostics_.add(place, "node " + in_quotes(node->id) + " repeats a body, so no other node can take its place",
                       "a node of the body is changed by  " + node->id + ".body.NODE.uses=kind.name");
      return;
    }
    const auto given = given_value(text, place, diagnostics_);
    if (!given) return;
    if (what == "uses") return set_uses(*node, key, yaml.text(*given, place, "uses"), place);
    if (what == "may_fail") {
      node->may_fail = yaml.boolean(*given, place, may_fail_of(node->id)).value_or(false);
      return;
    }
    const bool is_wire = what.starts_with("in.");
    const WrittenEntry entry{is_wire ? what.substr(3) : what, {place, *given, folder_of(written), true}};
    auto& target = is_wire ? node->wires : node->options;
    const auto old =
        std::find_if(target.begin(), target.end(), [&](const WrittenEntry& one) { return one.name == entry.name; });
    if (old != target.end())
      *old = entry;
    else
      target.push_back(entry);
  }

  void set_uses(WrittenNode& node, const std::string& key, const std::optional<std::string>& name, const Place& place) {
    if (!name) return;
    if (name->empty()) {
      diagnostics_.add(place, "node " + in_quotes(node.id) + " does not say what it uses",
                       "write it as  " + key + "=kind.name");
      return;
    }
    // The options under `with` were written for the replaced node, so another node must not get them. Overrides are
    // meant for this run, so they stay, in whatever order they come.
    const auto of_file = [](const WrittenEntry& option) { return !option.value.is_override; };
    if (*name != node.uses && std::erase_if(node.options, of_file) > 0)
      pipeline_.notes.push_back("node " + in_quotes(node.id) + ": the options written for " + node.uses +
                                " are not used by " + *name);
    node.uses = *name;
    node.uses_place = place;
  }

  /// Applies an override of the repetition. Returns false if it overrides something else.
  bool set_repetition(WrittenNode& node, const std::string& what, const std::string& text, const Place& place,
                      const Place& written) {
    WrittenRepetition& repetition = *node.repetition;
    if (what.starts_with("body.")) {
      repetition.overrides.push_back({what.substr(5), text, written.file.empty() ? Place{} : place});
      return true;
    }
    if (what != "at_most" && what != "until" && what != "if_pass_fails") return false;
    const auto value = given_value(text, place, diagnostics_);
    if (!value) return true;
    StrictYaml yaml(place, diagnostics_);
    if (what == "at_most") {
      repetition.at_most_place = place;
      set_at_most(repetition, yaml.integer(*value, place, "'at_most'"));
    } else if (what == "until") {
      repetition.until_place = place;
      repetition.until = yaml.text(*value, place, "'until'").value_or("");
    } else {
      set_if_pass_fails(repetition, place, yaml.text(*value, place, "'if_pass_fails'"));
    }
    return true;
  }

  const PipelineArguments& arguments_;
  Diagnostics& diagnostics_;
  bool inputs_required_;
  bool is_body_ = false;
  StrictYaml yaml_;
  WrittenPipeline pipeline_;
  fs::path folder_;
  std::vector<std::string> declared_;
};

}  // namespace

WrittenPipeline read_written_body(const fs::path& file, const std::string& name, const YAML::Node& body,
                                  const PipelineArguments& arguments, Diagnostics& diagnostics) {
  return PipelineReader(file, arguments, diagnostics, false).read_body(name, body);
}

WrittenPipeline read_written_pipeline(const fs::path& file, const PipelineArguments& arguments,
                                      Diagnostics& diagnostics, bool inputs_required) {
  return PipelineReader(file, arguments, diagnostics, inputs_required).read();
}

}  // namespace marrow
