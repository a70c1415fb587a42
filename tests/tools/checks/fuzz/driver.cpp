// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target without libFuzzer, so that the ordinary tests need no clang. It tries the seeds, then mutations of
// them, for 2 s, or 10 s if MARROW_TEST_ALL is 1. The mutations are the same in each run, unless MARROW_TEST_SEED or
// --seed gives another seed. This driver notices crashes, foreign exceptions, too much memory and too much time. Leaks
// and memory errors without an immediate effect need the sanitizers of tools/checks/fuzz.
//   fuzz_NAME --seeds FOLDER --dictionary FILE [--seconds 10] [--seed 1]        fuzz_NAME FILE...
#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <optional>

#include "heap.hpp"
#include "mutate.hpp"
#include "target.hpp"

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongest = 65536;
constexpr std::size_t kHeap = 256 << 20;
constexpr int kProcessor_s = 2,
              kWaiting_s =
                  60;  // the second limit only catches inputs that sleep, because other tests run at the same time

std::string current;     // the input that is tried
std::string reproducer;  // the file for a finding

/// Signal handlers call this, too, so it allocates nothing.
[[noreturn]] void report(const char* what) {
  const auto say = [](const char* text) { (void)!write(STDERR_FILENO, text, std::strlen(text)); };
  const int file = open(reproducer.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file >= 0 && write(file, current.data(), current.size()) >= 0) close(file);
  say("finding: ");
  say(what);
  say("; the input is ");
  say(reproducer.c_str());
  say(", and this program with it as its argument tries it again\n");
  _exit(1);
}

void on_signal(int number) {
  report(number == SIGPROF   ? "more than 2 s of processor time"
         : number == SIGALRM ? "no end within 60 s"
                             : strsignal(number));
}

void set_handlers() {
  static char stack[65536];  // a stack that overflows has no room for the handler
  stack_t own{};
  own.ss_sp = stack;
  own.ss_size = sizeof stack;
  sigaltstack(&own, nullptr);
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_ONSTACK;
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF, SIGALRM})
    sigaction(number, &action, nullptr);
}

void set_timer(int which, int seconds) {
  const itimerval time{{0, 0}, {seconds, 0}};
  setitimer(which, &time, nullptr);
}

void run_once(const std::string& input) {
  current = input;
  marrow::fuzz::limit_heap(kHeap, [] { report("more than 256 MB of memory"); });
  set_timer(ITIMER_PROF, kProcessor_s);
  set_timer(ITIMER_REAL, kWaiting_s);
  try {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(current.data()), current.size());
  } catch (const std::exception& error) {
    report((std::string("an exception that is no marrow::Error: ") + error.what()).c_str());
  } catch (...) {
    report("an exception of an unknown type");
  }
  set_timer(ITIMER_PROF, 0);
  set_timer(ITIMER_REAL, 0);
}

std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::string> read_seeds(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());  // the same order everywhere
  std::vector<std::string> seeds;
  for (const fs::path& path : paths) seeds.push_back(read_file(path));
  return seeds;
}

std::string variable(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

struct Settings {
  double seconds = variable("MARROW_TEST_ALL") == "1" ? 10 : 2;
  std::uint64_t seed = std::hash<std::string>()(variable("MARROW_TEST_SEED"));
  fs::path seeds, dictionary;
  std::vector<fs::path> inputs;
};

Settings settings_of(int count, char** words) {
  Settings settings;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (!word.starts_with("--")) {
      settings.inputs.push_back(word);
      continue;
    }
    if (++i == count) throw std::runtime_error(word + " needs a value");
    if (word == "--seconds")
      settings.seconds = std::stod(words[i]);
    else if (word == "--seed")
      settings.seed = std::stoull(words[i]);
    else if (word == "--seeds")
      settings.seeds = words[i];
    else if (word == "--dictionary")
      settings.dictionary = words[i];
    else
      throw std::runtime_error("unknown option " + word);
  }
  return settings;
}

/// Runs the seeds and their mutations. Returns the number of executions.
std::size_t fuzz(const Settings& settings, std::size_t& largest_heap) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(settings.seconds);
  std::vector<std::string> inputs = read_seeds(settings.seeds);
  if (inputs.empty()) throw std::runtime_error("there are no seeds in " + settings.seeds.string());
  marrow::fuzz::Mutator mutator(marrow::fuzz::read_dictionary(settings.dictionary), settings.seed);
  std::size_t executions = 0;
  for (const std::string& seed : inputs) run_once(seed), ++executions;
  for (; Clock::now() < end; ++executions) {
    const std::string& from = inputs[mutator.below(inputs.size())];
    run_once(mutator.mutated(from, inputs[mutator.below(inputs.size())], kLongest));
    largest_heap = std::max(largest_heap, marrow::fuzz::heap_peak());
  }
  return executions;
}

}  // namespace

int main(int count, char** words) try {
  const Settings settings = settings_of(count, words);
  const std::string name = fs::path(words[0]).filename().string();
  reproducer = (fs::current_path() / (name + "-finding")).string();
  marrow::fuzz::folder();
  set_handlers();
  if (!settings.inputs.empty()) {
    for (const fs::path& path : settings.inputs) {
      run_once(read_file(path));
      std::printf("%s: good, %zu kB of memory\n", path.c_str(), marrow::fuzz::heap_peak() / 1000);
    }
    return 0;
  }
  std::size_t largest_heap = 0;
  const std::size_t executions = fuzz(settings, largest_heap);
  std::printf("%s: %zu executions without a finding, at most %zu kB of memory, seed %llu\n", name.c_str(), executions,
              largest_heap / 1000, static_cast<unsigned long long>(settings.seed));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
