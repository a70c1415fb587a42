// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/base/framework_file.hpp"
#include "marrow/base/regular_file.hpp"
#include "tests/framework/fixture.hpp"

namespace library_fixture {

namespace fs = std::filesystem;
using runtime_fixture::Scratch;
inline const fs::path kBad = fs::path(MARROW_BINARY_DIR) / "tests" / "bad_plugins";
inline const fs::path kGood = fs::path(MARROW_BINARY_DIR) / "tests" / "plugins" / "marrow_test_numbers.so";

/// A folder with plugins, and a cache of descriptions of its own.
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
    fs::remove(file);  // another file, as a linker makes it: one that is loaded must not change
    fs::copy_file(kGood, file);
    if (with_manifest)
      fs::copy_file(fs::path(kGood).replace_extension(".json"), fs::path(file).replace_extension(".json"),
                    fs::copy_options::overwrite_existing);
    return file;
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  Scratch scratch;
  const marrow::Digest framework = marrow::file_digest(marrow::framework_file());
};

}  // namespace library_fixture
