// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/elf_file.hpp"

#include <elf.h>

#include <bit>
#include <cstring>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

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
