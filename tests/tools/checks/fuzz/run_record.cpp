// SPDX-License-Identifier: Apache-2.0
// The files that a run leaves: run.json, the pipeline.yaml beside it, the row of a cell, and a picture.
#include "difference/difference.hpp"

#include "marrow/base/json_text.hpp"
#include "marrow/compare/cell.hpp"
#include "run_files.hpp"
#include "target.hpp"

namespace {

using namespace marrow;

constexpr std::string_view kPipeline =
    "marrow: 1\nnodes:\n  one: {uses: test.constant, with: {value: 2}}\n  two: {uses: test.add, in: {a: one, b: [one, "
    "one]}}\noutputs: {sum: two}\n";
constexpr std::string_view kRecord =
    R"({"pipeline":"p","status":"done","seed":1,"nodes":[)"
    R"({"id":"one","status":"done","keys":{"number":"0f"},"items":{"number":[["","0f"]]}}]})";

/// An experiment with one variant, case and start, and two figures.
const compare::Experiment& experiment() {
  static const compare::Experiment one = [] {
    compare::Experiment made;
    made.variants.push_back({"a", {}, {}});
    made.cases.push_back({"b", {}, false, 1});
    made.starts.push_back({"0", {}, {}});
    made.metrics.resize(2);
    return made;
  }();
  return one;
}

/// The text with a right digest, without which nothing of it is read.
std::string with_digest(std::string_view text) {
  nlohmann::json row = parse_json(std::string(text), "a cell's row");
  if (!row.is_object()) return std::string(text);
  row.erase("digest");
  const std::string line = row.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  row["digest"] = hash_of_bytes(line.data(), line.size()).hex();
  return row.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void read(char format, std::string_view text) {
  if (format == 'c') {
    const compare::CellRow row = compare::row_from_json(with_digest(text), experiment());
    compare::row_from_json(compare::to_json(row), experiment());
    return;
  }
  if (format == 'i') {
    cli::read_png(fuzz::put("run/outputs/a.png", text));
    return;
  }
  fuzz::put("run/run.json", format == 'r' ? text : kRecord);
  cli::read_run(fuzz::put("run/pipeline.yaml", format == 'p' ? text : kPipeline).parent_path());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const char format = input.choice("rcpi");
  fuzz::expect_value_or_error([&] { read(format, input.rest); });
  return 0;
}
