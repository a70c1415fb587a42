// SPDX-License-Identifier: Apache-2.0
// Nodes by which the tests see what a comparison times, what the first call pays, and what it makes of numbers that are
// known.
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <marrow/plugin.hpp>

namespace {
using marrow::Metrics;

struct LoggedOptions {
  std::string name = "one";
  std::string not_for;
  std::filesystem::path path;
};
/// Writes "NAME CASE" to the file that the variable MARROW_TEST_CALLS names. Fails also if that is the text of the file
/// that MARROW_TEST_FAILS names.
Metrics logged(const LoggedOptions& options) {
  const std::string case_name = options.path.filename().string();
  if (const char* file = std::getenv("MARROW_TEST_CALLS"))
    std::ofstream(file, std::ios::app) << options.name << " " << case_name << "\n";
  std::string fails;
  if (const char* file = std::getenv("MARROW_TEST_FAILS")) std::getline(std::ifstream(file), fails);
  if (case_name == options.not_for || fails == options.name + " " + case_name)
    throw marrow::Error("it does not take this case");
  return {{{"value", double(options.name.size()), ""}}};
}

/// A pose whose search took as many evaluations as the case's name says.
marrow::Pose searched(const LoggedOptions& options) {
  marrow::Pose pose;
  pose.evaluations = std::stoi(options.path.filename().string());
  return pose;
}

/// The number in the file 'value' of a case, in mm. Fails if the file is empty.
Metrics case_value(const LoggedOptions& options) {
  double value = 0;
  if (!(std::ifstream(options.path / "value") >> value)) throw marrow::Error("the case has no number");
  return {{{"value", value, "mm"}}};
}

struct ShiftedOptions {
  double shift = 0, scale = 1;
};
/// Values of at least 0. A scale below 1 stands for another unit.
Metrics shifted(const Metrics& of, const ShiftedOptions& options) {
  const double value = std::max(0.0, of.items.at(0).value - options.shift);
  return {{{"value", value, options.scale < 1 ? "m" : "mm"}}};
}

struct ColdOptions {
  double first_s = 0, each_s = 0;
  int number = 0;
};
/// The first call in a process takes longer, as it does where libraries are loaded and threads are started.
Metrics cold(const ColdOptions& options) {
  static std::atomic<bool> is_first = true;
  if (is_first.exchange(false)) std::this_thread::sleep_for(std::chrono::duration<double>(options.first_s));
  std::this_thread::sleep_for(std::chrono::duration<double>(options.each_s));
  return {{{"value", double(options.number), ""}}};
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.logged", logged)
      .summary("Writes down that it was called")
      .out("number", "a number")
      .option("name", &LoggedOptions::name, "written before the case")
      .option("not_for", &LoggedOptions::not_for, "name of a case for which it fails")
      .option("path", &LoggedOptions::path, "the case");
  plugin.node("test.searched", searched)
      .summary("Seems to have searched")
      .out("pose", "where it is")
      .option("path", &LoggedOptions::path, "the case");
  plugin.node("test.case_value", case_value)
      .summary("Reads a number of a case")
      .out("number", "the number")
      .option("path", &LoggedOptions::path, "the case");
  plugin.node("test.shifted", shifted)
      .summary("Makes a number smaller")
      .in("of", "number")
      .out("number", "the difference, or 0")
      .option("shift", &ShiftedOptions::shift, "how much smaller")
      .option("scale", &ShiftedOptions::scale, "below 1 the unit is another one");
  plugin.node("test.cold", cold)
      .summary("Is slow when it is called first")
      .out("number", "its number")
      .option("first_s", &ColdOptions::first_s, "seconds more for the first call in a process")
      .option("each_s", &ColdOptions::each_s, "seconds of each call")
      .option("number", &ColdOptions::number, "what it gives");
}
