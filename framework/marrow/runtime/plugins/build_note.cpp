// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/build_note.hpp"

#include <elf.h>

#include <cstring>
#include <vector>

namespace marrow {

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
