// SPDX-License-Identifier: Apache-2.0
// The keys of cells and simulated cases. A key covers everything that a cell or case depends on, so that a kept one can
// be reused.
#include "cell_parts.hpp"

#include <map>
#include <set>

#include "marrow/base/machine.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/keys.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

/// The digest of what a path names. If it cannot be read, the text of the error is used instead: the node that needs
/// the file fails later and says why.
std::string content_now(const std::string& path) {
  try {
    return path_digest(path).hex();
  } catch (const Error& error) {
    return error.what();
  }
}

std::string with_all_replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

}  // namespace

Digest states_of_files(const Pipeline& pipeline) {
  Hasher hasher;
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    if (!needed[i]) continue;
    try {
      hasher.add(marrow::states_of_files(pipeline.nodes[i]));
    } catch (const Error& error) {
      hasher.add(std::string(error.what()));
    }
  }
  return hasher.digest();
}

std::string first_change(const Dependencies& before, const Catalogue& now) {
  for (const auto& [node, build_id] : before.builds)
    if (const LibraryInfo* library = now.library_of(node); !library || library->build_id != build_id)
      return "the plugin of " + node;
  for (const auto& [path, content] : before.contents)
    if (content_now(path) != content) return path;
  return "";
}

std::string CellRunner::content_of(const std::string& path, Look look) const {
  if (!keeps_dependencies_ || look == Look::anew) return content_now(path);
  std::map<std::string, std::string>& kept = dependencies_.contents;
  if (const auto found = kept.find(path); found != kept.end()) return found->second;
  return kept[path] = content_now(path);
}

/// The whole case counts, even if the nodes name only parts of it. The path of a simulated case does not count: it is
/// in a store, and hosts that share a comparison may have their stores at different places.
void CellRunner::add_pipeline(Hasher& hasher, const Pipeline& pipeline, const fs::path& case_folder, Look look) const {
  const std::string simulated = fs::absolute(store_ ? store_->cases() : folder_ / "cases").string() + "/";
  const std::string place = case_folder.empty() ? "" : fs::absolute(case_folder).string();
  const auto neutral = [&](const std::string& text) {
    return place.starts_with(simulated) ? with_all_replaced(text, place, "the simulated case") : text;
  };
  hasher.add(neutral(resolved_yaml(pipeline)));
  std::set<Digest> build_ids;
  std::map<std::string, std::string> paths;  // in an order that does not depend on the path of the case
  if (!place.empty()) paths.emplace(neutral(place), place);
  for (const PipelineNode* node : called_nodes(pipeline)) {
    const Digest build_id = catalogue_.library_of(node->info.name)->build_id;
    build_ids.insert(build_id);
    if (keeps_dependencies_) dependencies_.builds.emplace(node->info.name, build_id);
    for (const std::string& path : paths_of(*node)) paths.emplace(neutral(path), path);
  }
  for (const Digest& id : build_ids) hasher.add(id);
  for (const auto& [name, path] : paths) hasher.add(content_of(path, look));
}

fs::path CellRunner::place_of_simulated(std::size_t index, Look look) const {
  Hasher hasher;
  add_pipeline(hasher, simulation_of(index), {}, look);
  hasher.add(machine_digest());
  hasher.add(experiment_.cases[index].seed);
  return (store_ ? store_->cases() : folder_ / "cases") / hasher.digest().hex() / "outputs" /
         experiment_.simulation.output;
}

fs::path CellRunner::case_place(std::size_t index) const {
  const ExperimentCase& one = experiment_.cases[index];
  if (!one.is_simulated) return one.folder;
  if (!keeps_dependencies_) return place_of_simulated(index, Look::anew);
  if (const auto kept = places_.find(index); kept != places_.end()) return kept->second;
  return places_[index] = place_of_simulated(index, Look::may_be_kept);
}

std::string CellRunner::key_of(const CellIndex& cell, const Pipeline& pipeline) {
  Hasher hasher;
  add_pipeline(hasher, pipeline, case_folder(cell.case_index), Look::may_be_kept);
  hasher.add(seed_of(cell.case_index));
  for (const MetricChoice& metric : experiment_.metrics) {
    hasher.add(metric.path);
    hasher.add(metric.better == MetricChoice::Better::nearest_zero);  // the row then has the magnitude
  }
  hasher.add(experiment_.initial_error);
  return hasher.digest().hex() + "-" + machine_digest().hex();
}

std::string key_without_machine(const std::string& key) { return key.substr(0, key.find('-')); }

std::string CellRunner::key_of(const CellIndex& cell) {
  try {
    return key_of(cell, pipeline_of(cell, case_folder(cell.case_index), Depth::figures));
  } catch (const std::exception&) {
    return "";
  }
}

CellRunner::Watched CellRunner::watched(const CellIndex& cell, const Pipeline& pipeline) {
  const Digest states = states_of_files(pipeline);
  return {states, key_of(cell, pipeline)};
}

}  // namespace marrow::compare
