// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/extended_file.hpp"

#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 8;

fs::path whole(const fs::path& file) {
  std::error_code ignored;
  return fs::weakly_canonical(file, ignored);
}

}  // namespace

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
  else if (chain.size() == kMostFiles)
    yaml.fault(place, formatted("more than {} files extend each other", kMostFiles));
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
