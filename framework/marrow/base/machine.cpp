// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/machine.hpp"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <set>
#include <sstream>
#include <thread>

namespace marrow {
namespace {

/// The features of the processor by which OpenCV and the C library choose their code.
std::string processor_features() {
  std::string features = cpu_level();
#if defined(__x86_64__)
  __builtin_cpu_init();
  const auto add = [&](bool has, const char* name) { features += has ? std::string(" ") + name : ""; };
  add(__builtin_cpu_supports("sse3"), "sse3");
  add(__builtin_cpu_supports("ssse3"), "ssse3");
  add(__builtin_cpu_supports("sse4.1"), "sse4.1");
  add(__builtin_cpu_supports("sse4.2"), "sse4.2");
  add(__builtin_cpu_supports("popcnt"), "popcnt");
  add(__builtin_cpu_supports("avx"), "avx");
  add(__builtin_cpu_supports("fma"), "fma");
  add(__builtin_cpu_supports("fma4"), "fma4");
  add(__builtin_cpu_supports("avx2"), "avx2");
  add(__builtin_cpu_supports("avx512f"), "avx512f");
  add(__builtin_cpu_supports("avx512cd"), "avx512cd");
  add(__builtin_cpu_supports("avx512bw"), "avx512bw");
  add(__builtin_cpu_supports("avx512dq"), "avx512dq");
  add(__builtin_cpu_supports("avx512vl"), "avx512vl");
  add(__builtin_cpu_supports("avx512vnni"), "avx512vnni");
#endif
  return features;
}

/// Whether an environment variable counts. Those that do are OpenCV's switches for the processor's features, the choice
/// of code in two libraries of linear algebra that OpenCV may call, and the libraries that are loaded before all
/// others.
bool counts(std::string_view variable) {
  if (variable.starts_with("OPENCV_LOG")) return false;
  for (const char* beginning : {"OPENCV_", "OPENBLAS_CORETYPE=", "MKL_CBWR=", "LD_PRELOAD="})
    if (variable.starts_with(beginning)) return true;
  return false;
}

/// Adds the C library's switches for the processor's features. Its other switches do not change results; worker
/// processes set one of those.
void add_switches(std::string_view tunables, std::set<std::string>& variables) {
  std::istringstream stream{std::string(tunables)};
  for (std::string one; std::getline(stream, one, ':');)
    if (one.starts_with("glibc.cpu.")) variables.insert(one);
}

int threads_here() {
  std::error_code none;
  int count = 0;
  for (std::filesystem::directory_iterator task("/proc/self/task", none), end; !none && task != end;
       task.increment(none))
    ++count;
  return count;
}

/// Waits until the threads of this process are gone: a joined thread still counts until the system has removed it.
void wait_until_gone(int threads_before) {
  for (int tries = 0; tries < 500 && threads_here() > threads_before; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// How many of the `wanted` threads can be started besides this one.
int threads_at_once(int wanted) {
  const int before = threads_here();
  std::vector<std::thread> threads;
  std::atomic<bool> may_end{false};
  try {
    while (int(threads.size()) < wanted) threads.emplace_back([&] { may_end.wait(false); });
  } catch (const std::exception&) {  // a limit of threads, or of memory
  }
  may_end = true;
  may_end.notify_all();
  for (std::thread& thread : threads) thread.join();
  wait_until_gone(before);
  return int(threads.size());
}

}  // namespace

std::string cpu_level() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return "x86-64 with AVX-512";
  if (__builtin_cpu_supports("avx2")) return "x86-64 with AVX2";
  if (__builtin_cpu_supports("avx")) return "x86-64 with AVX";
  return "x86-64";
#else
  return "arm64";
#endif
}

Digest machine_digest() {
  static const std::string features = processor_features();
  std::set<std::string> variables;
  constexpr std::string_view kTunables = "GLIBC_TUNABLES=";
  for (char** one = environ; one && *one; ++one) {
    const std::string_view variable(*one);
    if (counts(variable))
      variables.insert(*one);
    else if (variable.starts_with(kTunables))
      add_switches(variable.substr(kTunables.size()), variables);
  }
  Hasher hasher;
  hasher.add(features);
  hasher.add(std::uint64_t(variables.size()));
  for (const std::string& variable : variables) hasher.add(variable);
  return hasher.digest();
}

int threads_to_be_had(int wanted) {
  static std::atomic<int> kept{0};  // TBB keeps the threads that it has started
  if (wanted <= kept) return wanted;
  int had = 0;
  for (int tries = 0; had == 0 && tries < 10; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));  // a process may just be ending
    had = threads_at_once(wanted + 1);
  }
  had = std::max(int(kept), had > 1 ? had - 1 : had);
  kept = had;
  return had;
}

}  // namespace marrow
