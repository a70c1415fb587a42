// SPDX-License-Identifier: Apache-2.0
#include "experiment_check.hpp"

#include <set>

#include "runtime/one_node.hpp"
#include "runtime/pipeline_names.hpp"

namespace marrow::compare {
namespace {

class Checker {
 public:
  Checker(const WrittenExperiment& written, const Catalogue& catalogue, Diagnostics& diagnostics)
      : written_(written), experiment_(written.experiment), catalogue_(catalogue), diagnostics_(diagnostics) {}

  /// Returns the notes that all variants have.
  std::vector<std::string> check() {
    std::vector<std::string> notes;
    check_simulation();
    for (std::size_t v = 0; v < experiment_.variants.size(); ++v) {
      Diagnostics faults;
      const Pipeline pipeline =
          read_pipeline(experiment_.pipeline, arguments_of(experiment_, {v, 0, 0}, "case"), catalogue_, faults, true);
      diagnostics_.add_all(faults);  // a fault of every variant is reported once
      if (!faults.empty()) continue;
      if (v == 0) notes = pipeline.notes;
      std::erase_if(notes, [&](const std::string& note) { return !contains(pipeline.notes, note); });
      if (v == 0)
        check_names(pipeline);
      else
        check_figures_of(experiment_.variants[v], pipeline);
    }
    if (experiment_.tune) check_tuning(*experiment_.tune);
    return notes;
  }

 private:
  void check_simulation() {
    for (std::size_t c = 0; c < experiment_.cases.size(); ++c) {
      if (!experiment_.cases[c].is_simulated) continue;
      Diagnostics faults;
      const Pipeline pipeline = read_pipeline(experiment_.simulation.pipeline, simulation_arguments_of(experiment_, c),
                                              catalogue_, faults, true);
      diagnostics_.add_all(faults);
      if (faults.empty()) find_output(pipeline, experiment_.simulation.output, written_.simulation_place);
      return;  // the other cases differ only in numbers
    }
  }

  /// The optimizer, and the tuned options at both ends of their ranges.
  void check_tuning(const TuneRule& rule) {
    Diagnostics faults;
    pipeline_of_node(rule.optimizer, {}, rule.optimizer_options, catalogue_, faults);
    for (const Diagnostic& fault : faults.sorted()) diagnostics_.add(rule.optimizer_place, fault.message, fault.hint);
    if (const NodeInfo* info = catalogue_.find(rule.optimizer); info && info->kind() != "optimizer")
      diagnostics_.add(rule.optimizer_place, "'" + rule.optimizer + "' is no optimizer",
                       "marrow list optimizer  shows which there are");
    for (const double end : {0.0, 1.0}) {
      Experiment tuned = experiment_;
      add_tuned(tuned, rule.values_at(std::vector<double>(rule.options.size(), end)));
      Diagnostics at_end;
      read_pipeline(tuned.pipeline, arguments_of(tuned, {tuned.variants.size() - 1, 0, 0}, "case"), catalogue_, at_end,
                    true);
      diagnostics_.add_all(at_end);
    }
  }

  void check_names(const Pipeline& pipeline) {
    for (std::size_t i = 0; i < experiment_.metrics.size(); ++i)
      check_figure(pipeline, experiment_.metrics[i].path, written_.metric_places[i]);
    if (!experiment_.initial_error.empty())
      check_figure(pipeline, experiment_.initial_error, written_.initial_error_place);
    for (std::size_t i = 0; i < experiment_.pictures.size(); ++i)
      find_output(pipeline, experiment_.pictures[i], written_.picture_places[i]);
  }

  /// A variant may use a node whose output has another type. The names of the outputs are the same in all variants.
  void check_figures_of(const Variant& variant, const Pipeline& pipeline) {
    for (const PipelineOutput& output : pipeline.outputs)
      if (const PortInfo& port = port_of(pipeline, output); figures_.contains(output.name) && port.type.id != "metrics")
        diagnostics_.add(variant.place,
                         "in variant '" + variant.name + "' output '" + output.name + "' is " + port.type.id +
                             ", not figures of merit",
                         "name an output of an evaluate node");
  }

  static const PortInfo& port_of(const Pipeline& pipeline, const PipelineOutput& output) {
    return pipeline.nodes[std::size_t(output.source.node)].info.outputs[std::size_t(output.source.output)];
  }

  void check_figure(const Pipeline& pipeline, const std::string& path, const Place& place) {
    const std::string output = path.substr(0, path.find('.'));
    const PipelineOutput* found = find_output(pipeline, output, place);
    if (!found) return;
    const PortInfo& port = port_of(pipeline, *found);
    if (port.type.id != "metrics")
      return diagnostics_.add(place, "output '" + output + "' is " + port.type.id + ", not figures of merit",
                              "name an output of an evaluate node");
    figures_.insert(output);
    if (path.find('.') == std::string::npos)
      diagnostics_.add(place, "'" + path + "' does not say which figure",
                       "write it as  " + path + ".mtre_mm, with the items of its lists between");
  }

  const PipelineOutput* find_output(const Pipeline& pipeline, const std::string& name, const Place& place) {
    std::vector<std::string> names;
    for (const PipelineOutput& output : pipeline.outputs) {
      names.push_back(output.name);
      if (output.name == name) return &output;
    }
    diagnostics_.add(place, "the pipeline " + pipeline.name + " has no output '" + name + "'", suggestion(name, names));
    return nullptr;
  }

  const WrittenExperiment& written_;
  const Experiment& experiment_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  std::set<std::string> figures_;  ///< outputs that metrics and the initial error are taken from
};

}  // namespace

std::vector<std::string> check_pipelines(const WrittenExperiment& written, const Catalogue& catalogue,
                                         Diagnostics& diagnostics) {
  return Checker(written, catalogue, diagnostics).check();
}

}  // namespace marrow::compare
