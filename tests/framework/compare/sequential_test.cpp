// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <marrow/compare/sequential.hpp>

#include "tests/harness/message_of.hpp"

namespace sequential_test {

using namespace marrow::compare;

std::vector<double> equal_shares(std::size_t looks) {
  std::vector<double> shares;
  for (std::size_t k = 1; k <= looks; ++k) shares.push_back(double(k) / double(looks));
  return shares;
}

TEST(Looks, LateLevelsAreThePublishedOnes) {
  // z of 4.8769, 3.3570, 2.6803, 2.2898, 2.0310 at five looks, two-sided alpha 0.05, of the spending function like
  // O'Brien and Fleming's (programs for Reboussin, DeMets, Kim and Lan 2000, Control Clin Trials 21:190).
  const std::vector<double> z{4.8769, 3.3570, 2.6803, 2.2898, 2.0310}, levels = levels_of_looks(equal_shares(5));
  ASSERT_EQ(levels.size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    const double expected = std::erfc(z[k] / std::sqrt(2.0));
    EXPECT_NEAR(levels[k] / expected, 1, 1e-3) << "look " << k + 1;
  }
}

TEST(Looks, OneLookTakesAllOfAlpha) {
  for (const Spending spending : {Spending::late, Spending::even})
    EXPECT_NEAR(levels_of_looks({1}, 0.1, spending)[0], 0.1, 1e-8);
}

TEST(Looks, EvenLevelsSpendTheFirstShareAtOnce) {
  const std::vector<double> levels = levels_of_looks(equal_shares(10), 0.05, Spending::even);
  EXPECT_NEAR(levels[0], 0.05 * std::log(1 + 0.1 * (std::exp(1.0) - 1)), 1e-9);
  for (const double level : levels) {
    EXPECT_GT(level, 0.007);
    EXPECT_LT(level, 0.014);
  }
}

TEST(Looks, RefuseSharesThatDoNotRise) {
  EXPECT_EQ(MESSAGE_OF(levels_of_looks({})), "there are no looks; give at least one");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({0.5, 0.5})), "look 2 has seen the share 0.500000 of the cases");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({1.1})), "look 1 has seen");
  EXPECT_HAS(MESSAGE_OF(levels_of_looks({1}, 5)), "from 0.001 to 0.5");
}

TEST(Looks, AreAtTheFirstCasesAndEveryFew) {
  EXPECT_EQ(looks_at(20, 20, 60), (std::vector<std::size_t>{20, 40, 60}));
  EXPECT_EQ(looks_at(7, 20, 30), (std::vector<std::size_t>{7, 27, 30}));
  EXPECT_EQ(looks_at(5, 1, 5), (std::vector<std::size_t>{5}));
  EXPECT_HAS(MESSAGE_OF(looks_at(5, 1, 4)), "begin at 5 cases and end at 4");
}

}  // namespace sequential_test
