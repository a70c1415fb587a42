// SPDX-License-Identifier: Apache-2.0
// Libraries that must be refused, each with one sentence that says why, and manifests that do not belong.
#include <dlfcn.h>
#include <elf.h>

#include "marrow/runtime/plugins/manifest.hpp"
#include "tests/framework/plugins/library_fixture.hpp"

namespace library_test {

namespace fs = std::filesystem;
using library_fixture::kBad;
using library_fixture::kGood;
using nlohmann::json;

class LibraryTest : public library_fixture::LibraryTest {
 protected:
  /// The good library with other bytes at the beginning.
  fs::path copy_with_header(const std::function<void(Elf64_Ehdr&)>& change) {
    const fs::path file = copy_good(false);
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    Elf64_Ehdr header{};
    stream.read(reinterpret_cast<char*>(&header), sizeof header);
    change(header);
    stream.seekp(0);
    stream.write(reinterpret_cast<const char*>(&header), sizeof header);
    return file;
  }
  /// The manifest of the good library with something invented in it, and with the checksum that makes it look
  /// untouched.
  fs::path copy_with_invented(const std::function<void(nlohmann::json&)>& invent) {
    const fs::path file = copy_good(true), manifest = fs::path(file).replace_extension(".json");
    nlohmann::json document = nlohmann::json::parse(text_of(manifest));
    invent(document);
    document.erase("checksum");
    std::ofstream(manifest) << marrow::with_checksum(document);
    return file;
  }
  /// That an invented manifest is found out before anything of the library is called.
  void expect_load_refused(const std::function<void(nlohmann::json&)>& invent, const std::string& reason) {
    const fs::path file = copy_with_invented(invent);
    const marrow::Catalogue catalogue({scratch.path / "plugins"});
    ASSERT_EQ(catalogue.libraries().at(0).note, "");
    EXPECT_EQ(MESSAGE_OF(catalogue.load("test.constant")),
              file.string() + " is not what its description says: " + reason + "; run 'marrow describe " +
                  file.string() + " --write', or remove " + fs::path(file).replace_extension(".json").string());
  }
};

TEST_F(LibraryTest, GoodLibraryIsDescribed) {
  const marrow::LibraryInfo info = marrow::describe_library(kGood);
  EXPECT_EQ(info.refused, "");
  EXPECT_GT(info.nodes.size(), 5u);
  EXPECT_GT(info.linked.size(), 1u);
}
TEST_F(LibraryTest, BadOnesAreRefused) {
  fs::path truncated = copy_good(false);
  fs::resize_file(truncated, fs::file_size(truncated) / 2);
  const std::vector<std::pair<fs::path, std::string>> rows{
      {kBad / "other_api.so", "was built for plugin interface 7.2, this marrow has 1.0"},
      {kBad / "debug_mode.so", "was built with _GLIBCXX_DEBUG (debug mode) on, this marrow with off"},
      {kBad / "other_alignment.so", "was built with EIGEN_MAX_ALIGN_BYTES 32, this marrow with 16"},
      {kBad / "fast_math.so",
       "was built with -ffast-math on, this marrow with off; leave out -ffast-math and -Ofast: they change the results "
       "of other nodes, and NaN is not seen"},
      {kBad / "crashes.so", "crashed while being loaded (Segmentation fault)"},
      {kBad / "throws.so", "crashed while being loaded (Aborted)"},
      {kBad / "no_entry.so", "is not a marrow plugin: it has no function marrow_plugin_entry"},
      {kBad / "wrong_declaration.so",
       "declares its nodes wrongly: edges.wrong: option 'low': its default is outside its own range; edges.wrong: "
       "trait "
       "'fast' is named twice"},
      {scratch.write("text.so", "hello\n"), "is not a shared library (it does not begin with an ELF header)"},
      {truncated, "is truncated: its ELF header speaks of"}};
  for (const auto& [file, reason] : rows)  // only where -mavx changes the alignment is there a library for it
    if (file.filename() != "other_alignment.so" || fs::exists(file)) expect_refused(file, reason);
}
TEST_F(LibraryTest, OneBadLibraryLeavesTheOthersWorking) {
  copy_good(true);
  fs::copy_file(kBad / "other_api.so", scratch.path / "plugins" / "a_bad_one.so");
  const marrow::Catalogue catalogue({scratch.path / "plugins"});
  EXPECT_NE(catalogue.find("test.add"), nullptr);
  EXPECT_NE(catalogue.libraries()[0].refused, "");
  EXPECT_NO_THROW(catalogue.load("test.add"));
}
TEST_F(LibraryTest, ManifestIsUsed) {
  const marrow::LibraryInfo info = marrow::library_info(copy_good(true), framework);
  EXPECT_EQ(info.note, "");
  EXPECT_GT(info.nodes.size(), 5u);
}
TEST_F(LibraryTest, WithoutManifestItIsDescribedAndRemembered) {
  const fs::path file = copy_good(false);
  EXPECT_GT(marrow::library_info(file, framework).nodes.size(), 5u);
  EXPECT_FALSE(fs::is_empty(scratch.path / "cache" / "marrow" / "libraries"));
}
TEST_F(LibraryTest, ManifestsThatDoNotFitAreNoticed) {
  const fs::path file = copy_good(true), manifest = fs::path(file).replace_extension(".json");
  std::string edited = text_of(manifest);
  edited.replace(edited.find("Keeps a core busy"), 5, "Burns");
  const std::string again = "), so it was described again";
  const auto note = [&] {
    const marrow::LibraryInfo info = marrow::library_info(file, framework);
    EXPECT_GT(info.nodes.size(), 5u);
    return info.note;
  };
  std::ofstream(manifest) << edited;
  EXPECT_EQ(note(), "its manifest is not used (it was edited by hand" + again);
  std::ofstream(manifest) << "{";
  EXPECT_EQ(note(), "its manifest is not used (it is damaged: its text:1:2: not valid JSON" + again);
  copy_good(true);
  std::ofstream(file, std::ios::app | std::ios::binary) << "another build";
  EXPECT_EQ(note(), "its manifest is stale (it belongs to another build of the library" + again);
}
TEST_F(LibraryTest, BuildIdFollowsTheLibraryAndTheFramework) {
  const fs::path file = copy_good(true);
  const marrow::Digest before = marrow::library_info(file, framework).build_id;
  EXPECT_EQ(before, marrow::library_info(file, framework).build_id);
  EXPECT_NE(before, marrow::library_info(file, marrow::Digest{1, 2}).build_id);
  std::ofstream(file, std::ios::app | std::ios::binary) << "x";
  EXPECT_NE(before, marrow::library_info(file, framework).build_id);
}

TEST_F(LibraryTest, ElfHeadersThatLieAreRefused) {
  const std::string truncated = "is truncated: its ELF header speaks of";
  using Change = void (*)(Elf64_Ehdr&);
  const std::vector<std::pair<Change, std::string>> rows{
      {[](Elf64_Ehdr& h) { h.e_shoff = UINT64_MAX - 100; }, truncated},
      {[](Elf64_Ehdr& h) { h.e_phoff = UINT64_MAX - 100; }, truncated},
      {[](Elf64_Ehdr& h) { h.e_phnum = 0; }, "its ELF header describes no program segments"},
      {[](Elf64_Ehdr& h) { h.e_ident[EI_CLASS] = ELFCLASS32; }, "is not a 64 bit library; build it for this machine"},
      {[](Elf64_Ehdr& h) { h.e_ident[EI_DATA] = ELFDATA2MSB; }, "has its bytes in another order than this machine"},
      {[](Elf64_Ehdr& h) { h.e_machine = EM_RISCV; }, "was built for RISC-V, this machine is"},
      {[](Elf64_Ehdr& h) { h.e_type = ET_REL; }, "is not a shared library (its ELF type is 1)"}};
  for (const auto& [change, reason] : rows) expect_refused(copy_with_header(change), reason);
  for (const std::uintmax_t size : {0, 3, 4, 5, 63, 64, 65, 500, 5000}) {
    const fs::path file = copy_good(false);
    fs::resize_file(file, size);
    expect_refused(file, size < 4 ? "is not a shared library" : truncated);
  }
  // Sections may be stripped; then only the segments tell how long the file must be.
  const fs::path file = copy_with_header([](Elf64_Ehdr& h) { h.e_shoff = h.e_shnum = 0; });
  fs::resize_file(file, 5000);
  expect_refused(file, truncated);
}

json& constant(json& j) { return j["nodes"][0]; }

TEST_F(LibraryTest, InventionsAreFoundOut) {
  const std::string of_constant = "nodes/test.constant/";
  using Invent = void (*)(json&);
  const std::vector<std::pair<Invent, std::string>> rows{
      {[](json& j) {
         constant(j)["options"][1]["type"] = "text", constant(j)["options"][1]["default"] = "x";
         constant(j)["options"][1].erase("minimum");
       },
       of_constant + "options/count/default: the library has 0, its description has \"x\""},
      {[](json& j) { constant(j)["options"][0]["default"] = 2.0; },
       of_constant + "options/value/default: the library has 1.0, its description has 2.0"},
      {[](json& j) {
         constant(j)["options"].push_back(constant(j)["options"][0]), constant(j)["options"].back()["name"] = "more";
       },
       of_constant + "options: the library has 7 of them, its description has 8 of them"},
      {[](json& j) { constant(j)["inputs"].push_back(j["nodes"][3]["inputs"][0]); },
       of_constant + "inputs: the library has 0 of them, its description has 1 of them"},
      {[](json& j) { j["nodes"][3]["inputs"][0]["type"]["size"] = 8; },
       "nodes/test.add/inputs/a/type/size: the library has 24, its description has 8"},
      {[](json& j) { constant(j)["random"] = true; },
       of_constant + "random: the library has false, its description has true"},
      {[](json& j) {
         j["writers"].push_back({{"type", {{"id", "metrics"}, {"version", 1}, {"size", 24}, {"function", false}}},
                                 {"extension", ".x"},
                                 {"help", "x"}});
       },
       "writers/metrics: the library has none, its description has it"}};
  for (const auto& [invent, reason] : rows) expect_load_refused(invent, reason);
  const marrow::LinkedLibrary last = marrow::describe_library(kGood).linked.back();
  expect_load_refused(
      [](json& j) { j["linked"].erase(j["linked"].size() - 1); },
      "it loads another " + fs::path(last.path).filename().string() + " (" + std::to_string(last.size) + " bytes)");
}
TEST_F(LibraryTest, LinkedLibraryOfTheSameSizeThatIsAnotherOneChangesTheBuildId) {
  const fs::path helper = scratch.write("libmarrow_helper.so", "first");
  const fs::path file = copy_with_invented([&](json& j) {
    j["linked"].push_back({{"path", helper.string()}, {"size", 5}});
  });
  const marrow::Digest first = marrow::library_info(file, framework).build_id;
  EXPECT_EQ(marrow::library_info(file, framework).build_id, first);
  scratch.write("libmarrow_helper.so", "other");
  EXPECT_NE(marrow::library_info(file, framework).build_id, first);
  EXPECT_EQ(marrow::library_info(file, framework).note, "");
}
/// The plugin that links others, in the scratch folder with the first version of both.
class LinkedLibraryTest : public LibraryTest {
 protected:
  LinkedLibraryTest() {
    fs::create_directories(scratch.path / "plugins" / "libs");
    fs::copy_file(kLinked / "linked.so", file);
    put(1, "libtest_base.so", scratch.path / "plugins" / "libs");
    put(1, "libtest_deep.so", scratch.path / "plugins" / "libs");
  }
  ~LinkedLibraryTest() override { unsetenv("LD_LIBRARY_PATH"); }
  void put(int version, const std::string& name, const fs::path& folder) {
    fs::create_directories(folder);
    fs::remove(folder / name);  // another file, as a linker makes it
    fs::copy_file(kLinked / ("libs" + std::to_string(version)) / name, folder / name);
  }
  marrow::Digest build_id() {
    const marrow::LibraryInfo info = marrow::library_info(file, framework);
    EXPECT_EQ(info.refused, "");
    return info.build_id;
  }
  const fs::path kLinked = fs::path(MARROW_BINARY_DIR) / "tests" / "linked_plugins";
  const fs::path file = scratch.path / "plugins" / "linked.so";
};

TEST_F(LinkedLibraryTest, WhatALinkedLibraryNeedsCountsToo) {
  const marrow::Digest first = build_id();
  EXPECT_EQ(build_id(), first);
  std::set<std::string> names;
  for (const marrow::LinkedLibrary& linked : marrow::library_info(file, framework).linked)
    names.insert(fs::path(linked.path).filename());
  EXPECT_TRUE(names.contains("libtest_base.so"));
  EXPECT_TRUE(names.contains("libtest_deep.so")) << "only another library needs it";
  ASSERT_EQ(fs::file_size(kLinked / "libs1" / "libtest_deep.so"), fs::file_size(kLinked / "libs2" / "libtest_deep.so"));
  put(2, "libtest_deep.so", scratch.path / "plugins" / "libs");
  EXPECT_NE(build_id(), first);
  put(1, "libtest_deep.so", scratch.path / "plugins" / "libs");
  EXPECT_EQ(build_id(), first);
}
TEST_F(LinkedLibraryTest, LibrariesThatTheLoaderFindsElsewhereCount) {
  marrow::write_manifest(marrow::library_info(file, framework));
  const marrow::Digest first = build_id();
  const fs::path elsewhere = scratch.path / "elsewhere";
  fs::create_directories(elsewhere);
  setenv("LD_LIBRARY_PATH", elsewhere.c_str(), 1);
  EXPECT_EQ(build_id(), first) << "nothing lies there";
  put(2, "libtest_base.so", elsewhere), put(1, "libtest_deep.so", elsewhere);
  setenv("LD_LIBRARY_PATH", (elsewhere.string() + ":").c_str(), 1);
  const marrow::LibraryInfo other = marrow::library_info(file, framework);
  EXPECT_NE(other.build_id, first);
  EXPECT_TRUE(other.note.starts_with("its manifest is stale (LD_LIBRARY_PATH leads to " + elsewhere.string()))
      << other.note;
  EXPECT_EQ(build_id(), other.build_id) << "from the cache";
  unsetenv("LD_LIBRARY_PATH");
  EXPECT_EQ(build_id(), first);
}
TEST_F(LinkedLibraryTest, TheSameLibraryInAnotherFolderLinksWhatIsBesideIt) {
  const marrow::Digest first = build_id();
  const fs::path folder = scratch.path / "another", other = folder / "linked.so";
  put(2, "libtest_base.so", folder / "libs"), put(1, "libtest_deep.so", folder / "libs");
  fs::copy_file(kLinked / "linked.so", other);
  const marrow::LibraryInfo info = marrow::library_info(other, framework);
  EXPECT_NE(info.build_id, first);
  for (const marrow::LinkedLibrary& linked : info.linked)
    EXPECT_FALSE(linked.path.starts_with((fs::canonical(scratch.path) / "plugins").string())) << linked.path;
  EXPECT_EQ(build_id(), first);
}
TEST_F(LinkedLibraryTest, AnotherLibraryThanTheDescribedOneIsFoundOut) {
  marrow::write_manifest(marrow::library_info(file, framework));
  const marrow::Catalogue catalogue({scratch.path / "plugins"});
  put(2, "libtest_deep.so", scratch.path / "elsewhere");
  // Loaded before under the same name, it is what the plugin gets.
  ASSERT_NE(dlopen((scratch.path / "elsewhere" / "libtest_deep.so").c_str(), RTLD_NOW), nullptr);
  const std::string said = MESSAGE_OF(catalogue.load("test.linked"));
  EXPECT_HAS(said, "it loads another libtest_deep.so (") << said;
}
TEST_F(LibraryTest, LinkedLibraryThatIsNoFileMakesTheManifestStale) {
  for (const std::string path : {"/dev/zero", "/", "/nonexistent/lib.so"}) {
    const fs::path file = copy_with_invented([&](json& j) { j["linked"].push_back({{"path", path}, {"size", 0}}); });
    EXPECT_HAS(marrow::library_info(file, framework).note, "its manifest is stale (") << path;
  }
}
TEST_F(LibraryTest, LibraryThatChangesAfterItWasDescribedIsNotUsed) {
  const fs::path file = copy_good(true);
  const marrow::Catalogue catalogue({scratch.path / "plugins"});
  std::ofstream(file, std::ios::app | std::ios::binary) << "another build";
  EXPECT_EQ(MESSAGE_OF(catalogue.load("test.add")),
            file.string() + " was changed since this program began; start it again");
}
TEST_F(LibraryTest, WrongDescriptionInTheCacheIsForgotten) {
  const fs::path file = copy_with_invented([](json&j) { constant(j)["random"] = true; }),
                 folder = scratch.path / "cache" / "marrow" / "libraries";
  fs::remove_all(scratch.path / "cache");
  const std::string invented = text_of(fs::path(file).replace_extension(".json"));
  fs::remove(fs::path(file).replace_extension(".json"));
  marrow::library_info(file, framework);
  std::ofstream(fs::directory_iterator(folder)->path()) << invented;
  EXPECT_THROW(marrow::Catalogue({scratch.path / "plugins"}).load("test.add"), marrow::Error);
  EXPECT_NO_THROW(marrow::Catalogue({scratch.path / "plugins"}).load("test.add"));
}
TEST_F(LibraryTest, DamagedCacheIsMadeAnewWithoutAWord) {
  const fs::path file = copy_good(false);
  marrow::library_info(file, framework);
  const fs::path cached = *fs::directory_iterator(scratch.path / "cache" / "marrow" / "libraries");
  const std::string whole = text_of(cached);
  for (const std::string& damaged :
       {std::string(), std::string("{"), std::string(1000000, '['), whole.substr(0, whole.size() / 2)}) {
    std::ofstream(cached) << damaged;
    const marrow::LibraryInfo info = marrow::library_info(file, framework);
    EXPECT_EQ(info.note, "");
    EXPECT_GT(info.nodes.size(), 5u);
    EXPECT_EQ(text_of(cached), whole);
  }
}
TEST_F(LibraryTest, LibraryThatLacksAnotherIsAskedAgain) {
  // The verdict on a library is kept, but not one that another library may change.
  const fs::path file = copy_good(false);
  std::string bytes = text_of(file);
  const std::size_t at = bytes.find("libtbb.so.12");
  const std::size_t name = at != std::string::npos ? at : bytes.find("libmarrow.so.0");
  ASSERT_NE(name, std::string::npos);
  bytes.replace(name, 6, "libxxx");
  std::ofstream(file, std::ios::binary) << bytes;
  const marrow::LibraryInfo info = marrow::library_info(file, framework);
  EXPECT_TRUE(info.refused.starts_with("cannot be loaded: ")) << info.refused;
  EXPECT_TRUE(!fs::exists(scratch.path / "cache") || fs::is_empty(scratch.path / "cache" / "marrow" / "libraries"));
}

}  // namespace library_test
