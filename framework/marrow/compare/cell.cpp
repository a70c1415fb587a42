// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/cell.hpp"

#include <cmath>

#include "cell_parts.hpp"
#include "experiment_figures.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "marrow/runtime/store/digest_memory.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

/// Results of nodes that a cell may add to the shared store. With one file for each case, these are at most two files
/// a cell in all.
constexpr long kSharedFilesOfCell = 1;

/// A path names a figure, or an item along an axis, that does not exist.
struct UnknownName : Error {
  UnknownName(const std::string& message, std::string along) : Error(message), axis(std::move(along)) {}
  std::string axis;  ///< empty if it is the name of a figure
};

/// A figure is not made although no node failed: a node lacks an input.
struct NotMade : Error {
  using Error::Error;
};

constexpr std::size_t kMostFigures = 20;  // that a message names

/// Why a figure is not made, and which ones can be.
std::string without_truth_text(const Pipeline& pipeline) {
  std::vector<std::string> figures = figures_without_truth(pipeline);
  const std::size_t more = figures.size() - std::min(figures.size(), kMostFigures);
  figures.resize(figures.size() - more);
  return ": its case has no truth, or an item is absent; without a truth this pipeline gives " +
         (figures.empty() ? std::string("no figures") : joined(figures, ", ")) +
         (more ? formatted(" and {} more", more) : "");
}

Pipeline checked(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(file, arguments, catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error("the pipeline has faults:\n" + diagnostics.text());
  return pipeline;
}

/// The figure that a path names. Nothing if a node that may fail has failed; a sentence about it is then added to
/// `absent`. Throws Error if the figure is missing for another reason or is not finite.
std::optional<marrow::Metric> figure(const Pipeline& pipeline, const RunResult& result, const std::string& path,
                                     std::string& absent) {
  const std::vector<std::string> parts = parts_of_path(path);
  Value value = value_of(result, find_named(pipeline.outputs, parts[0])->source);
  std::size_t used = 1;
  for (; value.is_list(); ++used) {
    const auto item =
        used < parts.size() ? std::find(value.names.begin(), value.names.end(), parts[used]) : value.names.end();
    if (item == value.names.end()) {
      throw UnknownName(
          "'" + path + "': there are " + joined(value.names, ", ") + " along '" + value.axis + "', name one of them",
          value.axis);
    }
    const Value picked = value.items[std::size_t(item - value.names.begin())];
    value = picked;
  }
  if (value.is_absent() && value.may_be_missing) {
    absent += (absent.empty() ? "'" : "; '") + path + "' is not there because " + value.missing;
    return std::nullopt;
  }
  if (value.is_absent() && value.missing.empty()) throw NotMade("'" + path + "' was not made");
  if (value.is_absent()) throw Error("'" + path + "' was not made: " + value.missing);
  const std::string name = figure_from(parts, used);
  std::vector<std::string> known;
  for (const marrow::Metric& metric : value.as<Metrics>().items) {
    known.push_back(metric.name);
    if (metric.name != name) continue;
    if (!std::isfinite(metric.value)) throw Error(formatted("'{}' is {:f}, not a finite number", path, metric.value));
    return metric;
  }
  throw UnknownName("'" + path + "': there is no figure '" + name + "'; " + suggestion(name, known), "");
}

/// The beginning of a metric's path: "verdict.distal".
std::string verdict_place(const NamedVerdict& one) {
  std::string item = one.item;
  std::replace(item.begin(), item.end(), '/', '.');
  return one.output + (item.empty() ? "" : "." + item);
}

CellRow::Figures verdict_figures_of(const Verdict& verdict) {
  CellRow::Figures figures;
  for (const marrow::Metric& one : verdict.figures)
    figures[one.name] = std::isfinite(one.value) ? std::optional(one.value) : std::nullopt;
  return figures;
}

int evaluations_in(const Value& value) {
  int sum = 0;
  for (const Value& item : value.items) sum += evaluations_in(item);
  if (!value.is_list() && !value.is_absent() && value.type == TypeInfo::of<Pose>()) sum += value.as<Pose>().evaluations;
  return sum;
}

/// The names along an axis, at any level of nested lists. These may have different items.
void add_names_along(const Value& value, const std::string& axis, std::vector<std::string>& names) {
  if (value.axis == axis)
    for (const std::string& name : value.names)
      if (!contains(names, name)) names.push_back(name);
  for (const Value& item : value.items) add_names_along(item, axis, names);
}

/// Whether a file has exactly this text. False also if the file is missing or cannot be read.
bool has_text(const fs::path& file, const std::string& text) {
  try {
    return read_text_file(file, kMostSourceBytes) == text;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

std::string reason_of(const Pipeline& pipeline, const RunResult& result) {
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    if (result.nodes[i].status == NodeRecord::Status::failed || result.nodes[i].status == NodeRecord::Status::cancelled)
      return "node '" + pipeline.nodes[i].id + "' (" + pipeline.nodes[i].info.name +
             ") failed: " + result.nodes[i].reason;
  return "";
}

CellRunner::CellRunner(const Experiment& experiment, const Catalogue& catalogue, const Store* store, fs::path folder,
                       int threads, const FileLimits& file_limits)
    : experiment_(experiment),
      catalogue_(catalogue),
      store_(store),
      folder_(std::move(folder)),
      threads_(threads),
      file_limits_(file_limits) {
  if (!store_) return;
  keep_digests_in(store_->folder());
  if (SharedStore* shared = store_->shared()) shared->allow_files(0);  // none before the first cell
}

fs::path CellRunner::folder_of(const CellIndex& cell) const { return folder_ / "cells" / cell_id(experiment_, cell); }

Pipeline CellRunner::simulation_of(std::size_t index) const {
  Pipeline pipeline = checked(experiment_.simulation.pipeline, simulation_arguments_of(experiment_, index), catalogue_);
  std::erase_if(pipeline.outputs,
                [&](const PipelineOutput& output) { return output.name != experiment_.simulation.output; });
  return pipeline;
}

std::uint64_t CellRunner::seed_of(std::size_t index) const {
  const ExperimentCase& one = experiment_.cases[index];
  return one.is_simulated || !one.folder.empty() ? 1 : one.seed;
}

Pipeline CellRunner::pipeline_of(const CellIndex& cell, const fs::path& case_folder, Depth depth) const {
  Pipeline pipeline = checked(experiment_.pipeline, arguments_of(experiment_, cell, case_folder), catalogue_);
  std::set<std::string> wanted;
  if (depth == Depth::pictures) wanted.insert(experiment_.pictures.begin(), experiment_.pictures.end());
  for (const MetricChoice& metric : experiment_.metrics) wanted.insert(metric.path.substr(0, metric.path.find('.')));
  if (!experiment_.initial_error.empty())
    wanted.insert(experiment_.initial_error.substr(0, experiment_.initial_error.find('.')));
  std::erase_if(pipeline.outputs, [&](const PipelineOutput& output) {
    const PortInfo& port = pipeline.output_of(output.source);
    const bool is_shown =
        depth == Depth::pictures && (port.type == TypeInfo::of<Scene>() || port.type == TypeInfo::of<Landscape>());
    return !wanted.contains(output.name) && !is_shown && port.type != TypeInfo::of<Pose>() &&
           port.type != TypeInfo::of<Verdict>();
  });
  return pipeline;
}

std::optional<CellRow> CellRunner::finished(const CellIndex& cell, const std::string& key) const {
  try {
    CellRow row = row_from_json(read_text_file(folder_of(cell) / "cell.json", kMostSourceBytes), experiment_);
    if (!row.failed.empty() || key.empty() || row.key != key) return std::nullopt;
    name_row(row, experiment_, cell);
    return row;
  } catch (const std::exception&) {  // there is no valid row: the cell runs again, and says what is wrong
    return std::nullopt;
  }
}

std::string CellRunner::fault_of_row(const CellIndex& cell) const {
  const fs::path file = folder_of(cell) / "cell.json";
  std::error_code error;
  if (!fs::exists(file, error)) return "";
  try {
    return fault_of_written_row(read_text_file(file, kMostSourceBytes));
  } catch (const Error& fault) {
    return fault.what();
  }
}

RunSettings CellRunner::settings_of(const CellIndex& cell) const {
  RunSettings settings;
  settings.threads = threads_;
  settings.file_limits = file_limits_;
  settings.seed = seed_of(cell.case_index);
  settings.store = store_;
  settings.remember = false;
  return settings;
}

RunRecipe CellRunner::recipe_of(const CellIndex& cell, const Pipeline& pipeline) const {
  return recipe_of_run(pipeline, settings_of(cell));
}

CellRunner::Done CellRunner::run_into(const fs::path& folder, const Pipeline& pipeline, const CellIndex& cell,
                                      const std::function<void(const RunEvent&)>& observer) {
  remove_tree(folder);
  RunFolder written(folder, pipeline);
  RunSettings settings = settings_of(cell);
  settings.wanted_by_others = wanted_by_others(cell, pipeline);
  settings.observer = observer;
  written.keep_failed_calls(settings, catalogue_);
  Done done{run_pipeline(pipeline, catalogue_, settings), ""};
  const auto outputs = written.write_outputs(pipeline, done.result, catalogue_, recipe_of(cell, pipeline));
  written.write_record(pipeline, done.result, settings, catalogue_,
                       arguments_of(experiment_, cell, case_folder(cell.case_index)), outputs);
  done.fault = reason_of(pipeline, done.result);
  for (const RunFolder::Written& output : outputs)
    if (done.fault.empty() && !output.fault.empty() && !output.fault.starts_with("not made"))
      done.fault = "output '" + output.output + "': " + output.fault;
  return done;
}

CellRow CellRunner::run(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer) {
  CellRow row;
  try {
    const Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::figures);
    const Watched before = watched(cell, pipeline);
    row.key = before.key;
    if (SharedStore* shared = store_ ? store_->shared() : nullptr) shared->allow_files(kSharedFilesOfCell);
    const Done done = run_into(folder_of(cell), pipeline, cell, observer);
    try {
      fill(row, pipeline, done);
    } catch (const NotMade& error) {
      row.lacks_figure = true;
      const auto arguments = arguments_of(experiment_, cell, case_folder(cell.case_index));
      throw Error(error.what() + without_truth_text(checked(experiment_.pipeline, arguments, catalogue_)));
    }
    if (row.failed.empty() && watched(cell, pipeline) != before) row.failed = kChanged;
  } catch (const UnknownName& error) {
    row.failed = error.what();
    // Items that were known before the comparison may be missing in this case only.
    row.lacks_figure = std::none_of(experiment_.named_items.begin(), experiment_.named_items.end(),
                                    [&](const NamedItem& one) { return one.axis == error.axis; });
  } catch (const std::exception& error) {
    row.failed = error.what();
  }
  if (!row.failed.empty()) {
    row.values.clear();
    row.units.clear();
    row.absent.clear();
    row.verdict.reset();
    row.failure_probability.reset();
    row.verdict_figures.clear();
    row.poses.clear();
  }
  row.values.resize(experiment_.metrics.size());
  row.units.resize(experiment_.metrics.size());
  name_row(row, experiment_, cell);
  return row;
}

/// Throws Error if a figure is missing, unless a node that may fail has failed.
void CellRunner::fill(CellRow& row, const Pipeline& pipeline, const Done& done) const {
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const NodeRecord& node = done.result.nodes[i];
    if (!node.calls && !node.cached) continue;
    row.nodes[pipeline.nodes[i].id] = {node.calls, node.cached, node.seconds + node.cached_seconds};
  }
  row.failed = done.fault;
  for (const PipelineOutput& output : pipeline.outputs)
    row.evaluations += evaluations_in(value_of(done.result, output.source));
  if (!row.failed.empty()) return;
  const std::vector<NamedVerdict> verdicts = verdicts_of(pipeline, done.result);
  row.poses = poses_of(pipeline, done.result, verdicts);
  if (!verdicts.empty()) {
    const Verdict worst = worst_of(verdicts);
    row.verdict = worst.judgement;
    if (std::isfinite(worst.failure_probability)) row.failure_probability = worst.failure_probability;
    for (const NamedVerdict& one : verdicts) row.verdict_figures[verdict_place(one)] = verdict_figures_of(one.verdict);
  }
  for (const MetricChoice& metric : experiment_.metrics) {
    const auto found = figure(pipeline, done.result, metric.path, row.absent);
    row.values.emplace_back();
    row.units.push_back(found ? found->unit : "");
    if (found)
      row.values.back() = metric.better == MetricChoice::Better::nearest_zero ? std::abs(found->value) : found->value;
  }
  if (experiment_.initial_error.empty()) return;
  if (const auto found = figure(pipeline, done.result, experiment_.initial_error, row.absent)) {
    row.initial_error = found->value;
    row.initial_error_unit = found->unit;
  }
}

fs::path CellRunner::pictures_of(const CellIndex& cell) const {
  return folder_ / "pictures" / cell_id(experiment_, cell);
}

bool CellRunner::draw(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer) {
  const fs::path folder = pictures_of(cell);
  const Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::pictures);
  const Watched before = watched(cell, pipeline);
  if (has_text(folder / "key.txt", before.key + "\n")) return false;
  const Done done = run_into(folder, pipeline, cell, observer);
  if (!done.fault.empty()) throw Error(done.fault);
  if (watched(cell, pipeline) != before) throw Error(kChanged);
  write_text_file(folder / "key.txt", before.key + "\n");
  return true;
}

const std::set<std::string>& CellRunner::wanted_by_others(const CellIndex& cell, const Pipeline& pipeline) {
  const auto [known, is_new] = wanted_.try_emplace(cell.variant);
  std::set<std::string>& wanted = known->second;
  if (!is_new || !store_ || !store_->shared()) return wanted;
  const std::vector<std::size_t> variants_with = variants_with_nodes(cell, pipeline);
  const std::vector<Dependence> depends = dependences(pipeline, experiment_);
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    if (variants_with[i] > 1 || (experiment_.starts.size() > 1 && !depends[i].on_start) ||
        (experiment_.cases.size() > 1 && !depends[i].on_case))
      wanted.insert(pipeline.nodes[i].id);
  return wanted;
}

std::vector<std::string> CellRunner::items_of(const CellIndex& cell, const NamedItem& asked) {
  Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::figures);
  const auto node = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(),
                                 [&](const PipelineNode& one) { return one.id == asked.node; });
  if (node == pipeline.nodes.end() || std::size_t(asked.output) >= node->info.outputs.size())
    throw Error("the pipeline has no such node '" + asked.node + "' any more");
  const Reference list{asked.node, {}, int(node - pipeline.nodes.begin()), asked.output, {}};
  pipeline.outputs = {{"items", list}};
  const RunResult result = run_pipeline(pipeline, catalogue_, settings_of(cell));
  if (result.failed()) throw Error(reason_of(pipeline, result));
  std::vector<std::string> names;
  add_names_along(value_of(result, list), asked.axis, names);
  return names;
}

void CellRunner::write(const CellIndex& cell, CellRow& row) const {
  try {
    const fs::path folder = folder_of(cell);
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Error("the folder " + folder.string() + " cannot be made: " + error.message());
    write_text_file(folder / "cell.json", to_json(row) + "\n");
  } catch (const Error& error) {
    if (!row.failed.empty()) return;  // the first reason is more useful
    const int tries = row.tries;
    row = failed_row(experiment_, cell, error.what(), tries);
  }
}

}  // namespace marrow::compare
