// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store_entry.hpp"

#include <mutex>
#include <new>

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// The beginning of each file: what it is, and the length and the hash of the description that follows. The last digit
/// of `magic` is raised with every change of the layout.
struct Preamble {
  std::array<char, 8> magic{'m', 'a', 'r', 'r', 'o', 'w', 'r', '2'};
  std::uint64_t size = 0;
  Digest digest;
};
static_assert(sizeof(Preamble) == 32);

constexpr std::uint64_t kMostDescription = 64 << 20;  // bytes
constexpr int kMostAxes = 16;
constexpr int kMostReadings = 3;  // to read a value

const char* const kDamaged = "the entry is not whole";

/// Passes the bytes on and hashes them.
class HashingArchive : public Archive {
 public:
  explicit HashingArchive(Archive& out) : out_(out) {}
  void bytes(const void* data, std::size_t size) override {
    hasher.bytes(data, size);
    out_.bytes(data, size);
  }
  Hasher hasher;

 private:
  Archive& out_;
};

void add_leaf(const Value& value, EntryDescription& description, int depth) {
  if (depth > kMostAxes || value.names.size() != value.items.size())
    throw Error("lists within that many lists are not kept");
  Leaf leaf{value.type.id, value.type.version, value.type.size, false, value.key, description.payload, 0,
            value.axis,    value.names};
  if (!value.is_list() && !value.is_absent()) {
    if (!value.type.content) throw Error("functions are not kept");
    if (!value.data) throw Error("a result that was not made is not kept");
    ByteCounter counter;
    value.type.content->pack(value.data.get(), counter);
    leaf.present = true;
    leaf.size = counter.count;
    description.payload += leaf.size;
  }
  description.leaves.push_back(std::move(leaf));
  for (const Value& item : value.items) add_leaf(item, description, depth + 1);
}

void write_values(Archive& out, const Value& value) {
  if (value.data) value.type.content->pack(value.data.get(), out);
  for (const Value& item : value.items) write_values(out, item);
}

/// Reads a value from its entry's file when it is first needed.
class StoredSource : public Source {
 public:
  StoredSource(fs::path file, std::uint64_t offset, const Leaf& leaf)
      : file_(std::move(file)),
        offset_(offset),
        size_(leaf.size),
        key_(leaf.key),
        type_{leaf.type, leaf.version, std::size_t(leaf.type_size), false, nullptr} {}

  std::shared_ptr<const void> data(const TypeInfo& type) override {
    const std::scoped_lock lock(mutex_);
    if (!data_) data_ = read(type);
    return data_;
  }

 private:
  std::shared_ptr<const void> read(const TypeInfo& type) const {
    if (!type.content)
      throw Error("values of type '" + type.id + "' cannot be read back without the plugin that knows them");
    const std::string name = "the stored result " + file_.string();
    if (type != type_) throw DamagedEntry(name + " is of another type or version than '" + type.id + "'");
    // In a shared folder, the file may be replaced by the same result while it is read.
    for (int tries = 1; tries < kMostReadings; ++tries) try {
        return read_once(type, name);
      } catch (const DamagedEntry&) {
        std::error_code error;
        if (!fs::exists(file_, error)) throw;
      }
    return read_once(type, name);
  }

  std::shared_ptr<const void> read_once(const TypeInfo& type, const std::string& name) const {
    const StoreFile file(file_);
    if (!file.is_open() || offset_ > file.size() || size_ > file.size() - offset_)
      throw DamagedEntry(name + " is gone");
    try {
      FileUnpacker unpacker(file, offset_, size_);
      auto data = type.content->unpack(unpacker);
      if (unpacker.remaining() == 0 && unpacker.digest() == key_) return data;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {  // the bytes are not a value of this type
    }
    throw DamagedEntry(name + " is damaged");
  }

  fs::path file_;
  std::uint64_t offset_, size_;
  Digest key_;
  TypeInfo type_;
  std::mutex mutex_;
  std::shared_ptr<const void> data_;
};

/// The value that begins at leaf `next`. Moves `next` to the first leaf after it.
Value value_at(const ReadEntry& entry, const fs::path& file, std::size_t& next, int depth) {
  if (next >= entry.description.leaves.size() || depth > kMostAxes) throw Error(kDamaged);
  const Leaf& leaf = entry.description.leaves[next++];
  if (!is_within(leaf, entry)) throw Error(kDamaged);
  Value value;
  value.type = {leaf.type, leaf.version, std::size_t(leaf.type_size), false, nullptr};
  value.key = leaf.key;
  value.axis = leaf.axis;
  value.names = leaf.names;
  if (value.is_list() ? leaf.present : !leaf.names.empty()) throw Error(kDamaged);
  for (std::size_t i = 0; i < leaf.names.size(); ++i) value.items.push_back(value_at(entry, file, next, depth + 1));
  if (leaf.present) value.source = std::make_shared<StoredSource>(file, entry.begin + leaf.offset, leaf);
  return value;
}

}  // namespace

EntryDescription describe_entry(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance) {
  EntryDescription description{key, provenance, {}, 0};
  for (const Value& output : outputs) add_leaf(output, description, 0);
  return description;
}

void write_description(Archive& out, const EntryDescription& description) {
  Packer packed;
  packed.add(description);
  if (packed.packed.size() > kMostDescription) throw Error("a list of that many items is not kept");
  Preamble preamble;
  preamble.size = packed.packed.size();
  preamble.digest = hash_of_bytes(packed.packed.data(), packed.packed.size());
  out.bytes(&preamble, sizeof preamble);
  out.bytes(packed.packed.data(), packed.packed.size());
}

void write_entry(Archive& out, const EntryDescription& description, const std::vector<Value>& outputs) {
  write_description(out, description);
  ByteCounter payload(&out);
  for (const Value& output : outputs) write_values(payload, output);
  if (payload.count != description.payload) throw Error("the result was changed while it was kept");
}

ReadEntry read_entry(const StoreFile& file, const Digest& key) {
  std::array<char, 4096> start;  // holds most descriptions: one read is enough
  const std::size_t at_hand = std::size_t(std::min<std::uint64_t>(file.size(), start.size()));
  Preamble preamble;
  if (at_hand < sizeof preamble || !file.read(start.data(), at_hand, 0)) throw Error(kDamaged);
  std::memcpy(&preamble, start.data(), sizeof preamble);
  if (preamble.magic != Preamble{}.magic || preamble.size > std::min(file.size() - sizeof preamble, kMostDescription))
    throw Error(kDamaged);
  std::string longer;
  std::string_view text(start.data() + sizeof preamble,
                        std::min(std::size_t(preamble.size), at_hand - sizeof preamble));
  if (text.size() < preamble.size) {
    longer.resize(std::size_t(preamble.size));
    if (!file.read(longer.data(), longer.size(), sizeof preamble)) throw Error(kDamaged);
    text = longer;
  }
  if (hash_of_bytes(text.data(), text.size()) != preamble.digest) throw Error(kDamaged);
  Unpacker unpacker(text);
  ReadEntry entry{unpacker.get<EntryDescription>(), sizeof preamble + preamble.size};
  if (unpacker.remaining() || entry.description.key != key || entry.description.payload != file.size() - entry.begin)
    throw Error(kDamaged);
  return entry;
}

bool copy_bytes(const StoreFile& file, std::uint64_t offset, std::uint64_t size, Archive& to) {
  constexpr std::uint64_t kPiece = 1 << 20;
  std::vector<char> piece(std::size_t(std::min(size, kPiece)));
  for (std::uint64_t done = 0; done < size;) {
    const std::size_t count = std::size_t(std::min(size - done, kPiece));
    if (!file.read(piece.data(), count, offset + done)) return false;
    to.bytes(piece.data(), count);
    done += count;
  }
  return true;
}

bool is_within(const Leaf& leaf, const ReadEntry& entry) {
  const std::uint64_t payload = entry.description.payload;
  return leaf.offset <= payload && leaf.size <= payload - leaf.offset;
}

bool copy_leaf(const StoreFile& file, const ReadEntry& entry, const Leaf& leaf, Archive& to) {
  HashingArchive hashed(to);
  return is_within(leaf, entry) && copy_bytes(file, entry.begin + leaf.offset, leaf.size, hashed) &&
         hashed.hasher.digest() == leaf.key;
}

bool copy_entry(const StoreFile& file, const ReadEntry& entry, Archive& to) {
  write_description(to, entry.description);
  std::uint64_t next = 0;
  for (const Leaf& leaf : entry.description.leaves) {
    if (!leaf.present) continue;
    if (leaf.offset != next || !copy_leaf(file, entry, leaf, to)) return false;
    next += leaf.size;
  }
  return next == entry.description.payload;
}

std::vector<Value> outputs_of(const ReadEntry& entry, const fs::path& file) {
  std::vector<Value> outputs;
  for (std::size_t next = 0; next < entry.description.leaves.size();) outputs.push_back(value_at(entry, file, next, 0));
  return outputs;
}

}  // namespace marrow
