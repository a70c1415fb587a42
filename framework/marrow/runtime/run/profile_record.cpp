// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/profile_record.hpp"

#include <unistd.h>

#include <charconv>
#include <fstream>
#include <sstream>

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Rows that are no threads have numbers above those of all threads of Linux (at most 2^22).
constexpr pid_t kFirstRow = 10'000'000;

/// The processor time of each thread of this process, in the steps of the system's clock (usually 10 ms).
std::map<pid_t, std::int64_t> processor_times() {
  static const std::int64_t tick_ns = 1'000'000'000 / sysconf(_SC_CLK_TCK);
  std::map<pid_t, std::int64_t> times;
  std::error_code error;
  for (fs::directory_iterator at("/proc/self/task", error), end; !error && at != end; at.increment(error)) {
    std::ifstream stream(at->path() / "stat");
    std::string line;
    std::getline(stream, line);
    const std::size_t name_end = line.rfind(')');  // the name may hold anything
    if (name_end == std::string::npos) continue;   // the thread has ended
    std::istringstream fields(line.substr(name_end + 1));
    std::string skipped;
    for (int field = 0; field < 11; ++field) fields >> skipped;
    std::int64_t user = 0, system = 0;
    fields >> user >> system;
    pid_t thread = 0;
    const std::string number = at->path().filename().string();
    std::from_chars(number.data(), number.data() + number.size(), thread);
    times[thread] = (user + system) * tick_ns;
  }
  return times;
}

}  // namespace

std::string place_of_item(const ProfilePlace& place, std::string_view item) {
  if (!item.empty() || place.items.empty()) return place.items + std::string(item);
  return place.items.substr(0, place.items.size() - 1);
}

std::size_t Profile::Record::name_of(Kind kind, const std::string& node, const std::string& what) {
  const std::scoped_lock lock(mutex);
  const auto [at, is_new] = index_of_name.try_emplace({kind, node, what}, names.size());
  if (is_new) {
    names.push_back({kind, node, what});
    sums.emplace_back();
  }
  return at->second;
}

pid_t Profile::Record::row_of(const std::string& row) {
  const std::scoped_lock lock(mutex);
  return rows.try_emplace(row, kFirstRow + pid_t(rows.size())).first->second;
}

void Profile::Record::add(Kept bar, Kind kind, std::string item, const Sum& sum) {
  const std::scoped_lock lock(mutex);
  Sum& all = sums[bar.name];
  all.calls += sum.calls;
  all.length_ns += sum.length_ns;
  all.own_ns += sum.own_ns;
  all.own_thread_ns += sum.own_thread_ns;
  all.process_ns += sum.process_ns;
  if (bar.row < kFirstRow && known_threads.insert(bar.row).second) threads.push_back(bar.row);
  const bool is_function = kind == Kind::function;
  if (is_function ? function_bars >= kMostFunctionBars : bars.size() - function_bars >= kMostOtherBars) {
    ++missing_bars;
    return;
  }
  const auto [at, is_new] = index_of_item.try_emplace(std::move(item), items.size());
  if (is_new) items.push_back(at->first);
  bar.item = at->second;
  bars.push_back(bar);
  if (is_function) ++function_bars;
}

void Profile::Record::sample() {
  const std::int64_t now = now_ns();
  {
    const std::scoped_lock lock(mutex);
    if (!samples.empty() && now - samples.back().at_ns < interval_ns) return;
  }
  Sample made{now, processor_times()};
  const std::scoped_lock lock(mutex);
  samples.push_back(std::move(made));
  if (samples.size() < kMostSamples) return;
  for (std::size_t i = 1; 2 * i < samples.size(); ++i) samples[i] = std::move(samples[2 * i]);
  samples.resize((samples.size() + 1) / 2);
  interval_ns *= 2;
}

std::size_t Profile::Record::left_out() const {
  const std::scoped_lock lock(mutex);
  return missing_bars;
}

}  // namespace marrow
