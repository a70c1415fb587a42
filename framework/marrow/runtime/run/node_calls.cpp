// SPDX-License-Identifier: Apache-2.0
// Makes a node's calls from its inputs, and its status and outputs from the results of the calls.
#include "marrow/runtime/run/node_calls.hpp"

#include "marrow/runtime/pipeline/may_fail.hpp"

namespace marrow {
namespace {

using Status = NodeRecord::Status;

std::string list_text(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return "(" + text + ")";
}

std::string short_name(const Pipeline& pipeline, const Reference& source) {
  return source.items.empty() ? pipeline.node_of(source).id : source.items.back();
}

/// Makes a list of one from a single item, because a list port may be given one item. If the value has other axes, this
/// is done for each innermost item. `name` is the name of the item.
Value as_list_of_one(const Value& value, const std::string& name, const std::string& axis) {
  Value result = value;
  if (value.is_list()) {
    for (Value& item : result.items) item = as_list_of_one(item, name, axis);
    return result;
  }
  if (value.is_absent()) return value;
  Value list;
  list.type = value.type;
  list.axis = axis;
  list.names = {name};
  list.items = {value};
  return list;
}

Value wired_value(const Pipeline& pipeline, const RunResult& result, const Wire& wire, const PortInfo& port) {
  if (!wire.is_list_literal) {
    Value value = value_of(result, wire.sources[0]);
    const std::vector<std::string> axes = pipeline.axes_of(wire.sources[0]);
    const bool has_axis = std::find(axes.begin(), axes.end(), port.axis) != axes.end();
    return port.axis.empty() || has_axis ? value
                                         : as_list_of_one(value, short_name(pipeline, wire.sources[0]), port.axis);
  }
  Value list;
  list.axis = port.axis;
  for (const Reference& source : wire.sources) {
    list.items.push_back(value_of(result, source));
    list.type = list.items.back().type;
    list.names.push_back(short_name(pipeline, source));
  }
  return list;
}

void spread(const PipelineNode& node, const std::vector<Value>& inputs, std::size_t depth, const std::string& item,
            NodeCalls& made) {
  if (depth == node.mapped_axes.size()) {
    made.calls.push_back({inputs, item, {}});
    return;
  }
  for (std::size_t k = 0; k < made.names[depth].size(); ++k) {
    std::vector<Value> slice = inputs;
    for (std::size_t i = 0; i < slice.size(); ++i)
      if (node.info.inputs[i].axis != node.mapped_axes[depth]) slice[i] = sliced(slice[i], node.mapped_axes[depth], k);
    spread(node, slice, depth + 1, item.empty() ? made.names[depth][k] : item + "/" + made.names[depth][k], made);
  }
}

int rank(Status status) {
  switch (status) {
    case Status::failed:
      return 5;
    case Status::cancelled:
      return 4;
    case Status::not_run:
      return 3;
    case Status::failed_alone:
      return 2;
    case Status::skipped:
      return 1;
    default:
      return 0;
  }
}

Value assembled(const PipelineNode& node, const NodeCalls& made, std::size_t output, std::size_t depth,
                std::size_t& next) {
  if (depth < made.names.size() && !(made.names[depth].size() == 1 && made.names[depth][0].empty())) {
    Value list;
    list.type = node.info.outputs[output].type;
    list.axis = node.mapped_axes[depth];
    list.names = made.names[depth];
    for (std::size_t k = 0; k < list.names.size(); ++k)
      list.items.push_back(assembled(node, made, output, depth + 1, next));
    return list;
  }
  const CallResult& result = made.calls[next++].result;
  if (result.status == Status::done) return result.outputs[output];
  Value absent;
  absent.type = node.info.outputs[output].type;
  absent.may_be_missing = result.status == Status::failed_alone;
  if (result.status == Status::failed || absent.may_be_missing)
    absent.missing = "node '" + node.id + "' failed";
  else if (result.status != Status::skipped)
    absent.missing = result.reason;
  return absent;
}

}  // namespace

void make_calls(const Pipeline& pipeline, const RunResult& result, std::size_t index, NodeCalls& made) {
  const PipelineNode& node = pipeline.nodes[index];
  std::vector<Value> inputs(node.info.inputs.size());
  for (const Wire& wire : node.wires)
    inputs[std::size_t(wire.port)] = wired_value(pipeline, result, wire, node.input_of(wire));
  for (const std::string& axis : node.mapped_axes) {
    std::vector<std::string> names;
    std::string first;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (node.info.inputs[i].axis == axis) continue;  // the node takes the whole list
      const std::vector<std::string> along = names_along(inputs[i], axis);
      if (along.empty()) continue;
      if (names.empty()) {
        names = along;
        first = node.info.inputs[i].name;
      } else if (names != along) {
        throw Error("inputs '" + first + "' and '" + node.info.inputs[i].name + "' do not go in step along '" + axis +
                    "': the first has " + list_text(names) + ", the second " + list_text(along));
      }
    }
    if (names.empty()) {
      expect_items(pipeline, node, inputs, axis);
      names = {""};  // the whole list is absent
    }
    made.names.push_back(std::move(names));
  }
  spread(node, inputs, 0, "", made);
}

std::string obstacle(const PipelineNode& node, Call& call, Status& status) {
  bool may_be_missing = false;
  for (std::size_t i = 0; i < call.inputs.size(); ++i) {
    const PortInfo& port = node.info.inputs[i];
    std::vector<const Value*> leaves{&call.inputs[i]};
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      const Value* value = leaves[k];
      for (const Value& item : value->items) leaves.push_back(&item);
      if (!value->is_absent()) continue;
      may_be_missing |= value->may_be_missing;
      if (value->may_be_missing) continue;
      status = Status::not_run;
      if (!value->missing.empty()) return value->missing;  // the first cause, however many nodes back
      status = Status::skipped;
      if (!port.optional) return "there is no '" + port.name + "'";
    }
  }
  if (!may_be_missing) return "";
  std::string reason = leave_out_failed(node, call.inputs);
  if (!reason.empty()) status = Status::failed;
  return reason;
}

void set_status(const std::vector<Call>& calls, NodeRecord& record) {
  // If all calls of a node are deferred, the node is not needed until a node that runs asks for what it makes.
  const bool deferred = !calls.empty() && std::all_of(calls.begin(), calls.end(),
                                                      [](const Call& call) { return call.result.is_deferred; });
  record.status = deferred ? Status::not_needed : Status::done;
  for (const Call& call : calls) {
    // The node gets the status of its worst call. `failed` is worse than what follows from failures of other nodes.
    static constexpr Status kOrder[] = {Status::failed, Status::cancelled, Status::not_run, Status::failed_alone,
                                        Status::skipped};
    for (Status status : kOrder)
      if (call.result.status == status && rank(status) > rank(record.status)) {
        record.status = status;
        record.reason = (call.item.empty() ? "" : call.item + ": ") + call.result.reason;
      }
  }
}

Value output_of(const PipelineNode& node, const NodeCalls& made, std::size_t output) {
  std::size_t next = 0;
  return assembled(node, made, output, 0, next);
}

Value picked(const Value& value, const std::string& item, const std::string& reference) {
  if (value.is_absent()) return value;
  const auto found = std::find(value.names.begin(), value.names.end(), item);
  if (found == value.names.end())
    throw Error("'" + reference + "': there is no '" + item + "' along the axis '" + value.axis + "'; " +
                suggestion(item, value.names));
  return value.items[std::size_t(found - value.names.begin())];
}

std::vector<std::string> names_along(const Value& value, const std::string& axis) {
  if (value.axis == axis) return value.names;
  for (const Value& item : value.items) {
    std::vector<std::string> names = names_along(item, axis);
    if (!names.empty()) return names;
  }
  return {};
}

Value sliced(const Value& value, const std::string& axis, std::size_t index) {
  if (!value.is_list()) return value;
  if (value.axis == axis) return value.items.at(index);
  Value result = value;
  for (Value& item : result.items) item = sliced(item, axis, index);
  return result;
}

Digest key_of(const Value& value) {
  if (!value.is_list()) return value.key;
  Hasher hasher;
  hasher.add(value.axis);
  hasher.add(value.names);
  for (const Value& item : value.items) hasher.add(key_of(item));
  return hasher.digest();
}

}  // namespace marrow
