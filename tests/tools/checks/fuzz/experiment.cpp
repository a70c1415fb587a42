// SPDX-License-Identifier: Apache-2.0
// Experiments, in a folder with a pipeline, a pipeline that simulates, and folders of cases.
#include "marrow/compare/experiment.hpp"
#include "nodes.hpp"

namespace {

using namespace marrow;

void put_neighbours() {
  fuzz::put("pipeline.yaml",
            "marrow: 1\ninputs:\n  case: {type: path, default: .}\n  amount: {type: number, default: 1}\nnodes:\n  "
            "one: {uses: test.constant, with: {value: $amount}}\n"
            "  start: {uses: test.displaced}\n  judge: {uses: judge.test, in: {of: one}}\n  all: {uses: "
            "test.sides}\noutputs: {errors: judge, start: start, sides: all.both}\n");
  fuzz::put("simulate.yaml",
            "marrow: 1\ninputs:\n  seed: {type: integer, default: 1}\n  shift: {type: number, default: 0}\nnodes:\n  "
            "one: {uses: test.constant, with: {count: $seed, value: $shift}}\noutputs: {case: one}\n");
  for (const char* name : {"cases/a", "cases/b"}) std::filesystem::create_directories(fuzz::folder() / name);
}

/// Numbers of many digits make many cases, up to the largest allowed number, which takes a thousand times as long.
bool has_long_number(std::string_view text) {
  std::size_t digits = 0;
  for (const char letter : text) {
    digits = letter >= '0' && letter <= '9' ? digits + 1 : 0;
    if (digits > 3) return true;
  }
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool once = (put_neighbours(), true);
  (void)once;
  if (size % 64 != 0 && has_long_number({reinterpret_cast<const char*>(data), size})) return -1;  // one in 64 may
  const std::filesystem::path file = fuzz::put("experiment.yaml", {reinterpret_cast<const char*>(data), size});
  fuzz::expect_value_or_error([&] {
    Diagnostics faults;
    const compare::Experiment experiment = compare::read_experiment(file, fuzz::nodes(), faults);
    if (!faults.empty())
      faults.text();
    else if (experiment.cell_count() > 0)
      compare::arguments_of(experiment, {}, "case");
  });
  return 0;
}
