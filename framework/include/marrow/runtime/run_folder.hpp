// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "marrow/runtime/executor.hpp"
#include "marrow/runtime/run_log.hpp"

namespace marrow {

/// The folder that a run leaves behind: pipeline.yaml (resolved), run.json (what ran, with what, how long), log.txt,
/// and outputs/ in formats that other programs open. Nothing that was there before is overwritten: the folder must be
/// new or empty. Of several processes that want the same folder, one gets it.
class RunFolder {
 public:
  /// Throws Error when the folder holds anything, was taken by another run just now, or cannot be written to.
  RunFolder(const std::filesystem::path& folder, const Pipeline& pipeline);
  /// Makes the first of base, base-2, base-3 ... that is not there yet.
  static RunFolder with_free_name(const std::filesystem::path& base, const Pipeline& pipeline);

  struct Written {
    std::string output;
    std::vector<std::string> files;  ///< relative to the folder
    std::string fault;               ///< why it was not written; empty when it was
  };
  /// Writes the pipeline's outputs, as far as they were made.
  std::vector<Written> write_outputs(const Pipeline& pipeline, const RunResult& result, const Catalogue& catalogue);
  RunLog& log() { return *log_; }
  void write_record(const Pipeline& pipeline, const RunResult& result, const RunSettings& settings,
                    const Catalogue& catalogue, const PipelineArguments& arguments,
                    const std::vector<Written>& written);

  const std::filesystem::path& path() const { return folder_; }

 private:
  RunFolder() = default;
  /// Whether the folder, which is there, became this run's.
  bool take(const Pipeline& pipeline);

  std::filesystem::path folder_;
  std::unique_ptr<RunLog> log_;
};

/// The widest instruction set that run-time dispatch finds on this machine.
std::string cpu_level();

}  // namespace marrow
