// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/thread_supply.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <thread>
#include <vector>

namespace marrow {
namespace {

int threads_here() {
  std::error_code none;
  int count = 0;
  for (std::filesystem::directory_iterator task("/proc/self/task", none), end; !none && task != end;
       task.increment(none))
    ++count;
  return count;
}

/// Waits until the threads of this process are gone: a joined thread still counts until the system has removed it.
void wait_until_gone(int threads_before) {
  for (int tries = 0; tries < 500 && threads_here() > threads_before; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// How many of the `wanted` threads can be started besides this one.
int threads_at_once(int wanted) {
  const int before = threads_here();
  std::vector<std::thread> threads;
  std::atomic<bool> may_end{false};
  try {
    while (int(threads.size()) < wanted) threads.emplace_back([&] { may_end.wait(false); });
  } catch (const std::exception&) {  // a limit of threads, or of memory
  }
  may_end = true;
  may_end.notify_all();
  for (std::thread& thread : threads) thread.join();
  wait_until_gone(before);
  return int(threads.size());
}

}  // namespace

int threads_to_be_had(int wanted) {
  static std::atomic<int> kept{0};  // TBB keeps the threads that it has started
  if (wanted <= kept) return wanted;
  int had = 0;
  for (int tries = 0; had == 0 && tries < 10; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));  // a process may just be ending
    had = threads_at_once(wanted + 1);
  }
  had = std::max(int(kept), had > 1 ? had - 1 : had);
  kept = had;
  return had;
}

}  // namespace marrow
