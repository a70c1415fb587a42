// SPDX-License-Identifier: Apache-2.0
// Rows that several hosts left of one cell: which one counts does not depend on the names or the order of the files.
#include <gtest/gtest.h>

#include <fstream>

#include "cluster/chunk_rows.hpp"
#include "tests/framework/fixture.hpp"

namespace chunk_rows_test {

using marrow::cli::RowsOfChunks;
using marrow::compare::CellRow;
using runtime_fixture::Scratch;

marrow::compare::Experiment experiment() {
  marrow::compare::Experiment e;
  e.variants.push_back({"v", {}, {}});
  for (const char* name : {"a", "b"}) e.cases.push_back({name, {}, false, 1});
  e.starts.push_back({"0", {}, {}});
  e.metrics.emplace_back();
  e.metrics.back().path = "errors.mtre_mm";
  return e;
}

std::string line(const std::string& key, double value, const std::string& failed = "") {
  CellRow row;
  marrow::compare::name_row(row, experiment(), {0, 0, 0});
  row.failed = failed;
  row.values = {failed.empty() ? std::optional(value) : std::nullopt};
  row.units = {"mm"};
  row.key = key;
  return to_json(row);
}

class ChunkRows : public testing::Test {
 protected:
  ChunkRows() { std::filesystem::create_directories(scratch.path / "rows"); }
  void put(const std::string& name, const std::string& lines) { std::ofstream(scratch.path / "rows" / name) << lines; }
  RowsOfChunks rows(const std::string& plan = "") { return {scratch.path, all, plan}; }
  const marrow::compare::Experiment all = experiment();
  Scratch scratch;
};

TEST_F(ChunkRows, ThoseOfThisMachineComeFirstThenByTheirTexts) {
  const std::vector<std::string> lines = {line("k-x", 3), line("k-y", 2), line("k-z", 1), line("other-x", 0)};
  std::set<double> of_others;
  for (const bool is_reversed : {false, true}) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      put(std::to_string(is_reversed ? lines.size() - i : i) + ".jsonl", lines[i] + "\n");
    EXPECT_EQ(rows().done({0, 0, 0}, "k-x")->values[0], 3);
    EXPECT_EQ(rows().done({0, 0, 0}, "k-y")->values[0], 2);
    of_others.insert(*rows().done({0, 0, 0}, "k-none")->values[0]);
    EXPECT_FALSE(rows().done({0, 0, 0}, "another-x"));
    EXPECT_FALSE(rows().done({0, 1, 0}, "k-x"));
    std::filesystem::remove_all(scratch.path / "rows");
    std::filesystem::create_directories(scratch.path / "rows");
  }
  EXPECT_EQ(of_others.size(), 1u);
}

TEST_F(ChunkRows, ContradictEachOtherByTheirFiguresOnly) {
  put("1.jsonl", line("k-x", 3) + "\n" + line("k-y", 3) + "\n" + line("other-x", 0) + "\n");
  EXPECT_FALSE(rows().contradicts({0, 0, 0}, *rows().done({0, 0, 0}, "k-x")));
  put("2.jsonl", line("k-z", 3.0000000000000004) + "\n");
  EXPECT_TRUE(rows().contradicts({0, 0, 0}, *rows().done({0, 0, 0}, "k-x")));
}

TEST_F(ChunkRows, OfFailedOnesTheFirstByItsTextCounts) {
  std::set<std::string> taken;
  for (const bool is_reversed : {false, true}) {
    put(is_reversed ? "p-2.jsonl" : "p-1.jsonl", line("k-x", 0, "out of memory") + "\n");
    put(is_reversed ? "p-1.jsonl" : "p-2.jsonl", line("k-x", 0, "a crash") + "\n");
    taken.insert(rows("p").failed({0, 0, 0})->failed);
    EXPECT_FALSE(rows("q").failed({0, 0, 0}));
  }
  EXPECT_EQ(taken.size(), 1u);
}

TEST_F(ChunkRows, ALineThatWasChangedOrCutIsNone) {
  std::string changed = line("k-x", 3), cut = line("k-x", 4);
  changed.replace(changed.find("3.0"), 3, "2.0");
  put("1.jsonl", changed + "\n" + cut.substr(0, cut.size() - 1) + "\n");
  EXPECT_FALSE(rows().done({0, 0, 0}, "k-x"));
  put("2.jsonl", line("k-x", 5) + "\n");
  EXPECT_EQ(rows().done({0, 0, 0}, "k-x")->values[0], 5);
}

}  // namespace chunk_rows_test
