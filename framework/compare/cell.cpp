// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/cell.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "cell_fault.hpp"
#include "cell_key.hpp"
#include "marrow/domain/number_text.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/runtime/run_folder.hpp"
#include "marrow/runtime/types.hpp"
#include "marrow/runtime/verdicts.hpp"
#include "runtime/digest_memory.hpp"
#include "runtime/remove_tree.hpp"
#include "runtime/shared_store.hpp"
#include "runtime/text_file.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

/// Results of nodes that a cell may add to the shared store. With one file for each case, these are at most two files
/// a cell in all.
constexpr long kSharedFilesOfCell = 1;

const std::string kChanged = "a file that the cell needs was changed while it ran; run it again";

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  return parts;
}

Pipeline checked(const fs::path& file, const PipelineArguments& arguments, const Catalogue& catalogue) {
  Diagnostics diagnostics;
  Pipeline pipeline = read_pipeline(file, arguments, catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error("the pipeline has faults:\n" + diagnostics.text());
  return pipeline;
}

/// The figure that a path names. Nothing if a node failed that may fail; `absent` then gets a sentence about it. Throws
/// Error if it is missing for another reason or is not a finite number.
std::optional<marrow::Metric> figure(const Pipeline& pipeline, const RunResult& result, const std::string& path,
                                     std::string& absent) {
  const std::vector<std::string> parts = split(path);
  const auto output = std::find_if(pipeline.outputs.begin(), pipeline.outputs.end(),
                                   [&](const PipelineOutput& one) { return one.name == parts[0]; });
  Value value = value_of(result, output->source);
  std::size_t used = 1;
  for (; value.is_list(); ++used) {
    const auto item =
        used < parts.size() ? std::find(value.names.begin(), value.names.end(), parts[used]) : value.names.end();
    if (item == value.names.end()) {
      std::string names;
      for (const std::string& name : value.names) names += (names.empty() ? "" : ", ") + name;
      throw Error("'" + path + "': there are " + names + " along '" + value.axis + "', name one of them");
    }
    const Value picked = value.items[std::size_t(item - value.names.begin())];
    value = picked;
  }
  if (value.is_absent() && value.may_be_missing) {
    absent += (absent.empty() ? "'" : "; '") + path + "' is not there because " + value.missing;
    return std::nullopt;
  }
  if (value.is_absent())
    throw Error("'" + path + "' was not made" +
                (value.missing.empty() ? ": its case has no truth, or an item is absent" : ": " + value.missing));
  std::string name;
  for (; used < parts.size(); ++used) name += (name.empty() ? "" : ".") + parts[used];
  std::vector<std::string> known;
  for (const marrow::Metric& metric : value.as<Metrics>().items) {
    known.push_back(metric.name);
    if (metric.name != name) continue;
    if (!std::isfinite(metric.value))
      throw Error("'" + path + "' is " + formatted("%f", metric.value) + ", not a finite number");
    return metric;
  }
  throw Error("'" + path + "': there is no figure '" + name + "'; " + suggestion(name, known));
}

int evaluations_in(const Value& value) {
  int sum = 0;
  for (const Value& item : value.items) sum += evaluations_in(item);
  if (!value.is_list() && !value.is_absent() && value.type == TypeInfo::of<Pose>()) sum += value.as<Pose>().evaluations;
  return sum;
}

/// Whether a file has exactly this text. False also if the file is missing or cannot be read.
bool has_text(const fs::path& file, const std::string& text) {
  try {
    return read_text_file(file, kMostSourceBytes) == text;
  } catch (const Error&) {
    return false;
  }
}

/// The time that a cell took, if the store has it.
std::optional<double> kept_seconds(const Store& store, const Digest& key) {
  try {
    const auto kept = store.find(key);
    if (!kept) return std::nullopt;
    const Value& value = kept->outputs.at(0);
    if (value.source && !value.is_list()) return value.as<Metrics>().items.at(0).value;
  } catch (const std::exception&) {  // the entry is not valid: the time is measured again
  }
  store.drop(key);
  return std::nullopt;
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
    const PortInfo& port =
        pipeline.nodes[std::size_t(output.source.node)].info.outputs[std::size_t(output.source.output)];
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

CellRunner::Done CellRunner::run_into(const fs::path& folder, const Pipeline& pipeline, const CellIndex& cell,
                                      const std::function<void(const RunEvent&)>& observer) {
  remove_tree(folder);
  RunFolder written(folder, pipeline);
  RunSettings settings;
  settings.threads = threads_;
  settings.file_limits = file_limits_;
  settings.seed = seed_of(cell.case_index);
  settings.store = store_;
  settings.remember = false;
  settings.wanted_by_others = wanted_by_others(cell, pipeline);
  settings.observer = observer;
  Done done{run_pipeline(pipeline, catalogue_, settings), ""};
  const auto outputs = written.write_outputs(pipeline, done.result, catalogue_);
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
    fill(row, pipeline, done);
    if (row.failed.empty() && watched(cell, pipeline) != before) row.failed = kChanged;
  } catch (const std::exception& error) {
    row.failed = error.what();
  }
  if (!row.failed.empty()) {
    row.values.clear();
    row.absent.clear();
    row.verdict.reset();
    row.failure_probability.reset();
  }
  row.values.resize(experiment_.metrics.size());
  row.units.resize(experiment_.metrics.size());
  name_row(row, experiment_, cell);
  return row;
}

/// Throws Error if a figure is missing, unless a node failed that may fail.
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
  if (const std::vector<NamedVerdict> verdicts = verdicts_of(pipeline, done.result); !verdicts.empty()) {
    const Verdict worst = worst_of(verdicts);
    row.verdict = worst.judgement;
    if (std::isfinite(worst.failure_probability)) row.failure_probability = worst.failure_probability;
  }
  for (const MetricChoice& metric : experiment_.metrics) {
    const auto found = figure(pipeline, done.result, metric.path, row.absent);
    row.values.emplace_back();
    row.units.push_back(found ? found->unit : "");
    if (found)
      row.values.back() = metric.better == MetricChoice::Better::nearest_zero ? std::abs(found->value) : found->value;
  }
  if (experiment_.initial_error.empty()) return;
  if (const auto found = figure(pipeline, done.result, experiment_.initial_error, row.absent))
    row.initial_error = found->value;
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

std::vector<std::size_t> CellRunner::variants_with_nodes(const CellIndex& cell, const Pipeline& pipeline) {
  const std::string& case_name = experiment_.cases[cell.case_index].name;
  std::map<Digest, std::size_t> variants_with;
  for (std::size_t v = 0; v < experiment_.variants.size(); ++v) {
    const auto others = histories(
        pipeline_of({v, cell.case_index, cell.start}, case_folder(cell.case_index), Depth::figures), case_name);
    for (const Digest& one : std::set<Digest>(others.begin(), others.end())) ++variants_with[one];
  }
  std::vector<std::size_t> counts;
  for (const Digest& one : histories(pipeline, case_name)) counts.push_back(variants_with[one]);
  return counts;
}

std::set<std::string> CellRunner::own_nodes(const CellIndex& cell, const Pipeline& pipeline) {
  const std::vector<std::size_t> variants_with = variants_with_nodes(cell, pipeline);
  std::set<std::string> ids;
  for (std::size_t i = 0; i < variants_with.size(); ++i)
    if (experiment_.variants.size() == 1 || variants_with[i] < experiment_.variants.size())
      ids.insert(pipeline.nodes[i].id);
  return ids;
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

double CellRunner::time(const CellIndex& cell) {
  const Pipeline pipeline = pipeline_of(cell, case_folder(cell.case_index), Depth::figures);
  RunSettings settings;
  settings.threads = threads_;
  settings.file_limits = file_limits_;
  settings.seed = seed_of(cell.case_index);
  settings.store = store_;
  settings.remember = false;
  settings.made_anew = own_nodes(cell, pipeline);
  settings.wanted_by_others = wanted_by_others(cell, pipeline);
  Hasher hasher;
  const Watched before = watched(cell, pipeline);
  hasher.add(std::string("seconds"));
  hasher.add(before.key);
  hasher.add(std::int64_t(threads_));
  // In another experiment, the variants may share more or fewer nodes.
  for (const std::string& id : settings.made_anew) hasher.add(id);
  const Digest key = hasher.digest();
  if (const auto known = store_ ? kept_seconds(*store_, key) : std::nullopt) return *known;

  const RunResult result = run_pipeline(pipeline, catalogue_, settings);
  if (result.failed()) throw Error(reason_of(pipeline, result));
  if (watched(cell, pipeline) != before) throw Error(kChanged);
  Value seconds = Value::of(std::make_shared<const Metrics>(Metrics{{{"seconds", result.seconds, "s"}}}));
  seconds.key = seconds.type.content->hash(seconds.data.get());
  if (store_)
    store_->save(key, {seconds}, {"time of " + cell_id(experiment_, cell), {}, {}, {}, false, 0, result.seconds, {}});
  return result.seconds;
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
