// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/run/replay.hpp"
#include "marrow/runtime/run/run_log.hpp"

namespace MARROW_EXPORT marrow {

class FailedCalls;

/// The folder with the results of a run: pipeline.yaml (resolved), run.json (what ran, with which inputs, how long),
/// log.txt, outputs/ in formats that other programs can open, and failed/ with what is needed to make a failed call
/// again. Existing files are never overwritten: the folder must
/// be new or empty. If several processes want the same folder, only one gets it.
class RunFolder {
 public:
  /// Throws Error if the folder is not empty, was just taken by another run, or cannot be written to.
  RunFolder(const std::filesystem::path& folder, const Pipeline& pipeline);
  /// Makes the first of the folders base, base-2, base-3 ... that does not exist yet.
  static RunFolder with_free_name(const std::filesystem::path& base, const Pipeline& pipeline);
  RunFolder(RunFolder&& other) noexcept;
  ~RunFolder();

  /// From now on, each failed call of a run with these settings leaves a folder failed/NODE/ITEM, from which
  /// read_failed_call() reads how to make it again. Does nothing if the settings have given values. The folder must not
  /// be moved from and must outlive the run.
  void keep_failed_calls(RunSettings& settings, const Catalogue& catalogue);
  /// The folders of the failed calls so far, relative to this one.
  std::vector<std::string> failed_calls() const;

  struct Written {
    std::string output;
    std::vector<std::string> files;  ///< relative to the folder
    std::string fault;               ///< why it was not written; empty if it was
    std::string absent;              ///< "node 'x' failed", which may fail: why it is not there, or not as a whole
  };
  /// Writes those outputs of the pipeline that were made. Each PNG file among them carries the recipe
  /// (replay.hpp). Without a recipe, outputs have the same bytes wherever their data lie.
  std::vector<Written> write_outputs(const Pipeline& pipeline, const RunResult& result, const Catalogue& catalogue,
                                     const std::optional<RunRecipe>& recipe);
  RunLog& log() { return *log_; }
  void write_record(const Pipeline& pipeline, const RunResult& result, const RunSettings& settings,
                    const Catalogue& catalogue, const PipelineArguments& arguments,
                    const std::vector<Written>& written);

  const std::filesystem::path& path() const { return folder_; }

 private:
  RunFolder();
  /// Tries to take the existing folder for this run. Returns false if another run has taken it.
  bool take(const Pipeline& pipeline);

  std::filesystem::path folder_;
  std::unique_ptr<RunLog> log_;
  std::unique_ptr<FailedCalls> failed_calls_;
};

}  // namespace marrow
