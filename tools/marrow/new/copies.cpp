// SPDX-License-Identifier: Apache-2.0
// New pipelines, experiments and cases.
#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "projects.hpp"
#include "templates.hpp"

namespace fs = std::filesystem;

namespace marrow::cli {
namespace {

/// A file that is there, or one of marrow's own in `folder`, with or without .yaml.
fs::path file_named(const std::string& from, const fs::path& folder) {
  if (fs::is_regular_file(from)) return from;
  std::vector<std::string> known;
  for (const fs::directory_entry& entry : fs::directory_iterator(shared_files(folder))) {
    const fs::path& path = entry.path();
    if (path.extension() != ".yaml") continue;
    if (path.filename() == from || path.stem() == from) return path;
    known.push_back(path.stem().string());
  }
  std::sort(known.begin(), known.end());
  throw Error("--from '" + printable(from) + "': neither a file here nor one of marrow's own; " +
              suggestion(from, known));
}

fs::path copy(const std::string& name, const fs::path& from, const fs::path& file) {
  expect_name(name, "the name");
  const fs::path target = file.empty() ? fs::path(name + ".yaml") : file;
  expect_free(target);
  const fs::path folder = fs::absolute(target).parent_path();
  if (!fs::is_directory(folder)) throw Error(printable(folder.string()) + ": there is no such folder; make it first");
  write_text_file(target, moved_text(from, folder));
  return target;
}

}  // namespace

fs::path new_pipeline(const std::string& name, const std::string& from, const fs::path& file) {
  return copy(name, file_named(from, "pipelines"), file);
}

fs::path new_experiment(const std::string& name, const std::string& from, const fs::path& file) {
  return copy(name, file_named(from, "pipelines/experiments"), file);
}

fs::path new_case(const std::string& name, const fs::path& folder) {
  if (name.empty() || name.find('/') != std::string::npos)
    throw Error("new case '" + printable(name) + "': expected the name of a folder; its place is given with --out");
  return write_project(folder, name, filled_templates(shared_files("templates/case"), {}));
}

}  // namespace marrow::cli
