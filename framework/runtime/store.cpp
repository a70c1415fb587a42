// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// In front of each file: what it is, how long the description is that follows, and its hash.
struct Preamble {
  std::array<char, 8> magic{'m', 'a', 'r', 'r', 'o', 'w', 'r', '1'};
  std::uint64_t size = 0;
  Digest digest;
};
static_assert(sizeof(Preamble) == 32);

/// An output, or an item of a list, as described in an entry.
struct Leaf {
  std::string type;
  std::int32_t version = 0;
  std::uint64_t type_size = 0;
  bool present = false;
  Digest key;
  std::uint64_t offset = 0, size = 0;  // of the packed value, after the description
  std::string axis;
  std::vector<std::string> names;
  std::vector<Leaf> items;
  static constexpr auto fields() {
    return std::make_tuple(&Leaf::type, &Leaf::version, &Leaf::type_size, &Leaf::present, &Leaf::key, &Leaf::offset, &Leaf::size, &Leaf::axis,
                           &Leaf::names, &Leaf::items);
  }
};

struct Description {
  Provenance provenance;
  std::vector<Leaf> outputs;
  std::uint64_t payload = 0;  // bytes of all packed values
  static constexpr auto fields() { return std::make_tuple(&Description::provenance, &Description::outputs, &Description::payload); }
};

class File {
 public:
  explicit File(const fs::path& path) : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  std::uint64_t size() const {
    struct stat status {};
    return fstat(descriptor_, &status) ? 0 : std::uint64_t(status.st_size);
  }
  bool read(void* data, std::size_t size, std::uint64_t offset) const {
    for (std::size_t done = 0; done < size;) {
      const ssize_t count = pread(descriptor_, static_cast<char*>(data) + done, size - done, off_t(offset + done));
      if (count <= 0) return false;
      done += std::size_t(count);
    }
    return true;
  }

 private:
  int descriptor_;
};

/// The description of an entry, and where its payload begins. Nothing for a file that is not whole.
std::optional<std::pair<Description, std::uint64_t>> describe(const File& file) {
  std::array<char, 4096> start;  // holds most descriptions: one read is enough
  const std::uint64_t size = file.size();
  const std::size_t at_hand = std::size_t(std::min<std::uint64_t>(size, start.size()));
  Preamble preamble;
  if (at_hand < sizeof preamble || !file.read(start.data(), at_hand, 0)) return std::nullopt;
  std::memcpy(&preamble, start.data(), sizeof preamble);
  if (preamble.magic != Preamble{}.magic || preamble.size > size - sizeof preamble) return std::nullopt;
  std::string longer;
  const char* text = start.data() + sizeof preamble;
  if (sizeof preamble + preamble.size > at_hand) {
    longer.resize(preamble.size);
    if (!file.read(longer.data(), longer.size(), sizeof preamble)) return std::nullopt;
    text = longer.data();
  }
  if (hash_of_bytes(text, preamble.size) != preamble.digest) return std::nullopt;
  Description description = Unpacker({text, std::size_t(preamble.size)}).get<Description>();
  const std::uint64_t begin = sizeof preamble + preamble.size;
  if (begin + description.payload != size) return std::nullopt;
  return std::pair(std::move(description), begin);
}

/// Reads a value from its entry's file when it is first needed.
class StoredSource : public Source {
 public:
  StoredSource(fs::path file, std::uint64_t offset, std::uint64_t size, const Digest& key) : file_(std::move(file)), offset_(offset), size_(size), key_(key) {}

  std::shared_ptr<const void> data(const TypeInfo& type) override {
    const std::scoped_lock lock(mutex_);
    if (data_) return data_;
    if (!type.content) throw Error("values of type '" + type.id + "' cannot be read back without the plugin that knows them");
    const File file(file_);
    const std::uint64_t page = std::uint64_t(sysconf(_SC_PAGESIZE)), begin = offset_ / page * page;
    if (!file.is_open() || file.size() < offset_ + size_) throw DamagedEntry("the stored result " + file_.string() + " is gone");
    void* mapped = mmap(nullptr, std::size_t(offset_ + size_ - begin), PROT_READ, MAP_PRIVATE, file.descriptor(), off_t(begin));
    if (mapped == MAP_FAILED) throw DamagedEntry("the stored result " + file_.string() + " cannot be read");
    const std::unique_ptr<void, std::function<void(void*)>> unmap(mapped, [&](void* at) { munmap(at, std::size_t(offset_ + size_ - begin)); });
    const std::string_view packed(static_cast<const char*>(mapped) + (offset_ - begin), std::size_t(size_));
    if (hash_of_bytes(packed.data(), packed.size()) != key_) throw DamagedEntry("the stored result " + file_.string() + " is damaged");
    Unpacker unpacker(packed);
    data_ = type.content->unpack(unpacker);
    return data_;
  }

 private:
  fs::path file_;
  std::uint64_t offset_, size_;
  Digest key_;
  std::mutex mutex_;
  std::shared_ptr<const void> data_;
};

Value value_of(const Leaf& leaf, const fs::path& file, std::uint64_t begin) {
  Value value;
  value.type = {leaf.type, leaf.version, std::size_t(leaf.type_size), false, nullptr};
  value.key = leaf.key;
  value.axis = leaf.axis;
  value.names = leaf.names;
  for (const Leaf& item : leaf.items) value.items.push_back(value_of(item, file, begin));
  if (leaf.present) value.source = std::make_shared<StoredSource>(file, begin + leaf.offset, leaf.size, leaf.key);
  return value;
}

/// Describes a value and packs its data. Throws Error for what cannot be stored.
Leaf pack(const Value& value, std::vector<std::string>& payload, std::uint64_t& offset) {
  Leaf leaf{value.type.id, value.type.version, value.type.size, false, value.key, offset, 0, value.axis, value.names, {}};
  for (const Value& item : value.items) leaf.items.push_back(pack(item, payload, offset));
  if (value.is_list() || value.is_absent()) return leaf;
  if (!value.type.content) throw Error("functions are not stored");
  Packer packer;
  value.type.content->pack(value.data.get(), packer);
  leaf.present = true;
  leaf.size = packer.packed.size();
  offset += leaf.size;
  payload.push_back(std::move(packer.packed));
  return leaf;
}

void list_keys(const Leaf& leaf, std::vector<Digest>& keys) {
  if (leaf.present) keys.push_back(leaf.key);
  for (const Leaf& item : leaf.items) list_keys(item, keys);
}

std::uint64_t bytes_below(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return fs::file_size(path, error);
  std::uint64_t sum = 0;
  for (fs::recursive_directory_iterator at(path, error), end; !error && at != end; at.increment(error))
    if (at->is_regular_file(error)) sum += at->file_size(error);
  return sum;
}

bool is_temporary(const fs::path& file) { return file.filename().string().find(".tmp-") != std::string::npos; }

/// Whether the process that named a temporary file has ended.
bool is_abandoned(const fs::path& file) {
  const std::string name = file.filename().string();
  const pid_t process = pid_t(std::atol(name.c_str() + name.find(".tmp-") + 5));
  return process <= 0 || (kill(process, 0) != 0 && errno == ESRCH);
}

}  // namespace

Store::Store(fs::path folder) : folder_(std::move(folder)) {}

fs::path Store::default_folder() {
  if (const char* folder = std::getenv("MARROW_CACHE")) return folder;
  if (const char* folder = std::getenv("XDG_CACHE_HOME")) return fs::path(folder) / "marrow" / "results";
  const char* home = std::getenv("HOME");
  return fs::path(home ? home : "/tmp") / ".cache" / "marrow" / "results";
}

fs::path Store::file_of(const Digest& key) const {
  const std::string name = key.hex();
  return folder_ / name.substr(0, 2) / name;
}

std::optional<StoredResult> Store::find(const Digest& key) const {
  const fs::path path = file_of(key);
  const File file(path);
  if (!file.is_open()) return std::nullopt;
  try {
    if (const auto entry = describe(file)) {
      StoredResult result{entry->first.provenance, {}};
      for (const Leaf& leaf : entry->first.outputs) result.outputs.push_back(value_of(leaf, path, entry->second));
      futimens(file.descriptor(), nullptr);  // used just now
      return result;
    }
  } catch (const Error&) {  // an entry of another layout: as good as damaged
  }
  drop(key);
  return std::nullopt;
}

void Store::drop(const Digest& key) const {
  std::error_code ignored;
  fs::remove(file_of(key), ignored);
}

std::string Store::write_whole(const fs::path& file, const std::vector<std::string_view>& parts) const {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const fs::path temporary = file.string() + ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(written_++);
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0) return "cannot write " + temporary.string() + ": " + std::strerror(errno);
  std::string fault;
  for (std::string_view part : parts)
    while (!part.empty() && fault.empty()) {
      const ssize_t count = write(descriptor, part.data(), part.size());
      if (count < 0 && errno != EINTR) fault = "cannot write " + file.string() + ": " + std::strerror(errno);
      if (count > 0) part.remove_prefix(std::size_t(count));
    }
  if (close(descriptor) && fault.empty()) fault = "cannot write " + file.string() + ": " + std::strerror(errno);
  if (fault.empty() && std::rename(temporary.c_str(), file.c_str())) fault = "cannot rename " + temporary.string() + ": " + std::strerror(errno);
  if (!fault.empty()) unlink(temporary.c_str());
  return fault;
}

std::string Store::save(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) const {
  Description description{provenance, {}, 0};
  std::vector<std::string> payload;
  for (const Value& output : outputs) description.outputs.push_back(pack(output, payload, description.payload));
  Packer packed;
  packed.add(description);
  Preamble preamble;
  preamble.size = packed.packed.size();
  preamble.digest = hash_of_bytes(packed.packed.data(), packed.packed.size());
  std::vector<std::string_view> parts{{reinterpret_cast<const char*>(&preamble), sizeof preamble}, packed.packed};
  parts.insert(parts.end(), payload.begin(), payload.end());
  return write_whole(file_of(key), parts);
}

void Store::remember(const std::string& place, const Last& last) const {
  Packer packed;
  packed.add(last);
  const Digest check = hash_of_bytes(packed.packed.data(), packed.packed.size());
  write_whole(folder_ / "last" / hash_of(place).hex(), {{reinterpret_cast<const char*>(&check), sizeof check}, packed.packed});
}

std::optional<Store::Last> Store::last(const std::string& place) const {
  const File file(folder_ / "last" / hash_of(place).hex());
  Digest check;
  if (!file.is_open() || file.size() <= sizeof check) return std::nullopt;
  std::string text(std::size_t(file.size()) - sizeof check, '\0');
  if (!file.read(&check, sizeof check, 0) || !file.read(text.data(), text.size(), sizeof check)) return std::nullopt;
  if (hash_of_bytes(text.data(), text.size()) != check) return std::nullopt;
  try {
    return Unpacker(text).get<Last>();
  } catch (const Error&) {  // of another layout
    return std::nullopt;
  }
}

std::vector<Store::Entry> Store::entries() const {
  std::vector<Entry> entries;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    const auto key = digest_of_hex(at->path().filename().string());
    if (!key || !at->is_regular_file(error) || at->path().parent_path().filename() == "last") continue;
    const File file(at->path());
    if (!file.is_open()) continue;
    Entry entry{*key, file.size(), {}, {}, {}};
    std::error_code ignored;
    entry.used = fs::last_write_time(at->path(), ignored);
    try {
      if (const auto described = describe(file)) {
        entry.provenance = described->first.provenance;
        for (const Leaf& leaf : described->first.outputs) list_keys(leaf, entry.outputs);
      }
    } catch (const Error&) {  // listed all the same, so that it can be collected
    }
    entries.push_back(std::move(entry));
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
  return entries;
}

Store::Freed Store::collect(std::uint64_t keep_bytes) const {
  struct Kept {
    fs::path path;
    std::uint64_t bytes = 0;
    fs::file_time_type used;
  };
  std::vector<Kept> all;
  std::vector<fs::path> abandoned;
  std::error_code error, ignored;
  for (fs::recursive_directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    if (is_temporary(at->path())) {
      if (is_abandoned(at->path())) abandoned.push_back(at->path());
      if (at->is_directory(ignored)) at.disable_recursion_pending();
    } else if (digest_of_hex(at->path().filename().string()) && at->path().parent_path().filename() != "last") {
      all.push_back({at->path(), bytes_below(at->path()), fs::last_write_time(at->path(), ignored)});
      if (at->is_directory(ignored)) at.disable_recursion_pending();
    }
  }
  for (const fs::path& path : abandoned) fs::remove_all(path, ignored);
  std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) { return a.used < b.used; });
  std::uint64_t total = 0;
  for (const Kept& one : all) total += one.bytes;
  Freed freed;
  for (const Kept& one : all) {
    if (total <= keep_bytes) break;
    fs::remove_all(one.path, ignored);
    total -= one.bytes;
    freed.bytes += one.bytes;
    ++freed.entries;
  }
  return freed;
}

void Store::tidy() const {
  const fs::path mark = folder_ / "tidied";
  std::error_code error;
  const auto last = fs::last_write_time(mark, error);
  if (!error && fs::file_time_type::clock::now() - last < std::chrono::hours(24)) return;
  write_whole(mark, {"when the store was last brought back to its size\n"});
  const char* limit = std::getenv("MARROW_CACHE_GB");
  const double keep_gb = limit && *limit ? std::strtod(limit, nullptr) : 20;
  collect(std::uint64_t(std::max(0.0, keep_gb) * 1e9));
}

std::optional<Digest> digest_of_hex(const std::string& text) {
  Digest digest;
  const char* begin = text.data();
  if (text.size() != 32) return std::nullopt;
  const auto high = std::from_chars(begin, begin + 16, digest.high, 16), low = std::from_chars(begin + 16, begin + 32, digest.low, 16);
  if (high.ptr != begin + 16 || low.ptr != begin + 32) return std::nullopt;
  return digest;
}

}  // namespace marrow
