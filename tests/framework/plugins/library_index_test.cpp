// SPDX-License-Identifier: Apache-2.0
// The descriptions that are kept from one start to the next: they are used as long as nothing has changed, and no
// longer.
#include "marrow/runtime/plugins/library_index.hpp"

#include <fcntl.h>

#include <elf.h>
#include <thread>

#include "marrow/runtime/plugins/manifest.hpp"
#include "tests/framework/plugins/library_fixture.hpp"

namespace library_index_test {

using namespace marrow;
namespace fs = std::filesystem;
using library_fixture::kGood;

/// Folders with the same library, all of which have been kept: the times of files that were just written tell nothing,
/// so this takes some seconds.
class LibraryIndexTest : public library_fixture::LibraryTest {
 protected:
  fs::path folder(const std::string& name) const { return scratch.path / name; }
  fs::path library(const std::string& name) const { return folder(name) / "marrow_test_numbers.so"; }
  fs::path manifest(const std::string& name) const { return folder(name) / "marrow_test_numbers.json"; }
  void make(const std::string& name) {
    fs::create_directories(folder(name));
    fs::copy_file(kGood, library(name));
    fs::copy_file(fs::path(kGood).replace_extension(".json"), manifest(name));
  }
  std::optional<LibraryInfo> found(const fs::path& file) { return LibraryIndex(file.parent_path()).find(file); }
  bool are_kept(const std::vector<fs::path>& files) {
    for (const fs::path& file : files) {
      const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
      while (Catalogue({file.parent_path()}), !found(file)) {
        if (std::chrono::steady_clock::now() > until) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    }
    return true;
  }
};
constexpr const char* kNotKept =
    "the folder for scratch files is in memory only, so the times of its files tell nothing";

TEST_F(LibraryIndexTest, IsUsedUntilSomethingChanges) {
  const std::vector<std::string> names{"same",           "longer",  "replaced",    "no_manifest",
                                       "other_manifest", "written", "open_folder", "removed"};
  std::vector<fs::path> files;
  for (const std::string& name : names) make(name), files.push_back(library(name));
  if (!are_kept(files)) GTEST_SKIP() << kNotKept;

  const LibraryInfo expected = library_info(library("same"), framework);
  const std::optional<LibraryInfo> kept = found(library("same"));
  ASSERT_TRUE(kept);
  EXPECT_EQ(manifest_text(*kept), manifest_text(expected));
  EXPECT_EQ(kept->build_id, expected.build_id);
  EXPECT_EQ(kept->file, expected.file);
  EXPECT_EQ(Catalogue({folder("same")}).library_of("test.add")->build_id, expected.build_id);

  std::ofstream(library("longer"), std::ios::app | std::ios::binary) << "another build";
  struct stat before {};
  ASSERT_EQ(stat(library("replaced").c_str(), &before), 0);
  fs::copy_file(library("replaced"), folder("replaced") / "new");
  fs::rename(folder("replaced") / "new", library("replaced"));
  const timespec times[] = {before.st_atim, before.st_mtim};
  ASSERT_EQ(utimensat(AT_FDCWD, library("replaced").c_str(), times, 0), 0);  // of the same size and time
  fs::remove(manifest("no_manifest"));
  std::ofstream(manifest("other_manifest")) << "{}";
  fs::permissions(library("written"), fs::perms(0666));
  fs::permissions(folder("open_folder"), fs::perms(0777));
  fs::remove(library("removed"));
  for (const std::string& name : names) EXPECT_EQ(found(library(name)).has_value(), name == "same") << name;
  EXPECT_TRUE(Catalogue({folder("removed")}).libraries().empty());
  for (const std::string name : {"written", "open_folder"})
    EXPECT_TRUE(Catalogue({folder(name)}).libraries().at(0).refused.starts_with("is not trusted, because others may"));

  setenv("LD_LIBRARY_PATH", folder("same").c_str(), 1);
  EXPECT_FALSE(found(library("same"))) << "the loader searches elsewhere";
  unsetenv("LD_LIBRARY_PATH");
  setenv("MARROW_TRUST_ALL_PLUGINS", "1", 1);
  EXPECT_FALSE(found(library("same")));
  unsetenv("MARROW_TRUST_ALL_PLUGINS");
  EXPECT_TRUE(found(library("same")));
  LibraryIndex::forget(folder("same"));
  EXPECT_FALSE(found(library("same")));
}

TEST_F(LibraryIndexTest, LinkedLibrariesCount) {
  const fs::path linked = fs::path(MARROW_BINARY_DIR) / "tests" / "linked_plugins";
  std::vector<fs::path> files;
  for (const std::string name : {"same", "other"}) {
    fs::create_directories(folder(name) / "libs");
    for (const std::string one : {"libtest_base.so", "libtest_deep.so"})
      fs::copy_file(linked / "libs1" / one, folder(name) / "libs" / one);
    fs::copy_file(linked / "linked.so", folder(name) / "linked.so");
    files.push_back(folder(name) / "linked.so");
    write_manifest(describe_library(files.back()));
  }
  if (!are_kept(files)) GTEST_SKIP() << kNotKept;
  fs::copy_file(linked / "libs2" / "libtest_deep.so", folder("other") / "libs" / "libtest_deep.so",
                fs::copy_options::overwrite_existing);
  EXPECT_TRUE(found(files[0]));
  EXPECT_FALSE(found(files[1]));
}

TEST_F(LibraryIndexTest, DamageCostsOnlyTime) {
  make("plugins");
  if (!are_kept({library("plugins")})) GTEST_SKIP() << kNotKept;
  fs::path file;
  for (const auto& one : fs::directory_iterator(scratch.path / "cache" / "marrow" / "libraries"))
    if (one.path().extension() == ".index") file = one.path();
  const std::string whole = text_of(file);
  ASSERT_GT(whole.size(), 1000u);
  std::vector<std::string> damaged{"", "x", whole.substr(0, whole.size() / 2), whole + "x"};
  for (std::size_t at = 0; at < whole.size(); at += whole.size() / 50) {
    damaged.push_back(whole);
    damaged.back()[at] = char(damaged.back()[at] ^ 1);
  }
  for (const std::string& text : damaged) {
    std::ofstream(file, std::ios::binary) << text;
    EXPECT_FALSE(found(library("plugins")));
  }
  EXPECT_NE(Catalogue({folder("plugins")}).find("test.add"), nullptr);
  EXPECT_EQ(text_of(file), whole) << "made anew";
  setenv("XDG_CACHE_HOME", "/proc/self/none", 1);
  EXPECT_NE(Catalogue({folder("plugins")}).find("test.add"), nullptr);
}

// The build id of an ELF file, in files made by hand.

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
  std::string of(const std::string& content) { return build_note(RegularFile(scratch.write("lib.so", content))); }
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
  const std::string whole = note(NT_GNU_BUILD_ID, kGnu, "twenty bytes of id..");
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_EQ(found(whole.substr(0, size)), "") << size;
  for (const unsigned size : {1u << 20, ~0u}) {
    EXPECT_EQ(found(bytes(Elf64_Nhdr{size, 4, NT_GNU_BUILD_ID}) + whole), "");
    EXPECT_EQ(found(bytes(Elf64_Nhdr{4, size, NT_GNU_BUILD_ID}) + whole), "");
  }
}

}  // namespace library_index_test
