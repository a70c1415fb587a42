// SPDX-License-Identifier: Apache-2.0
#include "around_run.hpp"

#include <cstdio>

#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/store/shared_store.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using Status = NodeRecord::Status;

/// Whether only nodes without inputs were called, one of them failed, and no output was written.
bool made_nothing(const Pipeline& pipeline, const RunOutcome& outcome) {
  const auto is_written = [](const RunFolder::Written& output) { return !output.files.empty(); };
  if (!outcome.result.failed() || outcome.result.cancelled() ||
      std::any_of(outcome.written.begin(), outcome.written.end(), is_written))
    return false;
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    if (!pipeline.nodes[i].wires.empty() && outcome.result.nodes[i].calls + outcome.result.nodes[i].cached > 0)
      return false;
  return true;
}

/// The first needed input of a skipped node for which nothing came; nullptr if there is none.
const Wire* lacking_wire(const Pipeline& pipeline, const RunResult& result, std::size_t node) {
  for (const Wire& wire : pipeline.nodes[node].wires) {
    const bool is_needed = wire.port >= 0 && !pipeline.nodes[node].info.inputs[std::size_t(wire.port)].optional;
    const auto is_absent = [&](const Reference& source) { return value_of(result, source).is_absent(); };
    if (is_needed && !wire.sources.empty() && std::all_of(wire.sources.begin(), wire.sources.end(), is_absent))
      return &wire;
  }
  return nullptr;
}

std::string node_text(const PipelineNode& node) { return "node '" + node.id + "' (" + node.info.name + ")"; }

std::string lack_of(const Pipeline& pipeline, const RunResult& result, const PipelineOutput& output) {
  std::size_t node = std::size_t(output.source.node);
  for (bool is_first = true; result.nodes[node].status == Status::skipped; is_first = false) {
    const Wire* wire = lacking_wire(pipeline, result, node);
    if (!wire) return "";
    const std::size_t source = std::size_t(wire->sources[0].node);
    if (result.nodes[source].status != Status::skipped)
      return is_first || result.nodes[source].status != Status::done
                 ? ""
                 : node_text(pipeline.nodes[node]) + " needs '" +
                       pipeline.nodes[node].info.inputs[std::size_t(wire->port)].name + "', which " +
                       node_text(pipeline.nodes[source]) + " does not give";
    node = source;
  }
  return "";
}

}  // namespace

FolderOfItsOwn::FolderOfItsOwn(const fs::path& parent) : parent_(parent) {
  std::error_code error;
  had_parent_ = fs::exists(parent, error);
}

bool FolderOfItsOwn::keep_if_fruitful(const Pipeline& pipeline, const RunOutcome& outcome) {
  if (!folder_.empty() && made_nothing(pipeline, outcome)) return false;
  folder_.clear();
  return true;
}

FolderOfItsOwn::~FolderOfItsOwn() {
  // Only what a run without outputs writes, each by its name: whatever else came there stays, and so does the folder.
  std::error_code error;
  if (!folder_.empty()) fs::remove_all(folder_ / "failed", error);
  for (const char* name : {"outputs", "run.json", "pipeline.yaml", "log.txt", ""})
    if (!folder_.empty()) fs::remove(folder_ / name, error);
  if (!had_parent_) fs::remove(parent_, error);
}

std::map<std::string, std::vector<std::string>> lacking_outputs(const Pipeline& pipeline, const RunResult& result) {
  std::map<std::string, std::vector<std::string>> outputs;
  for (const PipelineOutput& output : pipeline.outputs)
    if (const std::string reason = lack_of(pipeline, result, output); !reason.empty())
      outputs[reason].push_back(output.name);
  return outputs;
}

void print_lacking_outputs(const Pipeline& pipeline, const RunResult& result) {
  for (const auto& [reason, outputs] : lacking_outputs(pipeline, result)) {
    std::string names;
    for (const std::string& name : outputs) names += (names.empty() ? "" : ", ") + name;
    std::printf("  %s: not there because %s\n", printable(names).c_str(), printable(reason).c_str());
  }
}

ProfileOfRun::ProfileOfRun(const std::filesystem::path& file, RunSettings& settings) : file_(file) {
  if (!file.empty()) settings.profile.profile = &profile_.emplace();
}

bool ProfileOfRun::write(const std::string& title, const RunFolder& folder,
                         const std::function<void(const std::string&)>& note) const {
  if (!profile_) return true;
  if (const std::string text = note_on_profile(*profile_); !text.empty()) note(text);
  const std::string text = profile_->text(title);
  try {
    write_text_file(folder.path() / "profile.json", text);
    write_text_file(file_, text, Kinds::files_and_pipes);
    return true;
  } catch (const Error& error) {
    std::fprintf(stderr, "marrow: error: the profile: %s\n", printable_lines(error.what()).c_str());
    return false;
  }
}

// What must hold before a run begins, so that nothing is found at its end.

void expect_files_can_hold(const Pipeline& pipeline, const Catalogue& catalogue) {
  for (const PipelineOutput& output : pipeline.outputs) {
    const TypeInfo& type = pipeline.output_of(output.source).type;
    if (!catalogue.find_writer(type))
      throw Error(printable(pipeline.file.string()) + ": output '" + output.name + "' is " +
                  (type.is_function ? "a function" : "of the type " + std::string(type.id)) +
                  ", which no file can hold; the program itself runs this pipeline (only_inside): name other outputs "
                  "with --only");
  }
}

void expect_good_place(const Pipeline& pipeline, const std::filesystem::path& folder, const Store* store) {
  expect_nothing_reads(pipeline, folder.empty() ? "runs" : folder, "the output folder", "choose another with --out");
  if (store && store->fault().empty())
    expect_nothing_reads(pipeline, store->folder(), "the store of results",
                         "set MARROW_CACHE to another folder, or give --no-cache");
  if (store && store->shared())
    expect_nothing_reads(pipeline, store->shared()->folder(), "the shared store of results",
                         "set MARROW_SHARED_CACHE to another folder, or give --no-cache");
}

}  // namespace marrow::cli
