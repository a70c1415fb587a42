// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/place_of_results.hpp"

#include "marrow/base/file_names.hpp"
#include "marrow/base/process_state.hpp"
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

namespace fs = std::filesystem;

void write_value(const Value& value, const fs::path& stem, const fs::path& root, const Catalogue& catalogue,
                 RunFolder::Written& written) {
  if (value.is_list()) {
    const std::vector<std::string> names = distinct_names(value.names);
    for (std::size_t i = 0; i < value.items.size(); ++i)
      write_value(value.items[i], stem / file_name_of(names[i]), root, catalogue, written);
    return;
  }
  if (value.is_absent()) {
    if (value.may_be_missing)
      written.absent = value.missing;
    else if (!value.missing.empty())
      written.fault = "not made: " + value.missing;
    return;
  }
  const WriterInfo* writer = catalogue.find_writer(value.type);
  if (!writer) {
    written.fault = no_writer(value.type);
    return;
  }
  const fs::path file = stem.string() + writer->extension;
  if (fs::exists(fs::symlink_status(file))) {
    written.fault = file.string() + " holds another output already; give one of them another name";
    return;
  }
  try {
    fs::create_directories(file.parent_path());  // so a list of which no item was made has no folder
    const WriterDefinition& definition = catalogue.load_writer(value.type);
    ProcessState::of_runs()->keep_during([&] { definition.write(value.data.get(), file.string()); });
    written.files.push_back(file.lexically_relative(root).string());
  } catch (...) {
    written.fault = reason_of_exception();
    std::error_code ignored;
    fs::remove_all(file, ignored);  // half a file is worse than none
  }
}

}  // namespace marrow
