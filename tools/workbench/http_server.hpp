// SPDX-License-Identifier: Apache-2.0
#pragma once
// cpp-httplib's server, for a page that must answer while other connections are slow. The library gives each byte of a
// header ten seconds, and a connection a thread of a fixed number: some connections that send a byte now and then would
// hold up everybody.
#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace marrow::workbench {

inline constexpr std::chrono::milliseconds kHeaderDeadline{5000};  ///< for the whole header of a request

/// As many threads as there are connections, up to a limit. A thread is started when no other one is free, and stays.
class GrowingThreads : public httplib::TaskQueue {
 public:
  void enqueue(std::function<void()> task) override;
  void shutdown() override;

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  std::vector<std::thread> threads_;
  std::size_t free_ = 0;  ///< threads that wait for a task
  bool is_over_ = false;
};

/// The whole header of a request must come within kHeaderDeadline; otherwise the connection is closed. The body may
/// take longer: Access has seen the header by then.
class HttpServer : public httplib::Server {
 public:
  /// Lets many connections wait to be accepted. The library lets five wait; a browser tries again only after a second.
  /// Call this after the port is taken.
  void let_many_wait();

 private:
  bool process_and_close_socket(socket_t socket) override;
};

}  // namespace marrow::workbench
