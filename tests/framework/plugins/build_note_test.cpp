// SPDX-License-Identifier: Apache-2.0
// The build id of an ELF file, in files made by hand.
#include "marrow/base/elf_file.hpp"

#include <elf.h>

#include <cstring>

#include "tests/framework/fixture.hpp"

namespace build_note_test {

template <class T>
std::string bytes(const T& value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A note as it stands in a file: name and content are filled up to four bytes.
std::string note(unsigned type, std::string name, std::string content) {
  const Elf64_Nhdr header{unsigned(name.size()), unsigned(content.size()), type};
  name.resize((name.size() + 3) / 4 * 4, '\0');
  content.resize((content.size() + 3) / 4 * 4, '\0');
  return bytes(header) + name + content;
}

const std::string kGnu("GNU", 4);

class BuildNote : public testing::Test {
 protected:
  /// Of a file whose second segment has these notes.
  std::string found(const std::string& notes, unsigned type = PT_NOTE) {
    Elf64_Ehdr header{};
    std::memcpy(header.e_ident, ELFMAG, SELFMAG);
    header.e_phentsize = sizeof(Elf64_Phdr);
    header.e_phnum = 2;
    header.e_phoff = sizeof header;
    Elf64_Phdr code{}, segment{};
    code.p_type = PT_LOAD;
    segment.p_type = type;
    segment.p_offset = sizeof header + 2 * sizeof segment;
    segment.p_filesz = notes.size();
    return of(bytes(header) + bytes(code) + bytes(segment) + notes);
  }
  std::string of(const std::string& content) {
    return marrow::build_note(marrow::RegularFile(scratch.write("lib.so", content)));
  }
  runtime_fixture::Scratch scratch;
};

TEST_F(BuildNote, IsFoundAmongOthers) {
  const std::string id = note(NT_GNU_BUILD_ID, kGnu, "twenty bytes of id..");
  EXPECT_EQ(found(id), "twenty bytes of id..");
  EXPECT_EQ(found(note(NT_GNU_BUILD_ID, "Other", "a") + note(NT_GNU_ABI_TAG, kGnu, "abcde") + id),
            "twenty bytes of id..");
  EXPECT_EQ(found(note(NT_GNU_BUILD_ID, kGnu, "short") + id), "short");
}

TEST_F(BuildNote, IsEmptyWhereThereIsNone) {
  EXPECT_EQ(found(""), "");
  EXPECT_EQ(found(note(NT_GNU_ABI_TAG, kGnu, "abcd")), "");
  EXPECT_EQ(found(note(NT_GNU_BUILD_ID, kGnu, "abcd"), PT_DYNAMIC), "") << "a segment of another kind";
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of(std::string(100, 'x')), "") << "no ELF file";
}

TEST_F(BuildNote, IsEmptyInDamagedFiles) {
  const std::string whole = note(NT_GNU_BUILD_ID, kGnu, "twenty bytes of id..");
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_EQ(found(whole.substr(0, size)), "") << size;
  for (const unsigned size : {1u << 20, ~0u}) {
    EXPECT_EQ(found(bytes(Elf64_Nhdr{size, 4, NT_GNU_BUILD_ID}) + whole), "");
    EXPECT_EQ(found(bytes(Elf64_Nhdr{4, size, NT_GNU_BUILD_ID}) + whole), "");
  }
}

}  // namespace build_note_test
