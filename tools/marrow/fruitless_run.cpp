// SPDX-License-Identifier: Apache-2.0
#include "fruitless_run.hpp"

#include <algorithm>

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

}  // namespace marrow::cli
