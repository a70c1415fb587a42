// SPDX-License-Identifier: Apache-2.0
// Makes a checked graph from a written pipeline: looks up names, converts options, checks wires, finds axes.
#include "marrow/runtime/pipeline/pipeline.hpp"

#include <set>

#include "marrow/base/file_names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

std::string with_article(const std::string& noun) { return (noun.find_first_of("aeiou") == 0 ? "an " : "a ") + noun; }

class Resolver {
 public:
  /// `is_trial`: only the faults matter, not their hints.
  Resolver(const WrittenPipeline& written, const Catalogue& catalogue, Diagnostics& diagnostics, bool is_trial = false)
      : written_(written),
        catalogue_(catalogue),
        diagnostics_(diagnostics),
        tries_others_(!is_trial && diagnostics.empty()),
        input_texts_(written, diagnostics) {}

  /// `outer`: the file of this pipeline and the files whose bodies it is in.
  Pipeline resolve(const std::vector<fs::path>& outer = {}) {
    files_ = outer;
    pipeline_.name = written_.name;
    pipeline_.help = written_.help;
    pipeline_.only_inside = written_.only_inside;
    pipeline_.file = written_.file;
    pipeline_.files = written_.files;
    pipeline_.inputs = listed_inputs(*written_.inputs);
    pipeline_.notes = written_.notes;
    for (const WrittenNode& node : written_.nodes) {
      ids_.index.emplace(node.id, ids_.all.size());
      ids_.all.push_back(node.id);
      resolve_node(node);
    }
    for (std::size_t i = 0; i < written_.nodes.size(); ++i) resolve_wires(i);
    for (const auto& [name, value] : written_.outputs) resolve_output(name, value);
    point_at_renamed();
    check_circles(written_, diagnostics_);
    if (diagnostics_.empty()) add_notes(notes_of_replaced_options(written_, pipeline_));
    if (diagnostics_.empty()) order_and_find_axes(pipeline_, diagnostics_);
    note_unused_inputs();
    return std::move(pipeline_);
  }

 private:
  void resolve_node(const WrittenNode& written) {
    PipelineNode node;
    node.id = written.id;
    node.place = written.place;
    node.uses_place = written.uses_place;
    node.may_fail = written.may_fail;
    if (written.stands_for) {
      node.stands_for_input = true;
      node.info.name = "input";
      node.info.outputs = {*written.stands_for};
    } else if (written.repetition) {
      resolve_repetition(
          written, node, input_texts_,
          [&](std::vector<InputValue> inputs) { return read_body(written, std::move(inputs)); }, diagnostics_);
    } else if (const NodeInfo* info = catalogue_.find(written.uses)) {
      node.info = *info;
      if (const KindInfo* kind = catalogue_.find_kind(info->kind())) node.apart = kind->apart;
      resolve_options(written, node, input_texts_, unknown_values_, diagnostics_);
    } else if (!written.uses.empty()) {
      const std::vector<std::string>& names = node_names();
      const std::size_t dot = written.uses.find('.');
      const std::string kind = written.uses.substr(0, dot), own_name = written.uses.substr(dot + 1);
      std::vector<std::string> siblings;
      for (const std::string& name : names)
        if (name.starts_with(kind + ".")) siblings.push_back(name);
      std::string hint =
          diagnostics_.is_full() ? "" : catalogue_.hint_for(written.uses, siblings.empty() ? names : siblings);
      for (const LibraryInfo& library : catalogue_.libraries())
        if (!library.refused.empty() && library.file.stem().string().find(own_name) != std::string::npos)
          hint += "; " + library.file.filename().string() + " was refused: it " + library.refused;
      diagnostics_.add(written.uses_place, "unknown node " + in_quotes(written.uses), hint);
    }
    pipeline_.nodes.push_back(std::move(node));
  }

  void add_notes(const std::vector<std::string>& notes) {
    pipeline_.notes.insert(pipeline_.notes.end(), notes.begin(), notes.end());
  }

  ReadBody read_body(const WrittenNode& node, std::vector<InputValue> inputs) {
    constexpr std::size_t kMostBodies = 8;  // inside each other
    const WrittenValue& body = node.repetition->body;
    PipelineReading reading{std::move(inputs), node.changes, files_, PipelineReading::Use::body};
    WrittenPipeline written;
    if (body.value.IsScalar()) {
      const auto text = input_texts_.put_into(body.value.Scalar(), body.place, body.inputs.get());
      if (!text) return {};
      const fs::path file = body.folder / *text;
      std::error_code ignored;
      std::vector<fs::path>& files = reading.inside;
      files.push_back(fs::weakly_canonical(file, ignored));
      if (std::count(files.begin(), files.end(), files.back()) > 1 || files.size() > kMostBodies) {
        diagnostics_.add(body.place, in_quotes(*text) + " repeats itself: a body must not be its own body");
        return {};
      }
      written = read_written_pipeline(file, reading, catalogue_, diagnostics_);
    } else {
      written = read_written_body(body.place.file, node.id, body.value, reading, catalogue_, diagnostics_);
    }
    if (written.nodes.empty()) return {};
    Resolver resolver(written, catalogue_, diagnostics_, !tries_others_);
    ReadBody read{resolver.resolve(reading.inside), {}};
    pipeline_.files.insert(pipeline_.files.end(), read.pipeline.files.begin(), read.pipeline.files.end());
    for (const auto& [option_of, option] : resolver.unknown_values_) read.incomplete.insert(option_of->id);
    for (const PipelineNode& one : read.pipeline.nodes)
      if (one.stands_for_input) read.incomplete.insert(one.id);
    add_notes(read.pipeline.notes);
    return read;
  }

  const std::vector<std::string>& node_names() {
    if (node_names_.empty()) node_names_ = catalogue_.node_names();
    return node_names_;
  }

  const std::vector<KindPort>& ports_of_kind(const std::string& kind) {
    const auto found = ports_.find(kind);
    return found != ports_.end() ? found->second : ports_.emplace(kind, catalogue_.ports_of_kind(kind)).first->second;
  }

  /// Looks up a reference. node.word is a fault if only other nodes of the kind have the output `word`. Otherwise the
  /// word would name an item with one node of the kind and an output with another.
  Reference resolve(const std::string& text, const Place& place, const std::vector<TypeInfo>* types) {
    Reference source = resolve_reference(text, place, types, pipeline_.nodes, ids_, diagnostics_);
    if (source.node < 0 || source.items.empty()) return source;
    const PipelineNode& from = pipeline_.node_of(source);
    const std::string items = joined(source.items, ".");
    if (text != from.id + "." + items || !outputs_of_kind(from.info.kind()).contains(source.items[0])) return source;
    diagnostics_.add(place, "node " + in_quotes(from.id) + " has no output " + in_quotes(source.items[0]),
                     "other nodes of the kind " + from.info.kind() + " have one; an item of that name is " + from.id +
                         "." + pipeline_.output_of(source).name + "." + items);
    source.node = -1;
    return source;
  }

  const std::set<std::string>& outputs_of_kind(const std::string& kind) {
    const auto found = outputs_.find(kind);
    if (found != outputs_.end()) return found->second;
    std::set<std::string>& outputs = outputs_[kind];
    for (const std::string& name : node_names())
      if (const NodeInfo* node = catalogue_.find(name); node->kind() == kind)
        for (const PortInfo& output : node->outputs) outputs.insert(output.name);
    return outputs;
  }

  void resolve_wires(std::size_t index) {
    const WrittenNode& written = written_.nodes[index];
    PipelineNode& node = pipeline_.nodes[index];
    if (node.info.name.empty()) return;
    const std::vector<KindPort> of_kind = node.repetition ? std::vector<KindPort>() : ports_of_kind(node.info.kind());
    for (const auto& [name, value] : written.wires) {
      const PortInfo* own = find_named(node.info.inputs, name);
      const KindPort* of_others = own ? nullptr : find_named(of_kind, name);
      if (!own && !of_others) {
        diagnostics_.add(value.place, in_quotes(node.info.name) + " has no input " + in_quotes(name),
                         suggested(diagnostics_, name, names_of(of_kind)));
        continue;
      }
      // The wire to a port that only other nodes of the kind have is checked, and then left out.
      Wire wire = resolve_wire(value, own ? KindPort{own->name, own->help, {own->type}, own->axis} : *of_others, index);
      if (!own) {
        pipeline_.notes.push_back(
            "node " + in_quotes(node.id) + ": the wire to " + in_quotes(name) + " is not used: " + node.info.name +
            " does not have this input, only other nodes of the kind " + node.info.kind() + " do");
        continue;
      }
      wire.port = int(own - node.info.inputs.data());
      node.wires.push_back(std::move(wire));
    }
    for (const PortInfo& port : node.info.inputs)
      if (!port.optional && !find_named(written.wires, port.name))
        diagnostics_.add(written.place,
                         "node " + in_quotes(node.id) + ": input " + in_quotes(port.name) + " of " + node.info.name +
                             " is not wired",
                         "add  in: {" + port.name + ": ...}  with " + with_article(types_text({port.type}, port.axis)) +
                             " (" + port.help + ")" + or_another(index));
    check_relations(written, node, unknown_values_, diagnostics_);
  }

  Wire resolve_wire(const WrittenValue& value, const KindPort& port, std::size_t index) {
    Wire wire;
    const auto add = [&](const YAML::Node& text, const Place& place) {
      if (!text.IsScalar()) {
        diagnostics_.add(place, "input " + in_quotes(port.name) + " must name a node",
                         "write it as  " + port.name + ": node  or  node.output");
        return;
      }
      Reference source = resolve(text.Scalar(), place, &port.types);
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
    const StrictYaml yaml = yaml_of(value, diagnostics_);
    for (const YAML::Node& item : value.value) add(item, yaml.place(item));
    return wire;
  }

  void check_type(const Reference& source, const KindPort& port, std::size_t index) {
    if (source.node < 0) return;
    const PipelineNode& node = pipeline_.nodes[index];
    const PortInfo& output = pipeline_.output_of(source);
    const KindInfo* kind = catalogue_.find_kind(node.info.kind());
    if (output.type.id == TypeInfo::of<Truth>().id && !node.repetition && (!kind || !kind->sees_truth)) {
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

  /// Which nodes could replace `source`, or else `user`, so that the pipeline has no fault: "kind.one fits in place of
  /// kind.other". Empty if there are none.
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

  /// The nodes of the same kind with which the whole pipeline has no fault. All nodes of the kind are tried, so this is
  /// limited to a few places, and to pipelines that are not very long.
  const std::vector<std::string>& names_that_fit(std::size_t index) {
    constexpr std::size_t kMostNodes = 300, kMostTried = 4;
    static const std::vector<std::string> kNone;
    if (!tries_others_ || written_.nodes.size() > kMostNodes || written_.nodes[index].repetition) return kNone;
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
    pipeline_.outputs.push_back({name, resolve(value.value.Scalar(), value.place, nullptr)});
  }

  /// If a name is unknown, the typing error may be in its definition. So this points at the nearest defined name that
  /// nothing uses.
  void point_at_renamed() {
    std::map<std::string, Place> nodes;
    for (const WrittenNode& node : written_.nodes) nodes.emplace(node.id, node.place);
    point_at_renamed("node", nodes, ids_.used, ids_.unknown);
    point_at_renamed("input", text_inputs(), input_texts_.used, input_texts_.unknown);
  }

  void note_unused_inputs() {
    for (const auto& [name, place] : text_inputs())
      if (!input_texts_.used.contains(name) && !written_.inputs_of_parts.contains(name))
        pipeline_.notes.push_back("nothing uses the input " + in_quotes(name));
  }

  std::map<std::string, Place> text_inputs() const {
    std::map<std::string, Place> places;
    for (const DeclaredInput& input : written_.inputs->all)
      if (!input.data) places.emplace(input.name, input.place);
    return places;
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
                         in_quotes(wanted) + " is used but not defined; did you mean this name?");
    }
  }

  const WrittenPipeline& written_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  const bool tries_others_;  ///< false if the file has faults, because its nodes may be incomplete
  Pipeline pipeline_;
  NodeIds ids_;
  std::vector<std::string> node_names_;
  std::map<std::string, std::vector<KindPort>> ports_;    ///< by the name of the kind
  std::map<std::string, std::set<std::string>> outputs_;  ///< by the name of the kind
  UnknownValues unknown_values_;
  std::map<std::size_t, std::vector<std::string>> fitting_;  ///< by the index of the node
  InputTexts input_texts_;
  std::vector<fs::path> files_;
};

Pipeline resolved(const WrittenPipeline& written, const Catalogue& catalogue, Diagnostics& diagnostics, bool is_trial) {
  if (written.nodes.empty()) return {};
  std::error_code ignored;
  return Resolver(written, catalogue, diagnostics, is_trial).resolve({fs::weakly_canonical(written.file, ignored)});
}

WrittenPipeline written(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                        Diagnostics& diagnostics, PipelineReading::Use use) {
  std::error_code ignored;
  PipelineReading reading{arguments.inputs, changes_of(arguments.overrides, diagnostics), {}, use};
  reading.inside.push_back(fs::weakly_canonical(file, ignored));
  return read_written_pipeline(file, reading, catalogue, diagnostics);
}

}  // namespace

Pipeline read_pipeline(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                       Diagnostics& diagnostics, bool inputs_required) {
  const auto use = inputs_required ? PipelineReading::Use::alone : PipelineReading::Use::check;
  return resolved(written(file, arguments, catalogue, diagnostics, use), catalogue, diagnostics, false);
}

Pipeline try_pipeline(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                      Diagnostics& diagnostics) {
  return resolved(written(file, arguments, catalogue, diagnostics, PipelineReading::Use::check), catalogue, diagnostics,
                  true);
}

}  // namespace marrow
