// SPDX-License-Identifier: Apache-2.0
#pragma once
// The recipes of runs (marrow/runtime/run/run_recipe.hpp) in folders and in pages.
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace marrow::cli {

struct NamedRecipe {
  std::string name;  ///< the variant of a comparison; empty for a run
  std::string text;
};

/// The recipe of the run in a folder. Throws Error if no run wrote the folder, or if its files cannot be read.
std::string recipe_of_folder(const std::filesystem::path& folder);

/// The element of a page that holds recipes.
std::string recipes_element(const std::vector<NamedRecipe>& recipes);

/// The recipes in a page; none if it has no such element. Throws Error if the element is damaged.
std::vector<NamedRecipe> recipes_in_page(std::string_view page);

}  // namespace marrow::cli
