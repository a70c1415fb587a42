// SPDX-License-Identifier: Apache-2.0
// Adds cases to a comparison until its rule says stop.
#include <cstdio>

#include "compare/comparison.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;

/// The numbers of cases to look at, up to those that were asked for.
std::vector<std::size_t> looks_within(const CompareRequest& request, const Experiment& experiment) {
  if (!experiment.stop)
    throw Error(experiment.file.string() + " does not say when to stop adding cases; add for example  stop: {figure: " +
                experiment.metrics[0].path + ", width: 0.05, most_cases: 300, look_every: 20}");
  const compare::StopRule& rule = *experiment.stop;
  if (request.more_cases < rule.look_every && rule.first_cases < rule.most_cases)
    throw Error(formatted("--more-cases {} is less than the {} cases from one look to the next; give at least as many",
                          request.more_cases, rule.look_every));
  std::vector<std::size_t> looks = rule.looks();
  while (looks.back() > rule.first_cases + request.more_cases) looks.pop_back();
  return looks;
}

/// The experiment with so many further cases. It was read without faults before.
Experiment with_more(const Experiment& experiment, const Catalogue& catalogue, std::size_t more) {
  Diagnostics diagnostics;
  Experiment larger = compare::read_experiment(experiment.file, catalogue, diagnostics, more);
  if (!diagnostics.empty())
    throw Error(formatted("the experiment cannot have {} more cases:\n{}", more, diagnostics.text()));
  return larger;
}

}  // namespace

Experiment largest_experiment(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment) {
  return with_more(experiment, catalogue, looks_within(request, experiment).back() - experiment.stop->first_cases);
}

int run_more_cases(const CompareRequest& asked, const Catalogue& catalogue, const Experiment& experiment,
                   const std::filesystem::path& folder) {
  CompareRequest request = asked;
  const std::vector<std::size_t> looks = looks_within(asked, experiment);
  for (std::size_t k = 0;; ++k) {
    request.more_cases = looks[k] - experiment.stop->first_cases;
    const Experiment larger = with_more(experiment, catalogue, request.more_cases);
    if (k + 1 == looks.size()) return run_comparison(request, catalogue, larger, folder);
    const auto cells = run_cells(request, catalogue, larger, folder);
    if (!cells) return stopped();
    const Answer answer = answer_of(larger, cells->rows);
    request.made_before += cells->made;
    request.calls_before.add(cells->calls);
    for (const compare::CellRow& row : cells->rows)
      if (!row.failed.empty()) request.failed_before.emplace(row.id, row);
    if (answer.look->is_met) return run_comparison(request, catalogue, larger, folder);
    if (!request.quiet) std::fprintf(stderr, "marrow: %s\n", printable(answer.look_sentence).c_str());
  }
}

}  // namespace marrow::cli
