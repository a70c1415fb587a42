// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/place_of_results.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// The path without a slash at its end. Links are followed as far as the path exists.
fs::path real_path(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
  return real.has_filename() ? real : real.parent_path();
}

bool is_in(const fs::path& folder, const fs::path& place) {
  return std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first == folder.end();
}

}  // namespace

std::optional<fs::path> folder_that_holds(const std::vector<fs::path>& folders, const fs::path& place) {
  const fs::path real_place = real_path(place);
  for (const fs::path& folder : folders) {
    const fs::path real = real_path(folder);
    if (!real.empty() && is_in(real, real_place)) return folder;
  }
  return std::nullopt;
}

void expect_nothing_reads(const Pipeline& pipeline, const fs::path& place, const std::string& what,
                          const std::string& advice) {
  for (const PipelineNode* node : called_nodes(pipeline)) {
    for (const std::string& path : paths_of(*node)) {
      std::error_code error;
      const fs::path folder = real_path(path);
      if (!fs::is_directory(folder, error) || !folder_that_holds({folder}, place)) continue;
      throw Error(what + " " + place.string() + " lies in " + folder.string() + ", a folder that node '" + node->id +
                  "' reads, which would change while it is read; " + advice);
    }
  }
}

}  // namespace marrow
