// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/shared_inputs.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

constexpr std::uint64_t kMostShared_bytes = std::uint64_t(4) << 30;

/// Packs into an open file.
class MemoryPacker : public Archive {
 public:
  explicit MemoryPacker(int descriptor) : descriptor_(descriptor) {}
  void bytes(const void* data, std::size_t size) override {
    if (!write_all(descriptor_, {static_cast<const char*>(data), size}))
      throw Error(std::string("cannot share an input with Python: ") + std::strerror(errno));
    written_ += size;
  }
  std::uint64_t written() const { return written_; }

 private:
  int descriptor_;
  std::uint64_t written_ = 0;
};

template <class T>
void pack_samples(const Value& item, std::vector<float> T::*samples, MemoryPacker& packer, SharedInput& made) {
  const T& whole = item.as<T>();
  packer.bytes((whole.*samples).data(), (whole.*samples).size() * sizeof(float));
  made.samples_bytes = packer.written();
  T rest;
  rest.grid = whole.grid;
  packer.add(rest);
}

std::shared_ptr<SharedInput> packed(const Value& item) {
  auto made = std::make_shared<SharedInput>();
  MemoryPacker packer(made->memory.descriptor());
  if (item.type == TypeInfo::of<Volume>()) {
    pack_samples(item, &Volume::values, packer, *made);
  } else if (item.type == TypeInfo::of<SignedField>()) {
    pack_samples(item, &SignedField::values_mm, packer, *made);
  } else {
    Packer whole;
    content_of_own(item.type)->pack(item.data.get(), whole);  // the type may come from a manifest, without content
    packer.bytes(whole.packed.data(), whole.packed.size());
  }
  made->memory.seal();
  made->bytes = packer.written();
  return made;
}

}  // namespace

SharedInputs& SharedInputs::all() {
  static SharedInputs inputs(kMostShared_bytes);
  return inputs;
}

std::shared_ptr<const SharedInput> SharedInputs::share(const Value& item) {
  const std::scoped_lock lock(mutex_);
  forget_dead();
  const auto known = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.address == item.data.get() && entry.type == item.type.id;
  });
  if (known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
    return known->packed;
  }
  const std::shared_ptr<SharedInput> made = packed(item);
  made->number = ++last_number_;
  entries_.push_front({item.data, item.data.get(), item.type.id, made});
  forget_oldest();
  return made;
}

std::vector<std::uint64_t> SharedInputs::numbers() const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::uint64_t> numbers;
  for (const Entry& entry : entries_) numbers.push_back(entry.packed->number);
  return numbers;
}

void SharedInputs::forget_dead() {
  entries_.remove_if([](const Entry& entry) { return entry.data.expired(); });
}

void SharedInputs::forget_oldest() {
  std::uint64_t bytes = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    bytes += entry->packed->bytes;
    entry = bytes > most_bytes_ && entry != entries_.begin() ? entries_.erase(entry) : std::next(entry);
  }
}

}  // namespace marrow
