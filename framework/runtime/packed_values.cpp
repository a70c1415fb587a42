// SPDX-License-Identifier: Apache-2.0
#include "packed_values.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/types.hpp"

namespace marrow {
namespace {

constexpr int kMostAxes = 8;

/// At the end of the file: where the description is.
struct Trailer {
  std::uint64_t magic = 0x31766f727261'6d00;
  std::uint64_t begin = 0, size = 0;
};

/// Gathers small pieces; large ones go straight to the file.
class FilePacker : public Archive {
 public:
  explicit FilePacker(int descriptor) : descriptor_(descriptor) { gathered_.reserve(kGathered); }

  void bytes(const void* data, std::size_t size) override {
    if (gathered_.size() + size > kGathered) flush();
    if (size >= kGathered) put(static_cast<const char*>(data), size);
    else gathered_.append(static_cast<const char*>(data), size);
    written_ += size;
  }
  void flush() {
    put(gathered_.data(), gathered_.size());
    gathered_.clear();
  }
  std::uint64_t written() const { return written_; }

 private:
  static constexpr std::size_t kGathered = std::size_t(1) << 16;

  void put(const char* data, std::size_t size) {
    while (size > 0) {
      const ssize_t count = write(descriptor_, data, std::min(size, std::size_t(1) << 30));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) throw Error(std::string("cannot hand values to another process: ") + std::strerror(errno));
      data += count;
      size -= std::size_t(count);
    }
  }

  int descriptor_;
  std::string gathered_;
  std::uint64_t written_ = 0;
};

void describe(const Value& value, FilePacker& data, Packer& description) {
  description.add(value.type.id);
  description.add(std::int32_t(value.type.version));
  description.add(std::uint64_t(value.type.size));
  description.add(value.axis);
  description.add(value.names);
  description.add(std::uint64_t(value.items.size()));
  for (const Value& item : value.items) describe(item, data, description);
  const bool is_present = !value.is_list() && !value.is_absent();
  description.add(std::uint8_t(is_present));
  if (!is_present) return;
  if (!value.type.content) throw Error("functions cannot be handed to another process");
  const std::uint64_t begin = data.written();
  value.type.content->pack(value.data.get(), data);
  description.add(begin);
  description.add(data.written() - begin);
}

class Reader {
 public:
  Reader(std::string_view bytes, const ContentOf& content_of) : bytes_(bytes), content_of_(content_of) {}

  std::vector<Value> values() {
    Trailer trailer;
    if (bytes_.size() < sizeof trailer) fail();
    std::memcpy(&trailer, bytes_.data() + bytes_.size() - sizeof trailer, sizeof trailer);
    if (trailer.magic != Trailer{}.magic) fail();
    Unpacker description(part(trailer.begin, trailer.size));
    std::vector<Value> values;
    for (auto left = description.get<std::uint64_t>(); left > 0; --left) values.push_back(value(description, 0));
    return values;
  }

 private:
  [[noreturn]] static void fail() { throw Error("what the other process handed over is damaged"); }

  std::string_view part(std::uint64_t begin, std::uint64_t size) const {
    if (begin > bytes_.size() || size > bytes_.size() - begin) fail();
    return bytes_.substr(std::size_t(begin), std::size_t(size));
  }

  Value value(Unpacker& description, int depth) {
    if (depth > kMostAxes) fail();
    Value value;
    value.type.id = description.get<std::string>();
    value.type.version = description.get<std::int32_t>();
    value.type.size = std::size_t(description.get<std::uint64_t>());
    value.axis = description.get<std::string>();
    value.names = description.get<std::vector<std::string>>();
    if (description.get<std::uint64_t>() != value.names.size()) fail();
    for (std::size_t i = 0; i < value.names.size(); ++i) value.items.push_back(this->value(description, depth + 1));
    if (!description.get<std::uint8_t>()) return value;
    if (value.is_list()) fail();
    value.type.content = content_of_(value.type);
    if (!value.type.content) throw Error("values of type '" + value.type.id + "' are not known here");
    const auto begin = description.get<std::uint64_t>();
    Unpacker packed(part(begin, description.get<std::uint64_t>()));
    value.data = value.type.content->unpack(packed);
    if (packed.remaining()) fail();
    return value;
  }

  std::string_view bytes_;
  const ContentOf& content_of_;
};

}  // namespace

SharedMemory::SharedMemory() : descriptor_(memfd_create("marrow", MFD_CLOEXEC)) {
  if (descriptor_ < 0) throw Error(std::string("cannot make memory to share: ") + std::strerror(errno));
}

SharedMemory::~SharedMemory() { close(descriptor_); }

void write_values(int descriptor, const std::vector<Value>& values) {
  FilePacker data(descriptor);
  Packer description;
  description.add(std::uint64_t(values.size()));
  for (const Value& value : values) describe(value, data, description);
  Trailer trailer;
  trailer.begin = data.written();
  trailer.size = description.packed.size();
  data.bytes(description.packed.data(), description.packed.size());
  data.bytes(&trailer, sizeof trailer);
  data.flush();
}

std::uint64_t bytes_in(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) ? 0 : std::uint64_t(status.st_size);
}

std::vector<Value> read_values(int descriptor, const ContentOf& content_of) {
  const std::size_t size = std::size_t(bytes_in(descriptor));
  void* mapped = size ? mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor, 0) : MAP_FAILED;
  if (mapped == MAP_FAILED) throw Error("another process handed nothing over");
  const std::unique_ptr<void, std::function<void(void*)>> unmap(mapped, [&](void* at) { munmap(at, size); });
  return Reader({static_cast<const char*>(mapped), size}, content_of).values();
}

const Content* content_of_own(const TypeInfo& type) {
  static const std::vector<TypeInfo> kOwn{
      TypeInfo::of<Image>(),   TypeInfo::of<Picture>(), TypeInfo::of<Volume>(),     TypeInfo::of<SignedField>(),
      TypeInfo::of<Seeds>(),   TypeInfo::of<Mesh>(),    TypeInfo::of<Camera>(),     TypeInfo::of<View>(),
      TypeInfo::of<EdgeMap>(), TypeInfo::of<ShaftLines>(), TypeInfo::of<Landmarks>(), TypeInfo::of<Pose>(),
      TypeInfo::of<Truth>(),   TypeInfo::of<Metrics>(), TypeInfo::of<Scene>(),      TypeInfo::of<Landscape>(),
      TypeInfo::of<Case>()};
  const auto found = std::find(kOwn.begin(), kOwn.end(), type);
  return found == kOwn.end() ? nullptr : found->content;
}

}  // namespace marrow
