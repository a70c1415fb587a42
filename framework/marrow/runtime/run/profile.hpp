// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "marrow/base/stopwatch.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {

struct ProfilePlace;

/// Where the time of a run goes: one bar for each call of a node, and inside of it for each call of an outline
/// projector, of a radiograph projector, and of the function that an optimizer minimises. Bars of one thread lie within
/// each other or side by side. A pass of a body has no thread of its own, so the passes of a node have a row of their
/// own. Memory is bounded by the constants below; the sums over all bars of a name stay complete. Safe to use from
/// several threads.
class Profile {
 public:
  /// `cached`: the call's result was read back from the store. `store`: the data were read from it, or kept in it.
  /// `output`: the run's files were written.
  enum class Kind { node, cached, pass, function, store, output };
  static constexpr std::size_t kMostFunctionBars = 100'000;  ///< later calls of functions have no bar
  static constexpr std::size_t kMostOtherBars = 100'000;     ///< neither have later ones of other kinds
  static constexpr std::size_t kMostSamples = 2'000;         ///< of processor time; the interval is doubled for more

  Profile();
  ~Profile();
  Profile(const Profile&) = delete;
  Profile& operator=(const Profile&) = delete;

  class Bar;
  /// A bar in a row that belongs to no thread. `row` names the row.
  void add_pass(const ProfilePlace& place, const std::string& row, const std::string& node, const std::string& item,
                Clock::time_point begin, Clock::time_point end);
  /// Notes the processor time that each thread of this process has used. Does nothing if the last sample is too new.
  void sample();
  /// How many bars were left out because there were too many.
  std::size_t left_out() const;
  /// The profile in the trace event format of Chrome (docs/running.md), as JSON.
  std::string text(const std::string& title) const;

 private:
  struct Record;
  std::unique_ptr<Record> record_;
};

/// The profile that a run writes to, if any, and where in the whole run it is: inside the body of a node, the names of
/// the outer nodes and passes come before its own.
struct ProfilePlace {
  Profile* profile = nullptr;
  std::string nodes = {};  ///< "track/"
  std::string items = {};  ///< "0007/"

  /// The place inside the body of a node, in a pass; an empty pass is what all passes share.
  ProfilePlace inside(const std::string& node, const std::string& pass) const;
};

/// A bar on the thread that makes it, from then until its end. Costs nothing if the place has no profile. Must end on
/// the same thread, before bars that began earlier.
class Profile::Bar {
 public:
  /// `what` is what is done for the node, such as "outline"; empty for the call of the node itself.
  Bar(const ProfilePlace& place, Kind kind, std::string_view node, std::string_view item = {},
      std::string_view what = {});
  ~Bar();
  Bar(const Bar&) = delete;
  Bar& operator=(const Bar&) = delete;
  /// Leaves the bar out: there was nothing to do.
  void leave_out() { profile_ = nullptr; }

 private:
  friend class Profile;
  Profile* profile_;
  Bar* outer_ = nullptr;
  std::size_t name_ = 0;
  std::string item_;
  Kind kind_ = Kind::node;
  std::int64_t begin_ns_ = 0, thread_ns_ = 0, process_ns_ = 0;
  std::int64_t inner_ns_ = 0, inner_thread_ns_ = 0;  ///< of the bars directly inside
};

/// Throws Error if the profile of a run cannot be written there: it is a folder, the file's folder is missing or
/// read-only, or a node of the pipeline reads it. To be asked before a long run.
void expect_place_of_profile(const Pipeline& pipeline, const std::filesystem::path& file);

/// "the profile has no bars for 12 calls ...", if some were left out; else empty.
std::string note_on_profile(const Profile& profile);

/// What a profile keeps: bars, sums by name, and samples of processor time. Times in ns since it was made.
struct Profile::Record {
  struct Name {
    Kind kind;
    std::string node, what;
  };
  struct Kept {
    std::size_t name;
    pid_t row;  ///< the thread's number, or one of `rows`
    std::int64_t begin_ns, length_ns, thread_ns;
    std::size_t item = 0;
  };
  /// `own_ns` and `own_thread_ns` are without the bars inside, on the same thread. `process_ns` is the processor time
  /// of all threads meanwhile.
  struct Sum {
    std::int64_t calls = 0, length_ns = 0, own_ns = 0, own_thread_ns = 0, process_ns = 0;
  };
  struct Sample {
    std::int64_t at_ns;
    std::map<pid_t, std::int64_t> thread_ns;
  };

  std::int64_t ns_of(Clock::time_point time) const {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(time - start).count();
  }
  std::int64_t now_ns() const { return ns_of(Clock::now()); }
  std::size_t name_of(Kind kind, const std::string& node, const std::string& what);
  pid_t row_of(const std::string& row);
  void add(Kept bar, Kind kind, std::string item, const Sum& sum);
  void sample();
  std::size_t left_out() const;
  std::string text(const std::string& title) const;

 private:
  std::map<pid_t, std::string> names_of_rows() const;

  const Clock::time_point start = Clock::now();
  mutable std::mutex mutex;
  std::vector<Name> names;
  std::map<std::tuple<Kind, std::string, std::string>, std::size_t> index_of_name;
  std::vector<std::string> items{""};
  std::map<std::string, std::size_t> index_of_item{{"", 0}};
  std::map<std::string, pid_t> rows;
  std::vector<pid_t> threads;  ///< in the order of their first bars
  std::set<pid_t> known_threads;
  std::vector<Kept> bars;
  std::vector<Sum> sums;  ///< by name
  std::size_t function_bars = 0, missing_bars = 0;
  std::vector<Sample> samples;
  std::int64_t interval_ns = 100'000'000;
};

/// "0007/lateral"
std::string place_of_item(const ProfilePlace& place, std::string_view item);

/// Replaces the functions in a value by ones that call them, with a bar for each call: outlines, radiographs, and the
/// values of a function that an optimizer minimises. Costs stay as they are, and so do functions whose class code
/// elsewhere may look for by dynamic_cast, which would not find it any more. `node` made the value.
MARROW_EXPORT_TO_TESTS void show_calls(Value& value, const ProfilePlace& place, const std::string& node,
                                       const std::string& item);

}  // namespace marrow
