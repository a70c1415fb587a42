// SPDX-License-Identifier: Apache-2.0
// What leaves the store where it is to become smaller.
#include <chrono>
#include <set>
#include <thread>

#include "runtime/store_fixture.hpp"

namespace store_collect_test {

namespace fs = std::filesystem;
using marrow::Store;
using store_fixture::many;
using store_fixture::StoreTest;

TEST_F(StoreTest, TheLeastRecentlyUsedGoFirst) {
  for (int i = 0; i < 4; ++i) {
    store.save(marrow::hash_of(i), {many(1000)}, {});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  store.find(marrow::hash_of(0));  // used again
  const std::uint64_t one = store.entries()[0].bytes;
  const Store::Freed freed = store.collect(2 * one);
  EXPECT_EQ(freed.entries, 2u);
  EXPECT_EQ(freed.bytes, 2 * one);
  EXPECT_TRUE(store.find(marrow::hash_of(0)));
  EXPECT_FALSE(store.find(marrow::hash_of(1)));
  EXPECT_TRUE(store.find(marrow::hash_of(3)));
}

TEST_F(StoreTest, WhatNodesCameToGoesWithTheirResults) {
  const auto remembered = [&] {
    std::set<std::string> places;
    for (const char* place : {"old", "young"})
      if (store.last(place)) places.insert(place);
    return places;
  };
  for (int i = 0; i < 2; ++i) store.save(marrow::hash_of(i), {many(1000)}, {});
  for (const char* place : {"old", "young"}) store.remember(place, {});
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(store.folder() / "last" / marrow::hash_of(std::string("old")).hex(),
                      now - std::chrono::hours(72));
  const std::uint64_t one = store.entries()[0].bytes;
  for (const Store::Entry& entry : store.entries())
    fs::last_write_time(store.folder() / entry.key.hex().substr(0, 2) / entry.key.hex(), now - std::chrono::hours(60));
  EXPECT_EQ(store.collect(one).entries, 1u);
  EXPECT_EQ(remembered().size(), 2u) << "the call of the result that is kept may have begun then";
  fs::last_write_time(store.folder() / "last" / marrow::hash_of(std::string("old")).hex(),
                      now - std::chrono::hours(90));
  EXPECT_EQ(store.collect(2 * one).entries, 0u);
  EXPECT_EQ(remembered(), (std::set<std::string>{"young"}));
  EXPECT_EQ(store.collect(0).entries, 1u);
  EXPECT_TRUE(remembered().empty());
  EXPECT_TRUE(fs::is_empty(store.folder() / "last"));
}

}  // namespace store_collect_test
