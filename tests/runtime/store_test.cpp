// SPDX-License-Identifier: Apache-2.0
// What earlier runs left is read back, what is damaged is made again, and nothing is ever half there.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "marrow/runtime/store.hpp"
#include "runtime/fixture.hpp"

namespace {

namespace fs = std::filesystem;
using marrow::Digest;
using marrow::Metrics;
using marrow::PlannedNode;
using marrow::RunResult;
using marrow::Store;
using marrow::Value;
using What = PlannedNode::What;

Value number(double value) {
  Value result = Value::of<Metrics>(std::make_shared<const Metrics>(Metrics{{{"value", value, "mm"}}}));
  result.key = result.type.content->hash(result.data.get());
  return result;
}

Value many(std::size_t count) {
  marrow::Volume volume;
  volume.grid.size = {int(count), 1, 1};
  for (std::size_t i = 0; i < count; ++i) volume.values.push_back(float(i % 1000));
  Value result = Value::of<marrow::Volume>(std::make_shared<const marrow::Volume>(std::move(volume)));
  result.key = result.type.content->hash(result.data.get());
  return result;
}

fs::path only_file(const fs::path& folder) {
  fs::path found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().parent_path() != folder &&
        entry.path().parent_path().filename() != "last")
      found = entry.path();
  return found;
}

class StoreTest : public testing::Test {
 protected:
  RunResult run(const std::string& nodes, const std::string& outputs, std::uint64_t seed = 1) {
    read(nodes, outputs);
    settings.seed = seed;
    settings.threads = 2;
    settings.store = &store;
    settings.observer = [this](const marrow::RunEvent& event) {
      if (event.kind == marrow::RunEvent::Kind::warning || event.kind == marrow::RunEvent::Kind::failed)
        messages += event.text + "\n";
    };
    return marrow::run_pipeline(pipeline, test_catalogue(), settings);
  }
  std::vector<PlannedNode> plan(const std::string& nodes, const std::string& outputs, std::uint64_t seed = 1) {
    read(nodes, outputs);
    marrow::RunSettings planning;
    planning.seed = seed;
    planning.store = &store;
    return marrow::plan_pipeline(pipeline, test_catalogue(), planning);
  }
  void read(const std::string& nodes, const std::string& outputs) {
    marrow::Diagnostics diagnostics;
    pipeline =
        marrow::read_pipeline(scratch.write("p.yaml", "marrow: 1\nnodes:\n" + nodes + "outputs: {" + outputs + "}\n"),
                              {}, test_catalogue(), diagnostics);
    ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  }
  double result_of(const RunResult& result, std::size_t index = 0) {
    return marrow::value_of(result, pipeline.outputs[index].source).as<Metrics>().items[0].value;
  }
  static int calls(const RunResult& result) {
    int sum = 0;
    for (const auto& node : result.nodes) sum += node.calls;
    return sum;
  }
  Scratch scratch;
  Store store{scratch.path / "store"};
  marrow::Pipeline pipeline;
  marrow::RunSettings settings;
  std::string messages;
};

constexpr const char* kChain =
    "  c: {uses: test.constant, with: {value: 5}}\n  s: {uses: test.sides}\n  f: {uses: test.adder, in: {amount: c}}\n"
    "  a: {uses: test.apply, in: {adder: f, to: s.both}}\n  n: {uses: test.sum, in: {items: a}}\n";

TEST_F(StoreTest, ValuesComeBackAsTheyWere) {
  Value list;
  list.type = number(1).type;
  list.axis = "side";
  list.names = {"a", "b"};
  list.items = {number(1), number(2)};
  Value absent;
  absent.type = number(1).type;
  const Digest key = marrow::hash_of(std::string("key"));
  marrow::Provenance from;
  from.node = "test.x";
  from.options["low"] = "50";
  from.warnings = {"careful"};
  EXPECT_FALSE(store.find(key));
  EXPECT_EQ(store.save(key, {list, absent, many(100000)}, from), "");
  const auto found = store.find(key);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->provenance.options.at("low"), "50");
  EXPECT_EQ(found->provenance.warnings, from.warnings);
  ASSERT_EQ(found->outputs.size(), 3u);
  EXPECT_EQ(found->outputs[0].names, list.names);
  EXPECT_EQ(found->outputs[0].items[1].as<Metrics>().items[0].value, 2);
  EXPECT_EQ(found->outputs[0].items[1].as<Metrics>().items[0].unit, "mm");
  EXPECT_TRUE(found->outputs[1].is_absent());
  EXPECT_EQ(marrow::hash_of(found->outputs[2].as<marrow::Volume>()), many(100000).key);
}

TEST_F(StoreTest, SecondRunCallsNothing) {
  const RunResult first = run(kChain, "n: n, a: a");
  EXPECT_EQ(calls(first), 6);
  const RunResult second = run(kChain, "n: n, a: a");
  EXPECT_EQ(calls(second), 0);
  EXPECT_EQ(second.nodes[2].status, marrow::NodeRecord::Status::not_needed) << "nothing that runs needs the function";
  EXPECT_EQ(result_of(second), result_of(first));
  EXPECT_EQ(result_of(second), 10 + 5 + 20 + 5);
}

TEST_F(StoreTest, OnlyWhatChangedRunsAndFunctionsAreMadeForIt) {
  run(kChain, "n: n");
  std::string changed = kChain;
  changed.replace(changed.find("value: 5"), 8, "value: 6");
  const RunResult second = run(changed, "n: n");
  EXPECT_EQ(result_of(second), 10 + 6 + 20 + 6);
  EXPECT_EQ(second.nodes[1].calls, 0) << "the sides do not depend on it";
  EXPECT_EQ(second.nodes[2].calls, 1) << "one function for both items";
  EXPECT_EQ(second.nodes[3].calls, 2);
}

TEST_F(StoreTest, UnchangedContentStopsTheWave) {
  run("  c: {uses: test.constant, with: {value: 5, word: one}}\n  d: {uses: test.add, in: {a: c}}\n", "d: d");
  const RunResult second =
      run("  c: {uses: test.constant, with: {value: 5, word: two}}\n  d: {uses: test.add, in: {a: c}}\n", "d: d");
  EXPECT_EQ(second.nodes[0].calls, 1);
  EXPECT_EQ(second.nodes[1].calls, 0) << "the constant came out the same";
}

TEST_F(StoreTest, ASeedMattersToRandomNodesOnly) {
  const std::string nodes = "  c: {uses: test.constant}\n  d: {uses: test.draw}\n";
  run(nodes, "c: c, d: d", 1);
  const RunResult second = run(nodes, "c: c, d: d", 2);
  EXPECT_EQ(second.nodes[0].calls, 0);
  EXPECT_EQ(second.nodes[1].calls, 1);
}

TEST_F(StoreTest, FailuresAreNotKept) {
  const std::string nodes =
      "  c: {uses: test.constant, with: {value: 9}}\n  f: {uses: test.fail_above, in: {a: c}, with: {value: 1}}\n";
  EXPECT_TRUE(run(nodes, "f: f").failed());
  EXPECT_TRUE(run(nodes, "f: f").failed());
}

TEST_F(StoreTest, AFailedFunctionIsNamedByWhatNeedsIt) {
  const RunResult result =
      run("  c: {uses: test.constant, with: {value: 9}}\n  f: {uses: test.failing_adder, in: {amount: c}}\n"
          "  a: {uses: test.apply, in: {adder: f, to: c}}\n",
          "a: a");
  EXPECT_TRUE(result.failed());
  EXPECT_EQ(result.nodes[1].status, marrow::NodeRecord::Status::failed);
  EXPECT_EQ(result.nodes[2].status, marrow::NodeRecord::Status::not_run);
  EXPECT_EQ(result.nodes[2].reason, "node 'f' failed");
  EXPECT_EQ(messages, "node 'f' (test.failing_adder) failed: it cannot add (its inputs: amount = c)\n");
}

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
  // Where a machine is so slow that nothing is ever written in that time, they live longer.
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

/// Starts a process that claims a key, then does `work`; returns once the key is claimed.
template <class Work>
pid_t claimer(const Store& store, const Digest& key, const Work& work) {
  int pipe_ends[2];
  EXPECT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    const Store::Claim claim = store.claim(key, nullptr);
    if (write(pipe_ends[1], "c", 1) != 1) _exit(1);
    work();
    _exit(0);
  }
  char told = 0;
  EXPECT_EQ(read(pipe_ends[0], &told, 1), 1);
  close(pipe_ends[0]);
  close(pipe_ends[1]);
  return child;
}

TEST_F(StoreTest, AResultThatAnotherProcessMakesIsWaitedFor) {
  const Digest key = marrow::hash_of(1);
  int go_on[2];
  ASSERT_EQ(pipe(go_on), 0);
  const pid_t child = claimer(store, key, [&] {
    char told = 0;
    if (::read(go_on[0], &told, 1) != 1) _exit(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // so that it is waited for
    store.save(key, {number(7)}, {});
  });
  EXPECT_FALSE(store.find(key));
  { const Store::Claim other = store.claim(marrow::hash_of(2), nullptr); }  // another key is free
  ASSERT_EQ(write(go_on[1], "g", 1), 1);
  const Store::Claim claim = store.claim(key, nullptr);
  EXPECT_TRUE(store.find(key));
  waitpid(child, nullptr, 0);
}

TEST_F(StoreTest, AKilledProcessGivesItsClaimsBack) {
  const Digest key = marrow::hash_of(1);
  const pid_t child = claimer(store, key, [] { std::this_thread::sleep_for(std::chrono::hours(1)); });
  std::atomic<bool> cancelled{true};
  { const Store::Claim none = store.claim(key, &cancelled); }  // does not wait for the hour
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const Store::Claim claim = store.claim(key, nullptr);
}

TEST_F(StoreTest, AForkedChildDoesNotKeepAClaim) {
  const Digest key = marrow::hash_of(1);
  pid_t child = 0;
  {
    const Store::Claim claim = store.claim(key, nullptr);
    child = fork();
    if (child == 0) {
      std::this_thread::sleep_for(std::chrono::hours(1));
      _exit(0);
    }
  }
  std::atomic<bool> is_over{false};
  std::thread limit([&] {
    for (int i = 0; i < 6000 && !is_over; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (!is_over) kill(child, SIGKILL);
  });
  { const Store::Claim claim = store.claim(key, nullptr); }
  is_over = true;
  limit.join();
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, WNOHANG), 0) << "the claim came back only when the child was killed";
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
}

TEST_F(StoreTest, WaitingForAnotherIsSaidAndIsCancelled) {
  const Digest key = marrow::hash_of(1);
  const pid_t child = claimer(store, key, [] { std::this_thread::sleep_for(std::chrono::hours(1)); });
  std::atomic<bool> cancelled{false};
  std::string said;
  const auto start = std::chrono::steady_clock::now();
  {
    const Store::Claim none = store.claim(key, &cancelled, [&](bool waits) {
      said += waits ? "waits " : "goes on";
      cancelled = said == "waits waits ";
    });
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_EQ(said, "waits waits goes on");
  EXPECT_GE(seconds, 5);
  EXPECT_LT(seconds, 60) << "cancelled at once";
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
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
  EXPECT_NE(messages.find("results are not kept: cannot use the folder"), std::string::npos) << messages;
}

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

TEST_F(StoreTest, PlanSaysWhatRunsAndWhy) {
  std::vector<PlannedNode> planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].what, What::runs);
  EXPECT_EQ(planned[0].why, "it has not run before");
  run(kChain, "n: n");
  planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].what, What::cached);
  EXPECT_EQ(planned[2].what, What::function);
  EXPECT_EQ(planned[4].what, What::cached);

  std::string changed = kChain;
  changed.replace(changed.find("value: 5"), 8, "value: 6");
  planned = plan(changed, "n: n");
  EXPECT_EQ(planned[0].what, What::runs);
  EXPECT_EQ(planned[0].why, "option 'value' is 6, was 5");
  EXPECT_EQ(planned[1].what, What::cached);
  EXPECT_EQ(planned[3].what, What::depends);
  EXPECT_EQ(planned[3].waits_for, (std::set<std::string>{"c"})) << "through the function";
  EXPECT_EQ(planned[4].what, What::depends);

  store.collect(1);
  planned = plan(kChain, "n: n");
  EXPECT_EQ(planned[0].why,
            "the store has no result of it: it failed, was stopped or removed, or the processor is another");
}

TEST_F(StoreTest, WarningsAreRepeated) {
  const std::string nodes = "  w: {uses: test.warn}\n";
  run(nodes, "w: w");
  EXPECT_EQ(messages, "mind the gap\n");
  messages.clear();
  EXPECT_EQ(calls(run(nodes, "w: w")), 0);
  EXPECT_EQ(messages, "mind the gap\n");
}

}  // namespace
