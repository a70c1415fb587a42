// SPDX-License-Identifier: Apache-2.0
// A worker that does what it is asked, also what no worker should.
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <thread>

#include "marrow/base/error.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace {
using nlohmann::json;

/// Writes a line to where answers go, as a library that knows the protocol could.
void forge(const std::string& line) {
  for (int descriptor = 3; descriptor < 100; ++descriptor) {
    struct stat status {};
    if (fstat(descriptor, &status) == 0 && S_ISFIFO(status.st_mode) && write(descriptor, line.data(), line.size()) < 0)
      continue;
  }
}
}  // namespace

int main() {
  return marrow::serve_worker({
      {"echo", [](const json& request, marrow::WorkerReports&) { return request.at("text"); }},
      {"refuse", [](const json&, marrow::WorkerReports&) -> json { throw marrow::Error("it does not want to"); }},
      {"print", [](const json&,
                   marrow::WorkerReports&) { return std::puts("{\"job\": 1, \"end\": \"forged\"}"), json("done"); }},
      {"forge",
       [](const json& request, marrow::WorkerReports&) {
         return forge(request.at("line")), std::this_thread::sleep_for(std::chrono::seconds(60)), json("done");
       }},
      {"crash",
       [](const json&, marrow::WorkerReports& reports) -> json {
         reports.at("the middle");
         std::raise(SIGSEGV);
         return 0;
       }},
      {"exit", [](const json&, marrow::WorkerReports&) -> json { std::_Exit(7); }},
      {"sleep", [](const json&,
                   marrow::WorkerReports&) { return std::this_thread::sleep_for(std::chrono::seconds(60)), json(); }},
      {"wait",
       [](const json& request, marrow::WorkerReports& reports) {
         reports.waiting(true);
         std::this_thread::sleep_for(std::chrono::duration<double>(request.at("seconds").get<double>()));
         reports.waiting(false);
         return json("waited");
       }},
      {"memory",
       [](const json&, marrow::WorkerReports&) {
         std::string text(std::size_t(600) << 20, 'x');
         std::this_thread::sleep_for(std::chrono::seconds(60));
         return json(text.size());
       }},
      {"fork",
       [](const json& request, marrow::WorkerReports& reports) {
         const pid_t child = fork();
         if (child == 0) std::this_thread::sleep_for(std::chrono::seconds(600)), std::_Exit(0);
         reports.at(std::to_string(child));
         if (request.at("then") == "crash") std::raise(SIGSEGV);
         if (request.at("then") == "sleep") std::this_thread::sleep_for(std::chrono::seconds(600));
         return json(child);
       }},
      {"parent", [](const json&, marrow::WorkerReports&) { return json(getppid()); }},
  });
}
