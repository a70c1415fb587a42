// SPDX-License-Identifier: Apache-2.0
#include "workbench/http_server.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace marrow::workbench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::size_t kMostThreads = 512;
constexpr std::size_t kMostHeaderBytes = 256'000;
constexpr milliseconds kIdle{5000};     ///< how long a connection without a request is kept
constexpr milliseconds kQuiet{10'000};  ///< how long a body may pause, and a reader of an answer
constexpr milliseconds kLook{100};      ///< how often an idle connection looks whether the server ends

/// Whether the socket can be read or written (POLLIN, POLLOUT) before `deadline`.
bool is_ready(socket_t socket, short what, Clock::time_point deadline) {
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now()).count();
    pollfd one{socket, what, 0};
    const int found = poll(&one, 1, int(std::max<long long>(0, left)));
    if (found >= 0 || errno != EINTR) return found > 0;
  }
}

/// A connection as the library reads and writes it.
class Connection : public httplib::Stream {
 public:
  explicit Connection(socket_t socket) : socket_(socket) {}

  /// Whether a request begins within the time.
  bool has_request(milliseconds time) const { return begin_ < end_ || is_ready(socket_, POLLIN, Clock::now() + time); }
  void begin_header() {
    in_header_ = true;
    header_bytes_ = 0;
    header_ends_ = Clock::now() + kHeaderDeadline;
  }
  void end_header() { in_header_ = false; }

  bool is_readable() const override { return has_request(kQuiet); }
  bool is_writable() const override { return is_ready(socket_, POLLOUT, Clock::now() + kQuiet); }
  ssize_t read(char* bytes, std::size_t size) override {
    if (begin_ == end_ && !fill()) return -1;
    const std::size_t count = std::min(size, end_ - begin_);
    if (in_header_ && (header_bytes_ += count) > kMostHeaderBytes) return -1;
    std::copy_n(buffer_.data() + begin_, count, bytes);
    begin_ += count;
    return ssize_t(count);
  }
  ssize_t write(const char* bytes, std::size_t size) override {
    return is_writable() ? send(socket_, bytes, size, MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}  // always this machine
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  bool fill() {
    const Clock::time_point deadline = in_header_ ? header_ends_ : Clock::now() + kQuiet;
    if (in_header_ && Clock::now() > deadline) return false;
    if (!is_ready(socket_, POLLIN, deadline)) return false;
    const ssize_t count = recv(socket_, buffer_.data(), buffer_.size(), 0);
    begin_ = 0;
    end_ = std::size_t(std::max<ssize_t>(0, count));
    return count > 0;
  }

  const socket_t socket_;
  std::array<char, 16'384> buffer_;
  std::size_t begin_ = 0, end_ = 0, header_bytes_ = 0;
  bool in_header_ = false;
  Clock::time_point header_ends_;
};

}  // namespace

void GrowingThreads::enqueue(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  tasks_.push_back(std::move(task));
  if (tasks_.size() > free_ && threads_.size() < kMostThreads) {
    try {
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      if (threads_.empty()) throw;  // otherwise the task waits for another thread
    }
  }
  changed_.notify_one();
}

void GrowingThreads::shutdown() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void GrowingThreads::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++free_;
    changed_.wait(lock, [&] { return is_over_ || !tasks_.empty(); });
    --free_;
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

void HttpServer::let_many_wait() { ::listen(svr_sock_, int(kMostThreads)); }

bool HttpServer::process_and_close_socket(socket_t socket) {
  Connection connection(socket);
  bool is_good = true, is_closed = false;
  for (milliseconds idle{0}; is_good && !is_closed && idle < kIdle && svr_sock_ != INVALID_SOCKET;) {
    if (!connection.has_request(kLook)) {
      idle += kLook;
      continue;
    }
    idle = milliseconds(0);
    connection.begin_header();
    bool has_header = false;  // without it, the answer is a refusal, and what follows is no request
    const auto at_header = [&](httplib::Request&) {
      has_header = true;
      connection.end_header();
    };
    is_good = process_request(connection, false, is_closed, at_header) && has_header;
  }
  shutdown(socket, SHUT_RDWR);
  close(socket);
  return is_good;
}

}  // namespace marrow::workbench
