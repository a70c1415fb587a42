// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/packed_values.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>

#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

constexpr int kMostNested = 8;

constexpr std::size_t kLarge = std::size_t(1) << 20;

/// The end of the file. It says where the description is.
struct Trailer {
  std::uint64_t magic = 0x32766f7272616d00;
  std::uint64_t begin = 0, size = 0;
};

/// A large piece of a value, in the memory of the process that made it.
struct Piece {
  std::uint64_t place = 0;  ///< offset in the value's packed data
  std::uint64_t address = 0, size = 0;
  using fields = Fields<&Piece::place, &Piece::address, &Piece::size>;
};

/// Gathers small pieces. Larger ones are written to the file directly, or only their addresses are noted.
class FilePacker : public Archive {
 public:
  FilePacker(int descriptor, bool in_place) : descriptor_(descriptor), in_place_(in_place) {
    gathered_.reserve(kGathered);
  }

  void bytes(const void* data, std::size_t size) override {
    packed_ += size;
    if (in_place_ && size >= kLarge) {
      pieces_.push_back({packed_ - size, reinterpret_cast<std::uintptr_t>(data), size});
      return;
    }
    if (gathered_.size() + size > kGathered) flush();
    if (size >= kGathered)
      put({static_cast<const char*>(data), size});
    else
      gathered_.append(static_cast<const char*>(data), size);
    written_ += size;
  }
  void flush() {
    put(gathered_);
    gathered_.clear();
  }
  /// Bytes for the file so far, including gathered ones.
  std::uint64_t written() const { return written_; }
  /// Begins a value. After that, packed() is the number of its bytes, and pieces() are those that stayed in place.
  void begin() {
    packed_ = 0;
    pieces_.clear();
  }
  std::uint64_t packed() const { return packed_; }
  const std::vector<Piece>& pieces() const { return pieces_; }

 private:
  static constexpr std::size_t kGathered = std::size_t(1) << 16;

  void put(std::string_view bytes) {
    if (!write_all(descriptor_, bytes))
      throw Error(std::string("cannot hand values to another process: ") + std::strerror(errno));
  }

  int descriptor_;
  bool in_place_;
  std::string gathered_;
  std::uint64_t written_ = 0, packed_ = 0;
  std::vector<Piece> pieces_;
};

/// Reads the packed data of one value, from the file and from pieces in the memory of the other process.
class PieceUnpacker : public Unpacker {
 public:
  PieceUnpacker(std::string_view in_file, std::vector<Piece> pieces, std::uint64_t size, pid_t process)
      : Unpacker(std::size_t(size)), in_file_(in_file), pieces_(std::move(pieces)), process_(process) {}

 private:
  void take(void* data, std::size_t size) override {
    char* to = static_cast<char*>(data);
    while (size > 0) {
      const bool has_piece = next_ < pieces_.size();
      const std::uint64_t until_piece = has_piece ? pieces_[next_].place - at_ : size;
      if (until_piece > 0) {
        const std::size_t count = std::size_t(std::min<std::uint64_t>(size, until_piece));
        if (count > in_file_.size()) throw Error("what the other process handed over is damaged");
        std::memcpy(to, in_file_.data(), count);
        in_file_.remove_prefix(count);
        advance(to, size, count);
        continue;
      }
      Piece& piece = pieces_[next_];
      const std::size_t count = std::size_t(std::min<std::uint64_t>(size, piece.size));
      copy_from_process(to, piece.address, count);
      piece.place += count;
      piece.address += count;
      piece.size -= count;
      if (piece.size == 0) ++next_;
      advance(to, size, count);
    }
  }
  void advance(char*& to, std::size_t& size, std::size_t count) {
    to += count;
    size -= count;
    at_ += count;
  }
  void copy_from_process(char* to, std::uint64_t address, std::size_t size) const {
    while (size > 0) {
      iovec here{to, size}, there{reinterpret_cast<void*>(std::uintptr_t(address)), size};
      const ssize_t count = process_vm_readv(process_, &here, 1, &there, 1, 0);
      if (count <= 0)
        throw NoAccess(std::string("the memory of another process cannot be read: ") + std::strerror(errno));
      to += count;
      address += std::uint64_t(count);
      size -= std::size_t(count);
    }
  }

  std::string_view in_file_;
  std::vector<Piece> pieces_;
  pid_t process_;
  std::size_t next_ = 0;
  std::uint64_t at_ = 0;
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
  data.begin();
  value.type.content->pack(value.data.get(), data);
  description.add(begin);
  description.add(data.written() - begin);
  description.add(data.packed());
  description.add(data.pieces());
}

class PackedReader {
 public:
  PackedReader(std::string_view bytes, pid_t process, const ContentOf& content_of)
      : bytes_(bytes), process_(process), content_of_(content_of) {}

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
    if (depth > kMostNested) fail();
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
    const std::string_view in_file = part(begin, description.get<std::uint64_t>());
    const auto size = description.get<std::uint64_t>();
    auto pieces = description.get<std::vector<Piece>>();
    check_pieces(pieces, in_file.size(), size);
    PieceUnpacker packed(in_file, std::move(pieces), size, process_);
    value.data = value.type.content->unpack(packed);
    if (packed.remaining()) fail();
    return value;
  }

  /// Checks that the pieces follow each other, and that together with the bytes in the file they are the whole value.
  static void check_pieces(const std::vector<Piece>& pieces, std::uint64_t in_file, std::uint64_t size) {
    std::uint64_t end = 0, left = size;
    for (const Piece& piece : pieces) {
      if (piece.place < end || piece.place > size || piece.size > size - piece.place || piece.size == 0) fail();
      end = piece.place + piece.size;
      left -= piece.size;
    }
    if (left != in_file) fail();
  }

  std::string_view bytes_;
  pid_t process_;
  const ContentOf& content_of_;
};

/// Copies the whole file to our own memory, because the other process may still write to the file.
std::string contents_of(int descriptor) {
  std::string bytes(std::size_t(bytes_in(descriptor)), '\0');
  if (read_at(descriptor, bytes.data(), bytes.size(), 0) != std::int64_t(bytes.size()))
    throw Error("another process handed over nothing");
  return bytes;
}

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

SharedMemory::SharedMemory() : descriptor_(memfd_create("marrow", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (!descriptor_.is_open()) throw Error(std::string("cannot make memory to share: ") + std::strerror(errno));
}

void SharedMemory::seal() const {
  if (fcntl(descriptor_, F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw Error(std::string("cannot protect memory that is shared: ") + std::strerror(errno));
}

void write_values(int descriptor, const std::vector<Value>& values, bool in_place) {
  FilePacker data(descriptor, in_place);
  Packer description;
  description.add(std::uint64_t(values.size()));
  for (const Value& value : values) describe(value, data, description);
  Trailer trailer;
  trailer.begin = data.written();
  trailer.size = description.packed.size();
  FilePacker end(descriptor, false);
  data.flush();
  end.bytes(description.packed.data(), description.packed.size());
  end.bytes(&trailer, sizeof trailer);
  end.flush();
}

std::uint64_t bytes_in(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) ? 0 : std::uint64_t(status.st_size);
}

std::vector<Value> read_values(int descriptor, pid_t process, const ContentOf& content_of) {
  const std::string bytes = contents_of(descriptor);
  return PackedReader(bytes, process, content_of).values();
}

const Content* content_of_own(const TypeInfo& type) {
#define MARROW_INFO(Type, id, version) TypeInfo::of<Type>(),
  static const std::vector<TypeInfo> kOwn{MARROW_OWN_TYPES(MARROW_INFO)};
#undef MARROW_INFO
  const auto found = std::find(kOwn.begin(), kOwn.end(), type);
  return found == kOwn.end() ? nullptr : found->content;
}

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
