// SPDX-License-Identifier: Apache-2.0
#include "report/recipes.hpp"

#include "difference/run_record.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/run/run_recipe.hpp"
#include "report/report.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

constexpr std::string_view kBegin = "<script type=\"application/json\" id=\"recipes\">", kEnd = "</script>";

}  // namespace

std::string recipe_of_folder(const std::filesystem::path& folder) {
  const RunRecord run = read_run(folder);
  refuse_outside(folder, "pipeline.yaml");
  const std::string pipeline = read_text_file(folder / "pipeline.yaml", kMostSourceBytes);
  return RunRecipe{run.version, run.seed, run.file_limits, pipeline}.text();
}

std::string recipes_element(const std::vector<NamedRecipe>& recipes) {
  json list = json::array();
  for (const NamedRecipe& one : recipes) list.push_back({{"name", one.name}, {"recipe", one.text}});
  return std::string(kBegin) + text_in_page(list) + std::string(kEnd) + "\n";
}

std::vector<NamedRecipe> recipes_in_page(std::string_view page) {
  const std::size_t begin = page.find(kBegin);
  if (begin == page.npos) return {};
  std::string_view element = page.substr(begin + kBegin.size());
  element = element.substr(0, element.find(kEnd));
  std::vector<NamedRecipe> recipes;
  try {
    for (const json& one : parse_json(std::string(element), "the list of recipes"))
      recipes.push_back({one.at("name"), one.at("recipe")});
  } catch (const std::exception&) {
    throw Error("its recipe is damaged");
  }
  return recipes;
}

}  // namespace marrow::cli
