// SPDX-License-Identifier: Apache-2.0
// The simulated cases of an experiment: they are found in the store, copied from the shared store, or made.
// And the keys of cells and simulated cases. A key covers everything that a cell or case depends on, so that a kept one
// can be reused.
#include <map>
#include <set>

#include "cell_parts.hpp"
#include "marrow/base/machine.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "marrow/runtime/store/shared_folder.hpp"
#include "marrow/runtime/store/shared_store.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

/// The folder of a simulated case, from the path of its outputs.
fs::path case_folder_of(const fs::path& outputs) { return outputs.parent_path().parent_path(); }

/// The hash of a case's content. The file content.txt of a simulated case holds it, and is written last. A case that
/// does not match its hash is not whole, and is made again.
std::string content_of_case(const fs::path& outputs) { return path_digest(outputs).hex(); }

bool is_whole_case(const fs::path& folder, const fs::path& outputs) {
  try {
    return read_text_file(folder / "content.txt", kMostSourceBytes) == content_of_case(outputs) + "\n";
  } catch (const std::exception&) {  // it cannot be read
    return false;
  }
}

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

fs::path CellRunner::case_folder(std::size_t index) {
  const ExperimentCase& one = experiment_.cases[index];
  if (!one.is_simulated) return one.folder;
  FoundCase& found = simulated_[index];
  fs::path outputs = found.use ? found.outputs : case_place(index), folder = case_folder_of(outputs);
  // Until this process uses the folder, another one may remove it when it tidies the store up.
  for (int tries = 0; !found.use; ++tries) {
    std::shared_ptr<const void> use = use_folder(folder);
    if (use && is_whole_case(folder, outputs))
      found = {outputs, use};
    else if (tries < 10)
      make_case(index, folder);
    else
      throw Error("case '" + one.name + "' is removed again and again; let nothing tidy up " +
                  folder.parent_path().string() + " meanwhile");
  }
  std::error_code ignored;
  // Mark the folder as just used, so that it is removed last.
  fs::last_write_time(folder, fs::file_time_type::clock::now(), ignored);
  return outputs;
}

void CellRunner::make_case(std::size_t index, const fs::path& folder) const {
  SharedStore* shared = store_ ? store_->shared() : nullptr;
  const auto key = digest_of_hex(folder.filename().string());
  if (!shared || !key || !store_->prepare().empty()) return simulate(index, folder);
  const auto take_shared = [&](SharedLook look) {
    const TemporaryFolder temporary(new_folder_beside(folder));
    const bool is_there = shared->fetch_case(*key, temporary.path(), look);
    if (is_there) put_case(index, temporary.path(), folder);
    return is_there;
  };
  if (take_shared(SharedLook::quick)) return;
  const Store::Claim on_this_host = store_->claim(*key, nullptr);
  const SharedClaim among_hosts = shared->claim(*key, nullptr);
  const fs::path outputs = folder / "outputs" / experiment_.simulation.output;
  if (is_whole_case(folder, outputs) || take_shared(SharedLook::listed)) return;
  simulate(index, folder);
  shared->offer_case(*key, folder);
}

void CellRunner::simulate(std::size_t index, const fs::path& folder) const {
  const ExperimentCase& one = experiment_.cases[index];
  const Pipeline pipeline = simulation_of(index);
  const Digest states = states_of_files(pipeline);
  RunSettings settings;
  settings.seed = one.seed;
  settings.threads = threads_;
  settings.file_limits = file_limits_;
  if (const std::string fault = store_ ? store_->prepare() : ""; !fault.empty())
    throw Error("case '" + one.name + "' cannot be written: " + fault);
  const RunResult result = run_pipeline(pipeline, catalogue_, settings);
  if (result.failed()) throw Error("case '" + one.name + "' cannot be simulated: " + reason_of(pipeline, result));
  if (states_of_files(pipeline) != states || case_folder_of(place_of_simulated(index, Look::anew)) != folder)
    throw Error("case '" + one.name +
                "' cannot be simulated: what it is made from was changed meanwhile; run it again");
  const TemporaryFolder temporary(new_folder_beside(folder));
  RunFolder written(temporary.path(), pipeline);
  for (const RunFolder::Written& output : written.write_outputs(pipeline, result, catalogue_, std::nullopt))
    if (const std::string fault = output.fault + output.absent; !fault.empty())
      throw Error("case '" + one.name + "' cannot be written: " + fault);
  const fs::path outputs = fs::path("outputs") / experiment_.simulation.output;
  write_text_file(temporary.path() / "content.txt", content_of_case(temporary.path() / outputs) + "\n");
  put_case(index, temporary.path(), folder);
}

void CellRunner::put_case(std::size_t index, const fs::path& made, const fs::path& folder) const {
  const fs::path outputs = folder / "outputs" / experiment_.simulation.output;
  std::error_code error;
  fs::rename(made, folder, error);
  if (!error || is_whole_case(folder, outputs)) return;  // another process may have been quicker
  const TemporaryFolder damaged(new_folder_beside(folder));
  fs::rename(folder, damaged.path(), error);
  fs::rename(made, folder, error);
  if (!is_whole_case(folder, outputs))
    throw Error("case '" + experiment_.cases[index].name + "' cannot be written to " + folder.string() + ": " +
                error.message());
}

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
