// SPDX-License-Identifier: Apache-2.0
// The simulated cases of an experiment: they are found in the store, copied from the shared store, or made.
#include "cell_parts.hpp"
#include "marrow/base/folder_use.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/runtime/run/keys.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "marrow/runtime/store/shared_claim.hpp"
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

}  // namespace marrow::compare
