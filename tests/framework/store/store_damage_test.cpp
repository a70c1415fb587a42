// SPDX-License-Identifier: Apache-2.0
// Damaged results are made again, and no result is ever half written.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
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

}  // namespace store_damage_test
