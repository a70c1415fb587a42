// SPDX-License-Identifier: Apache-2.0
// The cells of chunks. Of the rows that several hosts left of one cell, which one counts does not depend on the names
// or the order of the files.

#include <numeric>

#include "cluster/cluster.hpp"
#include "tests/framework/fixture.hpp"

namespace chunk_cells_test {

using marrow::cli::cut_into_chunks;
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

// How cells are cut into chunks, with lengths computed by hand.
using Numbers = std::vector<std::size_t>;

Numbers all(std::size_t count) {
  Numbers numbers(count);
  std::iota(numbers.begin(), numbers.end(), std::size_t(0));
  return numbers;
}

std::vector<std::size_t> sizes(const std::vector<Numbers>& chunks) {
  std::vector<std::size_t> result;
  for (const Numbers& chunk : chunks) result.push_back(chunk.size());
  return result;
}

/// Every number once, in order.
void expect_whole(const std::vector<Numbers>& chunks, const Numbers& numbers) {
  Numbers joined;
  for (const Numbers& chunk : chunks) joined.insert(joined.end(), chunk.begin(), chunk.end());
  EXPECT_EQ(joined, numbers);
}

TEST(CutIntoChunks, ACaseIsAChunkIfNothingIsKnown) {
  const auto chunks = cut_into_chunks(all(30), 10, 0, {});
  EXPECT_EQ(sizes(chunks), (std::vector<std::size_t>{10, 10, 10}));
  expect_whole(chunks, all(30));
}

TEST(CutIntoChunks, WholeCasesUntilItIsLongEnough) {
  // 10 minutes are 25 cells of 24 s: three cases of 10, and the two that are left
  const auto chunks = cut_into_chunks(all(50), 10, 24, {});
  EXPECT_EQ(sizes(chunks), (std::vector<std::size_t>{30, 20}));
  expect_whole(chunks, all(50));
}

TEST(CutIntoChunks, ALongCaseIsCut) {
  // 10 minutes are 10 cells of a minute: a case of 45 makes four chunks of 11 or 12
  const auto chunks = cut_into_chunks(all(90), 45, 60, {});
  EXPECT_EQ(sizes(chunks), (std::vector<std::size_t>{11, 11, 11, 12, 11, 11, 11, 12}));
  expect_whole(chunks, all(90));
}

TEST(CutIntoChunks, CellsThatAreDoneAreNotThere) {
  const Numbers left{3, 4, 9, 10, 29};
  const auto chunks = cut_into_chunks(left, 10, 0, {});
  EXPECT_EQ(chunks, (std::vector<Numbers>{{3, 4, 9, 10, 29}}));
  expect_whole(chunks, left);
}

TEST(CutIntoChunks, NoMoreThanTheClusterTakes) {
  const auto chunks = cut_into_chunks(all(10'000), 10, 600, {10, 100});
  EXPECT_LE(chunks.size(), 100u);
  EXPECT_GT(chunks.size(), 70u);
  expect_whole(chunks, all(10'000));
}

TEST(CutIntoChunks, NothingIsLeft) { EXPECT_TRUE(cut_into_chunks({}, 10, 1, {}).empty()); }

}  // namespace chunk_cells_test
