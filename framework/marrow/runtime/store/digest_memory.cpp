// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/digest_memory.hpp"

#include "marrow/runtime/store/store.hpp"
#include "marrow/runtime/store/store_file.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr off_t kLarge_bytes = 4 << 20;  // reading a smaller file takes about as long as reading its record

/// A record. It holds the state too, so that a file that was renamed to another record's name is noticed.
struct KeptDigest {
  Digest state, digest;
  using fields = Fields<&KeptDigest::state, &KeptDigest::digest>;
};

std::mutex memory_mutex;
std::shared_ptr<const Store> memory_store;

std::optional<Digest> kept_digest(const fs::path& record, const Digest& state) {
  const auto text = read_checked(record, 1024);
  if (!text) return std::nullopt;
  try {
    const auto kept = Unpacker(*text).get<KeptDigest>();
    if (kept.state == state) return kept.digest;
  } catch (const Error&) {  // of another layout
  }
  return std::nullopt;
}

}  // namespace

void keep_digests_in(const fs::path& store) {
  const std::scoped_lock lock(memory_mutex);
  if (!memory_store || memory_store->folder() != store) memory_store = std::make_shared<const Store>(store);
}

Digest digest_in_state(const fs::path& file, const FileState& state, const std::function<Digest()>& make) {
  std::shared_ptr<const Store> store;
  {
    const std::scoped_lock lock(memory_mutex);
    store = memory_store;
  }
  if (!store || state.size < kLarge_bytes || !store->prepare().empty()) return make();
  Hasher hasher;
  state.add_to(hasher);
  const Digest key = hasher.digest();
  const fs::path record = store->folder() / "digests" / key.hex();
  if (const auto kept = kept_digest(record, key)) return *kept;
  const Store::Claim claim = store->claim(key, nullptr);
  if (const auto kept = kept_digest(record, key)) return *kept;
  const Digest digest = make();
  Packer packed;
  packed.add(KeptDigest{key, digest});
  if (state_of(file) == state) write_checked(record, packed.packed);
  return digest;
}

KnownKeys& KnownKeys::all() {
  static KnownKeys keys;
  return keys;
}

Digest KnownKeys::key_of(const Value& item) {
  {
    const std::scoped_lock lock(mutex_);
    const auto known = entries_.find(item.data.get());
    if (known != entries_.end() && known->second.type == item.type.id && !known->second.data.expired())
      return known->second.key;
  }
  const Digest key = item.type.content->hash(item.data.get());  // without the lock: it may take long
  const std::scoped_lock lock(mutex_);
  if (entries_.size() >= look_again_at_) forget_dead();
  entries_.insert_or_assign(item.data.get(), Entry{item.data, item.type.id, key});
  return key;
}

void KnownKeys::forget_dead() {
  std::erase_if(entries_, [](const auto& entry) { return entry.second.data.expired(); });
  look_again_at_ = std::max(look_again_at_, 2 * entries_.size());
}

}  // namespace marrow
