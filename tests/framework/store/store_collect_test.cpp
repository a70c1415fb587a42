// SPDX-License-Identifier: Apache-2.0
// What is removed when the store must become smaller.
#include <atomic>
#include <chrono>
#include <fstream>
#include <set>
#include <thread>

#include "tests/framework/store/store_fixture.hpp"

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

TEST_F(StoreTest, RecordsOfLastResultsGoWithTheResults) {
  const auto remembered = [&] {
    std::set<std::string> places;
    for (const char* place : {"old", "young"})
      if (!store.last(place).empty()) places.insert(place);
    return places;
  };
  for (int i = 0; i < 2; ++i) store.save(marrow::hash_of(i), {many(1000)}, {});
  for (const char* place : {"old", "young"}) store.remember(place, {{"node", {}}});
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(store.folder() / "last" / marrow::hash_of(std::string("old")).hex(),
                      now - std::chrono::hours(72));
  const std::uint64_t one = store.entries()[0].bytes;
  for (const Store::Entry& entry : store.entries())
    fs::last_write_time(marrow::entry_file(store.folder(), entry.key), now - std::chrono::hours(60));
  EXPECT_EQ(store.collect(one).entries, 1u);
  EXPECT_EQ(remembered().size(), 2u) << "the call that made the kept result may have begun then";
  fs::last_write_time(store.folder() / "last" / marrow::hash_of(std::string("old")).hex(),
                      now - std::chrono::hours(90));
  EXPECT_EQ(store.collect(2 * one).entries, 0u);
  EXPECT_EQ(remembered(), (std::set<std::string>{"young"}));
  EXPECT_EQ(store.collect(0).entries, 1u);
  EXPECT_TRUE(remembered().empty());
  EXPECT_TRUE(fs::is_empty(store.folder() / "last"));
}

class TidyingTest : public StoreTest {
 protected:
  /// A store with that many records of nodes' last results, all older than its only result.
  void fill(int records) {
    fs::remove_all(store.folder());
    ASSERT_EQ(store.save(marrow::hash_of(0), {many(10)}, {}), "");
    fs::create_directories(store.folder() / "last");
    const auto old = fs::file_time_type::clock::now() - std::chrono::hours(72);
    for (int i = 0; i < records; ++i) {
      const fs::path file = store.folder() / "last" / marrow::hash_of(i).hex();
      std::ofstream(file) << "record";
      fs::last_write_time(file, old);
    }
  }
  std::size_t records() const {
    return std::size_t(std::distance(fs::directory_iterator(store.folder() / "last"), fs::directory_iterator()));
  }
  /// The shortest of several times to look through that many records. The limit is so high that none is removed.
  double seconds_to_look_through(int count) {
    fill(count);
    const std::uint64_t all = std::uint64_t(1) << 40;
    for (const auto& file : fs::directory_iterator(store.folder() / "last"))
      fs::last_write_time(file, fs::file_time_type::clock::now());
    double shortest = 1e9;
    for (int i = 0; i < 5; ++i) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_EQ(store.collect(all).entries, 0u);
      shortest = std::min(shortest, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    EXPECT_EQ(records(), std::size_t(count));
    return shortest;
  }
};

TEST_F(TidyingTest, TakesTwiceAsLongForTwiceAsManyRecords) {
  // Four times as many: linear work takes 4 times as long, quadratic work 16 times.
  EXPECT_LT(seconds_to_look_through(4000), 8 * seconds_to_look_through(1000));
}

TEST_F(TidyingTest, OldRecordsGoOfAnyNumber) {
  fill(3000);
  EXPECT_EQ(store.collect(std::uint64_t(1) << 40).fault, "");
  EXPECT_EQ(records(), 0u);
}

TEST_F(TidyingTest, StopsWhenItIsAskedTo) {
  fill(100);
  std::atomic<bool> cancelled{true};
  EXPECT_EQ(store.tidy(&cancelled), "");
  EXPECT_EQ(records(), 100u) << "it stopped before it removed anything";
  fs::remove(store.folder() / "tidied");
  cancelled = false;
  EXPECT_EQ(store.tidy(&cancelled), "");
  EXPECT_EQ(records(), 0u);
}

TEST_F(StoreTest, ARunLeavesOneRecordHoweverManyItemsItHas) {
  const auto result = run("  l: {uses: test.letters}\n  b: {uses: test.add, in: {a: l, b: l}}\n", "b: b");
  ASSERT_EQ(calls(result), 4) << "one for the list, and one for each of its three items";
  const auto files = fs::directory_iterator(store.folder() / "last");
  EXPECT_EQ(std::distance(fs::begin(files), fs::end(files)), 1);
}

}  // namespace store_collect_test
