// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/regular_file.hpp"

#include <fcntl.h>

#include <elf.h>
#include <linux/magic.h>
#include <sys/vfs.h>
#include <bit>
#include <cerrno>
#include <memory>
#include <mutex>

#include "marrow/base/number_text.hpp"
#include "marrow/base/stopwatch.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Small enough to stay in the cache of a core between reading and hashing.
constexpr std::size_t kBlock_bytes = 256 << 10;

void expect_regular(const struct stat& status) {
  const char* kind = "neither a file nor a folder";
  if (S_ISREG(status.st_mode)) return;
  if (S_ISDIR(status.st_mode)) kind = "a folder";
  if (S_ISFIFO(status.st_mode)) kind = "a named pipe";
  if (S_ISSOCK(status.st_mode)) kind = "a socket";
  if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode)) kind = "a device";
  throw Error(std::string("is ") + kind + ", not a regular file");
}

Error unreadable() { return Error(std::string("cannot be read: ") + std::strerror(errno)); }

Error changed() { return Error("was changed while it was read; try again when nothing writes to it"); }

bool same(const timespec& a, const timespec& b) { return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec; }

constexpr time_t kResolution_s = 2, kOtherClocks_s = 600;

/// Whether a file system is on a disk of this host. Its times then come from this host's clock.
bool is_local(long kind) {
  constexpr std::array<long, 6> kLocal{EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC,       BTRFS_SUPER_MAGIC,
                                       F2FS_SUPER_MAGIC, OVERLAYFS_SUPER_MAGIC, 0x2fc12fc1 /* ZFS */};
  return std::find(kLocal.begin(), kLocal.end(), kind) != kLocal.end();
}

/// Whether this process has seen the file in this state for longer than the resolution of its time, by its own clock.
bool was_seen(const std::filesystem::path& file, const FileState& state) {
  struct Seen {
    FileState state;
    Clock::time_point since;
  };
  static std::mutex mutex;
  static std::map<std::filesystem::path, Seen> seen;
  const std::scoped_lock lock(mutex);
  const auto [known, is_new] = seen.try_emplace(file, Seen{state, Clock::now()});
  if (!is_new && !(known->second.state == state)) known->second = {state, Clock::now()};
  return seconds_since(known->second.since) > kResolution_s;
}

#if defined(__x86_64__)
constexpr int kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr int kMachine = EM_AARCH64;
#else
constexpr int kMachine = EM_NONE;  // not known: the dynamic loader decides
#endif

std::string machine_name(int machine) {
  switch (machine) {
    case EM_X86_64:
      return "x86-64";
    case EM_AARCH64:
      return "arm64";
    case EM_386:
      return "32 bit x86";
    case EM_ARM:
      return "32 bit arm";
    case EM_RISCV:
      return "RISC-V";
    case EM_PPC64:
      return "64 bit PowerPC";
    default:
      return formatted("ELF machine {}", machine);
  }
}

/// Checks that `bytes` bytes from `offset` on are inside the file. The sum of both is not computed, because it may
/// overflow.
void expect_inside(const RegularFile& file, std::uint64_t offset, std::uint64_t bytes) {
  if (offset <= file.size() && bytes <= file.size() - offset) return;
  throw Error(formatted(
      "is truncated: its ELF header speaks of {} bytes from byte {} on, the file has {}; build or copy it again", bytes,
      offset, file.size()));
}

void check_header(const RegularFile& file, const Elf64_Ehdr& header) {
  const std::string rebuild = "; build it for this machine";
  if (header.e_ident[EI_CLASS] != ELFCLASS64) throw Error("is not a 64 bit library" + rebuild);
  if (header.e_ident[EI_DATA] != (std::endian::native == std::endian::little ? ELFDATA2LSB : ELFDATA2MSB))
    throw Error("has its bytes in another order than this machine" + rebuild);
  if (kMachine != EM_NONE && header.e_machine != kMachine)
    throw Error("was built for " + machine_name(header.e_machine) + ", this machine is " + machine_name(kMachine) +
                rebuild);
  if (header.e_type != ET_DYN) throw Error(formatted("is not a shared library (its ELF type is {})", header.e_type));
  if (header.e_phnum == 0 || header.e_phentsize != sizeof(Elf64_Phdr))
    throw Error("is not a shared library (its ELF header describes no program segments)");
  expect_inside(file, header.e_phoff, std::uint64_t(header.e_phentsize) * header.e_phnum);
  expect_inside(file, header.e_shoff, std::uint64_t(header.e_shentsize) * header.e_shnum);
}

}  // namespace

RegularFile::RegularFile(const fs::path& file) {
  // The kind of the file is checked before it is opened, because opening a device may have an effect. It is checked
  // again afterwards, because the file may have been replaced in between.
  if (stat(file.c_str(), &status_) != 0) throw unreadable();
  expect_regular(status_);
  descriptor_ = Descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!descriptor_.is_open() || fstat(descriptor_, &status_) != 0) throw unreadable();
  expect_regular(status_);
}

std::size_t RegularFile::read(void* to, std::size_t wanted, std::uint64_t offset) const {
  const std::int64_t got = read_at(descriptor_, to, wanted, offset);
  if (got < 0) throw unreadable();
  return std::size_t(got);
}

void RegularFile::expect_unchanged() const {
  struct stat now {};
  if (fstat(descriptor_, &now) != 0) throw unreadable();
  if (now.st_size != status_.st_size || !same(now.st_mtim, status_.st_mtim)) throw changed();
}

// The file is not mapped into memory. If another program makes a mapped file shorter, reading it ends the process.
Digest digest_of(const RegularFile& file) {
  const auto block = std::make_unique_for_overwrite<char[]>(kBlock_bytes);
  Hasher hasher;
  std::uint64_t at = 0;
  while (const std::size_t count = file.read(block.get(), kBlock_bytes, at)) {
    hasher.bytes(block.get(), count);
    at += count;
    if (at > file.size()) break;  // the file grows, perhaps for ever
  }
  if (at != file.size()) throw changed();
  file.expect_unchanged();
  return hasher.digest();
}

Digest file_digest(const fs::path& file) try { return digest_of(RegularFile(file)); } catch (const Error& error) {
  throw Error(file.string() + " " + error.what());
}

std::string read_text(const RegularFile& file, std::size_t most_bytes) {
  if (file.size() > most_bytes)
    throw Error(formatted("has {} bytes, more than the {} that it may have", file.size(), most_bytes));
  std::string text(std::size_t(file.size()), '\0');
  if (file.read(text.data(), text.size(), 0) != text.size()) throw changed();
  file.expect_unchanged();
  return text;
}

bool FileState::operator==(const FileState& other) const {
  return device == other.device && number == other.number && size == other.size && same(written, other.written) &&
         same(changed, other.changed);
}

void FileState::add_to(Hasher& hasher) const {
  hasher.add(std::uint64_t(device));
  hasher.add(std::uint64_t(number));
  hasher.add(std::int64_t(size));
  for (const timespec& time : {written, changed}) {
    hasher.add(std::int64_t(time.tv_sec));
    hasher.add(std::int64_t(time.tv_nsec));
  }
}

std::optional<FileState> state_of(const std::filesystem::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return std::nullopt;
  return FileState{status.st_dev, status.st_ino, status.st_size, status.st_mtim, status.st_ctim};
}

bool is_settled(const std::filesystem::path& file, const FileState& state) {
  struct statfs system {};
  if (statfs(file.c_str(), &system) != 0 || system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC) return false;
  const time_t age_s = time(nullptr) - state.changed.tv_sec;
  if (is_local(system.f_type)) return age_s > kResolution_s;
  return age_s > kOtherClocks_s || was_seen(file, state);
}

void check_elf(const RegularFile& file) {
  Elf64_Ehdr header{};
  const std::size_t got = file.read(&header, sizeof header, 0);
  if (got < SELFMAG || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0)
    throw Error("is not a shared library (it does not begin with an ELF header)");
  if (got < sizeof header) expect_inside(file, 0, sizeof header);
  check_header(file, header);
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  const std::size_t bytes = segments.size() * sizeof(Elf64_Phdr);
  if (file.read(segments.data(), bytes, header.e_phoff) < bytes) file.expect_unchanged();
  for (const Elf64_Phdr& segment : segments)
    if (segment.p_type == PT_LOAD || segment.p_type == PT_DYNAMIC)
      expect_inside(file, segment.p_offset, segment.p_filesz);
}

std::string build_note(const RegularFile& file) {
  constexpr std::size_t kMostNote_bytes = 1 << 16;
  Elf64_Ehdr header{};
  if (file.read(&header, sizeof header, 0) < sizeof header || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
      header.e_phentsize != sizeof(Elf64_Phdr))
    return "";
  std::vector<Elf64_Phdr> segments(header.e_phnum);
  file.read(segments.data(), segments.size() * sizeof(Elf64_Phdr), header.e_phoff);
  for (const Elf64_Phdr& segment : segments) {
    if (segment.p_type != PT_NOTE || segment.p_filesz > kMostNote_bytes) continue;
    std::string text(segment.p_filesz, '\0');
    text.resize(file.read(text.data(), text.size(), segment.p_offset));
    const auto padded = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
    for (std::size_t at = 0; at + sizeof(Elf64_Nhdr) <= text.size();) {
      Elf64_Nhdr note;
      std::memcpy(&note, text.data() + at, sizeof note);
      const std::size_t name = at + sizeof note, content = name + padded(note.n_namesz);
      at = content + padded(note.n_descsz);
      if (at > text.size()) break;
      if (note.n_type == NT_GNU_BUILD_ID && text.compare(name, 4, "GNU", 4) == 0)
        return text.substr(content, note.n_descsz);
    }
  }
  return "";
}

}  // namespace marrow
