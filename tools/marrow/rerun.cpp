// SPDX-License-Identifier: Apache-2.0
// `marrow diff` and `marrow rerun`: whether two runs have the same results.
//
// `marrow recipe`: the pipeline file that a picture, a page or the folder of a run carries.
#include <unistd.h>
#include <cstdio>
#include <sstream>

#include "around_run.hpp"
#include "command_options.hpp"
#include "difference/difference.hpp"
#include "marrow/base/file_names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/png_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

struct RecipeRequest {
  fs::path given, out;
  std::string variant;
  bool remove = false, json = false;
};

bool is_page(const std::string& bytes) {
  std::string begin = bytes.substr(0, 15);
  std::transform(begin.begin(), begin.end(), begin.begin(), [](unsigned char c) { return std::tolower(c); });
  return begin.starts_with("<!doctype html") || begin.starts_with("<html");
}

std::vector<NamedRecipe> recipes_in_picture(const std::string& png) {
  const std::optional<std::string> text = png_text(png, kRecipeKeyword);
  if (!text)
    throw Error(
        "this picture has no recipe; marrow writes one into the pictures of a run's outputs, and a program that saves "
        "a picture again may drop it; the folder of the run has it, too");
  return {{"", *text}};
}

std::vector<NamedRecipe> recipes_in_html(const std::string& page) {
  std::vector<NamedRecipe> recipes = recipes_in_page(page);
  if (recipes.empty())
    throw Error("this page has no recipe; the pages of 'marrow show' and 'marrow compare' have one, make it again");
  return recipes;
}

std::vector<NamedRecipe> recipes_in(const fs::path& given) {
  if (fs::is_directory(given)) {
    expect_given(given, Wanted::run);
    return {{"", recipe_of_folder(given)}};
  }
  const std::string bytes = read_text_file(given, kMostRecordBytes);
  try {
    if (is_png(bytes)) return recipes_in_picture(bytes);
    if (is_page(bytes)) return recipes_in_html(bytes);
  } catch (const Error& fault) {
    throw Error(given.string() + ": " + fault.what());
  }
  throw Error(given.string() +
              ": this is no PNG picture, no HTML page and no folder of a run; only these have a recipe");
}

/// The one that was asked for.
const NamedRecipe& chosen(const std::vector<NamedRecipe>& recipes, const RecipeRequest& request) {
  if (request.variant.empty() && recipes.size() == 1) return recipes[0];
  std::vector<std::string> names;
  for (const NamedRecipe& one : recipes) {
    if (!one.name.empty() && one.name == request.variant) return one;
    if (!one.name.empty()) names.push_back(one.name);
  }
  const std::string file = request.given.string();
  if (names.empty()) throw Error(file + ": this is the recipe of one run, without variants; leave out --variant");
  if (request.variant.empty())
    throw Error(file + ": this page has the recipes of " + counted(names.size(), "variant") +
                "; choose one by --variant: " + cut(joined(names, ", "), 400));
  throw Error(file + ": the comparison has no variant " + in_quotes(request.variant) + "; " +
              suggestion(request.variant, names));
}

void say_written(const fs::path& file) {
  std::printf("%s\n", printable(plain_path(fs::absolute(file)).string()).c_str());
}

void remove_recipe(const RecipeRequest& request) {
  if (request.out.empty()) throw Error("--remove writes a picture without its recipe; say where to, with --out FILE");
  std::error_code error;
  const std::string bytes =
      fs::is_directory(request.given, error) ? "" : read_text_file(request.given, kMostRecordBytes);
  if (!is_png(bytes)) throw Error(request.given.string() + ": --remove takes a PNG picture, and this is none");
  std::string bare;
  try {
    bare = without_png_text(bytes, kRecipeKeyword);
  } catch (const Error& fault) {
    throw Error(request.given.string() + ": " + fault.what());
  }
  write_text_file(request.out, bare, Kinds::files_and_pipes);
  say_written(request.out);
}

/// On a terminal, nothing in a file of somebody else may command it; elsewhere, the text stays as it is.
void print_text(const std::string& text) {
  const bool is_terminal = isatty(STDOUT_FILENO);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    std::printf("%s\n", (is_terminal ? printable(line) : line).c_str());
}

void print_recipe(const RecipeRequest& request) {
  const std::vector<NamedRecipe> recipes = recipes_in(request.given);
  if (request.json && request.variant.empty()) {
    nlohmann::json list = nlohmann::json::array();
    for (const NamedRecipe& one : recipes) list.push_back({{"variant", one.name}, {"recipe", one.text}});
    return print_as_json(list);
  }
  const NamedRecipe& recipe = chosen(recipes, request);
  if (request.json) return print_as_json(nlohmann::json::array({{{"variant", recipe.name}, {"recipe", recipe.text}}}));
  if (request.out.empty()) return print_text(recipe.text);
  write_text_file(request.out, recipe.text, Kinds::files_and_pipes);
  say_written(request.out);
}

/// The exit code: 0 if the results are the same, else 1.
int print_findings(const Findings& findings, bool as_json) {
  if (as_json)
    print_as_json(json_of(findings));
  else
    print(findings);
  return findings.identical() ? 0 : 1;
}

int diff(const std::filesystem::path& before, const std::filesystem::path& now, bool as_json) {
  KnownValues values;
  return print_findings(find_differences(read_run(before), read_run(now), values), as_json);
}

int rerun(const RerunRequest& request) {
  RunRecord before = read_run(request.run);
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({request.run / "pipeline.yaml", {}, {}}, catalogue, pipeline, true)) return 2;
  expect_good_place(pipeline, request.folder, nullptr);
  const std::filesystem::path runs = "runs";
  FolderOfItsOwn own(runs);
  RunFolder folder = request.folder.empty() ? RunFolder::with_free_name(runs / (pipeline.name + "-rerun"), pipeline)
                                            : RunFolder(request.folder, pipeline);
  if (request.folder.empty()) own.take(folder.path());
  RunRequest how;
  how.seed = before.seed;
  how.threads = before.threads;
  how.file_limits = before.file_limits;
  if (request.file_limits.memory_mb > 0) how.file_limits.memory_mb = request.file_limits.memory_mb;
  if (request.file_limits.seconds > 0) how.file_limits.seconds = request.file_limits.seconds;
  how.log_level = request.log_level;
  how.quiet = request.quiet || request.json;
  // The store is not used: a result that is read back proves nothing, and a different result must not replace the
  // first.
  const RunOutcome outcome = execute(pipeline, catalogue, how, before.arguments, nullptr, folder);
  own.keep_if_fruitful(pipeline, outcome);
  if (outcome.result.cancelled()) return 130;
  KnownValues values;
  for (const NodeRecord& node : outcome.result.nodes)
    for (const Value& output : node.outputs) values.add(output);
  const int code = print_findings(find_differences(std::move(before), read_run(folder.path()), values), request.json);
  return outcome.is_faulty ? 1 : code;
}

}  // namespace

void add_recipe(CLI::App& app, int& code) {
  const auto request = std::make_shared<RecipeRequest>();
  CLI::App* command =
      app.add_subcommand("recipe", "print the pipeline file that made a picture, a page or a run, to run it again");
  command
      ->add_option("from", request->given,
                   "a picture (PNG) of a run, a page of 'marrow show' or 'marrow compare', or the folder of a run")
      ->required()
      ->type_name("PATH");
  CLI::Option* out = command->add_option("-o,--out", request->out, "file to write instead; an existing one is replaced")
                         ->type_name("FILE");
  CLI::Option* variant =
      command->add_option("--variant", request->variant, "of a comparison's page: the variant whose recipe it is")
          ->type_name("NAME");
  CLI::Option* remove = command->add_flag(
      "--remove", request->remove, "write the picture without its recipe to --out: the same pixels, no paths of yours");
  command->add_flag("--json", request->json, "print all recipes as JSON: [{variant, recipe}]")
      ->excludes(remove)
      ->excludes(out);
  remove->excludes(variant);
  command->callback([request, &code] {
    if (request->remove)
      remove_recipe(*request);
    else
      print_recipe(*request);
    code = 0;
  });
}

void add_diff(CLI::App& app, int& code) {
  struct Given {
    std::filesystem::path first, second;
    bool as_json = false;
  };
  const auto given = std::make_shared<Given>();
  CLI::App* command = app.add_subcommand("diff", "say where two runs begin to differ, by how much, and why");
  command->add_option("first", given->first, "folder of a run, or of a cell of a comparison")
      ->required()
      ->type_name("FOLDER");
  command->add_option("second", given->second, "folder of the run to compare it with")->required()->type_name("FOLDER");
  command->add_flag("--json", given->as_json, "as JSON");
  command->callback([given, &code] { code = diff(given->first, given->second, given->as_json); });
}

void add_rerun(CLI::App& app, int& code) {
  const auto request = std::make_shared<RerunRequest>();
  CLI::App* command = app.add_subcommand(
      "rerun", "repeat a run from its folder without stored results, and say whether its results are the same");
  command->add_option("run", request->run, "folder of the run, or of a cell of a comparison")
      ->required()
      ->type_name("FOLDER");
  command
      ->add_option("-o,--out", request->folder,
                   "folder to write; new or empty (default: runs/NAME-rerun, or runs/NAME-rerun-2 ... if that exists)")
      ->type_name("FOLDER");
  add_log_level(command, request->log_level);
  command->add_flag("-q,--quiet", request->quiet, "no progress");
  command->add_flag("--json", request->json, "print the differences as JSON");
  add_file_limits(command, request->file_limits, "as the run had it");
  command->callback([request, &code] { code = rerun(*request); });
}

}  // namespace marrow::cli
