// SPDX-License-Identifier: Apache-2.0
// marrow conformance: runs the suite of a node's kind, each check in a process of its own, so that a node that crashes or hangs
// fails that check and no other.
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "commands.hpp"
#include "conformance/suite.hpp"

namespace marrow::cli {
namespace {

using conformance::Check;
using conformance::Suite;
using OptionValues = std::map<std::string, OptionValue>;

/// Seconds that one check may take.
int time_limit_s() {
  const char* text = std::getenv("MARROW_CHECK_SECONDS");
  const int seconds = text ? std::atoi(text) : 0;
  return seconds > 0 ? seconds : 60;
}

struct Outcome {
  char verdict = '-';  ///< '+' passed, '-' failed, '~' does not apply
  std::string text;
};

/// In the child: the verdict and the text after it.
std::string measured(const NodeDefinition& node, const OptionValues& options, const Check& check) {
  try {
    const double figure = check.measure(conformance::Subject(node, options));
    if (check.unit.empty()) return "+";
    const std::string text = conformance::digits(figure) + " " + check.unit + ", limit " + conformance::digits(check.limit);
    return (figure <= check.limit ? "+" : "-") + text;
  } catch (const conformance::NotApplicable& missing) {
    return std::string("~does not apply: ") + missing.what();
  } catch (const std::exception& error) {
    return std::string("-") + error.what();
  }
}

/// All that comes from the pipe until it ends or time is up.
bool read_all(int descriptor, std::string& text) {
  pollfd wait{descriptor, POLLIN, 0};
  for (;;) {
    if (poll(&wait, 1, time_limit_s() * 1000) <= 0) return false;
    char buffer[4096];
    const ssize_t count = read(descriptor, buffer, sizeof buffer);
    if (count <= 0) return true;
    text.append(buffer, std::size_t(count));
  }
}

Outcome run_check(const Catalogue& catalogue, const std::string& node, const OptionValues& options, const Check& check) {
  int ends[2];
  if (pipe(ends) != 0) throw Error(std::string("cannot make a pipe: ") + std::strerror(errno));
  const pid_t child = fork();
  if (child < 0) throw Error(std::string("cannot start a process: ") + std::strerror(errno));
  if (child == 0) {
    close(ends[0]);
    std::string text;
    try {
      text = measured(catalogue.load(node), options, check);
    } catch (const std::exception& error) {
      text = std::string("-") + error.what();
    }
    const bool written = write(ends[1], text.data(), text.size()) == ssize_t(text.size());
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  std::string text;
  const bool in_time = read_all(ends[0], text);
  close(ends[0]);
  if (!in_time) kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  if (!in_time) return {'-', "it took longer than " + std::to_string(time_limit_s()) + " s"};
  if (WIFSIGNALED(status)) return {'-', std::string("it crashed: ") + strsignal(WTERMSIG(status))};
  if (text.empty()) return {'-', "it ended the process with exit code " + std::to_string(WEXITSTATUS(status))};
  return {text[0], text.substr(1)};
}

/// The names of the nodes meant by a node's name, a kind or a library's file.
std::vector<std::string> nodes_of(const Catalogue& catalogue, const std::string& what) {
  std::vector<std::string> names;
  for (const std::string& name : catalogue.node_names()) {
    const LibraryInfo* library = catalogue.library_of(name);
    std::error_code error;
    if (name == what || name.substr(0, name.find('.')) == what || library->file.filename() == what || std::filesystem::equivalent(library->file, what, error))
      names.push_back(name);
  }
  if (names.empty()) throw Error("there is no node, kind or library '" + what + "'; " + suggestion(what, catalogue.node_names()) + "; marrow doctor shows the folders searched");
  return names;
}

}  // namespace

void print_limits(const NodeInfo& node) {
  const Suite* suite = conformance::suite_of(node.kind());
  if (!suite) return;
  std::printf("\nConformance (marrow conformance %s)\n", node.name.c_str());
  for (const Check& check : conformance::checks_of(*suite)) {
    const std::string limit = check.unit.empty() ? "" : ": at most " + conformance::digits(check.limit) + " " + check.unit;
    std::printf("  %-26s %s%s\n", check.name.c_str(), check.what.c_str(), limit.c_str());
  }
}

int run_conformance(const std::vector<std::string>& subjects) {
  const Catalogue catalogue;
  std::map<char, int> count;
  for (const std::string& subject : subjects)
    for (const std::string& name : nodes_of(catalogue, subject)) {
      const Suite* suite = conformance::suite_of(catalogue.find(name)->kind());
      if (!suite) {
        std::printf("%s: its kind has no suite\n", name.c_str());
        continue;
      }
      std::printf("%s\n", name.c_str());
      const OptionValues options = suite->options ? suite->options() : OptionValues{};
      for (const Check& check : conformance::checks_of(*suite)) {
        const Outcome outcome = run_check(catalogue, name, options, check);
        ++count[outcome.verdict];
        std::printf("  %s %-26s %s\n", outcome.verdict == '+' ? "pass" : outcome.verdict == '~' ? "n/a " : "FAIL", check.name.c_str(), outcome.text.c_str());
        std::fflush(stdout);
      }
    }
  std::printf("%d passed, %d do not apply, %d failed\n", count['+'], count['~'], count['-']);
  return count['-'] ? 1 : 0;
}

}  // namespace marrow::cli
