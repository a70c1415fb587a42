// SPDX-License-Identifier: Apache-2.0
// Messages of a faulty worker: lines of its protocol, and values in shared memory. (Compiled without access control,
// because a private function reads a worker's lines.)
#include "marrow/runtime/process/worker.hpp"

#include <unistd.h>

#include "marrow/base/json_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/process/packed_values.hpp"
#include "target.hpp"

namespace {

using namespace marrow;

constexpr int kMostLines = 8;  // more would only make an input slower

/// A worker at job 7. Its process has ended already.
void understand(std::string_view text) {
  static Worker worker({{"/bin/true"}});
  for (int i = 0; i < kMostLines && !text.empty(); ++i) {
    const std::string line(text.substr(0, text.find('\n')));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    worker.close();
    worker.job_ = 7;
    worker.is_busy_ = true;
    const auto end = worker.understand(line, [](const nlohmann::json&) {});
    if (end && !end->failed.empty() && !end->answer.is_null())
      fuzz::finding("a job that failed has an answer: " + line);
  }
}

const Content* content_by_name(const TypeInfo& type) {
  for (const TypeInfo& known :
       {TypeInfo::of<Image>(), TypeInfo::of<Volume>(), TypeInfo::of<View>(), TypeInfo::of<Mesh>(), TypeInfo::of<Pose>(),
        TypeInfo::of<Landmarks>(), TypeInfo::of<Case>()})
    if (known.id == type.id) return known.content;
  return nullptr;
}

void read_memory(std::string_view bytes) {
  static const SharedMemory memory;
  if (ftruncate(memory.descriptor(), off_t(bytes.size())) != 0 ||
      pwrite(memory.descriptor(), bytes.data(), bytes.size(), 0) != ssize_t(bytes.size()))
    throw std::runtime_error("cannot write to shared memory");
  read_values(memory.descriptor(), getpid(), content_by_name);
}

void expect_same_text(std::string_view bytes) {
  const std::string text(bytes);
  if (bytes_of_json(parse_json(json_of_bytes(text).dump(), "")) != text) fuzz::finding("a text comes back as another");
  bytes_of_json(parse_json(text, ""));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const char way = input.choice("lmt");
  fuzz::expect_value_or_error([&] {
    if (way == 'l') understand(input.rest);
    if (way == 'm') read_memory(input.rest);
    if (way == 't') expect_same_text(input.rest);
  });
  return 0;
}
