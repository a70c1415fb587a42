// SPDX-License-Identifier: Apache-2.0
// `marrow curves`: sequences compared over time.
#include <cstdio>
#include <set>

#include "command_options.hpp"
#include "compare/comparison_folder.hpp"
#include "curves/curves.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

struct CurvesRequest {
  std::vector<fs::path> given;
  fs::path folder;
  std::string by = "auto";
  std::string lag;
  CurveSettings settings;
  bool as_json = false;
};

/// The runs in a folder that is no run itself, by their paths in it.
std::set<std::string> runs_in(const fs::path& folder) {
  std::set<std::string> runs;
  std::error_code error;
  if (!fs::is_directory(folder, error) || fs::exists(folder / "run.json", error)) return runs;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::recursive_directory_iterator(); ++entry) {
    if (!entry->is_directory() || !fs::exists(entry->path() / "run.json")) continue;
    runs.insert(entry->path().lexically_relative(folder).generic_string());
    entry.disable_recursion_pending();
  }
  return runs;
}

ComparedTrials compared_trials(const fs::path& first, const fs::path& second, const CurveSettings& settings) {
  const std::set<std::string> of_first = runs_in(first), of_second = runs_in(second);
  std::vector<TrialPair> pairs;
  std::vector<std::string> notes;
  for (const std::string& name : of_first)
    if (of_second.contains(name))
      pairs.push_back({name, read_recording(first / name), read_recording(second / name)});
    else
      notes.push_back("the run " + name + " is in the first folder only");
  for (const std::string& name : of_second)
    if (!of_first.contains(name)) notes.push_back("the run " + name + " is in the second folder only");
  if (pairs.empty())
    throw Error("no run of " + first.string() + " has the name of one of " + second.string() + "; the first has '" +
                *of_first.begin() + "', the second '" + *of_second.begin() +
                "'; runs of the same trial must have the same name in both folders");
  ComparedTrials result = compare_trials(pairs, settings);
  result.first = first.string();
  result.second = second.string();
  result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
  return result;
}

/// The variants of a comparison as folders of trials; any other path as it is.
std::vector<fs::path> opened(const std::vector<fs::path>& given) {
  if (given.size() > 1 || !is_comparison(given.front())) return given;
  throw Error(given.front().string() +
              ": this is the folder of a comparison; give the folders of two of its variants: " +
              (given.front() / "cells" / "VARIANT").string());
}

CurveAnswer answer_of(const CurvesRequest& request) {
  const std::vector<fs::path> given = opened(request.given);
  if (given.size() < 2)
    throw Error("a comparison over time takes two sequences or more: folders of runs, tables (CSV) or .tra");
  CurveAnswer answer;
  const bool are_trials = !runs_in(given.front()).empty();
  for (std::size_t i = 1; i < given.size(); ++i) {
    if (are_trials != !runs_in(given[i]).empty())
      throw Error(formatted("{} holds several runs and {} does not; give two single sequences, or two such folders",
                            given[are_trials ? 0 : i].string(), given[are_trials ? i : 0].string()));
    if (are_trials)
      answer.trials.push_back(compared_trials(given.front(), given[i], request.settings));
    else
      answer.sequences.push_back(
          compare_sequences(read_recording(given.front()), read_recording(given[i]), request.settings));
  }
  return answer;
}

int compare_curves(CurvesRequest& request) {
  request.settings.by = request.by == "auto"     ? TimeBase::seconds_if_known
                        : request.by == "frames" ? TimeBase::frames
                                                 : TimeBase::seconds;
  if (!request.lag.empty()) request.settings.lag = number("--lag", request.lag, -1e9, 1e9, "seconds or frames");
  const CurveAnswer answer = answer_of(request);
  if (!request.folder.empty()) write_curves(answer, request.folder);
  if (request.as_json) {
    print_as_json(json_of(answer));
    return 0;
  }
  print(answer);
  if (request.folder.empty())
    std::printf("Curves as a page, CSV and JSON: add --out FOLDER\n");
  else
    std::printf("%s\n", printable((request.folder / "report.html").string()).c_str());
  return 0;
}

}  // namespace

void add_curves(CLI::App& app, int& code) {
  const auto request = std::make_shared<CurvesRequest>();
  CLI::App* command = app.add_subcommand(
      "curves", "compare sequences over time: joint angles, poses and other figures, frame by frame");
  command
      ->add_option("sequences", request->given,
                   "two or more runs, tables (CSV), .tra, or folders of these; or of runs with the same names, one for "
                   "each trial. Each is compared with the first")
      ->required()
      ->type_name("PATH");
  command
      ->add_option("--figure", request->settings.figures, "only this figure, or those of this file; may be given again")
      ->expected(1)
      ->take_all()
      ->type_name("NAME");
  command->add_option("--by", request->by, "what frames are matched by; auto: by seconds where both know them")
      ->check(CLI::IsMember({"auto", "frames", "seconds"}))
      ->capture_default_str();
  command
      ->add_option("--lag", request->lag,
                   "the second is later by so much (seconds or frames, as printed): it is shifted back")
      ->type_name("NUMBER");
  command->add_option("-o,--out", request->folder, "new or empty folder for report.html, curves.csv and curves.json")
      ->type_name("FOLDER");
  command->add_flag("--json", request->as_json, "print all curves and their statistics as JSON");
  command->callback([request, &code] { code = compare_curves(*request); });
}

}  // namespace marrow::cli
