// SPDX-License-Identifier: Apache-2.0
#include "mapped.hpp"

#include <map>
#include <mutex>

namespace marrow::python {
namespace {

struct Mapped {
  std::mutex mutex;
  std::map<const void*, const float*> samples;
};

Mapped& mapped() {
  static auto* const all = new Mapped;  // outlives every Python object
  return *all;
}

}  // namespace

void note_mapped_samples(const void* item, const float* samples) {
  const std::scoped_lock lock(mapped().mutex);
  mapped().samples[item] = samples;
}

void forget_mapped_samples(const void* item) {
  const std::scoped_lock lock(mapped().mutex);
  mapped().samples.erase(item);
}

const float* samples_of_item(const void* item, const std::vector<float>& own) {
  if (!own.empty()) return own.data();
  const std::scoped_lock lock(mapped().mutex);
  const auto found = mapped().samples.find(item);
  return found == mapped().samples.end() ? own.data() : found->second;
}

bool is_mapped(const void* item) {
  const std::scoped_lock lock(mapped().mutex);
  return mapped().samples.contains(item);
}

}  // namespace marrow::python
