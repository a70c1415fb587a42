// SPDX-License-Identifier: Apache-2.0
// Readers that do what a hostile file may make a reader do: the first word of the file says what.
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <numeric>
#include <thread>

#include <marrow/plugin.hpp>

namespace {
using marrow::Metrics;

struct Options {
  std::filesystem::path path;
  double value = 0;
  std::vector<std::string> words;
};

Metrics number(const Options& options, const Metrics* added, marrow::Context& context) {
  std::ifstream stream(options.path);
  std::string word;
  stream >> word;
  if (word == "names") marrow::now_reading(options.path / "inner");
  if (word == "crash" || word == "names") std::raise(SIGSEGV);
  if (word == "abort") std::abort();
  if (word == "killed") std::raise(SIGKILL);
  if (word == "listen" && (std::getline(std::cin, word) || std::system("cat") != 0))
    throw marrow::Error("there is something to read");
  if (word == "nan") context.progress(std::nan(""));
  if (word == "flood") context.info(std::string(70'000'000, 'x'));
  if (word == "exit") std::_Exit(3);
  if (word == "refuse") throw marrow::Error(options.path.string() + ": is refused");
  if (word == "memory") return {{{"value", double(std::vector<double>(std::size_t(1) << 33, 1.0).back()), ""}}};
  if (word == "opencv") cv::Mat(1 << 17, 1 << 17, CV_8U).setTo(1);
  if (word == "inside") marrow::now_reading(options.path / "inner"), std::_Exit(0);
  if (word == "spin")
    for (std::atomic<int> i{0};; ++i) {
    }
  if (word == "sleep") std::this_thread::sleep_for(std::chrono::hours(1));
  if (word == "shout") std::puts("{\"job\": 1, \"end\": 7}"), std::fflush(stdout);
  if (word == "change") std::ofstream(options.path, std::ios::app) << "more";
  if (word == "change_back") {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(50));  // the time of a change comes in steps of some milliseconds
    std::ofstream(options.path, std::ios::app) << "more";
    std::filesystem::resize_file(options.path, word.size());
  }
  context.warn("a warning of " + word);
  context.progress(0.5, "half");
  return {{{"value", options.value + double(context.seed() % 1000) + (added ? added->items.at(0).value : 0), ""},
           {"process", double(getpid()), ""},
           {"letters", double(std::accumulate(options.words.begin(), options.words.end(), std::string()).size()), ""}}};
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.kind("parse").summary("reads files in a process of its own").runs_apart(marrow::Apart::parses);
  plugin.node("parse.test_number", number)
      .summary("A number, or whatever the file asks for")
      .random()
      .in("added", "a number")
      .out("number", "the number")
      .option("path", &Options::path, "a file")
      .option("value", &Options::value, "a number")
      .option("words", &Options::words, "words");
}
