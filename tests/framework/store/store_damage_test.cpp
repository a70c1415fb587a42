// SPDX-License-Identifier: Apache-2.0
// Damaged results are made again, and no result is ever half written.
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <random>
#include <thread>

#include "tests/framework/store/store_fixture.hpp"

namespace store_damage_test {

namespace fs = std::filesystem;
using marrow::RunResult;
using marrow::Store;
using runtime_fixture::test_catalogue;
using store_fixture::many;
using store_fixture::only_file;
using store_fixture::StoreTest;

TEST_F(StoreTest, EveryDamageIsNoticedAndMadeAgain) {
  const std::string nodes = "  c: {uses: test.constant, with: {value: 5}}\n";
  run(nodes, "c: c");
  const fs::path file = only_file(store.folder());
  const auto whole = [&] {
    std::ifstream stream(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string good = whole();
  ASSERT_GT(good.size(), 100u);
  for (std::size_t at = 0; at < good.size(); ++at)
    for (int kind = 0; kind < 2; ++kind) {
      std::string bad = good;
      if (kind)
        bad.resize(at);
      else
        bad[at] = char(bad[at] ^ 0x55);
      std::ofstream(file, std::ios::binary) << bad;
      const RunResult result = run(nodes, "c: c");
      ASSERT_FALSE(result.failed()) << at;
      ASSERT_EQ(result_of(result), 5) << at;
      ASSERT_EQ(result.nodes[0].calls, 1) << "damage at " << at << " was not noticed";
      ASSERT_EQ(whole().size(), good.size()) << "made again";
    }
}

TEST_F(StoreTest, DamagedInputOfANodeThatRunsIsMadeAgain) {
  run("  c: {uses: test.constant, with: {value: 5}}\n", "c: c");
  const fs::path file = only_file(store.folder());
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(-1, std::ios::end);
  stream.put('x');
  stream.close();
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 5}}\n  d: {uses: test.add, in: {a: c, b: c}}\n", "d: d");
  EXPECT_EQ(result_of(result), 10);
  EXPECT_EQ(result.nodes[0].calls, 1);
}

TEST_F(StoreTest, KilledWritersLeaveNothingHalf) {
  std::mt19937 chance(1);
  int found = 0;
  // On a machine so slow that nothing is written in this time, the writers live longer.
  for (int round = 0; round < 20 || (found <= 20 && round < 200); ++round) {
    const pid_t child = fork();
    if (child == 0) {
      for (int i = 0;; ++i) store.save(marrow::hash_of(i % 50), {many(100000)}, {});
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1 + chance() % (round < 20 ? 30 : 1000)));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    for (int i = 0; i < 50; ++i)
      if (const auto entry = store.find(marrow::hash_of(i))) {
        ++found;
        ASSERT_EQ(marrow::hash_of(entry->outputs[0].as<marrow::Volume>()), many(100000).key);
      }
  }
  EXPECT_GT(found, 20);
  store.collect(0);
  EXPECT_TRUE(only_file(store.folder()).empty())
      << "temporary files of killed processes are collected too: " << only_file(store.folder());
}

TEST_F(StoreTest, FullDiskDoesNotEndTheRun) {
  const pid_t child = fork();  // a limit on file size stands for the full disk
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{200, 200};
    setrlimit(RLIMIT_FSIZE, &limit);
    const std::string fault = store.save(marrow::hash_of(1), {many(100000)}, {});
    const bool told =
        fault.find("cannot write") != std::string::npos && fault.find("File too large") != std::string::npos;
    _exit(told && only_file(store.folder()).empty() ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0) << "it says why, and leaves no file";
}

TEST_F(StoreTest, AFolderThatCannotBeWrittenIsAWarning) {
  scratch.write("file", "");
  const Store nowhere(scratch.path / "file" / "store");
  read("  c: {uses: test.constant}\n", "c: c");
  settings.store = &nowhere;
  settings.observer = [this](const marrow::RunEvent& event) {
    if (event.kind == marrow::RunEvent::Kind::warning) messages += event.text;
  };
  EXPECT_FALSE(marrow::run_pipeline(pipeline, test_catalogue(), settings).failed());
  EXPECT_HAS(messages, "results are not kept: cannot use the folder");
}

// What is removed when the store must become smaller.

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

}  // namespace store_damage_test
