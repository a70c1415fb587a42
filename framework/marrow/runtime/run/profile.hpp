// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"
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

}  // namespace marrow
