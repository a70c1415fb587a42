// SPDX-License-Identifier: Apache-2.0
// Nodes with a body: the values that the body is given, those that a pass carries to the next, and the outputs.
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

#include <algorithm>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

std::string axes_text(const std::vector<std::string>& axes) {
  return axes.empty() ? "one item" : "a list over " + joined(axes, " and ");
}

/// The body in which given values replace outputs. For each value that `is_given`, a node that is never called is put
/// in front, and the users of the output are wired to it.
Pipeline with_given(const Pipeline& body, const std::vector<Repetition::Given>& given,
                    const std::vector<bool>& is_given) {
  Pipeline result = body;
  std::vector<PipelineNode> nodes;
  std::vector<std::size_t> place(given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!is_given[i]) continue;
    const PipelineNode& replaced = body.node_of(given[i].target);
    PipelineNode node;
    node.id = given[i].node;
    node.place = replaced.place;
    node.info.name = replaced.info.name;
    node.info.outputs = {body.output_of(given[i].target)};
    node.mapped_axes = replaced.mapped_axes;
    place[i] = nodes.size();
    nodes.push_back(std::move(node));
  }
  const int count = int(nodes.size());
  const auto rewire = [&](Reference& source) {
    for (std::size_t i = 0; i < given.size(); ++i)
      if (is_given[i] && source.has_same_output(given[i].target)) {
        source.node = int(place[i]);
        source.output = 0;
        return;
      }
    source.node += count;
  };
  for (PipelineNode& node : result.nodes)
    for (Wire& wire : node.wires)
      for (Reference& source : wire.sources) rewire(source);
  for (PipelineOutput& output : result.outputs) rewire(output.source);
  nodes.insert(nodes.end(), std::make_move_iterator(result.nodes.begin()), std::make_move_iterator(result.nodes.end()));
  result.nodes = std::move(nodes);
  return result;
}

class RepetitionResolver {
 public:
  RepetitionResolver(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, Diagnostics& diagnostics)
      : written_(written),
        repeat_(*written.repetition),
        node_(node),
        input_texts_(input_texts),
        diagnostics_(diagnostics),
        made_(std::make_shared<Repetition>()) {}

  void resolve(const BodyReader& read_body) {
    std::vector<InputValue> inputs = inputs_of_body();
    const std::size_t faults_before = diagnostics_.size();
    const ReadBody read = read_body(std::move(inputs));
    body_ = &read.pipeline;
    if (diagnostics_.size() > faults_before || body_->nodes.empty()) return;
    made_->alone = *body_;
    made_->axis = !repeat_.over.empty() ? repeat_.over : repeat_.at_most == 1 ? "once" : "pass";
    made_->is_loop = repeat_.over.empty();
    made_->at_most = repeat_.at_most;
    made_->goes_on = repeat_.goes_on;
    if (!find_given() || !find_carried() || !find_until()) return;
    std::vector<bool> all(made_->given.size(), true), at_first(made_->given.size());
    for (std::size_t i = 0; i < all.size(); ++i) at_first[i] = find_named(written_.wires, made_->given[i].name);
    made_->body = with_given(*body_, made_->given, all);
    made_->first = with_given(*body_, made_->given, at_first);
    if (!check_inputs(read.incomplete)) return;
    name_ports();
  }

 private:
  std::vector<InputValue> inputs_of_body() {
    std::vector<InputValue> inputs;
    for (const auto& [name, value] : written_.options) {
      if (!value.value.IsScalar()) {
        diagnostics_.add(value.place, "input " + in_quotes(name) + " of the body must be one value");
        continue;
      }
      const auto text = input_texts_.put_into(value.value.Scalar(), value.place, value.inputs.get());
      is_complete_ = is_complete_ && text;
      if (!text) continue;
      inputs.push_back({name, *text, value.place});
    }
    return inputs;
  }

  bool find_given() {
    NodeIds ids;
    for (const PipelineNode& node : body_->nodes) {
      ids.index.emplace(node.id, ids.all.size());
      ids.all.push_back(node.id);
    }
    bool is_good = true;
    const auto add = [&](const std::string& name, const Place& place) {
      const Reference target = resolve_reference(name, place, nullptr, body_->nodes, ids, diagnostics_);
      if (target.node >= 0 && !target.items.empty())
        diagnostics_.add(place, in_quotes(name) + " names one item; only a whole output can be given to the body");
      is_good = is_good && target.node >= 0 && target.items.empty();
      for (const Repetition::Given& other : made_->given)
        if (target.node >= 0 && target.has_same_output(other.target)) {
          diagnostics_.add(place, in_quotes(name) + " is given twice, as " + in_quotes(other.name) + " too");
          is_good = false;
        }
      Repetition::Given given{name, target, "given " + name, {}, -1};
      if (target.node >= 0) given.axes = body_->axes_of(target);
      made_->given.push_back(std::move(given));
    };
    for (const auto& [name, value] : written_.wires) add(name, value.place);
    for (const auto& [name, value] : repeat_.carry)
      if (!find_named(written_.wires, name)) add(name, value.place);
    return is_good;
  }

  /// The index of the body's output of this name, or -1 with a fault.
  int output_named(const std::string& name, const Place& place) {
    for (std::size_t i = 0; i < body_->outputs.size(); ++i)
      if (body_->outputs[i].name == name) return int(i);
    diagnostics_.add(place, "the body has no output " + in_quotes(name),
                     suggested(diagnostics_, name, names_of(body_->outputs)));
    return -1;
  }

  const TypeInfo& type_of(const Reference& source) const { return body_->output_of(source).type; }

  bool find_carried() {
    const std::size_t before = diagnostics_.size();
    for (const auto& [name, value] : repeat_.carry) {
      if (!value.value.IsScalar()) {
        diagnostics_.add(value.place, "'carry' must name an output of the body for " + in_quotes(name));
        continue;
      }
      const int output = output_named(value.value.Scalar(), value.place);
      if (output < 0) continue;
      const Reference& source = body_->outputs[std::size_t(output)].source;
      for (Repetition::Given& given : made_->given) {
        if (given.name != name) continue;
        given.carried = output;
        const bool same_type = type_of(source) == type_of(given.target);
        if (same_type && body_->axes_of(source) == given.axes) continue;
        diagnostics_.add(value.place, "output " + in_quotes(value.value.Scalar()) + " of the body is " +
                                          (same_type ? axes_text(body_->axes_of(source)) : type_of(source).id) +
                                          ", but takes the place of " + in_quotes(name) + ", which is " +
                                          (same_type ? axes_text(given.axes) : type_of(given.target).id));
      }
    }
    if (made_->is_loop && repeat_.at_most > 1 && repeat_.carry.empty())
      diagnostics_.add(written_.place, "node " + in_quotes(written_.id) + " carries nothing from pass to pass",
                       "all passes would be the same; add  carry: {NODE: OUTPUT OF THE BODY}, or set  at_most: 1");
    return diagnostics_.size() == before;
  }

  bool find_until() {
    if (!repeat_.until_place.line && repeat_.until.empty()) return true;
    made_->until = output_named(repeat_.until, repeat_.until_place);
    if (made_->until < 0) return false;
    const Reference& source = body_->outputs[std::size_t(made_->until)].source;
    if (type_of(source).id == TypeInfo::of<Stop>().id && body_->axes_of(source).empty()) return true;
    diagnostics_.add(repeat_.until_place, "'until' must name one value of type stop, but " + in_quotes(repeat_.until) +
                                              " is " + type_of(source).id);
    return false;
  }

  /// Checks that all options are known of the nodes of the body that run.
  bool check_inputs(const std::set<std::string>& incomplete) {
    if (!is_complete_) return true;
    bool is_good = true;
    for (const Pipeline* pipeline : {&made_->first, &made_->body}) {
      const std::vector<bool> needed = pipeline->needed([&](const std::string& id) { return made_->is_given(id); });
      for (std::size_t i = 0; i < needed.size() && is_good; ++i) {
        const std::string& id = pipeline->nodes[i].id;
        if (!needed[i] || made_->is_given(id) || !incomplete.contains(id)) continue;
        diagnostics_.add(written_.place,
                         "node " + in_quotes(written_.id) + ": node " + in_quotes(id) +
                             " of the body needs an input of the body that has no value",
                         "give it as  with: {INPUT: VALUE},  or give the node's output under  in:");
        is_good = false;
      }
    }
    return is_good;
  }

  void name_ports() {
    const std::size_t inputs = written_.wires.size();
    for (std::size_t i = 0; i < inputs; ++i) {
      const Repetition::Given& given = made_->given[i];
      node_.info.inputs.push_back({given.name, "in the place of " + given.name + " of the body", type_of(given.target),
                                   false, given.axes.empty() ? "" : given.axes.back()});
    }
    for (const PipelineOutput& output : body_->outputs) {
      const std::vector<std::string> axes = body_->axes_of(output.source);
      const TypeInfo& type = type_of(output.source);
      if (type.is_function) {
        diagnostics_.add(written_.place,
                         "output " + in_quotes(output.name) + " of the body is a function (" + type.id + ")",
                         "the outputs of a body must be data; leave this one out");
        return;
      }
      if (contains(axes, made_->axis)) {
        diagnostics_.add(written_.place, "output " + in_quotes(output.name) + " of the body is itself a list over " +
                                             in_quotes(made_->axis));
        return;
      }
      const std::string last = "last_" + output.name;
      if (find_named(body_->outputs, last)) {
        diagnostics_.add(
            written_.place, "the body has the outputs " + in_quotes(output.name) + " and " + in_quotes(last),
            in_quotes(last) + " is already the name of the last " + in_quotes(output.name) + "; rename one of them");
        return;
      }
      node_.info.outputs.push_back({output.name, "of each pass", type, true, made_->axis});
      node_.info.outputs.push_back({last, "of the last pass", type, true, axes.empty() ? "" : axes.back()});
    }
    node_.info.name = "repeat";
    node_.info.summary = "runs its body again and again";
    node_.repetition = made_;
  }

  const WrittenNode& written_;
  const WrittenRepetition& repeat_;
  PipelineNode& node_;
  InputTexts& input_texts_;
  Diagnostics& diagnostics_;
  std::shared_ptr<Repetition> made_;
  const Pipeline* body_ = nullptr;
  bool is_complete_ = true;
};

}  // namespace

void resolve_repetition(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts,
                        const BodyReader& read_body, Diagnostics& diagnostics) {
  RepetitionResolver(written, node, input_texts, diagnostics).resolve(read_body);
}

void check_axes_of_repetition(const Pipeline& pipeline, const PipelineNode& node, Diagnostics& diagnostics) {
  const Repetition& repetition = *node.repetition;
  bool has_axis = false;
  for (const Wire& wire : node.wires)
    for (const Reference& source : wire.sources) {
      std::vector<std::string> axes = pipeline.axes_of(source);
      const std::vector<std::string> found = axes;
      if (!repetition.is_loop) has_axis |= std::erase(axes, repetition.axis) > 0;
      std::vector<std::string> expected = repetition.given[std::size_t(wire.port)].axes;
      if (wire.is_list_literal && !expected.empty()) expected.pop_back();
      const bool is_one = axes.empty() && expected.size() == 1;  // one item is taken as a list of one
      if (axes != expected && !is_one)
        diagnostics.add(source.place, "in a pass, " + in_quotes(node.input_of(wire).name) + " of the body is " +
                                          axes_text(expected) + ", but " + in_quotes(source.text) + " is " +
                                          axes_text(found));
    }
  if (!repetition.is_loop && !has_axis && diagnostics.empty())
    diagnostics.add(node.place,
                    "node " + in_quotes(node.id) + " goes over " + in_quotes(repetition.axis) +
                        ", but none of its inputs is a list over it",
                    "wire a list over it under  in:");
}

}  // namespace marrow
