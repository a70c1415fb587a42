// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store.hpp"

#include <unistd.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "marrow/base/file_names.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/stopwatch.hpp"
#include "marrow/runtime/store/shared_folder.hpp"
#include "marrow/runtime/store/shared_store.hpp"
#include "marrow/runtime/store/store_entry.hpp"
#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// What a file in `last` holds. It includes the place, so that a file that was renamed to another place's name is
/// noticed.
struct Remembered {
  std::string place;
  Store::LastResults results;
  using fields = Fields<&Remembered::place, &Remembered::results>;
};

constexpr std::uint64_t kMostRemembered = 16 << 20;  // bytes

struct flock one_byte(short type, off_t place) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = place;
  lock.l_len = 1;
  return lock;
}

}  // namespace

Store::Store() : Store(default_folder(), SharedStore::of_environment()) {}
Store::Store(const fs::path& folder) : Store(folder, nullptr) {}
Store::Store(const fs::path& folder, std::shared_ptr<SharedStore> shared)
    : folder_(folder.empty() ? folder : plain_path(fs::absolute(folder))), shared_(std::move(shared)) {}

fs::path Store::default_folder() {
  const char* folder = std::getenv("MARROW_CACHE");
  if (folder && *folder) return folder;
  const fs::path cache = user_cache_folder();
  return cache.empty() ? cache : cache / "marrow" / "store";
}

std::string Store::fault() const { return examine_store(folder_).fault; }

bool Store::is_there() const {
  if (!is_checked_) is_checked_ = examine_store(folder_).is_store;
  return is_checked_;
}

std::string Store::prepare() const {
  if (is_checked_ && access((folder_ / kStoreMarker).c_str(), F_OK) == 0) return "";
  std::string fault = make_store(folder_);
  is_checked_ = fault.empty();
  return fault;
}

std::optional<StoredResult> Store::find(const Digest& key) const { return find(key, Where::anywhere); }

std::optional<StoredResult> Store::find(const Digest& key, Where where) const {
  std::optional<StoredResult> found = find_here(key);
  if (found || where == Where::here || !shared_ || !prepare().empty()) return found;
  std::optional<StoredResult> in_place;
  if (!shared_->fetch(key, entry_file(folder_, key), where == Where::anew ? SharedLook::listed : SharedLook::quick,
                      in_place))
    return found;
  return in_place ? std::move(in_place) : find_here(key);
}

std::optional<StoredResult> Store::find_here(const Digest& key) const {
  if (!is_there()) return std::nullopt;
  const fs::path path = entry_file(folder_, key);
  const StoreFile file(path);
  if (!file.is_open()) return std::nullopt;
  try {
    ReadEntry entry = read_entry(file, key);
    StoredResult result{{}, outputs_of(entry, path)};
    result.provenance = std::move(entry.description.provenance);
    file.mark_as_used();
    return result;
  } catch (const std::bad_alloc&) {
    return std::nullopt;
  } catch (const Error&) {  // damaged, of another layout, or of another key
  }
  drop(key);
  return std::nullopt;
}

void Store::drop(const Digest& key) const {
  if (is_there()) unlink(entry_file(folder_, key).c_str());
}

std::string Store::save(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) const {
  if (std::string fault = prepare(); !fault.empty()) return fault;
  try {
    const EntryDescription description = describe_entry(key, outputs, provenance);
    return write_whole(entry_file(folder_, key), [&](Archive& out) { write_entry(out, description, outputs); });
  } catch (const std::bad_alloc&) {
    return "out of memory";
  } catch (...) {  // a value of a plugin's own type
    return reason_of_exception();
  }
}

void Store::remember(const std::string& place, const LastResults& results) const {
  if (results.empty() || !prepare().empty()) return;
  LastResults all = results;
  all.merge(last(place));
  Packer packed;
  packed.add(Remembered{place, std::move(all)});
  if (packed.packed.size() <= kMostRemembered) write_checked(folder_ / "last" / hash_of(place).hex(), packed.packed);
}

Store::LastResults Store::last(const std::string& place) const {
  if (!is_there()) return {};
  const auto text = read_checked(folder_ / "last" / hash_of(place).hex(), kMostRemembered);
  if (!text) return {};
  try {
    Remembered remembered = Unpacker(*text).get<Remembered>();
    if (remembered.place == place) return std::move(remembered.results);
  } catch (const Error&) {  // of another layout
  }
  return {};
}

std::optional<std::uint64_t> bytes_of_gigabytes(std::string_view text) {
  constexpr double kMost_GB = 1e6;
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !(number >= 0 && number <= kMost_GB))
    return std::nullopt;
  return std::uint64_t(number * 1e9);
}

// Claims say which process makes a result. Each key locks one byte of one file. So there is nothing to clean up, and
// the kernel releases the lock if its holder dies.

Store::Claim::~Claim() {
  if (!descriptor_.is_open()) return;
  // A child that was forked in the meantime shares the lock through its copy of the descriptor. Closing only our
  // descriptor would not release the lock.
  struct flock lock = one_byte(F_UNLCK, 0);
  lock.l_len = 0;  // to the end of the file
  fcntl(descriptor_, F_OFD_SETLK, &lock);
}

Store::Claim Store::claim(const Digest& key, const std::atomic<bool>* cancelled,
                          const std::function<void(bool)>& on_wait) const {
  if (!prepare().empty()) return Claim();
  // Each claim opens the file again, so that two threads of one process exclude each other too.
  Descriptor descriptor(
      open((folder_ / "claims").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600));
  if (!descriptor.is_open()) return Claim();
  fchmod(descriptor, 0600);  // with any umask
  Waiting waiting(on_wait);
  struct flock lock = one_byte(F_WRLCK, off_t(key.low >> 2));
  auto pause = std::chrono::milliseconds(1);
  while (fcntl(descriptor, F_OFD_SETLK, &lock) != 0) {
    if ((errno != EAGAIN && errno != EACCES && errno != EINTR) || (cancelled && cancelled->load())) return Claim();
    waiting.goes_on();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(50));
  }
  return Claim(std::move(descriptor));
}

}  // namespace marrow
