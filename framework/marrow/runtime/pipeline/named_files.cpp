// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/named_files.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/regular_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& folder, const fs::path& file) {
  const fs::path from_folder = file.lexically_relative(folder);
  return !from_folder.empty() && *from_folder.begin() != "..";
}

/// For a link inside a folder that leads to a file of the folder or to nothing. Throws Error for any other link.
NamedFile linked_file(const fs::path& root, const fs::directory_entry& entry) {
  std::error_code error;
  const fs::path target = fs::canonical(entry.path(), error);
  NamedFile file{entry.path(), "", !error};
  if (error) return file;
  if (!is_below(root, target))
    throw Error(entry.path().string() + ": is a link to a place outside " + root.string() +
                "; copy it into the folder");
  if (fs::is_directory(target, error))
    throw Error(entry.path().string() + ": is a link to a folder; put the folder itself there");
  file.is_there = fs::is_regular_file(target, error);
  return file;
}

/// Whether the option names a file that names further ones, which lie in its folder or below it (the trait of read).
bool names_files(const PipelineNode& node, const OptionInfo& option) {
  const std::vector<std::string>& traits = node.info.traits;
  return option.name == "path" && std::find(traits.begin(), traits.end(), "names_files") != traits.end();
}

void add_folder(const fs::path& root, const fs::path& folder, std::vector<NamedFile>& files) {
  std::error_code error;
  const auto fail = [&](const fs::path& path) {
    throw Error(path.string() + ": cannot be read: " + error.message() + "; all files of a folder count");
  };
  fs::directory_iterator at(folder, error);
  if (error) fail(folder);
  for (const fs::directory_iterator end; at != end; at.increment(error)) {
    if (error) fail(folder);
    const fs::file_status status = at->symlink_status(error);
    if (error) fail(at->path());
    if (fs::is_symlink(status))
      files.push_back(linked_file(root, *at));
    else if (fs::is_directory(status))
      add_folder(root, at->path(), files);
    else if (fs::is_regular_file(status))
      files.push_back({at->path(), ""});
  }
  if (error) fail(folder);
}

constexpr std::size_t kMostExtended = 8;

fs::path whole(const fs::path& file) {
  std::error_code ignored;
  return fs::weakly_canonical(file, ignored);
}

}  // namespace

std::vector<NamedFile> files_named_by(const fs::path& path) {
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) return {};
  if (!fs::is_directory(path, error)) return {{path, ".", fs::is_regular_file(path, error)}};
  const fs::path root = fs::canonical(path, error);
  if (error) throw Error(path.string() + ": cannot be read: " + error.message());
  std::vector<NamedFile> files;
  add_folder(root, root, files);
  for (NamedFile& file : files) file.name = file.file.lexically_relative(root).generic_string();
  std::sort(files.begin(), files.end(), [](const NamedFile& a, const NamedFile& b) { return a.name < b.name; });
  return files;
}

std::vector<std::string> paths_of(const PipelineNode& node, std::size_t option) {
  std::vector<std::string> paths;
  const OptionType type = node.info.options[option].type;
  if (type == OptionType::path) paths = {std::get<std::string>(node.options[option])};
  if (type == OptionType::paths) paths = std::get<std::vector<std::string>>(node.options[option]);
  if (type == OptionType::path && !paths[0].empty())
    for (const std::string& ending : node.info.options[option].beside)
      paths.push_back(fs::path(paths[0]).replace_extension(ending).string());
  std::error_code error;
  if (type == OptionType::path && names_files(node, node.info.options[option]) && fs::is_regular_file(paths[0], error))
    paths.push_back(fs::path(paths[0]).parent_path().string());
  return paths;
}

std::vector<std::string> paths_of(const PipelineNode& node) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < node.options.size(); ++i)
    for (std::string& path : paths_of(node, i))
      if (!path.empty()) all.push_back(std::move(path));
  return all;
}

Digest content_of(const std::filesystem::path& path) {
  Hasher hasher;
  for (const NamedFile& file : files_named_by(path)) {
    hasher.add(file.name);
    hasher.add(file.is_there ? file_digest(file.file) : Digest{});
  }
  return hasher.digest();
}

std::optional<fs::path> extended_file(StrictYaml& yaml, const YAML::Node& name, const std::vector<fs::path>& chain) {
  const Place place = yaml.place(name);
  const auto text = yaml.text(name, place, "extends");
  if (!text) return std::nullopt;
  const fs::path file = fs::absolute(chain.back()).parent_path() / *text;
  std::string circle;
  bool is_in_chain = false;
  for (const fs::path& one : chain) {
    circle += one.filename().string() + " extends ";
    is_in_chain |= whole(one) == whole(file);
  }
  std::error_code ignored;
  if (is_in_chain)
    yaml.fault(place, "the files extend each other in a circle: " + circle + whole(file).filename().string(),
               "one of them must stand alone");
  else if (chain.size() == kMostExtended)
    yaml.fault(place, formatted("more than {} files extend each other", kMostExtended));
  else if (text->empty() || !fs::exists(file, ignored))
    yaml.fault(place, "there is no file " + in_quotes(*text) + " to extend", nearest_file(file));
  else
    return chain[0].is_absolute() ? file.lexically_normal() : fs::proximate(file);
  return std::nullopt;
}

std::string nearest_file(const fs::path& missing) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(missing.parent_path(), ignored))
    if (entry.path().extension() == ".yaml" || entry.path().extension() == ".yml")
      names.push_back(entry.path().filename().string());
  return suggestion(missing.filename().string(), names);
}

}  // namespace marrow
