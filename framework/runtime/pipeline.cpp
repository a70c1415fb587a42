// SPDX-License-Identifier: Apache-2.0
// From a written pipeline to a checked graph: names looked up, options converted, wires typed, axes found.
#include "marrow/runtime/pipeline.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "contract.hpp"
#include "file_names.hpp"
#include "input_texts.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/runtime/types.hpp"
#include "pipeline_axes.hpp"
#include "pipeline_text.hpp"
#include "plain_path.hpp"
#include "relations.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  if (parts.empty()) parts.emplace_back();
  return parts;
}

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

bool contains(const std::vector<std::string>& list, const std::string& item) {
  return std::find(list.begin(), list.end(), item) != list.end();
}

std::string joined(const std::vector<std::string>& list, const char* separator) {
  std::string text;
  for (const std::string& item : list) text += (text.empty() ? "" : separator) + item;
  return text;
}

std::string with_article(const std::string& noun) { return (noun.find_first_of("aeiou") == 0 ? "an " : "a ") + noun; }

class Resolver {
 public:
  /// `is_trial`: whether the result is only asked for its faults.
  Resolver(const WrittenPipeline& written, const Catalogue& catalogue, Diagnostics& diagnostics, bool is_trial = false)
      : written_(written),
        catalogue_(catalogue),
        diagnostics_(diagnostics),
        tries_others_(!is_trial && diagnostics.empty()),
        input_texts_(written, diagnostics) {}

  Pipeline resolve() {
    pipeline_.name = written_.name;
    pipeline_.help = written_.help;
    pipeline_.file = written_.file;
    pipeline_.notes = written_.notes;
    for (const WrittenNode& node : written_.nodes) {
      index_.emplace(node.id, ids_.size());
      ids_.push_back(node.id);
      resolve_node(node);
    }
    for (std::size_t i = 0; i < written_.nodes.size(); ++i) resolve_wires(i);
    for (const auto& [name, value] : written_.outputs) resolve_output(name, value);
    point_at_renamed();
    if (diagnostics_.empty()) order_and_find_axes(pipeline_, diagnostics_);
    return std::move(pipeline_);
  }

 private:
  void resolve_node(const WrittenNode& written) {
    PipelineNode node;
    node.id = written.id;
    node.place = written.place;
    if (const NodeInfo* info = catalogue_.find(written.uses)) {
      node.info = *info;
      if (const KindInfo* kind = catalogue_.find_kind(info->kind())) node.apart = kind->apart;
      resolve_options(written, node);
    } else if (!written.uses.empty()) {
      const std::vector<std::string>& names = node_names();
      const std::string kind = written.uses.substr(0, written.uses.find('.'));
      std::vector<std::string> siblings;
      for (const std::string& name : names)
        if (name.starts_with(kind + ".")) siblings.push_back(name);
      std::string hint = suggested(written.uses, siblings.empty() ? names : siblings);
      for (const LibraryInfo& library : catalogue_.libraries())
        if (!library.refused.empty() &&
            library.file.stem().string().find(written.uses.substr(written.uses.find('.') + 1)) != std::string::npos)
          hint += "; " + library.file.filename().string() + " was refused: it " + library.refused;
      diagnostics_.add(written.uses_place, "unknown node " + in_quotes(written.uses), hint);
    }
    pipeline_.nodes.push_back(std::move(node));
  }

  const std::vector<std::string>& node_names() {
    if (node_names_.empty()) node_names_ = catalogue_.node_names();
    return node_names_;
  }

  const std::vector<KindPort>& ports_of_kind(const std::string& kind) {
    const auto found = ports_.find(kind);
    return found != ports_.end() ? found->second : ports_.emplace(kind, catalogue_.ports_of_kind(kind)).first->second;
  }

  /// A suggestion as long as faults are kept: thousands of unknown names among thousands of known ones take long.
  std::string suggested(const std::string& wrong, const std::vector<std::string>& known) const {
    return diagnostics_.is_full() ? "" : suggestion(wrong, known);
  }

  StrictYaml yaml_of(const WrittenValue& value) {
    return value.is_override ? StrictYaml(value.place, diagnostics_) : StrictYaml(value.place.file, diagnostics_);
  }

  void resolve_options(const WrittenNode& written, PipelineNode& node) {
    const std::vector<std::string> known = names_of(node.info.options);
    for (const auto& [name, value] : written.options)
      if (!contains(known, name))
        diagnostics_.add(value.place, in_quotes(node.info.name) + " has no option " + in_quotes(name),
                         suggested(name, known));
    for (const OptionInfo& option : node.info.options) {
      OptionValue result = option.default_value;
      const auto given = std::find_if(written.options.begin(), written.options.end(),
                                      [&](const auto& item) { return item.first == option.name; });
      if (given != written.options.end()) {
        const WrittenValue& value = given->second;
        StrictYaml yaml = yaml_of(value);
        const auto substitute = [&](const std::string& text, const Place& place) {
          return input_texts_.put_into(text, place.line ? place : value.place);
        };
        auto converted = yaml.option(value.value, value.place, option,
                                     "option " + in_quotes(option.name) + " of " + node.info.name, substitute);
        if (converted)
          result = in_folder(std::move(*converted), option.type, value.folder);
        else
          unknown_values_.insert({&written, option.name});
      } else if (option.required) {
        unknown_values_.insert({&written, option.name});
        diagnostics_.add(written.place,
                         "node " + in_quotes(node.id) + ": option " + in_quotes(option.name) + " of " + node.info.name +
                             " must be given",
                         option.help);
      }
      node.options.push_back(std::move(result));
    }
  }

  /// Options against each other, where each of them could be read. The fault is shown at the last one that the file
  /// gives.
  void check_relations(const WrittenNode& written, const PipelineNode& node) {
    const auto value = [&](const std::string& name) -> const OptionValue* {
      for (std::size_t i = 0; i < node.options.size(); ++i)
        if (node.info.options[i].name == name) return &node.options[i];
      return nullptr;
    };
    const auto is_wired = [&](const std::string& name) { return is_written(written.wires, name); };
    for (const RelationInfo& relation : node.info.relations) {
      Place place = written.place;
      bool is_known = true;
      for (const std::string& name : relation.names) {
        is_known = is_known && !unknown_values_.contains({&written, name});
        const bool is_input = name.starts_with("in.");
        for (const auto& [other, given] : is_input ? written.wires : written.options)
          if (other == (is_input ? name.substr(3) : name)) place = given.place;
      }
      if (!is_known) continue;
      if (const auto fault = broken(relation, node.info.name, value, is_wired))
        diagnostics_.add(place, fault->message, fault->hint);
    }
  }

  template <class Written>
  static bool is_written(const Written& list, const std::string& name) {
    return std::any_of(list.begin(), list.end(), [&](const auto& item) { return item.first == name; });
  }

  static OptionValue in_folder(OptionValue value, OptionType type, const fs::path& folder) {
    const auto full = [&](const std::string& text) { return text.empty() ? text : plain_path(folder / text).string(); };
    if (type == OptionType::path) return full(std::get<std::string>(value));
    if (type == OptionType::paths)
      for (std::string& text : std::get<std::vector<std::string>>(value)) text = full(text);
    return value;
  }

  void resolve_wires(std::size_t index) {
    const WrittenNode& written = written_.nodes[index];
    PipelineNode& node = pipeline_.nodes[index];
    if (node.info.name.empty()) return;
    const std::vector<KindPort>& of_kind = ports_of_kind(node.info.kind());
    for (const auto& [name, value] : written.wires) {
      const auto port = std::find_if(node.info.inputs.begin(), node.info.inputs.end(),
                                     [&, n = name](const PortInfo& p) { return p.name == n; });
      const bool own = port != node.info.inputs.end();
      const auto sibling =
          std::find_if(of_kind.begin(), of_kind.end(), [&, n = name](const KindPort& p) { return p.name == n; });
      if (!own && sibling == of_kind.end()) {
        diagnostics_.add(value.place, in_quotes(node.info.name) + " has no input " + in_quotes(name),
                         suggested(name, names_of(of_kind)));
        continue;
      }
      // A port that only siblings use is checked like any other, and then left unwired.
      Wire wire =
          resolve_wire(value, own ? KindPort{port->name, port->help, {port->type}, port->axis} : *sibling, index);
      if (!own) continue;
      wire.port = int(port - node.info.inputs.begin());
      node.wires.push_back(std::move(wire));
    }
    for (const PortInfo& port : node.info.inputs)
      if (!port.optional && !is_written(written.wires, port.name))
        diagnostics_.add(written.place,
                         "node " + in_quotes(node.id) + ": input " + in_quotes(port.name) + " of " + node.info.name +
                             " is not wired",
                         "add  in: {" + port.name + ": ...}  with " + with_article(types_text({port.type}, port.axis)) +
                             " (" + port.help + ")" + or_another(index));
    check_relations(written, node);
  }

  Wire resolve_wire(const WrittenValue& value, const KindPort& port, std::size_t index) {
    Wire wire;
    const auto add = [&](const YAML::Node& text, const Place& place) {
      if (!text.IsScalar()) {
        diagnostics_.add(place, "input " + in_quotes(port.name) + " must name a node",
                         "write it as  " + port.name + ": node  or  node.output");
        return;
      }
      Reference source = resolve_reference(text.Scalar(), place, &port.types);
      check_type(source, port, index);
      wire.sources.push_back(std::move(source));
    };
    if (!value.value.IsSequence()) {
      add(value.value, value.place);
      return wire;
    }
    wire.is_list_literal = true;
    if (port.axis.empty()) {
      diagnostics_.add(value.place, "input " + in_quotes(port.name) + " of " + pipeline_.nodes[index].info.name +
                                        " takes one " + types_text(port.types, "") + ", not a list");
      return wire;
    }
    const StrictYaml yaml = yaml_of(value);
    for (const YAML::Node& item : value.value) add(item, yaml.place(item));
    return wire;
  }

  Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types) {
    Reference source{text, place, -1, -1, {}};
    const std::vector<std::string> parts = split(text);
    const std::string id = parts.empty() ? text : parts[0];
    const auto found = index_.find(id);
    used_nodes_.insert(id);
    if (found == index_.end()) {
      unknown_nodes_.insert(id);
      diagnostics_.add(place, "there is no node " + in_quotes(id), suggested(id, ids_));
      return source;
    }
    const std::size_t index = found->second;
    const std::vector<PortInfo>& outputs = pipeline_.nodes[index].info.outputs;
    if (outputs.empty()) return source;  // its node is unknown, which has been said
    std::size_t used = 1;
    int output = -1;
    for (std::size_t i = 0; i < outputs.size(); ++i)
      if (parts.size() > 1 && outputs[i].name == parts[1]) output = int(i);
    if (output >= 0) {
      used = 2;
    } else {
      output = default_output(outputs, types, parts.size() > 1);
    }
    if (output < 0) {
      if (parts.size() > 1)
        diagnostics_.add(place, "node " + in_quotes(parts[0]) + " has no output " + in_quotes(parts[1]),
                         suggested(parts[1], names_of(outputs)));
      else
        diagnostics_.add(place,
                         "node " + in_quotes(parts[0]) + " has several outputs" +
                             (types ? " and not just one " + types_text(*types, "") : ""),
                         "say which: " + parts[0] + "." + joined(names_of(outputs), ", "));
      return source;
    }
    source.node = int(index);
    source.output = output;
    source.items.assign(parts.begin() + std::ptrdiff_t(used), parts.end());
    return source;
  }

  /// The output that a bare node's name means: its only one, or the only one of the wanted types.
  static int default_output(const std::vector<PortInfo>& outputs, const std::vector<TypeInfo>* types, bool picks_item) {
    if (outputs.size() == 1) return 0;
    if (picks_item || !types) return -1;
    int found = -1;
    for (std::size_t i = 0; i < outputs.size(); ++i)
      if (has_id(*types, outputs[i].type.id)) {
        if (found >= 0) return -1;
        found = int(i);
      }
    return found;
  }

  static bool has_id(const std::vector<TypeInfo>& types, const std::string& id) {
    return std::any_of(types.begin(), types.end(), [&](const TypeInfo& type) { return type.id == id; });
  }

  void check_type(const Reference& source, const KindPort& port, std::size_t index) {
    if (source.node < 0) return;
    const PipelineNode& node = pipeline_.nodes[index];
    const PipelineNode& from = pipeline_.nodes[std::size_t(source.node)];
    const PortInfo& output = from.info.outputs[std::size_t(source.output)];
    const KindInfo* kind = catalogue_.find_kind(node.info.kind());
    if (output.type.id == TypeInfo::of<Truth>().id && (!kind || !kind->sees_truth)) {
      diagnostics_.add(source.place,
                       "the truth may be wired only to nodes of a kind that may see it, not to " + node.info.name,
                       "a method that sees the truth proves nothing");
    } else if (std::find(port.types.begin(), port.types.end(), output.type) == port.types.end()) {
      std::string hint = "the two plugins were built with different versions of this type; rebuild both";
      if (!has_id(port.types, output.type.id)) hint = fitting(std::size_t(source.node), index);
      diagnostics_.add(source.place,
                       "input " + in_quotes(port.name) + " of " + node.info.name + " expects " +
                           types_text(port.types, "") + ", but " + in_quotes(source.text) + " is " + output.type.id +
                           " (" + output.help + ")",
                       hint);
    }
  }

  /// Nodes with which the pipeline would have no fault, of the kinds of these two: "kind.one fits in place of
  /// kind.other". Empty where there are none.
  std::string fitting(std::size_t source, std::size_t user) {
    for (const std::size_t index : {source, user}) {
      const std::vector<std::string>& names = names_that_fit(index);
      if (!names.empty())
        return joined(names, ", ") + (names.size() == 1 ? " fits" : " fit") + " in place of " +
               written_.nodes[index].uses;
    }
    return "";
  }

  std::string or_another(std::size_t index) {
    const std::vector<std::string>& names = names_that_fit(index);
    return names.empty() ? "" : ", or use " + joined(names, ", ");
  }

  /// Nodes of the same kind with which the whole pipeline would be good. Each is tried, so of few nodes only, and not
  /// in very long pipelines.
  const std::vector<std::string>& names_that_fit(std::size_t index) {
    constexpr std::size_t kMostNodes = 300, kMostTried = 4;
    static const std::vector<std::string> kNone;
    if (!tries_others_ || written_.nodes.size() > kMostNodes) return kNone;
    if (const auto known = fitting_.find(index); known != fitting_.end()) return known->second;
    if (fitting_.size() == kMostTried) return kNone;
    std::vector<std::string>& names = fitting_[index];
    const std::string& used = written_.nodes[index].uses;
    for (const std::string& name : node_names()) {
      if (name == used || !name.starts_with(used.substr(0, used.find('.') + 1))) continue;
      WrittenPipeline other = written_;
      other.nodes[index].uses = name;
      other.nodes[index].options.clear();
      Diagnostics faults;
      Resolver(other, catalogue_, faults, true).resolve();
      if (faults.empty()) names.push_back(name);
    }
    return names;
  }

  void resolve_output(const std::string& name, const WrittenValue& value) {
    check_file_name(diagnostics_, value.place, name, "an output's name");
    if (!value.value.IsScalar()) {
      diagnostics_.add(value.place, "output " + in_quotes(name) + " must name a node or one of its outputs");
      return;
    }
    pipeline_.outputs.push_back({name, resolve_reference(value.value.Scalar(), value.place, nullptr)});
  }

  /// Where a name is unknown, the slip may be at its definition: the nearest name, which nothing uses.
  void point_at_renamed() {
    std::map<std::string, Place> nodes;
    for (const WrittenNode& node : written_.nodes) nodes.emplace(node.id, node.place);
    point_at_renamed("node", nodes, used_nodes_, unknown_nodes_);
    point_at_renamed("input", written_.input_places, input_texts_.used, input_texts_.unknown);
  }

  void point_at_renamed(const std::string& what, const std::map<std::string, Place>& defined,
                        const std::set<std::string>& used, const std::set<std::string>& unknown) {
    std::vector<std::string> names;
    for (const auto& [name, place] : defined) names.push_back(name);
    for (const std::string& wanted : unknown) {
      if (diagnostics_.is_full()) return;
      const std::string nearest = nearest_name(wanted, names);
      if (!nearest.empty() && !used.contains(nearest))
        diagnostics_.add(defined.at(nearest), "nothing uses " + what + " " + in_quotes(nearest),
                         in_quotes(wanted) + " is used, but is not there: is this it?");
    }
  }

  const WrittenPipeline& written_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  const bool tries_others_;  ///< not of a file that could not be read in full: its nodes may be half
  Pipeline pipeline_;
  std::vector<std::string> ids_, node_names_;
  std::map<std::string, std::size_t> index_;  ///< of nodes, by their ids
  std::map<std::string, std::vector<KindPort>> ports_;
  std::set<std::pair<const WrittenNode*, std::string>> unknown_values_;  ///< options whose values could not be read
  std::map<std::size_t, std::vector<std::string>> fitting_;              ///< by node
  InputTexts input_texts_;
  std::set<std::string> used_nodes_, unknown_nodes_;  ///< by references
};

}  // namespace

Pipeline read_pipeline(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                       Diagnostics& diagnostics, bool inputs_required) {
  const WrittenPipeline written = read_written_pipeline(file, arguments, diagnostics, inputs_required);
  if (written.nodes.empty()) return {};
  return Resolver(written, catalogue, diagnostics).resolve();
}

}  // namespace marrow
