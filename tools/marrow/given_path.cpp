// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <regex>
#include <string>

#include "commands.hpp"
#include "compare/comparison_folder.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// One of the things that marrow's commands take or make.
struct Thing {
  std::optional<Wanted> kind;  ///< nothing: no command takes it alone
  std::string what, advice;
};

std::string name_of(Wanted wanted) {
  if (wanted == Wanted::pipeline) return "a pipeline";
  return wanted == Wanted::experiment ? "an experiment" : "the folder of a run";
}

std::optional<Thing> thing_in_folder(const fs::path& folder) {
  std::error_code error;
  const std::string name = shell_path(folder);
  if (is_comparison(folder))
    return Thing{{},
                 "the folder of a comparison",
                 "its report is " + printable((folder / "report.html").string()) +
                     ", its cells are runs (cells/VARIANT/CASE/START), and this continues it: marrow compare "
                     "EXPERIMENT --out " +
                     name};
  if (fs::exists(folder / "run.json", error))
    return Thing{Wanted::run, name_of(Wanted::run),
                 "look at it by: marrow show " + name + "; repeat it by: marrow rerun " + name};
  if (fs::exists(folder / "case.yaml", error))
    return Thing{
        {}, "the folder of a case", "give it to a pipeline: marrow run PIPELINE case=" + shell_word(folder.string())};
  return std::nullopt;
}

/// By the first of the keys that only one kind of file has at its top level. Everything in the expression is bounded:
/// it is matched by recursion. `name`: the file as a word of a shell.
std::optional<Thing> thing_in_text(const std::string& text, const std::string& name) {
  static const std::regex kKey("(?:^|[\\n\\r]|\xEF\xBB\xBF)(experiment|variants|marrow|nodes|marrow-[a-z-]{1,40}) ?:");
  std::smatch key;
  if (!std::regex_search(text, key, kKey)) return std::nullopt;
  if (key[1] == "experiment" || key[1] == "variants")
    return Thing{Wanted::experiment, name_of(Wanted::experiment),
                 "look at it by: marrow compare " + name + " --dry-run"};
  if (key[1] == "marrow" || key[1] == "nodes")
    return Thing{Wanted::pipeline, name_of(Wanted::pipeline), "run it by: marrow run " + name};
  return Thing{{}, "a file of the format " + key[1].str(), "a pipeline names it in an option or an input"};
}

std::optional<Thing> thing_at(const fs::path& given, Wanted wanted) {
  std::error_code error;
  if (given != "-" && fs::is_directory(given, error)) return thing_in_folder(given);
  const fs::path folder = given.has_parent_path() ? given.parent_path() : fs::path(".");
  if (wanted == Wanted::run && fs::exists(folder / "run.json", error) && fs::exists(given, error))
    return Thing{{}, "a file of a run", "give the folder: " + printable(folder.string())};
  try {
    return thing_in_text(read_given_text(given, kMostSourceBytes), shell_path(given));
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

void expect_given(const fs::path& given, Wanted wanted) {
  if (given.empty()) throw Error("the path of " + name_of(wanted) + " is empty; a variable may have no value");
  if (given == "-" && wanted != Wanted::pipeline)
    throw Error("- is the standard input, which holds no " + name_of(wanted).substr(name_of(wanted).find(' ') + 1) +
                "; give its path (./- is a file of that name)");
  const std::optional<Thing> thing = thing_at(given, wanted);
  if (thing && thing->kind != wanted)
    throw Error(given.string() + ": this is " + thing->what + ", not " + name_of(wanted) + "; " + thing->advice);
}

}  // namespace marrow::cli
