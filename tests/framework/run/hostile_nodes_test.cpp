// SPDX-License-Identifier: Apache-2.0
// Nodes that throw anything, or change what all nodes of the process share: they fail, and others beside them give what
// they give without them. What is right is known from the run without the hostile node, and from IEEE 754 and the C
// library for the state itself.
#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <limits>
#include <opencv2/core.hpp>
#include <optional>

#include "marrow/base/process_state.hpp"
#include "marrow/base/thread_state.hpp"
#include "marrow/runtime/store/store.hpp"
#include "tests/framework/fixture.hpp"

namespace hostile_nodes_test {

namespace fs = std::filesystem;
using Status = marrow::NodeRecord::Status;

class HostileNodes : public testing::Test {
 protected:
  marrow::RunResult run(const std::string& how) {
    std::string nodes = "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 5}}\n", outputs;
    for (const char* number : {"1", "2", "3", "4", "5", "6"}) {
      nodes += std::string("  s") + number + ": {uses: test.sensitive, in: {a: c}, with: {number: " + number + "}}\n";
      outputs += std::string(outputs.empty() ? "" : ", ") + "s" + number + ": s" + number;
      if (std::string(number) == "3" && !how.empty())
        nodes += "  bad: {uses: test.hostile, in: {a: c}, with: {how: " + how + "}, may_fail: true}\n";
    }
    if (!how.empty()) outputs += ", bad: bad";
    marrow::Diagnostics diagnostics;
    pipeline = marrow::read_pipeline(scratch.write("p.yaml", nodes + "outputs: {" + outputs + "}\n"), {}, catalogue,
                                     diagnostics);
    EXPECT_TRUE(diagnostics.empty()) << diagnostics.text();
    marrow::RunSettings settings;
    settings.threads = 4;
    settings.store = store ? &*store : nullptr;
    return marrow::run_pipeline(pipeline, catalogue, settings);
  }
  const marrow::NodeRecord& node(const marrow::RunResult& result, const std::string& id) const {
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
      if (pipeline.nodes[i].id == id) return result.nodes[i];
    throw marrow::Error("there is no node " + id);
  }
  /// The content hashes of what the healthy nodes give.
  std::vector<marrow::Digest> healthy(const marrow::RunResult& result) const {
    std::vector<marrow::Digest> digests;
    for (const char* id : {"s1", "s2", "s3", "s4", "s5", "s6"}) {
      EXPECT_EQ(node(result, id).status, Status::done) << node(result, id).reason;
      digests.push_back(node(result, id).outputs.at(0).key);
    }
    return digests;
  }
  void expect_failure(const std::string& how, const std::string& reason) {
    const marrow::RunResult result = run(how);
    EXPECT_EQ(node(result, "bad").status, Status::failed_alone) << how;
    EXPECT_EQ(node(result, "bad").reason, reason) << how;
    EXPECT_EQ(healthy(result), right) << how;
  }
  void expect_changed(const std::string& how, const std::string& what) {
    expect_failure(how, what + " while it ran; a plugin must leave it as it is");
  }

  runtime_fixture::Scratch scratch;
  const marrow::Catalogue catalogue{
      {fs::path(MARROW_BINARY_DIR) / "tests" / "plugins", fs::path(MARROW_BINARY_DIR) / "tests" / "hostile_plugins"}};
  std::optional<marrow::Store> store;
  marrow::Pipeline pipeline;
  std::vector<marrow::Digest> right = healthy(run(""));
};

TEST_F(HostileNodes, TheyMayThrowAnything) {
  expect_failure("throw number", "threw something that is not a std::exception (int); throw marrow::Error");
  expect_failure("throw text", "threw something that is not a std::exception (char const*); throw marrow::Error");
}

TEST_F(HostileNodes, ArithmeticIsPutBack) {
  expect_changed("rounding", "the rounding of numbers was changed");
  expect_changed("traps", "the trapping of faults in calculations was changed");
#ifdef __x86_64__
  expect_changed("tiny", "the treatment of tiny numbers (-ffast-math makes them 0) was changed");
#endif
}

TEST_F(HostileNodes, LocalesArePutBack) {
  expect_changed("locale", "the locale was changed");
  expect_changed("locale of streams", "the locale was changed");
  expect_changed("locale of thread", "the locale of its thread was changed");
  EXPECT_STREQ(setlocale(LC_ALL, nullptr), "C");
  EXPECT_EQ(std::locale(), std::locale::classic());
}

TEST_F(HostileNodes, SignalsArePutBack) {
  expect_changed("handler", "the handling of a signal was changed");
  expect_changed("blocked signals", "the set of signals that its thread blocks was changed");
  struct sigaction now {};
  sigaction(SIGUSR1, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
}

TEST_F(HostileNodes, WhatTheSystemKeepsIsPutBack) {
  rlimit before{}, after{};
  getrlimit(RLIMIT_NOFILE, &before);
  struct stat input {
  }, input_after{};
  fstat(STDIN_FILENO, &input);
  const mode_t mask = umask(027);
  const fs::path folder = fs::current_path();
  right = healthy(run(""));
  expect_changed("umask", "the mask of new files' permissions (umask) was changed");
  expect_changed("environment", "the environment was changed");
  expect_changed("limit", "a limit of the process was changed");
  expect_changed("standard input", "a standard stream was changed");
  expect_changed("working folder", "the working folder was changed to /");
  EXPECT_EQ(umask(mask), 027u);
  EXPECT_EQ(std::getenv("MARROW_HOSTILE"), nullptr);
  getrlimit(RLIMIT_NOFILE, &after);
  EXPECT_EQ(after.rlim_cur, before.rlim_cur);
  fstat(STDIN_FILENO, &input_after);
  EXPECT_EQ(input_after.st_ino, input.st_ino);
  EXPECT_EQ(fs::current_path(), folder);
}

TEST_F(HostileNodes, SettingsOfOpenCvArePutBack) {
  expect_changed("instructions of OpenCV", "a setting of OpenCV was changed");
  expect_changed("threads of OpenCV", "a setting of OpenCV was changed");
}

TEST_F(HostileNodes, TheyMayLieAboutSizes) {
  for (
      const auto& [about, reason] :
      {std::pair<std::string, std::string>(
           "volume",
           "it gave an output 'volume' that cannot be: its grid has 1000 x 1000 x 1000 voxels, but there are 8 values"),
       {"mesh",
        "it gave an output 'mesh' that cannot be: a triangle has the vertex 1000000, but there are 3 vertices, counted "
        "from 0"},
       {"pose",
        "it gave an output 'pose' that cannot be: the pose: the covariance has the negative variance -1 in row 1, "
        "column "
        "1; a covariance is symmetric and has no negative eigenvalue"}}) {
    marrow::Diagnostics diagnostics;
    pipeline = marrow::read_pipeline(scratch.write("lies.yaml",
                                                   "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 5}}\n"
                                                   "  bad: {uses: test.liar, in: {a: c}, with: {about: " +
                                                       about +
                                                       "}, may_fail: true}\n"
                                                       "outputs: {bad: bad." +
                                                       about + "}\n"),
                                     {}, catalogue, diagnostics);
    ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
    const marrow::RunResult result = marrow::run_pipeline(pipeline, catalogue, {});
    EXPECT_EQ(node(result, "bad").status, Status::failed_alone);
    EXPECT_EQ(node(result, "bad").reason, reason);
  }
}

TEST_F(HostileNodes, NothingWrongIsKept) {
  store.emplace(scratch.path / "store");
  for (const char* how : {"rounding", "locale", "environment", "instructions of OpenCV"}) {
    store->collect(0);
    run(how);
    const marrow::RunResult again = run("");
    EXPECT_EQ(healthy(again), right) << how;
    for (const char* id : {"s1", "s6"}) EXPECT_EQ(node(again, id).cached, 1) << "read back, not made anew";
  }
}

TEST_F(HostileNodes, TheCallersArithmeticIsNotThatOfNodes) {
  fesetround(FE_UPWARD);
  const std::vector<marrow::Digest> made = healthy(run(""));
  EXPECT_EQ(fegetround(), FE_UPWARD) << "it is the caller's";
  fesetround(FE_TONEAREST);
  EXPECT_EQ(made, right);
}

TEST(ThreadState, KnowsWhatIsUsual) {
  const volatile double one = 1, three = 3, smallest = std::numeric_limits<double>::min();
  fesetround(FE_UPWARD);
  {
    const marrow::UsualArithmetic usual;
    // The nearest of the numbers of 53 bits to a third is 0x1.5555555555555p-2; the next above it ends in 6.
    EXPECT_EQ(one / three, 0x1.5555555555555p-2);
    EXPECT_GT(smallest / 2, 0);
  }
  EXPECT_EQ(one / three, 0x1.5555555555556p-2);
  fesetround(FE_TONEAREST);
}

TEST(ProcessState, WhatInitialisersOfALibraryChangeIsPutBack) {
  const marrow::Catalogue catalogue({fs::path(MARROW_BINARY_DIR) / "tests" / "unusual_plugins"});
  ASSERT_EQ(catalogue.libraries().size(), 1u);
  ASSERT_EQ(catalogue.libraries()[0].refused, "");
  catalogue.load("test.unusual");
  const volatile double smallest = std::numeric_limits<double>::min();
  EXPECT_GT(smallest / 2, 0);
  EXPECT_EQ(fegetround(), FE_TONEAREST);
  EXPECT_STREQ(setlocale(LC_ALL, nullptr), "C");
}

TEST(ProcessState, OfCallsSideBySideNoneIsBlamedForAnother) {
  marrow::ProcessState state;
  int calls = 0;
  std::atomic<bool> is_changed{false}, may_end{false};
  std::thread hostile([&] {
    EXPECT_THROW(state.keep_during([&] {
      setenv("MARROW_HOSTILE", "1", 1);
      is_changed = true;
      while (!may_end) std::this_thread::yield();
    }),
                 marrow::Error);
  });
  while (!is_changed) std::this_thread::yield();
  state.keep_during([&] {
    ++calls;
    EXPECT_EQ(std::getenv("MARROW_HOSTILE") == nullptr, calls == 2);
    may_end = true;
  });
  hostile.join();
  EXPECT_EQ(calls, 2) << "it ran beside the other one, and then alone";
}

}  // namespace hostile_nodes_test
