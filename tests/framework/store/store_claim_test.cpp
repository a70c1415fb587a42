// SPDX-License-Identifier: Apache-2.0
// While one process makes a result, others wait until it is kept or nobody makes it any more.
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include "tests/framework/store/store_fixture.hpp"

namespace store_claim_test {

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

}  // namespace store_claim_test
