// SPDX-License-Identifier: Apache-2.0
// A plugin of the user's own that links a library in a folder into which others may write.
#include <pwd.h>
#include <unistd.h>

#include "marrow/base/framework_file.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/trust.hpp"
#include "tests/framework/environment.hpp"
#include "tests/framework/plugins/library_fixture.hpp"
#include "tests/harness/message_of.hpp"

namespace untrusted_links_test {

namespace fs = std::filesystem;
constexpr uid_t kSomebody = 54321;

class UntrustedLinksTest : public library_fixture::LibraryTest {
 protected:
  UntrustedLinksTest() {
    environment.set("MARROW_TRUST_ALL_PLUGINS", std::nullopt);
    environment.set("MARROW_TEST_MARK", mark.string());
    const fs::path built = fs::path(MARROW_BINARY_DIR) / "tests" / "linked_plugins";
    fs::create_directories(libraries);
    fs::copy_file(built / "linked.so", file);
    fs::copy_file(built / "libs3" / "libtest_base.so", libraries / "libtest_base.so");
  }
  std::string expected() const {
    return "cannot be loaded, because it needs '" + fs::canonical(libraries / "libtest_base.so").string() +
           "', which is not trusted, because others may write to '" + fs::canonical(libraries).string() + "' (owner " +
           getpwuid(geteuid())->pw_name + ", mode 0777); chmod go-w '" + fs::canonical(libraries).string() +
           "', or set MARROW_TRUST_ALL_PLUGINS=1";
  }

  runtime_fixture::Environment environment;
  const fs::path mark = scratch.path / "mark", plugins = scratch.path / "plugins", libraries = plugins / "libs",
                 file = plugins / "linked.so";
};

TEST_F(UntrustedLinksTest, TheyAreKnownBeforeTheyAreLoaded) {
  const std::vector<fs::path> found = marrow::libraries_to_load(file);
  EXPECT_NE(std::find(found.begin(), found.end(), libraries / "libtest_base.so"), found.end());
  EXPECT_FALSE(fs::exists(mark)) << "nothing of them has run";
}

TEST_F(UntrustedLinksTest, TheyAreRefusedBeforeTheyRun) {
  fs::permissions(libraries, fs::perms(0777));
  EXPECT_EQ(marrow::describe_library(file).refused, expected());
  const marrow::Catalogue catalogue({plugins});
  EXPECT_EQ(catalogue.libraries().at(0).refused, expected());
  EXPECT_FALSE(fs::exists(mark));
  fs::permissions(libraries, fs::perms(0755));  // as advised
  EXPECT_EQ(marrow::Catalogue({plugins}).libraries().at(0).refused, "");
  EXPECT_TRUE(fs::exists(mark)) << "what others cannot change is loaded";
}

TEST_F(UntrustedLinksTest, ADescriptionDoesNotMakeThemTrusted) {
  const marrow::LibraryInfo described = marrow::library_info(file, framework);
  ASSERT_EQ(described.refused, "");
  fs::remove(mark);
  fs::permissions(libraries, fs::perms(0777));
  EXPECT_EQ(marrow::Catalogue({plugins}).libraries().at(0).refused, expected());
  EXPECT_EQ(marrow::test::message_of([&] { marrow::load_library(described); }), file.string() + " " + expected());
  EXPECT_FALSE(fs::exists(mark));
  environment.set("MARROW_TRUST_ALL_PLUGINS", "1");
  EXPECT_EQ(marrow::Catalogue({plugins}).libraries().at(0).refused, "");
}

TEST_F(UntrustedLinksTest, TheOwnerCountsToo) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  const fs::path library = libraries / "libtest_base.so";
  ASSERT_EQ(chown(library.c_str(), kSomebody, kSomebody), 0);
  fs::permissions(library, fs::perms(0755));
  EXPECT_EQ(marrow::untrusted_among({library}),
            "cannot be loaded, because it needs '" + library.string() + "', which is not trusted, because '" +
                fs::canonical(library).string() +
                "' belongs to user 54321 (mode 0755), who is neither you nor root; copy it into a folder of your own, "
                "or set MARROW_TRUST_ALL_PLUGINS=1");
  EXPECT_EQ(marrow::untrusted_among({library}, kSomebody), "")
      << "who owns the interpreter is trusted with its modules";
}

TEST_F(UntrustedLinksTest, WhatTheSystemHasIsTrusted) {
  EXPECT_EQ(marrow::untrusted_among(marrow::libraries_to_load(marrow::framework_file())), "");
}

}  // namespace untrusted_links_test
