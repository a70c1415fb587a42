// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

namespace marrow {
namespace {

class CallBuilder {
 public:
  CallBuilder(const NodeInfo& info, const Catalogue& catalogue, Diagnostics& diagnostics)
      : info_(info), diagnostics_(diagnostics) {
    written_.id = info.name.substr(info.name.find('.') + 1);
    written_.place = {info.name};
    written_.uses = info.name;
    node_.id = written_.id;
    node_.place = written_.place;
    node_.info = info;
    if (const KindInfo* kind = catalogue.find_kind(info.kind())) node_.apart = kind->apart;
  }

  void add_option(const std::string& name, const std::string& text) {
    const Place place = place_of(name);
    if (const auto value = given_value(text, place, diagnostics_))
      written_.options.push_back({name, {place, *value, std::filesystem::current_path(), nullptr, 0, true}});
  }

  void add_input(const std::string& name, const Value& value) {
    const PortInfo* port = find_named(info_.inputs, name);
    if (!port) {
      diagnostics_.add(place_of(name), in_quotes(info_.name) + " has no input " + in_quotes(name),
                       suggestion(name, names_of(info_.inputs)));
      return;
    }
    written_.wires.push_back({name, {place_of(name), {}, {}, nullptr, 0, true}});
    if (value.type != port->type)
      diagnostics_.add(
          place_of(name),
          "input " + in_quotes(name) + " of " + info_.name + " expects " + port->type.id + ", got " + value.type.id,
          port->help);
    PipelineNode source;
    source.id = "given " + name;  // no node of a file has a name with a space in it
    source.place = written_.place;
    source.info.name = "given";
    source.info.outputs = {{name, port->help, port->type, false, ""}};
    for (const Value* one = &value; one->is_list(); one = &one->items[0]) source.mapped_axes.push_back(one->axis);
    Wire wire;
    wire.port = int(port - info_.inputs.data());
    wire.sources = {{name, place_of(name), int(made_.pipeline.nodes.size()), 0, {}}};
    node_.wires.push_back(std::move(wire));
    made_.given[source.id] = {value};
    made_.pipeline.nodes.push_back(std::move(source));
  }

  OneNode finish() {
    WrittenPipeline no_inputs;
    InputTexts texts(no_inputs, diagnostics_);
    UnknownValues unknown;
    resolve_options(written_, node_, texts, unknown, diagnostics_);
    for (const PortInfo& port : info_.inputs)
      if (!port.optional && !find_named(written_.wires, port.name))
        diagnostics_.add(place_of(port.name),
                         info_.name + " needs the input " + in_quotes(port.name) + ", of type " + port.type.id,
                         port.help);
    check_relations(written_, node_, unknown, diagnostics_);
    Pipeline& pipeline = made_.pipeline;
    pipeline.name = written_.id;
    pipeline.file = info_.name;
    for (std::size_t i = 0; i < info_.outputs.size(); ++i)
      pipeline.outputs.push_back(
          {info_.outputs[i].name, {info_.outputs[i].name, {}, int(pipeline.nodes.size()), int(i), {}}});
    pipeline.nodes.push_back(std::move(node_));
    if (diagnostics_.empty()) order_and_find_axes(pipeline, diagnostics_);
    return std::move(made_);
  }

 private:
  Place place_of(const std::string& part) const { return {info_.name + "(" + part + ")"}; }

  const NodeInfo& info_;
  Diagnostics& diagnostics_;
  WrittenNode written_;
  PipelineNode node_;
  OneNode made_;
};

}  // namespace

OneNode pipeline_of_node(const std::string& name, const std::vector<std::pair<std::string, Value>>& inputs,
                         const std::vector<std::pair<std::string, std::string>>& options, const Catalogue& catalogue,
                         Diagnostics& diagnostics) {
  const NodeInfo* info = catalogue.find(name);
  if (!info) {
    diagnostics.add({name}, "unknown node " + in_quotes(name), catalogue.hint_for(name, catalogue.node_names()));
    return {};
  }
  CallBuilder call(*info, catalogue, diagnostics);
  for (const auto& [port, value] : inputs) call.add_input(port, value);
  for (const auto& [option, text] : options) call.add_option(option, text);
  return call.finish();
}

}  // namespace marrow
