// SPDX-License-Identifier: Apache-2.0
// The server of `marrow open` ends at any time when it is told to.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "workbench/server.hpp"

namespace {

/// Whether a server that is told to end before it listens does so within 20 seconds.
bool ends() {
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    const std::atomic<bool> stop{true};
    marrow::workbench::Server server;
    server.listen(0);
    server.run(stop);
    _exit(0);
  }
  int status = 1;
  waitpid(child, &status, 0);
  return status == 0;
}

TEST(WorkbenchServer, ASignalBeforeItListensEndsIt) {
  for (int round = 0; round < 60; ++round) ASSERT_TRUE(ends()) << "round " << round;
}

}  // namespace
