// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/known_keys.hpp"

#include <algorithm>

namespace marrow {

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
