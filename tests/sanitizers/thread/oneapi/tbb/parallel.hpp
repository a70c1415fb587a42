// SPDX-License-Identifier: Apache-2.0
// In place of oneTBB under the thread sanitizer. The sanitizer does not see into libtbb.so, which is built without it,
// and takes each hand-over of a task there for a race. What marrow uses of it is here on plain threads, which the
// sanitizer understands. A task waits for no other one here either, so that what is free of races on these threads is
// so on oneTBB's.
#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace tbb {

class global_control {
 public:
  enum parameter { max_allowed_parallelism };
  global_control(parameter, std::size_t value) : before_(most().exchange(value)) {}
  ~global_control() { most() = before_; }
  global_control(const global_control&) = delete;
  global_control& operator=(const global_control&) = delete;
  static std::atomic<std::size_t>& most() {
    static std::atomic<std::size_t> value{4};
    return value;
  }

 private:
  std::size_t before_;
};

class task_arena {
 public:
  explicit task_arena(int threads, unsigned = 1) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~task_arena() { terminate(); }
  task_arena(const task_arena&) = delete;
  task_arena& operator=(const task_arena&) = delete;

  template <class Task>
  void enqueue(Task&& task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.emplace_back(std::forward<Task>(task));
    }
    changed_.notify_one();
  }
  template <class Task>
  auto execute(Task&& task) {
    return task();
  }
  void terminate() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  void work() {
    for (std::unique_lock lock(mutex_);;) {
      changed_.wait(lock, [this] { return is_over_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      task();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

namespace this_task_arena {
template <class Task>
auto isolate(Task&& task) {
  return task();
}
}  // namespace this_task_arena

/// The body for each of [first, last), each thread taking the next one that is left. Throws what one of them threw.
template <class Index, class Body>
void parallel_for(Index first, std::type_identity_t<Index> last, const Body& body) {
  std::atomic<Index> next{first};
  std::mutex mutex;
  std::exception_ptr fault;
  const auto work = [&] {
    try {
      for (Index i = next++; i < last; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      fault = std::current_exception();
      next = last;
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < global_control::most(); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (fault) std::rethrow_exception(fault);
}

}  // namespace tbb
