// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/profile.hpp"

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <ctime>
#include <fstream>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/place_of_results.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

thread_local Profile::Bar* innermost = nullptr;

std::int64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

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

using nlohmann::json;

std::string json_string(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

/// The format's times are in microseconds.
std::string microseconds(std::int64_t ns) {
  return formatted("{}{}.{:03}", ns < 0 ? "-" : "", std::abs(ns) / 1000, std::abs(ns) % 1000);
}

const char* name_of_kind(Profile::Kind kind) {
  static constexpr const char* kNames[] = {"node", "cached", "pass", "function", "store", "output"};
  return kNames[int(kind)];
}

std::string title_of(const std::string& node, const std::string& what) {
  if (node.empty() || what.empty()) return node + what;
  return node + ": " + what;
}

std::string metadata(const char* name, pid_t row, const std::string& arguments) {
  return formatted(R"({{"ph":"M","pid":{},"tid":{},"name":"{}","args":{{{}}}}})", ::getpid(), row, name, arguments);
}

}  // namespace

Profile::Profile() : record_(std::make_unique<Record>()) {}
Profile::~Profile() = default;

ProfilePlace ProfilePlace::inside(const std::string& node, const std::string& pass) const {
  return {profile, nodes + node + "/", pass.empty() ? items : items + pass + "/"};
}

Profile::Bar::Bar(const ProfilePlace& place, Kind kind, std::string_view node, std::string_view item,
                  std::string_view what)
    : profile_(place.profile) {
  if (!profile_) return;
  kind_ = kind;
  item_ = place_of_item(place, item);
  name_ = profile_->record_->name_of(kind, place.nodes + std::string(node), std::string(what));
  outer_ = innermost;
  innermost = this;
  process_ns_ = clock_ns(CLOCK_PROCESS_CPUTIME_ID);
  thread_ns_ = clock_ns(CLOCK_THREAD_CPUTIME_ID);
  begin_ns_ = profile_->record_->now_ns();
}

Profile::Bar::~Bar() {
  if (innermost == this) innermost = outer_;
  if (!profile_) return;
  const std::int64_t end_ns = profile_->record_->now_ns(), length_ns = end_ns - begin_ns_;
  const std::int64_t thread_ns = clock_ns(CLOCK_THREAD_CPUTIME_ID) - thread_ns_;
  if (outer_) {
    outer_->inner_ns_ += length_ns;
    outer_->inner_thread_ns_ += thread_ns;
  }
  try {
    profile_->record_->add({name_, ::gettid(), begin_ns_, length_ns, thread_ns}, kind_, std::move(item_),
                           {1, length_ns, length_ns - inner_ns_, thread_ns - inner_thread_ns_,
                            clock_ns(CLOCK_PROCESS_CPUTIME_ID) - process_ns_});
  } catch (const std::bad_alloc&) {  // the run goes on without this bar
  }
}

void Profile::add_pass(const ProfilePlace& place, const std::string& row, const std::string& node,
                       const std::string& item, Clock::time_point begin, Clock::time_point end) {
  const std::int64_t begin_ns = record_->ns_of(begin), length_ns = record_->ns_of(end) - begin_ns;
  record_->add({record_->name_of(Kind::pass, place.nodes + node, ""), record_->row_of(row), begin_ns, length_ns, 0},
               Kind::pass, place_of_item(place, item), {1, length_ns, 0, 0, 0});
}

void Profile::sample() { record_->sample(); }

std::size_t Profile::left_out() const { return record_->left_out(); }

std::string Profile::text(const std::string& title) const { return record_->text(title); }

std::string note_on_profile(const Profile& profile) {
  if (profile.left_out() == 0) return "";
  return formatted("the profile has no bars for {} later calls, because there were too many; its sums count them",
                   profile.left_out());
}

void expect_place_of_profile(const Pipeline& pipeline, const fs::path& file) {
  const auto refuse = [&](const std::string& why) { throw Error("cannot write the profile " + file.string() + why); };
  std::error_code error;
  if (fs::is_directory(file, error))
    refuse(": this is a folder; name a file in it, such as " + (file / "profile.json").string());
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::exists(folder, error)) refuse(": there is no folder " + folder.string() + "; make it, or name another file");
  if (!fs::is_directory(folder, error)) refuse(": " + folder.string() + " is no folder; name another file");
  if (::access(folder.c_str(), W_OK) != 0)
    refuse(": nothing can be written to " + folder.string() + " (" + std::strerror(errno) + "); name another file");
  expect_nothing_reads(pipeline, file, "the profile", "name another file");
  for (const PipelineNode* node : called_nodes(pipeline))
    for (const std::string& path : paths_of(*node))
      if (fs::equivalent(path, file, error)) refuse(": node '" + node->id + "' reads this file; name another");
}

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

// Writes a profile in the trace event format of Chrome: Duca and Sinclair, "Trace Event Format", 2016.

/// The main thread only waits, so the others are counted.
std::map<pid_t, std::string> Profile::Record::names_of_rows() const {
  std::map<pid_t, std::string> result{{::getpid(), "main thread"}};
  for (const pid_t thread : threads) result.try_emplace(thread, formatted("thread {}", result.size()));
  for (const Sample& sample : samples)
    for (const auto& [thread, ns] : sample.thread_ns)
      if (ns > 0) result.try_emplace(thread, formatted("thread {}", result.size()));
  return result;
}

std::string Profile::Record::text(const std::string& title) const {
  const std::scoped_lock lock(mutex);
  std::map<pid_t, std::string> row_names = names_of_rows();
  std::string text = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
  text += metadata("process_name", ::getpid(), "\"name\":" + json_string("marrow run " + title));
  for (const auto& [row, number] : rows) row_names.try_emplace(number, row);
  for (const auto& [row, name] : row_names)
    text += ",\n" + metadata("thread_name", row, "\"name\":" + json_string(name));

  std::vector<Kept> sorted = bars;
  std::sort(sorted.begin(), sorted.end(), [](const Kept& a, const Kept& b) {
    return std::tuple(a.row, a.begin_ns, -a.length_ns) < std::tuple(b.row, b.begin_ns, -b.length_ns);
  });
  for (const Kept& bar : sorted) {
    const Name& name = names[bar.name];
    const std::string shown = title_of(name.node, name.what) + (bar.item ? " (" + items[bar.item] + ")" : "");
    text += formatted(
        ",\n"
        R"({{"ph":"X","pid":{},"tid":{},"ts":{},"dur":{},)",
        ::getpid(), bar.row, microseconds(bar.begin_ns), microseconds(bar.length_ns));
    if (name.kind != Kind::pass) text += formatted(R"("tdur":{},)", microseconds(bar.thread_ns));
    text += formatted(R"("cat":"{}","name":{},"args":{{"node":{},"item":{}}}}})", name_of_kind(name.kind),
                      json_string(shown), json_string(name.node), json_string(items[bar.item]));
  }
  for (std::size_t i = 1; i < samples.size(); ++i) {
    std::string busy;
    for (const auto& [thread, ns] : samples[i].thread_ns) {
      const auto before = samples[i - 1].thread_ns.find(thread);
      const std::int64_t used = ns - (before == samples[i - 1].thread_ns.end() ? 0 : before->second);
      if (!row_names.contains(thread)) continue;
      busy += (busy.empty() ? "" : ",") + json_string(row_names.at(thread)) + ":" +
              fixed_number(double(used) / double(samples[i].at_ns - samples[i - 1].at_ns), 3);
    }
    text += formatted(
        ",\n"
        R"({{"ph":"C","pid":{},"tid":0,"ts":{},"name":"processors","args":{{{}}}}})",
        ::getpid(), microseconds(samples[i - 1].at_ns), busy);
  }
  text += "\n],\"marrow\":{\"sums\":[";
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (sums[i].calls == 0) continue;
    text += formatted(
        "{}\n"
        R"({{"kind":"{}","node":{},"what":{},"calls":{},"us":{},"own_us":{},"own_thread_us":{},)",
        text.ends_with('[') ? "" : ",", name_of_kind(names[i].kind), json_string(names[i].node),
        json_string(names[i].what), sums[i].calls, microseconds(sums[i].length_ns), microseconds(sums[i].own_ns),
        microseconds(sums[i].own_thread_ns));
    text += formatted(R"("process_us":{}}})", microseconds(sums[i].process_ns));
  }
  return text + formatted("\n],\"left_out\":{},\"us\":{}}}}}\n", missing_bars, microseconds(now_ns()));
}

}  // namespace marrow
