// SPDX-License-Identifier: Apache-2.0
#pragma once
// One HTML file that shows a run or a comparison, and needs nothing else. tools/report holds the page, its data.js says
// what the data are.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compare/comparison.hpp"
#include "runtime/text_file.hpp"

namespace marrow::cli {

/// What cells share in a report: pictures, meshes and scenes by the hash of their content.
struct ReportMaterial {
  nlohmann::json pictures = nlohmann::json::object();
  nlohmann::json geometries = nlohmann::json::object();
  nlohmann::json scenes = nlohmann::json::object();
  std::vector<std::string> left_out;  ///< sentences about files that a record names outside its run's folder
  /// That a file of the run is left out, because its name or a link leads out of the run's folder.
  void note_if_outside(const std::filesystem::path& run_folder, const std::string& name);
  void print_left_out() const;

  /// Adds all that a run's folder holds to look at, and what the run says of it to `cell`. What cannot be read is left
  /// out.
  void add_run(const std::filesystem::path& run_folder, nlohmann::json& cell);
  /// Encoding pictures is what a report takes longest for: keeps what add_run() finds in the folder itself.
  static void prepare(const std::filesystem::path& run_folder);
  /// The same as add_run(), from what prepare() kept where it is there.
  void add_prepared(const std::filesystem::path& run_folder, nlohmann::json& cell);

 private:
  void add_file(const std::filesystem::path& file, const std::string& name, nlohmann::json& cell);
  void add_json(const nlohmann::json& file, nlohmann::json& cell);
};

/// The file as a data URL: a PNG at most `size_px` long, as WebP. Throws Error for a file that is no PNG.
std::string picture_url(const std::filesystem::path& png_file, int size_px);

/// Writes the page with these data in it.
void write_page(const nlohmann::json& data, const std::filesystem::path& file, Kinds kinds = Kinds::files);

/// {nodes, edges} of a pipeline, with what each of `variants` makes otherwise.
nlohmann::json graph_of(const Pipeline& pipeline, const std::vector<std::pair<std::string, Pipeline>>& variants);

/// What runs say of the machine and the plugins that they used.
nlohmann::json machine_of(const nlohmann::json& run_record);

/// A text as one word of a POSIX shell's command line, whatever is in it.
std::string shell_word(const std::string& text);
/// The same for a path, which is never taken for an option.
std::string shell_path(const std::filesystem::path& path);

/// FOLDER/report.html of a comparison; `shown` are the cells whose pictures were made.
void write_report(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows,
                  const Answer& answer, const compare::CellRunner& runner, const std::vector<compare::CellIndex>& shown,
                  const CompareRequest& request, const std::filesystem::path& folder);

}  // namespace marrow::cli
