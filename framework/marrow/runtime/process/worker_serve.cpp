// SPDX-License-Identifier: Apache-2.0
// The worker's side, which does the work.
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <new>
#include <opencv2/core.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow {
namespace {

using nlohmann::json;

constexpr int kFirstOwnDescriptor = 16;  // above those that the worker is given
constexpr std::size_t kLongestText_bytes = 1 << 20;

/// Reads lines from the standard input as it was at the start. A library, and a process that it starts, find nothing
/// there: they would take requests away, or wait for ever.
class Requests {
 public:
  Requests() : descriptor_(fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, kFirstOwnDescriptor)) {
    const Descriptor nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
    dup2(nothing, STDIN_FILENO);
  }
  std::optional<std::string> next() {
    for (std::size_t newline; (newline = text_.find('\n')) == std::string::npos;) {
      char buffer[65536];
      const ssize_t count = read(descriptor_, buffer, sizeof buffer);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return std::nullopt;
      text_.append(buffer, std::size_t(count));
    }
    const std::size_t newline = text_.find('\n');
    std::string line = text_.substr(0, newline);
    text_.erase(0, newline + 1);
    return line;
  }

 private:
  int descriptor_;
  std::string text_;
};

/// A text of a message. A longer one than the reader takes is cut.
void shorten(json& text) {
  if (!text.is_string() || text.get_ref<const std::string&>().size() <= kLongestText_bytes) return;
  const std::size_t all = text.get_ref<const std::string&>().size();
  text = formatted("{}... ({} more bytes)", text.get_ref<const std::string&>().substr(0, kLongestText_bytes),
                   all - kLongestText_bytes);
}

/// Sends answers to the standard output as it was at the start. What a library prints there must not be taken for an
/// answer.
class Answers : public WorkerReports {
 public:
  Answers() : descriptor_(fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, kFirstOwnDescriptor)) {
    dup2(STDERR_FILENO, STDOUT_FILENO);
  }

  void begin(const json& job) { job_ = job; }
  void say(json report) override { send(std::move(report)); }
  void send(json message) {
    message["job"] = job_;
    for (const char* key : {"text", "failed", "place"})
      if (message.contains(key)) shorten(message[key]);
    const std::string line = message.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
    const std::scoped_lock lock(mutex_);
    if (!write_all(descriptor_, line)) _exit(1);  // nobody reads the answers any more
  }

 private:
  int descriptor_;
  json job_;
  std::mutex mutex_;
};

bool is_left_behind() {
  const char* parent = std::getenv("MARROW_PARENT");
  return parent && std::atol(parent) != long(getppid());
}

json failure(const std::string& why) { return {{"failed", why.empty() ? "it gave no reason" : why}}; }

json out_of_memory() {
  json failed = failure("out of memory");
  failed["out_of_memory"] = true;
  return failed;
}

json result_of(const WorkerTask& task, const json& request, Answers& answers) {
  try {
    return {{"end", task(request, answers)}};
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (const cv::Exception& error) {
    return error.code == cv::Error::StsNoMem ? out_of_memory() : failure(error.what());
  } catch (const json::exception& error) {
    return failure(std::string("the request cannot be understood: ") + error.what());
  } catch (...) {
    return failure(reason_of_exception());
  }
}

}  // namespace

int serve_worker(const std::map<std::string, WorkerTask>& tasks) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  keep_descendants();
  for (int descriptor = STDERR_FILENO + 1; descriptor < kFirstOwnDescriptor; ++descriptor)
    fcntl(descriptor, F_SETFD, FD_CLOEXEC);  // what the worker is given is not for what it starts
  if (is_left_behind()) return 1;
  signal(SIGPIPE, SIG_IGN);
  Answers answers;
  Requests requests;
  while (const auto line = requests.next()) {
    const json request = parse_json(*line, "a request");
    answers.begin(request.at("job"));
    const auto task = tasks.find(request.at("do").get<std::string>());
    answers.send(task == tasks.end() ? failure("there is no task '" + request.at("do").get<std::string>() + "'")
                                     : result_of(task->second, request, answers));
  }
  return 0;
}

json json_of_bytes(const std::string& text) {
  try {
    json(text).dump();
    return text;
  } catch (const json::exception&) {  // not UTF-8
    return {{"bytes", std::vector<std::uint8_t>(text.begin(), text.end())}};
  }
}

std::string bytes_of_json(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_object() || !value.contains("bytes") || !value["bytes"].is_array()) throw Error("expected a text");
  std::string text;
  for (const json& byte : value["bytes"]) text += char(integer_of(byte, 0, 255, "a byte of a text"));
  return text;
}

}  // namespace marrow
