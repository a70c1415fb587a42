// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/worker.hpp"

#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "tests/harness/message_of.hpp"

namespace worker_test {

using marrow::Worker;
using marrow::WorkerEnd;
using marrow::test::message_of;
using nlohmann::json;

WorkerEnd ask(Worker& worker, json request, double seconds = 120, double memory_mb = 1000) {
  worker.ask(std::move(request));
  return worker.wait({seconds, memory_mb}, nullptr, nullptr);
}

WorkerEnd ask(const json& request, double seconds = 120, double memory_mb = 1000) {
  Worker worker({{MARROW_TEST_WORKER}, {}, true});
  return ask(worker, request, seconds, memory_mb);
}

/// Returns when the worker has started, which may take a busy machine longer than a test's limit.
void wait_for_start(Worker& worker) { ASSERT_EQ(ask(worker, {{"do", "echo"}, {"text", 0}}).answer, 0); }

/// The one child of this thread.
pid_t only_child() {
  std::string text;
  std::getline(std::ifstream("/proc/self/task/" + std::to_string(gettid()) + "/children"), text);
  return pid_t(std::atol(text.c_str()));
}

/// As /proc says it: 'T' for suspended, 'Z' for ended; 0 where there is no such process.
char state_of(pid_t process) {
  std::string text;
  std::getline(std::ifstream("/proc/" + std::to_string(process) + "/stat"), text);
  const std::size_t name_end = text.rfind(") ");
  return name_end != std::string::npos && name_end + 2 < text.size() ? text[name_end + 2] : '\0';
}

/// Whether the process comes to one of these states within half a minute.
bool comes_to(pid_t process, const std::string& states) {
  for (int i = 0; i < 3000; ++i) {
    if (states.find(state_of(process)) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
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
  for (const char* line :
       {"end {}\n", "{\"job\": 2, \"end\": 1}\n", "{\"end\": 1}\n", "[1]\n", "{\"job\": \"1\", \"end\": 1}\n", "\n"}) {
    const WorkerEnd end = ask({{"do", "forge"}, {"line", line}});
    EXPECT_TRUE(end.died) << line;
    EXPECT_EQ(end.failed, "its process sent something that is not part of its job") << line;
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
  EXPECT_EQ(ask({{"do", "memory"}}, 120, 300).failed, "its process used more than 300 MB of memory");
}

TEST(Worker, WaitingForAnotherIsNotItsTime) {
  Worker worker({{MARROW_TEST_WORKER}, {}, true});
  wait_for_start(worker);
  // The limit leaves room for a pause before it says that it waits.
  EXPECT_EQ(ask(worker, {{"do", "wait"}, {"seconds", 6.0}}, 4).answer, "waited");
}

TEST(Worker, TimeWhileItIsSuspendedIsNotItsTime) {
  Worker worker({{MARROW_TEST_WORKER}});
  wait_for_start(worker);
  const pid_t process = only_child();
  ASSERT_GT(process, 0);
  kill(process, SIGSTOP);
  ASSERT_TRUE(comes_to(process, "T"));
  worker.ask({{"do", "echo"}, {"text", 1}});
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::seconds(6));
    kill(process, SIGCONT);
  });
  // The limit leaves room for a pause after it goes on.
  EXPECT_EQ(worker.wait({4, 1000}, nullptr, nullptr).answer, 1);
  later.join();
}

TEST(Worker, WhatStaysSuspendedIsEnded) {
  Worker worker({{MARROW_TEST_WORKER}});
  wait_for_start(worker);
  kill(only_child(), SIGSTOP);
  worker.ask({{"do", "echo"}, {"text", 1}});
  const WorkerEnd end = worker.wait({120, 1000, 1.5}, nullptr, nullptr);
  EXPECT_TRUE(end.is_late);
  EXPECT_EQ(end.failed, "its process was suspended for more than 1.5 s");
  EXPECT_TRUE(worker.is_dead());
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
    const pid_t process = only_child();
    worker.ask({{"do", "sleep"}});
    if (write(ends[1], &process, sizeof process) > 0) raise(SIGKILL);
    _exit(1);
  }
  pid_t worker = 0;
  ASSERT_EQ(read(ends[0], &worker, sizeof worker), ssize_t(sizeof worker));
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(comes_to(worker, std::string("ZX\0", 3))) << "it would sleep for a minute";
}

TEST(Worker, WhatItHasStartedEndsWithIt) {
  for (const char* then : {"answer", "crash", "sleep"}) {
    pid_t child = 0;
    {
      Worker worker({{MARROW_TEST_WORKER}, {}, true});
      wait_for_start(worker);
      ask(worker, {{"do", "fork"}, {"then", then}}, 2);
      child = pid_t(std::stol(worker.at()));
    }
    ASSERT_GT(child, 0);
    EXPECT_TRUE(comes_to(child, std::string("ZX\0", 3))) << then;
  }
}

TEST(Worker, SignalsOfTheProgramLoseNoEnd) {
  struct sigaction handled = {}, before = {};
  handled.sa_handler = [](int) {};
  sigaction(SIGUSR1, &handled, &before);  // without SA_RESTART, as Python has it
  const pthread_t here = pthread_self();
  std::atomic<bool> is_over{false};
  std::thread signals([&] {
    while (!is_over) {
      pthread_kill(here, SIGUSR1);
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
  });
  for (int i = 0; i < 50; ++i) {
    pid_t process = 0;
    {
      Worker worker({{MARROW_TEST_WORKER}, {}, true});
      process = only_child();
      worker.ask({{"do", "sleep"}});
    }
    EXPECT_EQ(state_of(process), '\0') << "a process that has ended stays where nobody waited for it";
    EXPECT_EQ(ask({{"do", "crash"}}).signal, SIGSEGV);
  }
  is_over = true;
  signals.join();
  sigaction(SIGUSR1, &before, nullptr);
}

TEST(Worker, ProgramThatIsNotThereIsSaid) {
  EXPECT_EQ(message_of([] { Worker worker({{"/nowhere/marrow-worker"}}); }),
            "cannot start /nowhere/marrow-worker: No such file or directory; install marrow again");
}

TEST(Worker, ALowLimitOfFilesIsSaid) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit low{50, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &low);
  std::string said;
  try {
    const Worker worker({{MARROW_TEST_WORKER}});
  } catch (const std::exception& error) {
    said = error.what();
  }
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(said,
            "cannot start a process: no more than 50 files may be open at once; raise the limit (ulimit -n 1024)");
}

TEST(Worker, BytesThatAreNoTextTravelToo) {
  for (const std::string& text :
       {std::string("plain"), std::string("M\xfcller"), std::string("a\0b", 3), std::string("\xff\xfe")})
    EXPECT_EQ(marrow::bytes_of_json(json::parse(marrow::json_of_bytes(text).dump())), text);
}

}  // namespace worker_test
