// SPDX-License-Identifier: Apache-2.0
// How cells are cut into chunks, with lengths computed by hand.
#include <gtest/gtest.h>

#include <numeric>

#include "cluster/plan.hpp"

namespace cut_test {

using marrow::cli::ChunkRule;
using marrow::cli::cut_into_chunks;
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

}  // namespace cut_test
