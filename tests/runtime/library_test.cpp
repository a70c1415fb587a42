// SPDX-License-Identifier: Apache-2.0
// Libraries that must be refused, each with one sentence that says why, and manifests that do not belong.
#include "marrow/runtime/library.hpp"
#include "runtime/fixture.hpp"

namespace {

namespace fs = std::filesystem;
const fs::path kBad = fs::path(MARROW_BINARY_DIR) / "tests" / "bad_plugins";
const fs::path kGood = fs::path(MARROW_BINARY_DIR) / "tests" / "plugins" / "marrow_test_numbers.so";

class LibraryTest : public testing::Test {
 protected:
  LibraryTest() { setenv("XDG_CACHE_HOME", (scratch.path / "cache").c_str(), 1); }
  void expect_refused(const fs::path& file, const std::string& reason) {
    const marrow::LibraryInfo info = marrow::describe_library(file);
    EXPECT_NE(info.refused.find(reason), std::string::npos) << info.refused;
    EXPECT_TRUE(info.nodes.empty());
  }
  fs::path copy_good(bool with_manifest) {
    fs::create_directories(scratch.path / "plugins");
    const fs::path file = scratch.path / "plugins" / "marrow_test_numbers.so";
    fs::copy_file(kGood, file, fs::copy_options::overwrite_existing);
    if (with_manifest)
      fs::copy_file(fs::path(kGood).replace_extension(".json"), fs::path(file).replace_extension(".json"), fs::copy_options::overwrite_existing);
    return file;
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  Scratch scratch;
  const marrow::Digest framework = marrow::file_digest(marrow::framework_file());
};

TEST_F(LibraryTest, GoodLibraryIsDescribed) {
  const marrow::LibraryInfo info = marrow::describe_library(kGood);
  EXPECT_EQ(info.refused, "");
  EXPECT_GT(info.nodes.size(), 5u);
  EXPECT_GT(info.linked.size(), 1u);
}
TEST_F(LibraryTest, OtherApi) { expect_refused(kBad / "other_api.so", "was built for plugin interface 7.2, this marrow has 1.0"); }
TEST_F(LibraryTest, DebugMode) { expect_refused(kBad / "debug_mode.so", "was built with _GLIBCXX_DEBUG (debug mode) on, this marrow with off"); }
TEST_F(LibraryTest, OtherEigenAlignment) {
  if (!fs::exists(kBad / "other_alignment.so")) GTEST_SKIP() << "only where -mavx changes the alignment";
  expect_refused(kBad / "other_alignment.so", "was built with EIGEN_MAX_ALIGN_BYTES 32, this marrow with 16");
}
TEST_F(LibraryTest, Crash) { expect_refused(kBad / "crashes.so", "crashed while being loaded (Segmentation fault)"); }
TEST_F(LibraryTest, NoEntry) { expect_refused(kBad / "no_entry.so", "is no marrow plugin: it has no function marrow_plugin_entry"); }
TEST_F(LibraryTest, WrongDeclaration) {
  expect_refused(kBad / "wrong_declaration.so",
                 "declares its nodes wrongly: edges.wrong: option 'low': its default is outside its own range; edges.wrong: input 'picture': the "
                 "kind 'edges' has none of that name");
}
TEST_F(LibraryTest, TextFile) { expect_refused(scratch.write("text.so", "hello\n"), "is not a shared library (it does not begin with an ELF header)"); }
TEST_F(LibraryTest, Truncated) {
  const fs::path file = copy_good(false);
  fs::resize_file(file, fs::file_size(file) / 2);
  expect_refused(file, "is truncated: its ELF header speaks of");
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
TEST_F(LibraryTest, StaleManifestIsNoticed) {
  const fs::path file = copy_good(true);
  std::ofstream(file, std::ios::app | std::ios::binary) << "another build";
  const marrow::LibraryInfo info = marrow::library_info(file, framework);
  EXPECT_EQ(info.note, "its manifest is stale (it belongs to another build of the library), so it was described anew");
  EXPECT_GT(info.nodes.size(), 5u);
}
TEST_F(LibraryTest, EditedManifestIsNoticed) {
  const fs::path file = copy_good(true), manifest = fs::path(file).replace_extension(".json");
  std::string text = text_of(manifest);
  text.replace(text.find("Keeps a core busy"), 5, "Burns");
  std::ofstream(manifest) << text;
  EXPECT_EQ(marrow::library_info(file, framework).note, "its manifest is not used (it was edited by hand), so it was described anew");
}
TEST_F(LibraryTest, DamagedManifestIsNoticed) {
  const fs::path file = copy_good(true);
  std::ofstream(fs::path(file).replace_extension(".json")) << "{";
  EXPECT_EQ(marrow::library_info(file, framework).note, "its manifest is not used (it is damaged), so it was described anew");
}
TEST_F(LibraryTest, BuildIdFollowsTheLibraryAndTheFramework) {
  const fs::path file = copy_good(true);
  const marrow::Digest before = marrow::library_info(file, framework).build_id;
  EXPECT_EQ(before, marrow::library_info(file, framework).build_id);
  EXPECT_NE(before, marrow::library_info(file, marrow::Digest{1, 2}).build_id);
  std::ofstream(file, std::ios::app | std::ios::binary) << "x";
  EXPECT_NE(before, marrow::library_info(file, framework).build_id);
}

}  // namespace
