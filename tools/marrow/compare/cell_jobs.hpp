// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cells of a comparison as jobs for worker processes.
#include <string>
#include <vector>

#include "compare/comparison.hpp"
#include "compare/pool.hpp"

namespace marrow::cli {

/// The settings of workers that run cells into `folder`.
PoolSettings pool_of(const CompareRequest& request, const std::filesystem::path& folder, int threads);

/// The cells of an experiment, numbered as in cells_of(), with their keys. Not thread-safe.
class CellJobs {
 public:
  CellJobs(const compare::Experiment& experiment, compare::CellRunner& runner);

  std::size_t count() const { return cells_.size(); }
  const compare::CellIndex& cell(std::size_t number) const { return cells_[number]; }
  std::size_t number_of(const compare::CellIndex& cell) const;
  /// The present key of everything that the cell depends on. It is kept for job_of() and row_of().
  const std::string& take_key(std::size_t number);

  /// `what` is "cell", "time" or "draw". Call take_key() before.
  Job job_of(const char* what, std::size_t number, std::string group) const;
  /// Jobs that make the simulated ones of these cases.
  std::vector<Job> cases_of(const std::vector<std::size_t>& case_numbers) const;
  /// The row from a worker's answer. The answer counts only if it is about the requested cell.
  compare::CellRow row_of(const Job& job, const JobEnd& end) const;
  /// Why a case cannot be made, from the end of its job. Empty if it was made.
  std::string fault_of_case(const Job& job, const JobEnd& end) const;

 private:
  const compare::Experiment& experiment_;
  compare::CellRunner& runner_;
  std::vector<compare::CellIndex> cells_;
  std::vector<std::string> keys_;
};

}  // namespace marrow::cli
