// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/pipeline_text.hpp"

#include <algorithm>
#include <set>

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
    std::set<std::string> given;
    for (const YamlEntry& entry : yaml_.map(root, start, "the pipeline", &kKeys)) {
      given.insert(entry.key);
      if (entry.key == "marrow") {
        const auto version = yaml_.integer(entry.value, entry.place, "marrow");
        if (version && *version != 1)
          yaml_.fault(entry.place, formatted("this file is of format {}, this program reads format 1", *version));
      }
      if (entry.key == "name") {
        pipeline_.name = yaml_.text(entry.value, entry.place, "name").value_or("");
        if (entry.value.IsScalar()) check_file_name(diagnostics_, entry.place, pipeline_.name, "a pipeline's name");
      }
      if (entry.key == "help") pipeline_.help = yaml_.text(entry.value, entry.place, "help").value_or("");
      if (entry.key == "only_inside")
        pipeline_.only_inside = yaml_.boolean(entry.value, entry.place, "only_inside").value_or(false);
      if (entry.key == "inputs") read_inputs(entry);
      if (entry.key == "nodes")
        for (const YamlEntry& node : yaml_.map(entry.value, entry.place, "nodes")) read_node(node);
      if (entry.key == "outputs") pipeline_.outputs = entries(entry, "outputs");
    }
    if (!root.IsMap()) return;
    check_keys(given, start);
    check_given_inputs();
  }

  void check_keys(const std::set<std::string>& given, const Place& start) {
    if (!given.contains("name") && !is_body_) name_after_file(start);
    if (!given.contains("marrow") && !is_body_)
      yaml_.fault(start, "the key 'marrow' is missing", "begin the file with  marrow: 1");
    if (!given.contains("nodes"))
      yaml_.fault(start, "the key 'nodes' is missing", "name the nodes of the pipeline under it");
    else if (pipeline_.nodes.empty() && diagnostics_.empty())
      yaml_.fault(start, "the pipeline has no nodes", "name them under  nodes:");
    if (!given.contains("outputs"))
      yaml_.fault(start, "the key 'outputs' is missing", "name what the pipeline computes, as  outputs: {name: node}");
  }

  void name_after_file(const Place& start) {
    pipeline_.name = pipeline_.file == "-" ? "stdin" : pipeline_.file.stem().string();
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
      std::optional<WrittenValue> value;
      bool may_be_empty = false;
      for (const YamlEntry& entry : yaml_.map(input.value, input.place, "input " + in_quotes(input.key), &kKeys)) {
        if (entry.key == "help") yaml_.text(entry.value, entry.place, "help");
        if (entry.key == "default") {
          value.emplace(WrittenValue{entry.place, entry.value, folder_});
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
        if (one.name == input.key)
          value.emplace(WrittenValue{place_of(one), YAML::Node(one.value), folder_of(one.place)});
      set_input(input, info, value, may_be_empty);
    }
  }

  /// `may_be_empty`: its default is an empty text, so an empty path is a good value.
  void set_input(const YamlEntry& input, const OptionInfo& info, const std::optional<WrittenValue>& value,
                 bool may_be_empty) {
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
        target = entries(part, in_quotes(part.key) + " of node " + in_quotes(node.id));
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
    } else if (part.key == "carry") {
      repetition.carry = entries(part, what);
    } else {
      set_passes(node, part.key, part.value, part.place, yaml_);
    }
  }

  std::vector<WrittenEntry> entries(const YamlEntry& map, const std::string& what) {
    std::vector<WrittenEntry> entries;
    for (const YamlEntry& item : yaml_.map(map.value, map.place, what))
      entries.push_back({item.key, {item.place, item.value, folder_}});
    return entries;
  }

  /// Sets how many passes there are. `key`: at_most, until or if_pass_fails.
  void set_passes(WrittenNode& node, const std::string& key, const YAML::Node& value, const Place& place,
                  StrictYaml& yaml) {
    constexpr std::int64_t kMostPasses = 1'000'000;
    static const std::vector<std::string> kChoices{"end", "go_on"};
    WrittenRepetition& repetition = *node.repetition;
    const std::string what = in_quotes(key) + " of node " + in_quotes(node.id);
    if (key == "at_most") {
      const auto passes = yaml.integer(value, place, what);
      if (!passes) return;
      if (*passes >= 1 && *passes <= kMostPasses)
        repetition.at_most = int(*passes);
      else
        diagnostics_.add(
            place, formatted("'at_most' is {}, but must be a number of passes from 1 to {}", *passes, kMostPasses));
    } else if (key == "until") {
      repetition.until_place = place;
      repetition.until = yaml.text(value, place, what).value_or("");
    } else {
      const auto choice = yaml.text(value, place, what);
      if (choice && !contains(kChoices, *choice))
        diagnostics_.add(place, "'if_pass_fails' is " + in_quotes(*choice) + ", but must be end or go_on",
                         suggestion(*choice, kChoices));
      repetition.goes_on = choice == "go_on";
    }
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
    const std::size_t dot = key.find('.');
    if (dot == std::string::npos || dot + 1 == key.size())
      return diagnostics_.add(place,
                              "an override is node.option=value, node.uses=kind.name, node.may_fail=true or "
                              "node.in.port=reference");
    const std::string id = key.substr(0, dot), what = key.substr(dot + 1);
    std::vector<std::string> ids;
    for (const WrittenNode& one : pipeline_.nodes) ids.push_back(one.id);
    const auto found = std::find(ids.begin(), ids.end(), id);
    if (found == ids.end())
      return diagnostics_.add(place, "the pipeline has no node " + in_quotes(id), suggestion(id, ids));
    WrittenNode& node = pipeline_.nodes[std::size_t(found - ids.begin())];
    if (node.repetition && set_repetition(node, what, text, place, written)) return;
    if (node.repetition && what == "uses")
      return diagnostics_.add(place, "node " + in_quotes(id) + " repeats a body, so no other node can take its place",
                              "a node of the body is changed by  " + id + ".body.NODE.uses=kind.name");
    const auto given = given_value(text, place, diagnostics_);
    if (!given) return;
    StrictYaml yaml(place, diagnostics_);
    if (what == "uses")
      set_uses(node, key, yaml.text(*given, place, "uses"), place);
    else if (what == "may_fail")
      node.may_fail = yaml.boolean(*given, place, may_fail_of(id)).value_or(false);
    else
      set_entry(node, what, {place, *given, folder_of(written), true});
  }

  /// `what`: an option, or in.port.
  static void set_entry(WrittenNode& node, const std::string& what, const WrittenValue& value) {
    const bool is_wire = what.starts_with("in.");
    const std::string name = is_wire ? what.substr(3) : what;
    auto& target = is_wire ? node.wires : node.options;
    const auto old =
        std::find_if(target.begin(), target.end(), [&](const WrittenEntry& one) { return one.name == name; });
    if (old != target.end())
      old->value = value;
    else
      target.push_back({name, value});
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
    static const std::vector<std::string> kKeys{"at_most", "until", "if_pass_fails"};
    if (what.starts_with("body.")) {
      node.repetition->overrides.push_back({what.substr(5), text, written.file.empty() ? Place{} : place});
      return true;
    }
    if (!contains(kKeys, what)) return false;
    StrictYaml yaml(place, diagnostics_);
    if (const auto value = given_value(text, place, diagnostics_)) set_passes(node, what, *value, place, yaml);
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
