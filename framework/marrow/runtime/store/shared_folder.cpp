// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/shared_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <sstream>
#include <system_error>
#include <thread>

#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/stopwatch.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSharedLine = "marrow shared store of results, layout 1\n";
constexpr int kMostLooks = 6;
constexpr auto kFirstPause = std::chrono::milliseconds(20);  // each pause is twice as long as the one before
const std::string kWhereTo = "; set MARROW_SHARED_CACHE to a folder for it, or unset it";

bool is_marked(const fs::path& folder, SharedLook look) {
  std::string ignored;
  return read_shared(
      folder / kStoreMarker, look,
      [](const StoreFile& file) {
        std::string text(std::min<std::size_t>(file.size(), kSharedLine.size()), '\0');
        return file.read(text.data(), text.size(), 0) && text == kSharedLine;
      },
      ignored);
}

Permissions permissions_of(const struct stat& status) {
  return {status.st_mode & 0660, status.st_mode & (S_ISGID | 0770), status.st_gid};
}

/// Whether an error of opening means only that the file is not there, or is not there any more.
bool is_absence(int number) { return number == ENOENT || number == ESTALE || number == ELOOP; }

using Seconds = std::chrono::duration<double>;

constexpr double kDefault_s = 30, kLeast_s = 0.2, kMost_s = 86400;
constexpr int kBeats = 6;  // signs of life within the seconds after which a claim is taken over

/// What a claim file says: "IDENTITY NUMBER-OF-CLAIM SECONDS BEATS".
struct ClaimText {
  std::string owner;
  unsigned long long number = 0;
  double seconds = claim_seconds();
};

ClaimText parsed(const std::string& text) {
  std::istringstream words(text);
  ClaimText claim;
  double seconds = 0;
  if (words >> claim.owner >> claim.number >> seconds && is_identity(claim.owner)) {
    claim.seconds = std::clamp(seconds, kLeast_s, kMost_s);
    return claim;
  }
  return {};  // it was made just now, or its owner was killed before it wrote
}

/// The text of a claim; nothing if the file does not exist or cannot be read. Only opening the file again shows what
/// other hosts wrote to it.
std::optional<std::string> claim_text(const fs::path& file) {
  constexpr std::size_t kMost = 256;
  constexpr int kMostTries = 5;
  for (int tries = 0; tries < kMostTries; ++tries) {
    const StoreFile open_file(file);
    if (!open_file.is_open()) {
      if (open_file.fault() != ENOENT || !is_listed(file)) return std::nullopt;
      continue;  // this host did not know of it yet
    }
    std::string text(std::size_t(std::min<std::uint64_t>(open_file.size(), kMost)), '\0');
    if (open_file.read(text.data(), text.size(), 0)) return text;
  }
  return std::nullopt;
}

}  // namespace

/// A claim file of this process. It stays open, so that a sign of life is never written to another process's file of
/// the same name.
class HeldClaim {
 public:
  HeldClaim(fs::path file, Descriptor descriptor)
      : file_(std::move(file)), descriptor_(std::move(descriptor)), process_(getpid()), number_(next_number()) {
    beat();
  }
  ~HeldClaim() {
    // A child that was forked in the meantime keeps the file. So does a process whose claim was taken over.
    if (process_ == getpid())
      if (const ClaimText now = parsed(claim_text(file_).value_or(""));
          now.owner == this_process() && now.number == number_)
        unlink(file_.c_str());
  }
  HeldClaim(const HeldClaim&) = delete;
  HeldClaim& operator=(const HeldClaim&) = delete;

  /// Writes a sign of life. Closing any descriptor of a file sends what was written to the server, so that other hosts
  /// see it; fsync() would also wait for the disk. A fault does no harm: at worst, another process takes the claim
  /// over.
  void beat() {
    const std::string text = formatted("{} {} {:.3f} {:012}\n", this_process(), number_, claim_seconds(), ++beats_);
    if (pwrite(descriptor_, text.data(), text.size(), 0) == ssize_t(text.size())) Descriptor(dup(descriptor_)).close();
  }

 private:
  static unsigned long long next_number() {
    static std::atomic<unsigned long long> number{0};
    return ++number;
  }

  fs::path file_;
  Descriptor descriptor_;
  pid_t process_;
  unsigned long long number_, beats_ = 0;
};

namespace {

/// The one thread of a process that gives signs of life for all of its claims. It runs from the first claim on.
class Heart {
 public:
  ~Heart() {
    {
      const std::scoped_lock lock(mutex_);
      is_over_ = true;
    }
    changed_.notify_all();
    if (!thread_.joinable()) return;
    if (process_ == getpid())
      thread_.join();
    else
      thread_.detach();
  }
  void add(const std::shared_ptr<HeldClaim>& claim) {
    const std::scoped_lock lock(mutex_);
    if (process_ != getpid()) {  // forked: the thread runs in the other process only
      if (thread_.joinable()) thread_.detach();
      process_ = getpid();
      claims_.clear();
    }
    claims_.push_back(claim);
    if (thread_.joinable()) return;
    try {
      thread_ = std::thread([this] { run(); });
    } catch (const std::system_error&) {  // no more threads: others take the claim over if it lasts long
    }
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    while (!is_over_) {
      changed_.wait_for(lock, Seconds(claim_seconds() / kBeats));
      std::vector<std::shared_ptr<HeldClaim>> claims;
      for (const std::weak_ptr<HeldClaim>& one : claims_)
        if (auto claim = one.lock()) claims.push_back(std::move(claim));
      std::erase_if(claims_, [](const auto& one) { return one.expired(); });
      lock.unlock();  // the folder may take long to answer
      for (const auto& claim : claims) claim->beat();
      claims.clear();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::weak_ptr<HeldClaim>> claims_;
  bool is_over_ = false;
  pid_t process_ = getpid();
  std::thread thread_;
};

Heart& heart() {
  static Heart heart;
  return heart;
}

/// Removes a claim whose owner has ended, as its text said. If several processes do this at once, only one of them can
/// rename the file. If the owner was quicker, or the result was claimed again in the meantime, the file is put back.
void take_away(const fs::path& file, const std::string& text) {
  const fs::path aside = temporary_beside(file);
  if (std::rename(file.c_str(), aside.c_str()) != 0) return;
  if (claim_text(aside) != text) link(aside.c_str(), file.c_str());
  unlink(aside.c_str());
}

/// Watches a claim of another process. Only the time during which this process looked at the claim counts. So a process
/// that was suspended, or that waited for the file system, does not take its own absence for the owner's.
class Watch {
 public:
  /// Whether the owner of the claim has ended, as far as this can be known. A claim that could not be read (no text)
  /// counts as unchanged.
  bool is_left(const std::optional<std::string>& text) {
    const Clock::time_point now = Clock::now();
    if (text && text != text_) {
      text_ = text;
      unchanged_ = Seconds(0);
    } else {
      unchanged_ += std::min<Seconds>(now - looked_, 2 * pause_);
    }
    looked_ = now;
    const ClaimText claim = parsed(text_.value_or(""));
    pause_ = std::clamp<Seconds>(1.5 * pause_, Seconds(kFirst_s), Seconds(std::min(1.0, claim.seconds / kBeats)));
    return life_of(claim.owner) == Life::ended || unchanged_.count() > claim.seconds;
  }
  /// What the claim said when it was last read; nothing if it never could be.
  const std::optional<std::string>& text() const { return text_; }
  void pause() const { std::this_thread::sleep_for(pause_); }

 private:
  static constexpr double kFirst_s = 0.01;
  std::optional<std::string> text_;
  Clock::time_point looked_ = Clock::now();
  Seconds unchanged_{0}, pause_{kFirst_s};
};

}  // namespace

SharedFolderState examine_shared(const fs::path& folder) {
  SharedFolderState state;
  const std::string name = "the folder " + folder.string();
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    state.fault = errno == ENOENT
                      ? name + " does not exist on this host; make it (for a group: mkdir -m 2770), or mount it"
                      : "cannot use the folder " + folder.string() + ": " + std::strerror(errno) + kWhereTo;
    return state;
  }
  state.permissions = permissions_of(status);
  state.may_write = faccessat(AT_FDCWD, folder.c_str(), W_OK, AT_EACCESS) == 0;
  if (!S_ISDIR(status.st_mode))
    state.fault = folder.string() + " is no folder" + kWhereTo;
  else if (status.st_mode & S_IWOTH)
    state.fault = "everybody may write to " + folder.string() + "; take that from them (chmod o-w)";
  else if (faccessat(AT_FDCWD, folder.c_str(), R_OK | X_OK, AT_EACCESS) != 0)
    state.fault = "cannot look into the folder " + folder.string() + ": " + std::strerror(errno);
  else if (is_marked(folder, SharedLook::quick))
    state.is_store = true;
  else if (!holds_nothing(folder)) {  // another process may be making it a store at this moment
    state.is_store = is_marked(folder, SharedLook::listed);
    if (!state.is_store) state.fault = name + " holds other things and is no shared store of marrow" + kWhereTo;
  } else if (!state.may_write)
    state.fault = name + " is empty, and this user may not write to it; ask its owner for the right";
  return state;
}

SharedFolderState make_shared(const fs::path& folder) {
  const SharedFolderState state = examine_shared(folder);
  if (state.is_store || !state.fault.empty()) return state;
  const std::string fault = write_whole(
      folder / kStoreMarker,
      [](Archive& out) {
        for (std::string_view part : {kSharedLine, kStoreForPeople}) out.bytes(part.data(), part.size());
      },
      true, state.permissions);
  SharedFolderState made = examine_shared(folder);
  if (made.fault.empty()) made.fault = fault;
  return made;
}

bool is_listed(const fs::path& file) {
  const fs::path folder = file.parent_path();
  std::error_code error;
  fs::directory_iterator at(folder, error);
  if (error) {
    const fs::directory_iterator above(folder.parent_path(), error);
    at = fs::directory_iterator(folder, error);
  }
  for (const fs::directory_iterator end; !error && at != end; at.increment(error))
    if (at->path().filename() == file.filename()) return true;
  return false;
}

bool read_shared(const fs::path& file, SharedLook look, const std::function<bool(const StoreFile&)>& use,
                 std::string& fault) {
  auto pause = kFirstPause;
  bool is_there = look == SharedLook::listed && is_listed(file);
  for (int tries = 1;; ++tries) {
    const StoreFile open_file(file);
    if (open_file.is_open()) {
      if (use(open_file)) return true;
      is_there = true;
    } else if (!is_absence(open_file.fault())) {
      fault = "cannot read " + file.string() + ": " + std::strerror(open_file.fault());
      return false;
    }
    if (!is_there || tries == kMostLooks) return false;
    std::this_thread::sleep_for(pause);
    pause *= 2;
    is_there = is_listed(file);
  }
}

SharedClaim::SharedClaim(std::shared_ptr<HeldClaim> held) : held_(std::move(held)) {}
SharedClaim::~SharedClaim() = default;

double claim_seconds() {
  const char* text = std::getenv("MARROW_CLAIM_SECONDS");
  double given = 0;
  if (!text || std::from_chars(text, text + std::strlen(text), given).ec != std::errc() || !(given > 0))
    return kDefault_s;
  return std::clamp(given, kLeast_s, kMost_s);
}

SharedClaim claim_file(const fs::path& file, const Permissions& permissions, const std::atomic<bool>* cancelled,
                       const std::function<void(bool)>& on_wait, std::string& fault) {
  Waiting waiting(on_wait);
  Watch watch;
  constexpr int kMostTries = 5;
  for (int stale = 0;;) {
    if (cancelled && cancelled->load()) return {};
    if (Descriptor descriptor(open_new_file(file, permissions)); descriptor.is_open()) {
      const auto held = std::make_shared<HeldClaim>(file, std::move(descriptor));
      heart().add(held);
      return SharedClaim(held);
    }
    if (errno == EINTR || (errno == ESTALE && ++stale < kMostTries)) continue;
    if (errno != EEXIST) {
      fault = "cannot make the claim " + file.string() + ": " + std::strerror(errno);
      return {};
    }
    if (watch.is_left(claim_text(file))) {
      if (!watch.text()) return {};  // its owner is unknown: making the result twice is better than waiting for ever
      take_away(file, *watch.text());
      watch = Watch();
      continue;
    }
    waiting.goes_on();
    watch.pause();
  }
}

std::string owner_of_claim(const fs::path& file) { return parsed(claim_text(file).value_or("")).owner; }

}  // namespace marrow
