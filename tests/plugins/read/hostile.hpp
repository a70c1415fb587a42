// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the tests of hostile files: the limits within which a small file must be refused.
#include <chrono>

#include "tests/plugins/read/damage.hpp"

namespace marrow::test {

/// Reads in a process of its own that may take 256 MB, and returns its error. Fails the test unless the error names the
/// file and comes within 60 seconds, also on a busy machine.
inline std::string refusal_within_limits(const std::function<void()>& read, const std::string& file_name) {
  std::string said;
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome = outcome_of(read, file_name, 256 << 20, said);
  EXPECT_EQ(outcome, Outcome::refused) << file_name << ": " << name_of(outcome) << ": " << said;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60)) << file_name;
  return said;
}

#define EXPECT_REFUSED(read, file_name, text)                                                                \
  do {                                                                                                       \
    const std::string marrow_said = ::marrow::test::refusal_within_limits([&] { (void)(read); }, file_name); \
    EXPECT_NE(marrow_said.find(text), std::string::npos) << "it said: " << marrow_said;                      \
  } while (false)

}  // namespace marrow::test
