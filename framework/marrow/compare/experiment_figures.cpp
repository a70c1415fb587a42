// SPDX-License-Identifier: Apache-2.0
#include "experiment_figures.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/output_faults.hpp"

namespace marrow::compare {
namespace {

std::string in_capitals(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = char(c - 'a' + 'A');
  return text;
}

/// "errors.FRAGMENT.STAGE.", for a figure of an output that is a list over fragments and stages.
std::string start_of_path(const std::string& output, const std::vector<std::string>& axes) {
  std::string text = output + ".";
  for (const std::string& axis : axes) text += in_capitals(axis) + ".";
  return text;
}

/// An output that is a list over an axis, of a node that is not called along this axis. So this node names the items.
struct AxisMaker {
  int node = -1, output = -1;
};

bool takes_long(const PipelineNode& node) {
  return node.repetition || std::any_of(node.info.outputs.begin(), node.info.outputs.end(),
                                        [](const PortInfo& output) { return output.type.is_function; });
}

class MakerSearch {
 public:
  MakerSearch(const Pipeline& pipeline, const std::string& axis) : pipeline_(pipeline), axis_(axis) {}

  void look_at(const Reference& value) {
    const PipelineNode& node = pipeline_.node_of(value);
    if (node.repetition) return;
    if (pipeline_.output_of(value).axis == axis_) return consider({value.node, value.output});
    if (!seen_.insert(value.node).second) return;
    for (const Wire& wire : node.wires) {
      if (node.input_of(wire).axis == axis_) continue;  // it takes the whole list
      for (const Reference& source : wire.sources)
        if (contains(pipeline_.axes_of(source), axis_)) look_at(source);
    }
  }

  const std::vector<AxisMaker>& best() const { return best_; }

 private:
  void consider(const AxisMaker& maker) {
    std::set<int> needed{maker.node}, open = needed;
    while (!open.empty()) {
      const PipelineNode& node = pipeline_.nodes[std::size_t(*open.begin())];
      open.erase(open.begin());
      if (takes_long(node)) return;
      for (const Wire& wire : node.wires)
        for (const Reference& source : wire.sources)
          if (needed.insert(source.node).second) open.insert(source.node);
    }
    if (!best_.empty() && needed.size() > fewest_) return;
    if (!best_.empty() && needed.size() < fewest_) best_.clear();
    best_.push_back(maker);
    fewest_ = needed.size();
  }

  const Pipeline& pipeline_;
  const std::string& axis_;
  std::set<int> seen_;
  std::vector<AxisMaker> best_;
  std::size_t fewest_ = 0;
};

/// The outputs that name the items along one axis of a value. All inputs of a node have the same items along an axis,
/// so there may be several such outputs. Returns those that need the fewest other nodes, because one of them may be
/// absent in a case. Empty if each needs a cost, a projector, an optimizer or a repeated body: these take as long as a
/// registration.
std::vector<AxisMaker> quick_makers(const Pipeline& pipeline, const Reference& value, const std::string& axis) {
  MakerSearch search(pipeline, axis);
  search.look_at(value);
  return search.best();
}

}  // namespace

std::vector<std::string> parts_of_path(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t dot; (dot = path.find('.', begin)) != std::string::npos; begin = dot + 1)
    parts.push_back(path.substr(begin, dot - begin));
  parts.push_back(path.substr(begin));
  return parts;
}

std::string figure_from(const std::vector<std::string>& parts, std::size_t first) {
  std::string name;
  for (std::size_t i = first; i < parts.size(); ++i) name += (i == first ? "" : ".") + parts[i];
  return name;
}

const PipelineOutput* find_output(const Pipeline& pipeline, const std::string& name, const Place& place,
                                  Diagnostics& diagnostics) {
  if (const PipelineOutput* output = find_named(pipeline.outputs, name)) return output;
  diagnostics.add(place, "the pipeline " + pipeline.name + " has no output '" + name + "'",
                  suggestion(name, names_of(pipeline.outputs)));
  return nullptr;
}

std::vector<std::string> figures_without_truth(const Pipeline& pipeline) {
  std::vector<bool> is_called(pipeline.nodes.size());
  const auto is_there = [&](const Reference& source) {
    return is_called[std::size_t(source.node)] && pipeline.output_of(source).type != TypeInfo::of<Truth>();
  };
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    is_called[i] = std::all_of(pipeline.nodes[i].wires.begin(), pipeline.nodes[i].wires.end(), [&](const Wire& wire) {
      return pipeline.nodes[i].input_of(wire).optional ||
             std::any_of(wire.sources.begin(), wire.sources.end(), is_there);
    });
  std::vector<std::string> paths;
  for (const PipelineOutput& output : pipeline.outputs) {
    const PortInfo& port = pipeline.output_of(output.source);
    if (!is_there(output.source) || port.type.id != "metrics") continue;
    const std::string start = start_of_path(output.name, pipeline.axes_of(output.source));
    for (const std::string& figure : port.figures) paths.push_back(start + figure);
    if (port.figures.empty()) paths.push_back(start + "*");
  }
  return paths;
}

void FigureChecker::check(std::size_t variant, const Pipeline& pipeline) {
  for (const MetricChoice& metric : experiment_.metrics) check(variant, pipeline, metric.path, metric.place);
  if (!experiment_.initial_error.empty())
    check(variant, pipeline, experiment_.initial_error, experiment_.initial_error_place);
}

void FigureChecker::check(std::size_t variant, const Pipeline& pipeline, const std::string& path, const Place& place) {
  if (faulty_.contains(path)) return;
  Diagnostics faults;
  look_at(variant, pipeline, path, place, faults);
  if (variant == 0 && !faults.empty()) faulty_.insert(path);
  diagnostics_.add_all(faults);  // two figures of one output may have the same fault
}

void FigureChecker::look_at(std::size_t variant, const Pipeline& pipeline, const std::string& path, const Place& place,
                            Diagnostics& faults) {
  const std::vector<std::string> parts = parts_of_path(path);
  const PipelineOutput* output = find_output(pipeline, parts[0], place, faults);
  if (!output) return;
  // A variant may use another node, whose output has another type, other lists or other figures.
  const Variant& own = experiment_.variants[variant];
  const std::string subject = (variant == 0 ? "" : "in variant '" + own.name + "' ") + "output '" + output->name + "'";
  const PortInfo& port = pipeline.output_of(output->source);
  if (port.type.id != "metrics")
    return faults.add(variant == 0 ? place : own.place, subject + " is " + port.type.id + ", not figures of merit",
                      "name an output of an evaluate node");
  const std::vector<std::string> axes = pipeline.axes_of(output->source);
  const std::string start = start_of_path(output->name, axes);
  if (parts.size() == 1)
    return faults.add(place, "'" + path + "' does not say which figure", "write it as  " + start + "FIGURE");
  if (parts.size() < axes.size() + 2)
    return faults.add(place,
                      "'" + path + "' has too few parts: " + subject + " is a list over " + joined(axes, " and "),
                      "write it as  " + start + parts.back());
  const std::string figure = figure_from(parts, axes.size() + 1);
  if (!may_have_figure(port, figure))
    return faults.add(place,
                      subject + " (" + pipeline.node_of(output->source).info.name + ") has no figure '" + figure + "'",
                      suggestion(figure, port.figures));
  add_items(variant, pipeline, *output, parts, {path, {}, {}, place, variant, {}, 0});
}

void FigureChecker::add_items(std::size_t variant, const Pipeline& pipeline, const PipelineOutput& output,
                              const std::vector<std::string>& parts, NamedItem item) {
  const std::vector<std::string> axes = pipeline.axes_of(output.source);
  std::vector<Digest> alike;  // nodes with equal digests give equal results
  for (std::size_t i = 0; i < axes.size(); ++i)
    for (const AxisMaker& maker : quick_makers(pipeline, output.source, axes[i])) {
      if (alike.empty()) alike = histories(pipeline, "");
      const std::string made_from = formatted("{}{}", alike[std::size_t(maker.node)].hex(), maker.output);
      if (!known_items_.insert(item.path + "\n" + axes[i] + "\n" + made_from).second) continue;
      item.item = parts[i + 1];
      item.axis = axes[i];
      item.variant = variant;
      item.node = pipeline.nodes[std::size_t(maker.node)].id;
      item.output = maker.output;
      items_.push_back(item);
    }
}

}  // namespace marrow::compare
