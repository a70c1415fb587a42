// SPDX-License-Identifier: Apache-2.0
#include "cluster/chunk_rows.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/process_identity.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;

constexpr std::size_t kMostFaultBytes = 2000;

fs::path rows_folder(const fs::path& folder) { return folder / "rows"; }

fs::path fault_file(const fs::path& folder, const std::string& chunk) {
  return rows_folder(folder) / (chunk + ".fault");
}

/// The result in a row, without what differs each time the cell runs.
std::string result_of(CellRow row) {
  row.tries = 1;
  row.seconds.reset();
  row.nodes.clear();
  row.key.clear();
  return compare::to_json(row);
}

}  // namespace

ChunkFile::ChunkFile(const fs::path& folder, const std::string& chunk)
    : final_(rows_folder(folder) / (chunk + ".jsonl")),
      part_(rows_folder(folder) / (chunk + "." + this_process() + ".part")) {
  std::error_code error;
  fs::create_directories(rows_folder(folder), error);
  descriptor_ = Descriptor(open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666));
  expect_good(descriptor_.is_open());
}

void ChunkFile::expect_good(bool is_good) const {
  if (!is_good) throw Error("cannot write " + part_.string() + ": " + std::strerror(errno));
}

void ChunkFile::add(const CellRow& row) { expect_good(write_all(descriptor_, compare::to_json(row) + "\n")); }

void ChunkFile::finish() {
  expect_good(fsync(descriptor_) == 0);
  expect_good(descriptor_.close());  // a full disk may be noticed only here
  expect_good(rename(part_.c_str(), final_.c_str()) == 0);
}

std::map<std::string, bool> chunk_files(const fs::path& folder) {
  std::map<std::string, bool> chunks;
  std::error_code error;
  for (fs::directory_iterator at(rows_folder(folder), error), end; !error && at != end; at.increment(error)) {
    const fs::path name = at->path().filename();
    if (name.extension() == ".jsonl") chunks[name.stem().string()] = true;
    if (name.extension() == ".part") chunks.emplace(name.native().substr(0, name.native().find('.')), false);
  }
  return chunks;
}

void leave_fault_of_chunk(const fs::path& folder, const std::string& chunk, const std::string& fault) {
  const fs::path file = fault_file(folder, chunk);
  std::error_code ignored;
  fs::create_directories(file.parent_path(), ignored);
  try {
    write_text_file(file, cut(printable(fault), kMostFaultBytes));
  } catch (const Error&) {
  }
}

void remove_fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  std::error_code ignored;
  fs::remove(fault_file(folder, chunk), ignored);
}

std::string fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  try {
    return printable(read_text_file(fault_file(folder, chunk), kMostFaultBytes));
  } catch (const Error&) {
    return "";
  }
}

RowsOfChunks::RowsOfChunks(const fs::path& folder, const compare::Experiment& experiment, const std::string& plan,
                           std::set<std::string> cells)
    : experiment_(experiment), cells_(std::move(cells)) {
  std::error_code error;
  for (fs::directory_iterator at(rows_folder(folder), error), end; !error && at != end; at.increment(error))
    if (const fs::path extension = at->path().extension(); extension == ".jsonl" || extension == ".part")
      add_file(at->path(), !plan.empty() && at->path().filename().native().starts_with(plan + "-"));
}

void RowsOfChunks::add_file(const fs::path& file, bool is_of_plan) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) try {
      if (is_wanted(line)) add_line(line, is_of_plan);
    } catch (const std::exception&) {  // the last line of a killed task, or another experiment's
    }
}

/// Looks only at the first "id" of the line. A name with an escaped letter is always wanted.
bool RowsOfChunks::is_wanted(const std::string& line) const {
  constexpr std::string_view kId = R"("id":")";
  const std::size_t at = cells_.empty() ? std::string::npos : line.find(kId);
  if (at == std::string::npos) return true;
  const std::string name = line.substr(at + kId.size(), line.find('"', at + kId.size()) - at - kId.size());
  return name.find('\\') != std::string::npos || cells_.contains(name);
}

void RowsOfChunks::add_line(const std::string& line, bool is_of_plan) {
  CellRow row = compare::row_from_json(line, experiment_);
  const std::string id = nlohmann::json::parse(line).at("id");
  if (row.failed.empty())
    done_[id].push_back(std::move(row));
  else if (is_of_plan)
    if (const auto [known, is_new] = failed_.emplace(id, row); !is_new && to_json(row) < to_json(known->second))
      known->second = std::move(row);
}

/// The rows with this key, except for the machine. Nothing here depends on the order of the files: first those of this
/// machine, then by their texts.
std::vector<CellRow> RowsOfChunks::rows_of(const compare::CellIndex& cell, const std::string& key) const {
  std::vector<CellRow> rows;
  const auto found = done_.find(compare::cell_id(experiment_, cell));
  if (found == done_.end() || key.empty()) return rows;
  for (const CellRow& row : found->second)
    if (compare::key_without_machine(row.key) == compare::key_without_machine(key)) rows.push_back(row);
  if (rows.size() > 1)
    std::sort(rows.begin(), rows.end(), [&](const CellRow& a, const CellRow& b) {
      if ((a.key == key) != (b.key == key)) return a.key == key;
      return to_json(a) < to_json(b);
    });
  for (CellRow& row : rows) compare::name_row(row, experiment_, cell);
  return rows;
}

std::optional<CellRow> RowsOfChunks::done(const compare::CellIndex& cell, const std::string& key) const {
  const std::vector<CellRow> rows = rows_of(cell, key);
  return rows.empty() ? std::nullopt : std::optional(rows.front());
}

bool RowsOfChunks::contradicts(const compare::CellIndex& cell, const CellRow& taken) const {
  const std::vector<CellRow> rows = rows_of(cell, taken.key);
  return std::any_of(rows.begin(), rows.end(),
                     [result = result_of(taken)](const CellRow& row) { return result_of(row) != result; });
}

std::optional<CellRow> RowsOfChunks::failed(const compare::CellIndex& cell) const {
  const auto found = failed_.find(compare::cell_id(experiment_, cell));
  if (found == failed_.end()) return std::nullopt;
  CellRow row = found->second;
  compare::name_row(row, experiment_, cell);
  return row;
}

}  // namespace marrow::cli
