// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <marrow/compare/letters.hpp>
#include <marrow/domain/random.hpp>

#include "tests/harness/message_of.hpp"

namespace letters_test {

using marrow::compare::letters_of_groups;
using Letters = std::vector<std::string>;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(Letters, AreSharedByThoseThatNothingTellsApart) {
  EXPECT_EQ(letters_of_groups(0, {}), Letters());
  EXPECT_EQ(letters_of_groups(3, {}), (Letters{"a", "a", "a"}));
  EXPECT_EQ(letters_of_groups(2, {{1, 0}}), (Letters{"a", "b"}));
  EXPECT_EQ(letters_of_groups(3, {{0, 2}}), (Letters{"a", "ab", "b"}));
}

TEST(Letters, OfAChainInWhichNeighboursDoNotDiffer) {
  const Pairs different{{0, 2}, {0, 3}, {0, 4}, {1, 3}, {1, 4}, {2, 4}};
  EXPECT_EQ(letters_of_groups(5, different), (Letters{"a", "ab", "bc", "cd", "d"}));
}

TEST(Letters, SayOfEachPairWhetherItDiffers) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    marrow::Random random(seed);
    const std::size_t things = 2 + random.index(6);
    Pairs different;
    for (std::size_t i = 0; i < things; ++i)
      for (std::size_t j = i + 1; j < things; ++j)
        if (random.uniform() < 0.4) different.emplace_back(i, j);
    const auto letters = letters_of_groups(things, different);
    ASSERT_TRUE(letters);
    for (std::size_t i = 0; i < things; ++i)
      for (std::size_t j = i + 1; j < things; ++j) {
        const bool differ = std::find(different.begin(), different.end(), std::pair(i, j)) != different.end();
        EXPECT_EQ((*letters)[i].find_first_of((*letters)[j]) == std::string::npos, differ) << seed;
      }
  }
}

TEST(Letters, AreNotGivenWhereThereAreTooFew) {
  Pairs pairs;  // each with its neighbour alone: every choice of one of each pair is a group
  for (std::size_t i = 0; i < 4; ++i) pairs.emplace_back(2 * i, 2 * i + 1);
  EXPECT_EQ(letters_of_groups(8, pairs)->front(), "abcdefgh");
  pairs.emplace_back(8, 9);
  EXPECT_EQ(letters_of_groups(10, pairs), std::nullopt);  // 32 groups
  for (std::size_t i = 5; i < 40; ++i) pairs.emplace_back(2 * i, 2 * i + 1);
  EXPECT_EQ(letters_of_groups(80, pairs), std::nullopt);
}

TEST(Letters, RefuseAPairThatIsNone) {
  for (const auto& [one, other] : Pairs{{0, 3}, {3, 1}, {1, 1}})
    EXPECT_EQ(MESSAGE_OF(letters_of_groups(3, {{one, other}})),
              "the pair " + std::to_string(one) + " and " + std::to_string(other) +
                  " of 3 things cannot differ; give two of them, counted from 0");
}

}  // namespace letters_test
