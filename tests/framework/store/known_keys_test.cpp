// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/known_keys.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace {

using marrow::Digest;
using marrow::KnownKeys;

int times_hashed = 0;

marrow::Value number(std::shared_ptr<const int> data, const std::string& type = "test_number") {
  static constexpr marrow::Content kContent{[](const void* at) {
                                              ++times_hashed;
                                              return Digest{std::uint64_t(*static_cast<const int*>(at)), 1};
                                            },
                                            nullptr, nullptr};
  marrow::Value value;
  value.type = {type, 1, sizeof(int), false, &kContent};
  value.data = std::move(data);
  return value;
}

TEST(KnownKeys, DataAreHashedOnceWhileTheyLive) {
  KnownKeys keys;
  times_hashed = 0;
  const auto seven = std::make_shared<const int>(7);
  EXPECT_EQ(keys.key_of(number(seven)), (Digest{7, 1}));
  EXPECT_EQ(keys.key_of(number(seven)), (Digest{7, 1}));
  EXPECT_EQ(times_hashed, 1);
  EXPECT_EQ(keys.key_of(number(std::make_shared<const int>(8))), (Digest{8, 1}));
  EXPECT_EQ(times_hashed, 2);
}

TEST(KnownKeys, OtherDataAtTheSameAddressAreHashedAnew) {
  KnownKeys keys;
  int here = 1;
  const auto nothing = [](const int*) {};
  EXPECT_EQ(keys.key_of(number(std::shared_ptr<const int>(&here, nothing))), (Digest{1, 1}));
  here = 2;
  EXPECT_EQ(keys.key_of(number(std::shared_ptr<const int>(&here, nothing))), (Digest{2, 1}));
}

TEST(KnownKeys, TheSameAddressAsAnotherTypeIsHashedAnew) {
  KnownKeys keys;
  times_hashed = 0;
  const auto seven = std::make_shared<const int>(7);
  keys.key_of(number(seven));
  keys.key_of(number(seven, "another_type"));
  EXPECT_EQ(times_hashed, 2);
}

TEST(KnownKeys, DeadDataAreForgotten) {
  KnownKeys keys;
  const auto kept = std::make_shared<const int>(5);
  keys.key_of(number(kept));
  times_hashed = 0;
  for (int i = 0; i < 1000; ++i) keys.key_of(number(std::make_shared<const int>(i)));
  EXPECT_EQ(times_hashed, 1000);
  EXPECT_EQ(keys.key_of(number(kept)), (Digest{5, 1}));
  EXPECT_EQ(times_hashed, 1000) << "data that still exist are still known";
}

}  // namespace
