// SPDX-License-Identifier: Apache-2.0
// A node that fails in every way that a plugin can fail a comparison.
#include <chrono>
#include <csignal>
#include <thread>

#include <marrow/plugin.hpp>

namespace {
using marrow::Metrics;

struct Options {
  std::string how = "none";
  double value = 1;
  std::string text = "it will not do";
};

Metrics misbehave(const Metrics& a, const Options& options) {
  double value = a.items.at(0).value + options.value;
  if (options.how == "crash") std::raise(SIGSEGV);
  if (options.how == "exit") std::_Exit(3);
  if (options.how == "error") throw marrow::Error(options.text);
  if (options.how == "elsewhere") std::filesystem::current_path("/");
  if (options.how == "nan") value = std::numeric_limits<double>::quiet_NaN();
  if (options.how == "hang")
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  std::vector<std::vector<char>> hoard;
  while (options.how == "memory") {
    hoard.emplace_back(std::size_t(20) << 20, 'x');
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return {{{"value", value, "mm"}, {"twice", 2 * value, "mm"}}};
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.misbehave", misbehave)
      .summary("Fails as it is told")
      .in("a", "number")
      .out("number", "a + value")
      .option("how", &Options::how, "what goes wrong",
              marrow::one_of({"none", "crash", "exit", "error", "nan", "hang", "memory", "elsewhere"}))
      .option("value", &Options::value, "added")
      .option("text", &Options::text, "of the error");
}
