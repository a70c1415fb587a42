// SPDX-License-Identifier: Apache-2.0
// A worker process of a comparison: reads "case N" and "cell", "time" or "draw" VARIANT CASE START (numbers), answers "end ...".
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <mutex>
#include <sstream>

#include "compare/comparison.hpp"
#include "marrow/domain/error.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;

/// Answers go to the standard output as it was at the start: what a plugin prints there must not pass for an answer.
class Answers {
 public:
  Answers() : stream_(fdopen(dup(STDOUT_FILENO), "w")) { dup2(STDERR_FILENO, STDOUT_FILENO); }
  ~Answers() { std::fclose(stream_); }
  void line(const std::string& text) {
    const std::scoped_lock lock(mutex_);
    std::fprintf(stream_, "%s\n", text.c_str());
    std::fflush(stream_);
  }

 private:
  std::FILE* stream_;
  std::mutex mutex_;
};

std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n') c = ' ';
  return text;
}

}  // namespace

int worker(const CompareRequest& request) {
  Answers answers;
  const Catalogue catalogue;
  Diagnostics diagnostics;
  const compare::Experiment experiment = compare::read_experiment(request.file, catalogue, diagnostics);
  if (!diagnostics.empty()) throw Error("the experiment has faults:\n" + diagnostics.text());
  const Store store;
  CellRunner runner(experiment, catalogue, request.no_cache ? nullptr : &store, request.folder, request.threads);
  const auto observer = [&](const RunEvent& event) {
    if (event.kind == RunEvent::Kind::started) answers.line("at node '" + event.node + "'" + (event.item.empty() ? "" : " (" + event.item + ")"));
  };
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    try {
      if (what == "case") {
        std::size_t index = 0;
        words >> index;
        runner.case_folder(index);
        answers.line("end good");
        continue;
      }
      CellIndex cell;
      words >> cell.variant >> cell.case_index >> cell.start;
      if (what == "cell") {
        answers.line("end " + compare::to_json(runner.run(cell, observer)));
      } else if (what == "time") {
        answers.line("end " + std::to_string(runner.time(cell)));
      } else {
        if (runner.draw(cell, observer)) ReportMaterial::prepare(runner.pictures_of(cell));
        answers.line("end good");
      }
    } catch (const std::exception& error) {
      answers.line("end " + one_line(error.what()));
    }
  }
  return 0;
}

}  // namespace marrow::cli
