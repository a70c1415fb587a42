// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "experiment_figures.hpp"
#include "experiment_sections.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::compare {
namespace {

struct CheckedPipelines {
  std::vector<std::string> notes;            ///< of all variants: what one variant does not use, another may need
  std::vector<NamedItem> items;              ///< Experiment::named_items
  std::vector<std::filesystem::path> files;  ///< of the pipelines

  void add_files(const Pipeline& pipeline) { files.insert(files.end(), pipeline.files.begin(), pipeline.files.end()); }
};

/// Reads the pipelines with the inputs of the cells and the changes of each variant. Checks that they have everything
/// that the experiment names.
class Checker {
 public:
  Checker(const WrittenExperiment& written, const Catalogue& catalogue, Diagnostics& diagnostics)
      : written_(written),
        experiment_(written.experiment),
        catalogue_(catalogue),
        diagnostics_(diagnostics),
        figures_(written.experiment, diagnostics) {}

  CheckedPipelines check() {
    CheckedPipelines checked;
    check_simulation(checked);
    for (std::size_t v = 0; v < experiment_.variants.size(); ++v) {
      Diagnostics faults;
      const Pipeline pipeline =
          read_pipeline(experiment_.pipeline, arguments_of(experiment_, {v, 0, 0}, "case"), catalogue_, faults, true);
      diagnostics_.add_all(faults);  // a fault of every variant is reported once
      if (!faults.empty()) continue;
      checked.add_files(pipeline);
      if (v == 0) checked.notes = pipeline.notes;
      std::erase_if(checked.notes, [&](const std::string& note) { return !contains(pipeline.notes, note); });
      figures_.check(v, pipeline);
      if (v == 0) check_pictures(pipeline);
    }
    if (experiment_.tune) check_tuning(*experiment_.tune);
    checked.items = figures_.items();
    return checked;
  }

 private:
  void check_simulation(CheckedPipelines& checked) {
    for (std::size_t c = 0; c < experiment_.cases.size(); ++c) {
      if (!experiment_.cases[c].is_simulated) continue;
      Diagnostics faults;
      const Pipeline pipeline = read_pipeline(experiment_.simulation.pipeline, simulation_arguments_of(experiment_, c),
                                              catalogue_, faults, true);
      diagnostics_.add_all(faults);
      checked.add_files(pipeline);
      if (faults.empty()) find_output(pipeline, experiment_.simulation.output, written_.simulation_place, diagnostics_);
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

  /// A report shows scenes and landscapes even if they are not named; they may be named too.
  void check_pictures(const Pipeline& pipeline) {
    for (std::size_t i = 0; i < experiment_.pictures.size(); ++i) {
      const PipelineOutput* output =
          find_output(pipeline, experiment_.pictures[i], written_.picture_places[i], diagnostics_);
      if (!output) continue;
      const TypeInfo& type = pipeline.output_of(output->source).type;
      const WriterInfo* writer = catalogue_.find_writer(type);
      if (!writer || writer->extension == ".png" || type == TypeInfo::of<Scene>() || type == TypeInfo::of<Landscape>())
        continue;
      diagnostics_.add(written_.picture_places[i], "output '" + output->name + "' is " + type.id + ", not a picture",
                       "name an output of a render node");
    }
  }

  const WrittenExperiment& written_;
  const Experiment& experiment_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  FigureChecker figures_;
};

/// The options of the displaced node that each start sets.
SetBySection options_of_starts(const StartProtocol& protocol) {
  SetBySection set{"'starts'", {}};
  for (const char* option : {"rotation_deg", "translation_mm"})
    set.names.push_back({protocol.node + "." + option, protocol.place});
  if (protocol.distance_mm > 0) set.names.push_back({protocol.node + ".distance_mm", protocol.place});
  return set;
}

/// Inputs that are given for all cases although each case has its own value. `case_input` is the one that gets the
/// case's folder, or empty.
void refuse_replaced_inputs(StrictYaml& yaml, const std::vector<InputValue>& inputs, const SeededInputs& seeded,
                            const Named& case_input) {
  SetBySection given{"'inputs'", {}}, drawn{"'draw'", {}}, seeds{"'seed_input'", {}};
  for (const InputValue& one : inputs) given.names.push_back({one.name, one.place});
  for (const DrawnInput& one : seeded.drawn) drawn.names.push_back({one.name, one.place});
  for (const auto& [name, place] : seeded.taking_seed) seeds.names.push_back({name, place});
  refuse_replaced(yaml, "the input", given, drawn);
  refuse_replaced(yaml, "the input", given, seeds);
  refuse_replaced(yaml, "the input", drawn, seeds);
  if (!case_input.name.empty()) refuse_replaced(yaml, "the input", given, {"'cases'", {case_input}});
}

}  // namespace

Experiment read_experiment(const std::filesystem::path& file, const Catalogue& catalogue, Diagnostics& diagnostics,
                           std::size_t more_cases) {
  WrittenExperiment written = read_written_experiment(file, diagnostics, more_cases);
  if (!diagnostics.empty()) return std::move(written.experiment);
  const CheckedPipelines checked = Checker(written, catalogue, diagnostics).check();
  Experiment& experiment = written.experiment;
  experiment.named_items = checked.items;
  experiment.notes = checked.notes;
  for (const std::filesystem::path& one : checked.files)
    if (std::find(experiment.files.begin(), experiment.files.end(), one) == experiment.files.end())
      experiment.files.push_back(one);
  return std::move(experiment);
}

SetBySection options_set_by(const std::string& section, const std::vector<Override>& changes) {
  SetBySection set{section, {}};
  for (const Override& one : changes) set.names.push_back({one.key, one.place});
  return set;
}

void refuse_replaced(StrictYaml& yaml, const std::string& what, const SetBySection& first, const SetBySection& later) {
  for (const Named& one : first.names)
    for (const Named& other : later.names)
      if (one.name == other.name)
        yaml.fault(one.place,
                   formatted("{} '{}' is set by {} and by {} in line {}, whose values would replace this one", what,
                             one.name, first.section, later.section, other.place.line),
                   "leave one of them out");
}

void refuse_replaced_values(StrictYaml& yaml, const Experiment& experiment, std::vector<SetBySection> combined,
                            const SetBySection& tuned) {
  const auto refuse = [&](const SetBySection& first, const SetBySection& later) {
    refuse_replaced(yaml, "the option", first, later);
  };
  if (experiment.protocol) {
    const SetBySection starts = options_of_starts(*experiment.protocol);
    refuse(options_set_by("'set'", experiment.common), starts);
    refuse(tuned, starts);
    combined.push_back(starts);
  }
  for (const Variant& variant : experiment.variants)
    for (const SetBySection& section : combined)
      refuse(options_set_by("variant '" + variant.name + "'", variant.overrides), section);
  for (std::size_t i = 0; i < combined.size(); ++i)
    for (std::size_t k = i + 1; k < combined.size(); ++k) refuse(combined[i], combined[k]);
  const bool has_folders = std::any_of(experiment.cases.begin(), experiment.cases.end(),
                                       [](const auto& one) { return one.is_simulated || !one.folder.empty(); });
  refuse_replaced_inputs(yaml, experiment.inputs, experiment.seeded,
                         {has_folders ? experiment.case_input : "", experiment.cases_place});
  refuse_replaced_inputs(yaml, experiment.simulation.inputs, experiment.simulation.seeded, {});
}

}  // namespace marrow::compare
