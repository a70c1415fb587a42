// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/worker.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "marrow/domain/error.hpp"

namespace {

using marrow::Worker;
using marrow::WorkerEnd;
using nlohmann::json;

WorkerEnd ask(Worker& worker, json request, double seconds = 20, double memory_mb = 1000) {
  worker.ask(std::move(request));
  return worker.wait({seconds, memory_mb}, nullptr, nullptr);
}

WorkerEnd ask(const json& request, double seconds = 20, double memory_mb = 1000) {
  Worker worker({{MARROW_TEST_WORKER}, {}, true});
  return ask(worker, request, seconds, memory_mb);
}

TEST(Worker, AnswersOneJobAfterTheOther) {
  Worker worker({{MARROW_TEST_WORKER}});
  EXPECT_EQ(ask(worker, {{"do", "echo"}, {"text", "a\nend {}\nb"}}).answer, "a\nend {}\nb");
  EXPECT_EQ(ask(worker, {{"do", "refuse"}}).failed, "it does not want to");
  EXPECT_EQ(ask(worker, {{"do", "nothing"}}).failed, "there is no task 'nothing'");
  EXPECT_EQ(ask(worker, {{"do", "echo"}, {"text", 3}}).answer, 3);
}

TEST(Worker, WhatALibraryPrintsIsNoAnswer) { EXPECT_EQ(ask({{"do", "print"}}).answer, "done"); }

TEST(Worker, LinesThatAreNoPartOfTheJobEndIt) {
  for (const char* line : {"end {}\n", "{\"job\": 2, \"end\": 1}\n", "{\"end\": 1}\n", "[1]\n", "{\"job\": \"1\", \"end\": 1}\n", "\n"}) {
    const WorkerEnd end = ask({{"do", "forge"}, {"line", line}});
    EXPECT_TRUE(end.died) << line;
    EXPECT_EQ(end.failed, "its process sent something that is no part of its job") << line;
  }
}

TEST(Worker, DeathSaysWhereItWas) {
  const WorkerEnd crash = ask({{"do", "crash"}});
  EXPECT_TRUE(crash.died);
  EXPECT_EQ(crash.signal, SIGSEGV);
  EXPECT_EQ(crash.failed, "crashed in the middle: Segmentation fault");
  EXPECT_EQ(ask({{"do", "exit"}}).failed, "ended with exit code 7");
}

TEST(Worker, TimeAndMemoryAreLimited) {
  const WorkerEnd late = ask({{"do", "sleep"}}, 0.3);
  EXPECT_TRUE(late.is_late);
  EXPECT_EQ(late.failed, "its process took longer than 0.3 s");
  EXPECT_EQ(ask({{"do", "memory"}}, 20, 300).failed, "its process used more than 300 MB of memory");
}

TEST(Worker, WaitingForAnotherIsNotItsTime) { EXPECT_EQ(ask({{"do", "wait"}, {"seconds", 1.0}}, 0.5).answer, "waited"); }

TEST(Worker, TimeWhileItIsSuspendedIsNotItsTime) {
  Worker worker({{MARROW_TEST_WORKER}});
  const pid_t process = [&] {
    // The worker's number: the one child that we have.
    std::string text;
    std::getline(std::ifstream("/proc/self/task/" + std::to_string(gettid()) + "/children"), text);
    return pid_t(std::atol(text.c_str()));
  }();
  ASSERT_GT(process, 0);
  worker.ask({{"do", "echo"}, {"text", 1}});
  kill(process, SIGSTOP);
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(900));
    kill(process, SIGCONT);
  });
  EXPECT_EQ(worker.wait({0.5, 1000}, nullptr, nullptr).answer, 1);
  later.join();
}

TEST(Worker, CancelEndsIt) {
  const std::atomic<bool> cancelled{true};
  Worker worker({{MARROW_TEST_WORKER}});
  worker.ask({{"do", "sleep"}});
  EXPECT_THROW(worker.wait({20, 1000}, &cancelled, nullptr), marrow::Cancelled);
  EXPECT_TRUE(worker.is_dead());
}

TEST(Worker, DoesNotOutliveWhoMadeIt) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    Worker worker({{MARROW_TEST_WORKER}});
    std::string text;
    std::getline(std::ifstream("/proc/self/task/" + std::to_string(gettid()) + "/children"), text);
    worker.ask({{"do", "sleep"}});
    const pid_t process = pid_t(std::atol(text.c_str()));
    if (write(ends[1], &process, sizeof process) > 0) raise(SIGKILL);
    _exit(1);
  }
  pid_t worker = 0;
  ASSERT_EQ(read(ends[0], &worker, sizeof worker), ssize_t(sizeof worker));
  waitpid(child, nullptr, 0);
  bool is_gone = false;
  for (int i = 0; i < 200 && !is_gone; ++i) {
    std::string state;
    std::getline(std::ifstream("/proc/" + std::to_string(worker) + "/stat"), state);
    is_gone = state.empty() || state.find(") Z") != std::string::npos;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(is_gone);
}

TEST(Worker, ProgramThatIsNotThereIsSaid) {
  try {
    Worker worker({{"/nowhere/marrow-worker"}});
    FAIL();
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "cannot start /nowhere/marrow-worker: No such file or directory; install marrow again");
  }
}

TEST(Worker, BytesThatAreNoTextTravelToo) {
  for (const std::string& text : {std::string("plain"), std::string("M\xfcller"), std::string("a\0b", 3), std::string("\xff\xfe")})
    EXPECT_EQ(marrow::bytes_of_json(json::parse(marrow::json_of_bytes(text).dump())), text);
}

}  // namespace
