// SPDX-License-Identifier: Apache-2.0
// Nodes that throw anything, lie about sizes, or change what all nodes of the process share: they fail, and the others
// give what they give without them. What is right is known from a run without the hostile node, and from IEEE 754 and
// the C library for the state itself.

#include <thread>

#include "marrow/base/process_state.hpp"
#include "tests/framework/run_fixture.hpp"

namespace hostile_nodes_test {

namespace fs = std::filesystem;
using marrow::test::message_of;
using Status = marrow::NodeRecord::Status;

std::string hostile(const std::string& how) { return "uses: test.hostile, with: {how: " + how + "}"; }
const std::string kChanged = " was changed while it ran; a plugin must leave it as it is";

class HostileNodes : public run_fixture::RunTest {
 protected:
  const marrow::Catalogue& catalogue() const override {
    static const marrow::Catalogue catalogue(
        {fs::path(MARROW_BINARY_DIR) / "tests" / "plugins", fs::path(MARROW_BINARY_DIR) / "tests" / "hostile_plugins"});
    return catalogue;
  }
  /// Six healthy nodes, with one of this declaration among them unless it is empty. With one thread they run in turn.
  marrow::RunResult run_beside(const std::string& bad, const std::string& output = "bad", int threads = 1) {
    std::string nodes = "  c: {uses: test.constant, with: {value: 5}}\n", outputs;
    for (const std::string number : {"1", "2", "3", "4", "5", "6"}) {
      nodes +=
          "  s" + number + ": {uses: test.sensitive, in: {a: c}, with: {number: " + number + "}, may_fail: true}\n";
      outputs += "s" + number + ": s" + number + ", ";
      if (number == "3" && !bad.empty()) nodes += "  bad: {" + bad + ", in: {a: c}, may_fail: true}\n";
    }
    if (!bad.empty()) outputs += "bad: " + output;
    settings.threads = threads;
    settings.store = store ? &*store : nullptr;
    return run(nodes, outputs);
  }
  /// The content hashes of what the healthy nodes give. They may fail for this reason only.
  std::vector<marrow::Digest> healthy(const marrow::RunResult& result, const std::string& may_be = "") const {
    std::vector<marrow::Digest> digests;
    for (const char* id : {"s1", "s2", "s3", "s4", "s5", "s6"}) {
      const marrow::NodeRecord& one = record(result, id);
      EXPECT_EQ(one.reason, one.status == Status::done ? "" : may_be) << id;
      digests.push_back(one.status == Status::done ? one.outputs.at(0).key : marrow::Digest{});
    }
    return digests;
  }

  std::optional<marrow::Store> store;
  const std::vector<marrow::Digest> right = healthy(run_beside(""));
};

TEST_F(HostileNodes, EachFailsAlone) {
  const std::string folder = fs::current_path(), not_standard = "threw something that is not a std::exception (";
  const std::vector<std::array<std::string, 3>> rows{
      {hostile("throw number"), "bad", not_standard + "int); throw marrow::Error"},
      {hostile("throw text"), "bad", not_standard + "char const*); throw marrow::Error"},
      {hostile("rounding"), "bad", "the rounding of numbers" + kChanged},
      {hostile("traps"), "bad", "the trapping of faults in calculations" + kChanged},
#ifdef __x86_64__
      {hostile("tiny"), "bad", "the treatment of tiny numbers (-ffast-math makes them 0)" + kChanged},
#endif
      {hostile("locale"), "bad", "the locale" + kChanged},
      {hostile("locale of streams"), "bad", "the locale" + kChanged},
      {hostile("locale of thread"), "bad", "the locale of its thread" + kChanged},
      {hostile("handler"), "bad", "the handling of a signal" + kChanged},
      {hostile("blocked signals"), "bad", "the set of signals that its thread blocks" + kChanged},
      {hostile("working folder"), "bad",
       "the working folder was changed to / while it ran; a plugin must leave it as it is"},
      {"uses: test.liar, with: {about: volume}", "bad.volume",
       "it gave an output 'volume' that cannot be: its grid has 1000 x 1000 x 1000 voxels, but there are 8 values"},
      {"uses: test.liar, with: {about: mesh}", "bad.mesh",
       "it gave an output 'mesh' that cannot be: a triangle has the vertex 1000000, but there are 3 vertices, counted "
       "from 0"},
      {"uses: test.liar, with: {about: pose}", "bad.pose",
       "it gave an output 'pose' that cannot be: the pose: the covariance has the negative variance -1 in row 1, "
       "column "
       "1; a covariance is symmetric and has no negative eigenvalue"}};
  for (const auto& [bad, output, reason] : rows) {
    const marrow::RunResult result = run_beside(bad, output);
    EXPECT_EQ(record(result, "bad").status, Status::failed_alone) << bad;
    EXPECT_EQ(record(result, "bad").reason, reason) << bad;
    EXPECT_EQ(healthy(result), right) << bad;
  }
  EXPECT_STREQ(setlocale(LC_ALL, nullptr), "C");
  EXPECT_EQ(std::locale(), std::locale::classic());
  struct sigaction now {};
  sigaction(SIGUSR1, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
  EXPECT_EQ(fs::current_path(), folder);
}

TEST_F(HostileNodes, WhatRanBesideThemIsRightOrFails) {
  store.emplace(scratch.path / "store");
  const std::vector<std::pair<std::string, std::string>> rows{
      {"rounding", ""},
      {"locale of streams", "the locale" + kChanged},
      {"working folder", "the working folder was changed to / while it ran; a plugin must leave it as it is"}};
  for (const auto& [how, reason] : rows) {
    store->collect(0);
    const std::vector<marrow::Digest> beside = healthy(run_beside(hostile(how), "bad", 4), reason);
    for (std::size_t i = 0; i < right.size(); ++i) EXPECT_TRUE(beside[i] == right[i] || beside[i] == marrow::Digest{});
    const marrow::RunResult again = run_beside("");
    EXPECT_EQ(healthy(again), right) << how << ": nothing wrong is kept";
    for (std::size_t i = 0; i < right.size(); ++i)
      EXPECT_EQ(record(again, "s" + std::to_string(i + 1)).cached, beside[i] == right[i]) << "else it is made anew";
  }
}

TEST_F(HostileNodes, TheCallersSettingsAreNotThoseOfNodes) {
  fesetround(FE_UPWARD);
  cv::setNumThreads(3);
  cv::setUseOptimized(false);
  const std::vector<marrow::Digest> made = healthy(run_beside(""));
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

TEST(ProcessState, NoResultOfAChangedProcessCounts) {
  marrow::ProcessState state;
  std::atomic<bool> is_changed{false}, is_put_back{false};
  std::string of_hostile;
  std::thread hostile([&] {
    of_hostile = message_of([&] {
      state.keep_during([&] {
        setlocale(LC_ALL, "C.UTF-8");
        is_changed = true;
        while (!is_put_back) std::this_thread::yield();
      });
    });
  });
  while (!is_changed) std::this_thread::yield();
  EXPECT_EQ(message_of([&] { state.keep_during([] {}); }), "the locale" + kChanged) << "who ends first notices it";
  EXPECT_STREQ(setlocale(LC_ALL, nullptr), "C");
  EXPECT_EQ(message_of([&] { state.keep_during([] {}); }), "");
  is_put_back = true;
  hostile.join();
  EXPECT_EQ(of_hostile, "the locale" + kChanged) << "also when another has put it back";
}

}  // namespace hostile_nodes_test
