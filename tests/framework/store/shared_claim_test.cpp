// SPDX-License-Identifier: Apache-2.0
// Claims between hosts: who gets them, and when they are taken over.
#include "marrow/runtime/store/shared_folder.hpp"

#include <sys/wait.h>

#include <csignal>
#include <latch>
#include <thread>

#include "tests/framework/identities.hpp"
#include "tests/framework/store/store_fixture.hpp"

namespace shared_claim_test {

namespace fs = std::filesystem;
using marrow::SharedClaim;

class SharedClaimTest : public testing::Test {
 protected:
  SharedClaim claim(const std::atomic<bool>* cancelled = nullptr, const std::function<void(bool)>& on_wait = {}) {
    return marrow::claim_file(file, of_group, cancelled, on_wait, fault);
  }
  SharedClaim claim_of_another() const {
    std::string ignored;
    return marrow::claim_file(file, of_group, nullptr, {}, ignored);
  }
  std::string text() const {
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    return line;
  }
  /// A claim of a process of another host, which promises a sign of life within some seconds.
  void claim_elsewhere(const std::string& seconds, int beats) const {
    scratch.write("claims/key", runtime_fixture::process_elsewhere() + " 1 " + seconds + " " + std::to_string(beats));
  }
  double seconds_to_claim(std::atomic<bool>* cancelled = nullptr) {
    const auto start = std::chrono::steady_clock::now();
    is_held = claim(cancelled).is_held();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  void SetUp() override { fs::create_directories(file.parent_path()); }
  runtime_fixture::Scratch scratch;
  runtime_fixture::Environment environment;
  const marrow::Permissions of_group{0600, 0700, getegid()};
  fs::path file = scratch.path / "claims" / "key";
  std::string fault;
  bool is_held = false;
};

TEST_F(SharedClaimTest, ManyClaimsAtOnceMakeTheirFolder) {
  constexpr int kRounds = 400, kClaims = 4;
  for (int round = 0; round < kRounds; ++round) {
    const fs::path folder = scratch.path / ("claims-" + std::to_string(round));
    std::vector<std::string> faults(kClaims);
    std::latch start(kClaims);
    std::vector<std::thread> threads;
    for (int i = 0; i < kClaims; ++i)
      threads.emplace_back([&, i] {
        start.arrive_and_wait();
        marrow::claim_file(folder / std::to_string(i), of_group, nullptr, {}, faults[i]);
      });
    for (std::thread& thread : threads) thread.join();
    for (const std::string& text : faults) EXPECT_EQ(text, "") << "round " << round;
  }
}

TEST_F(SharedClaimTest, ItNamesItsOwnerAndIsRemovedAtItsEnd) {
  fs::remove_all(file.parent_path());
  {
    const SharedClaim held = claim();
    EXPECT_TRUE(held.is_held());
    EXPECT_EQ(marrow::owner_of_claim(file), marrow::this_process());
  }
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(fault, "");
}

TEST_F(SharedClaimTest, OnlyOneHoldsIt) {
  std::atomic<int> holders{0}, most{0}, done{0};
  const auto work = [&] {
    for (int i = 0; i < 5; ++i) {
      const SharedClaim held = claim_of_another();
      const int now = ++holders;
      if (now > most) most = now;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      --holders;
      ++done;
    }
  };
  std::thread first(work), second(work), third(work);
  for (std::thread* one : {&first, &second, &third}) one->join();
  EXPECT_EQ(done, 15);
  EXPECT_EQ(most, 1);
}

TEST_F(SharedClaimTest, AKilledOwnerOfThisHostLosesItAtOnce) {
  const pid_t child = store_fixture::claimer([&] { return claim_of_another(); }, [] { pause(); });
  std::atomic<bool> cancelled{false};
  const auto give_up = [&](bool) { cancelled = true; };
  EXPECT_FALSE(claim(&cancelled, give_up).is_held()) << "its owner lives";
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_LT(seconds_to_claim(), 10) << "30 s are for owners of other hosts";
  EXPECT_TRUE(is_held);
}

TEST_F(SharedClaimTest, AnOwnerElsewhereThatGivesNoSignOfLifeLosesIt) {
  claim_elsewhere("0.5", 7);
  EXPECT_GE(seconds_to_claim(), 0.5) << "this process watches it first";
  EXPECT_TRUE(is_held);
}

TEST_F(SharedClaimTest, AnOwnerElsewhereThatGivesSignsOfLifeKeepsIt) {
  std::atomic<bool> cancelled{false};
  claim_elsewhere("3", 0);
  std::thread owner([&] {
    for (int beat = 1; beat <= 40; ++beat) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      claim_elsewhere("3", beat);
    }
    cancelled = true;
  });
  EXPECT_GE(seconds_to_claim(&cancelled), 3.5);
  owner.join();
  EXPECT_FALSE(is_held);
}

TEST_F(SharedClaimTest, AClaimWhoseOwnerWasKilledBeforeItWroteIsTakenOver) {
  environment.set("MARROW_CLAIM_SECONDS", "0.4");
  for (const char* started : {"", "hos"}) {
    scratch.write("claims/key", started);
    EXPECT_GE(seconds_to_claim(), 0.4);
    EXPECT_TRUE(is_held);
  }
}

TEST_F(SharedClaimTest, AHolderGivesSignsOfLife) {
  environment.set("MARROW_CLAIM_SECONDS", "0.3");
  const SharedClaim held = claim();
  const std::string first = text();
  for (int i = 0; i < 600 && text() == first; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_NE(text(), first);
  EXPECT_HAS(text(), " 0.300 ");
}

TEST_F(SharedClaimTest, AClaimThatAnotherTookOverIsLeftToIt) {
  {
    const SharedClaim held = claim();
    fs::remove(file);
    claim_elsewhere("30", 1);
  }
  EXPECT_EQ(marrow::owner_of_claim(file), runtime_fixture::process_elsewhere());
}

TEST_F(SharedClaimTest, AFolderInWhichNoneCanBeMadeIsAFault) {
  fs::remove_all(file.parent_path());
  scratch.write("claims", "a file");
  EXPECT_FALSE(claim().is_held());
  EXPECT_EQ(fault, "cannot make the claim " + file.string() + ": Not a directory");
}

TEST(ClaimSecondsTest, AreThoseOfTheEnvironment) {
  runtime_fixture::Environment environment;
  for (const auto& [text, expected] : std::map<std::string, double>{
           {"", 30}, {"5", 5}, {"0.5", 0.5}, {"0", 30}, {"-1", 30}, {"nan", 30}, {"soon", 30}, {"1e9", 86400}}) {
    environment.set("MARROW_CLAIM_SECONDS", text);
    EXPECT_EQ(marrow::claim_seconds(), expected) << text;
  }
}

// While one process makes a result, others wait until it is kept or nobody makes it any more.

using marrow::Digest;
using marrow::Store;
using store_fixture::number;
using store_fixture::StoreTest;

/// A process that claims a key, then does `work`.
template <class Work>
pid_t claimer_of(const Store& store, const Digest& key, const Work& work) {
  return store_fixture::claimer([&] { return store.claim(key, nullptr); }, work);
}

TEST_F(StoreTest, AResultThatAnotherProcessMakesIsWaitedFor) {
  const Digest key = marrow::hash_of(1);
  int go_on[2];
  ASSERT_EQ(pipe(go_on), 0);
  const pid_t child = claimer_of(store, key, [&] {
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

TEST_F(StoreTest, NoFileStaysOpen) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const Digest key = marrow::hash_of(1);
  ASSERT_EQ(store.prepare(), "");
  std::filesystem::create_directories(marrow::entry_file(store.folder(), key));  // a folder is no entry
  const auto before = open_files();
  {
    const Store::Claim claim = store.claim(marrow::hash_of(2), nullptr);
    EXPECT_EQ(open_files(), before + 1) << "the claim is held";
  }
  EXPECT_EQ(open_files(), before) << "claim";
  EXPECT_FALSE(store.find(key));
  EXPECT_EQ(open_files(), before) << "entry";
  plan("  c: {uses: test.constant}\n", "c: c");
  EXPECT_EQ(open_files(), before) << "plan";
}

TEST_F(StoreTest, AKilledProcessGivesItsClaimsBack) {
  const Digest key = marrow::hash_of(1);
  const pid_t child = claimer_of(store, key, [] { std::this_thread::sleep_for(std::chrono::hours(1)); });
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
  const pid_t child = claimer_of(store, key, [] { std::this_thread::sleep_for(std::chrono::hours(1)); });
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

}  // namespace shared_claim_test
