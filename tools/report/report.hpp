// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes one HTML file that shows a run or a comparison and needs no other file. For a large comparison, further
// pictures are beside it. data.js in tools/report/page describes the data.
#include <array>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "compare/comparison.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {

// The recipes of runs (marrow/runtime/run/run_recipe.hpp) in folders and in pages.

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

/// Data that the cells of a report share: pictures, meshes and scenes, by the hash of their content.
struct ReportMaterial {
  nlohmann::json pictures = nlohmann::json::object();
  nlohmann::json geometries = nlohmann::json::object();
  nlohmann::json scenes = nlohmann::json::object();
  std::vector<std::string> left_out;  ///< sentences about files that a record names outside its run's folder
  /// `pictures`, `geometries` and `scenes` with their names.
  std::array<std::pair<const char*, nlohmann::json*>, 3> groups();
  /// Adds a sentence to `left_out` if the name of a file, or a link, leads out of the run's folder.
  void note_if_outside(const std::filesystem::path& run_folder, const std::string& name);
  void print_left_out() const;

  /// Adds all pictures, meshes and scenes in a run's folder, and the data about them to `cell`. Files that cannot be
  /// read are left out.
  void add_run(const std::filesystem::path& run_folder, nlohmann::json& cell);
  /// Stores the result of add_run() in the folder itself, because encoding pictures takes most of a report's time.
  static void prepare(const std::filesystem::path& run_folder);
  /// The same as add_run(), but uses the result that prepare() stored, if there is one.
  void add_prepared(const std::filesystem::path& run_folder, nlohmann::json& cell);

 private:
  void add_file(const std::filesystem::path& file, const std::string& name, nlohmann::json& cell);
  void add_json(const nlohmann::json& file, nlohmann::json& cell);
};

/// A PNG file as a data URL, converted to WebP with a longer side of at most `size_px`. Throws Error if it is no PNG.
std::string picture_url(const std::filesystem::path& png_file, int size_px);

/// Writes the page with these data and recipes.
void write_page(const nlohmann::json& data, const std::vector<NamedRecipe>& recipes, const std::filesystem::path& file,
                Kinds kinds = Kinds::files);

/// The figures of merit that a run wrote: one table for each folder of files, one column for each file in it.
nlohmann::json figures_of(const std::filesystem::path& folder, const nlohmann::json& record);

/// The profile that a run wrote, as the page draws it; null if there is none. A damaged one adds a sentence to
/// `left_out`.
nlohmann::json profile_of(const std::filesystem::path& folder, std::vector<std::string>& left_out);

/// Writes the page of a single run, and returns the file. An empty `file` means RUN/report.html. Throws Error if the
/// folder is not that of a run.
std::filesystem::path write_run_page(const std::filesystem::path& folder, std::filesystem::path file = {});

/// {nodes, edges} of a pipeline. Each node also has its differences in each of `variants`.
nlohmann::json graph_of(const Pipeline& pipeline, const std::vector<std::pair<std::string, Pipeline>>& variants);

/// Processor and number of cores of this machine, and the processor level from the record of a run.
nlohmann::json machine_of(const nlohmann::json& run_record);
/// [{file, build_id}] of the plugins that a run used.
nlohmann::json plugins_of(const nlohmann::json& run_record);
/// The text of a file that people write; empty if it cannot be read, for a page without it.
std::string text_if_readable(const std::filesystem::path& file);

/// Any text as one word of a command that a person copies into a shell. It holds only characters that terminals and
/// pages show as they are: a text with others is written as $'...', which bash, zsh, ksh and POSIX of 2024 read.
std::string shell_word(const std::string& text);
/// The same for a path. It is never taken for an option.
std::string shell_path(const std::filesystem::path& path);
/// Any text as one word of a script for /bin/sh, in single quotes, where no character is special.
std::string script_word(const std::string& text);

/// Writes FOLDER/report.html of a comparison. `shown`: the cells whose pictures were made, those of a case and start
/// together, the most important ones first. What does not fit into the page goes to FOLDER/report.
void write_report(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows,
                  const Answer& answer, const compare::CellRunner& runner, const std::vector<compare::CellIndex>& shown,
                  const CompareRequest& request, const std::filesystem::path& folder);

// The single cells on a comparison's page: a row for each, and pictures, curves and 3D views of some. The page holds as
// many of these as its size allows; the others are beside it, in the folder report/.

/// Whether a file of this name in FOLDER/report is a part of a page.
bool is_part_name(const std::string& name);

/// Bytes of the page with these data.
std::size_t page_bytes(const nlohmann::json& data);

}  // namespace marrow::cli
