// SPDX-License-Identifier: Apache-2.0
// A node that changes what all nodes of a process share, and one whose result shows it.
#include <fenv.h>
#include <locale.h>
#include <oneapi/tbb/parallel_for.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <locale>
#include <marrow/plugin.hpp>
#include <sstream>
#include <thread>
#ifdef __x86_64__
#include <xmmintrin.h>
#endif

namespace {
using marrow::Metrics;

struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
};

struct HostileOptions {
  std::string how = "nothing";
};

Metrics hostile(const Metrics& a, const HostileOptions& options) {
  const std::string& how = options.how;
  if (how == "rounding") fesetround(FE_UPWARD);
  if (how == "traps") feenableexcept(FE_DIVBYZERO);
#ifdef __x86_64__
  if (how == "tiny") _mm_setcsr(_mm_getcsr() | 0x8040);  // as the start of a program that was linked with -ffast-math
#endif
  if (how == "locale") setlocale(LC_ALL, "C.UTF-8");
  if (how == "locale of streams") std::locale::global(std::locale(std::locale(), new Comma));
  if (how == "locale of thread") uselocale(newlocale(LC_ALL_MASK, "C.UTF-8", locale_t(nullptr)));
  if (how == "handler") signal(SIGUSR1, SIG_IGN);
  if (how == "blocked signals") {
    sigset_t some;
    sigemptyset(&some);
    sigaddset(&some, SIGUSR2);
    pthread_sigmask(SIG_BLOCK, &some, nullptr);
  }
  if (how == "working folder") std::filesystem::current_path("/");
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // others run meanwhile
  if (how == "throw number") throw 7;
  if (how == "throw text") throw "a text";
  return a;
}

struct LiarOptions {
  std::string about = "volume";
};

struct Lies {
  std::optional<marrow::Volume> volume;
  std::optional<marrow::Mesh> mesh;
  std::optional<marrow::Pose> pose;
};

/// A value that holds less than it says.
Lies lie(const Metrics&, const LiarOptions& options) {
  Lies lies;
  if (options.about == "mesh")
    lies.mesh = marrow::Mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 1000000}}};
  else if (options.about == "pose")
    lies.pose.emplace().covariance = marrow::Matrix6d(-marrow::Matrix6d::Identity());
  else
    lies.volume.emplace().grid.size = {1000, 1000, 1000};
  if (lies.volume) lies.volume->values.resize(8);
  return lies;
}

double third() {
  const volatile double one = 1, three = 3;
  return one / three;
}

struct SensitiveOptions {
  double number = 0;
};

Metrics sensitive(const Metrics& a, const SensitiveOptions& options) {
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const volatile double smallest = std::numeric_limits<double>::min();
  std::ostringstream text;
  text << 0.5;
  const double here = third();
  std::atomic<int> different{0};
  tbb::parallel_for(0, 16, [&](int) { different += third() != here; });
  return {{{"number", a.items.at(0).value + options.number, ""},
           {"third", here, ""},
           {"different", double(different), ""},
           {"tiny", smallest / 2, ""},
           {"digits", text.str() == "0.5" ? 1.0 : 0.0, ""},
           {"parsed", std::strtod("0.5", nullptr), ""},
           {"optimized", double(cv::useOptimized()), ""},
           {"threads", double(cv::getNumThreads()), ""},
           {"random", double(cv::theRNG().next()), ""},
           {"folder", double(std::filesystem::current_path().string().size()), ""}}};
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.hostile", hostile)
      .summary("Does harm as it is told")
      .in("a", "number")
      .out("number", "the same")
      .option("how", &HostileOptions::how, "what it does");
  plugin.node("test.liar", lie)
      .summary("Gives a value that holds less than it says")
      .in("a", "anything")
      .out("volume", &Lies::volume, "a volume")
      .out("mesh", &Lies::mesh, "a mesh")
      .out("pose", &Lies::pose, "a pose")
      .option("about", &LiarOptions::about, "volume, mesh or pose");
  plugin.node("test.sensitive", sensitive)
      .summary("What it gives shows harm that was done")
      .in("a", "number")
      .out("numbers", "what the state of the process leads to")
      .option("number", &SensitiveOptions::number, "added");
}
