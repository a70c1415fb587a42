// SPDX-License-Identifier: Apache-2.0
// Experiments, beside a pipeline, one that simulates, and folders of cases.
#include "marrow/compare/experiment.hpp"
#include "nodes.hpp"
#include "target.hpp"

namespace {

using namespace marrow;

void put_neighbours() {
  fuzz::put("pipeline.yaml",
            "marrow: 1\ninputs:\n  case: {type: path, default: .}\n  amount: {type: number, default: 1}\nnodes:\n  one: {uses: test.constant, with: {value: $amount}}\n"
            "  start: {uses: test.displaced}\n  judge: {uses: evaluate.test, in: {of: one}}\n  all: {uses: test.sides}\noutputs: {errors: judge, start: start, sides: all.both}\n");
  fuzz::put("simulate.yaml",
            "marrow: 1\ninputs:\n  seed: {type: integer, default: 1}\n  shift: {type: number, default: 0}\nnodes:\n  one: {uses: test.constant, with: {count: $seed, value: $shift}}\noutputs: {case: one}\n");
  for (const char* name : {"cases/a", "cases/b"}) std::filesystem::create_directories(fuzz::folder() / name);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool once = (put_neighbours(), true);
  (void)once;
  const std::filesystem::path file = fuzz::put("experiment.yaml", {reinterpret_cast<const char*>(data), size});
  fuzz::expect_value_or_error([&] {
    Diagnostics faults;
    const compare::Experiment experiment = compare::read_experiment(file, fuzz::nodes(), faults);
    if (!faults.empty()) faults.text();
    else if (experiment.cell_count() > 0) compare::arguments_of(experiment, {}, "case");
  });
  return 0;
}
