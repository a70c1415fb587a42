// SPDX-License-Identifier: Apache-2.0
#include "experiment_figures.hpp"

#include "axis_maker.hpp"
#include "figure_path.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/cell.hpp"
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

}  // namespace

const PipelineOutput* find_output(const Pipeline& pipeline, const std::string& name, const Place& place,
                                  Diagnostics& diagnostics) {
  for (const PipelineOutput& output : pipeline.outputs)
    if (output.name == name) return &output;
  diagnostics.add(place, "the pipeline " + pipeline.name + " has no output '" + name + "'",
                  suggestion(name, names_of(pipeline.outputs)));
  return nullptr;
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
