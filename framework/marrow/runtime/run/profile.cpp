// SPDX-License-Identifier: Apache-2.0
// Keeps the bars of a run.
#include "marrow/runtime/run/profile.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/place_of_results.hpp"
#include "marrow/runtime/run/profile_record.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

thread_local Profile::Bar* innermost = nullptr;

std::int64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
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

}  // namespace marrow
