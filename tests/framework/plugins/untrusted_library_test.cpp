// SPDX-License-Identifier: Apache-2.0
// What lies in a plugin folder without being a library of the user's: pipes and devices, and files that others may have
// put there.
#include <pwd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <thread>

#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/trust.hpp"
#include "tests/framework/plugins/library_fixture.hpp"

namespace untrusted_library_test {

namespace fs = std::filesystem;
constexpr uid_t kSomebody = 54321;

class UntrustedLibraryTest : public library_fixture::LibraryTest {
 protected:
  UntrustedLibraryTest() { unsetenv("MARROW_TRUST_ALL_PLUGINS"); }
  ~UntrustedLibraryTest() override { unsetenv("MARROW_TRUST_ALL_PLUGINS"); }
  /// That neither describing nor a catalogue loads it.
  void expect_untrusted(const fs::path& file, const std::string& reason) {
    expect_refused(file, reason);
    const marrow::Catalogue catalogue({file.parent_path()});
    EXPECT_HAS(catalogue.libraries().at(0).refused, reason) << catalogue.libraries().at(0).refused;
    EXPECT_TRUE(catalogue.node_names().empty());
  }
  void expect_trusted(const fs::path& file) { EXPECT_EQ(marrow::describe_library(file).refused, ""); }
  static std::string others_may_write(const fs::path& path, const std::string& mode) {
    return "is not trusted, because others may write to '" + path.string() + "' (owner " +
           getpwuid(geteuid())->pw_name + ", mode " + mode + "); " +
           (mode[0] == '1' ? "move the library into a folder of your own" : "chmod go-w '" + path.string() + "'") +
           ", or set MARROW_TRUST_ALL_PLUGINS=1";
  }
  const fs::path folder = scratch.path / "plugins";
};

TEST_F(UntrustedLibraryTest, WhatIsNoFileIsNotOpened) {
  alarm(240);  // a named pipe would be waited for for ever
  fs::create_directories(folder / "folder.so");
  ASSERT_EQ(mkfifo((folder / "pipe.so").c_str(), 0600), 0);
  fs::create_symlink("pipe.so", folder / "link_to_pipe.so");
  fs::create_symlink("/dev/zero", folder / "device.so");
  fs::create_symlink("nothing", folder / "dangling.so");
  fs::create_symlink("loop.so", folder / "loop.so");
  const int socket_end = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{AF_UNIX, {}};
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s", (folder / "socket.so").c_str());
  ASSERT_EQ(bind(socket_end, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  std::map<std::string, std::string> refused;
  const marrow::Catalogue catalogue({folder});
  for (const marrow::LibraryInfo& info : catalogue.libraries()) {
    refused[info.file.filename()] = info.refused;
    EXPECT_EQ(marrow::describe_library(info.file).refused, info.refused);
  }
  close(socket_end);
  EXPECT_EQ(refused["folder.so"], "is a folder, not a regular file");
  EXPECT_EQ(refused["pipe.so"], "is a named pipe, not a regular file");
  EXPECT_EQ(refused["link_to_pipe.so"], "is a named pipe, not a regular file");
  EXPECT_EQ(refused["socket.so"], "is a socket, not a regular file");
  EXPECT_EQ(refused["dangling.so"], "cannot be read: No such file or directory");
  EXPECT_EQ(refused["loop.so"], "cannot be read: Too many levels of symbolic links");
  // The folder /dev, or the device, may be open to all: that is found first.
  EXPECT_TRUE(refused["device.so"].starts_with("is a device") || refused["device.so"].starts_with("is not trusted"))
      << refused["device.so"];
  alarm(0);
}
TEST_F(UntrustedLibraryTest, ManifestThatIsNoFileIsNotOpened) {
  alarm(240);
  const fs::path file = copy_good(false), manifest = fs::path(file).replace_extension(".json");
  ASSERT_EQ(mkfifo(manifest.c_str(), 0600), 0);
  EXPECT_EQ(marrow::library_info(file, framework).note,
            "its manifest is not used (it is a named pipe, not a regular file), so it was described again");
  fs::remove(manifest);
  std::ofstream(manifest) << "{}";
  fs::resize_file(manifest, std::uintmax_t(1) << 30);
  EXPECT_EQ(marrow::library_info(file, framework).note,
            "its manifest is not used (it has 1073741824 bytes, more than the 4194304 that it may have), so it was "
            "described again");
  alarm(0);
}
TEST_F(UntrustedLibraryTest, UnreadableFolderIsSaid) {
  std::ofstream(scratch.path / "file") << "";
  const marrow::Catalogue catalogue({scratch.path / "file", scratch.path / "nowhere"});
  ASSERT_EQ(catalogue.libraries().size(), 1u);
  EXPECT_EQ(catalogue.libraries()[0].refused, "cannot be searched for libraries: Not a directory");
}
TEST_F(UntrustedLibraryTest, FolderThatAllMayWrite) {
  const fs::path file = copy_good(true);
  fs::permissions(folder, fs::perms(0777));
  expect_untrusted(file, others_may_write(folder, "0777"));
  fs::permissions(folder, fs::perms(01777));
  expect_untrusted(file, others_may_write(folder, "1777"));
  setenv("MARROW_TRUST_ALL_PLUGINS", "0", 1);
  expect_untrusted(file, others_may_write(folder, "1777"));
  setenv("MARROW_TRUST_ALL_PLUGINS", "1", 1);
  expect_trusted(file);
  EXPECT_EQ(marrow::library_info(file, framework).note, "");
}
TEST_F(UntrustedLibraryTest, FolderAboveThatAllMayWrite) {
  const fs::path file = copy_good(true);
  fs::permissions(scratch.path, fs::perms(0777));
  expect_untrusted(file, others_may_write(scratch.path, "0777"));
  fs::permissions(scratch.path, fs::perms(01777));  // nobody can replace what is not theirs
  expect_trusted(file);
}
TEST_F(UntrustedLibraryTest, LibraryThatAllMayWrite) {
  const fs::path file = copy_good(true);
  fs::permissions(file, fs::perms(0666));
  expect_untrusted(file, others_may_write(file, "0666"));
}
TEST_F(UntrustedLibraryTest, LinksCountAtBothEnds) {
  const fs::path file = copy_good(true), elsewhere = scratch.path / "elsewhere", link = elsewhere / "x.so";
  fs::create_directories(elsewhere);
  fs::create_symlink(file, link);
  expect_trusted(link);
  fs::permissions(elsewhere, fs::perms(0777));
  expect_untrusted(link, others_may_write(elsewhere, "0777"));
  fs::permissions(elsewhere, fs::perms(0700));
  fs::permissions(folder, fs::perms(0777));
  expect_untrusted(link, others_may_write(folder, "0777"));
}
TEST_F(UntrustedLibraryTest, ThePrivateGroupOfTheUserMayWrite) {
  const fs::path file = copy_good(true);  // as with umask 002
  fs::permissions(folder, fs::perms(0775));
  fs::permissions(file, fs::perms(0775));
  fs::permissions(fs::path(file).replace_extension(".json"), fs::perms(0664));
  if (geteuid() != 0) GTEST_SKIP() << "the user may have no private group";
  expect_trusted(file);
  EXPECT_EQ(marrow::library_info(file, framework).note, "");
  ASSERT_EQ(chown(folder.c_str(), 0, kSomebody), 0);
  expect_untrusted(file, others_may_write(folder, "0775"));
  ASSERT_EQ(setegid(kSomebody), 0);  // as after newgrp: a group that is used for once is no private one
  const std::string fault = marrow::changeable_by_others(file);
  ASSERT_EQ(setegid(0), 0);
  EXPECT_HAS(fault, "others may write to '" + folder.string() + "'") << fault;
}
TEST_F(UntrustedLibraryTest, TheGroupOfAUserWithoutANameMayWrite) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  const fs::path file = copy_good(true);  // in a container, users may have numbers alone
  fs::permissions(scratch.path, fs::perms(0755));
  fs::permissions(folder, fs::perms(0775));
  ASSERT_EQ(chown(folder.c_str(), kSomebody, kSomebody), 0);
  const auto fault_as = [&](gid_t group) {
    if (setegid(group) != 0 || seteuid(kSomebody) != 0) return std::string("nobody else can be had here");
    const std::string fault = marrow::changeable_by_others(file);
    if (seteuid(0) != 0 || setegid(0) != 0) std::abort();
    return fault;
  };
  EXPECT_EQ(fault_as(kSomebody), "");
  ASSERT_EQ(chown(folder.c_str(), kSomebody, kSomebody + 1), 0);
  EXPECT_EQ(fault_as(kSomebody + 1), "");
  EXPECT_HAS(fault_as(kSomebody), "others may write to '" + folder.string() + "' (owner user 54321, mode 0775)");
}
TEST_F(UntrustedLibraryTest, AnAccessListIsNoPrivateGroup) {
  // With a list, the mode shows as the group's what the list gives anyone at most.
  const fs::path file = copy_good(true);
  struct Entry {
    std::uint16_t tag, permissions;
    std::uint32_t id;
  };
  struct {
    std::uint32_t version = 2;
    Entry entries[5] = {{1, 7, ~0u}, {2, 7, kSomebody}, {4, 5, ~0u}, {16, 7, ~0u}, {32, 5, ~0u}};
  } list;
  expect_trusted(file);
  if (setxattr(folder.c_str(), "system.posix_acl_access", &list, sizeof list, 0) != 0)
    GTEST_SKIP() << "no access lists here";
  ASSERT_EQ(fs::status(folder).permissions(), fs::perms(0775));
  expect_untrusted(file, "others may write to '" + folder.string() + "' (owner ");
  expect_untrusted(file, "mode 0775 and an access list); chmod go-w '" + folder.string() + "'");
  fs::permissions(folder, fs::perms(0755));  // as advised: the list no longer lets anyone write
  expect_trusted(file);
}
TEST_F(UntrustedLibraryTest, WhatBelongsToSomebodyElse) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  const fs::path file = copy_good(true), manifest = fs::path(file).replace_extension(".json");
  const auto belongs = [](const fs::path& path, const std::string& mode) {
    return "is not trusted, because '" + path.string() + "' belongs to user 54321 (mode " + mode +
           "), who is neither you nor root; copy it into a folder of your own, or set MARROW_TRUST_ALL_PLUGINS=1";
  };
  fs::permissions(manifest, fs::perms(0644));
  ASSERT_EQ(chown(manifest.c_str(), kSomebody, kSomebody), 0);
  EXPECT_EQ(marrow::library_info(file, framework).note,
            "its manifest is not used (it " + belongs(manifest, "0644") + "), so it was described again");
  fs::permissions(file, fs::perms(0755));
  ASSERT_EQ(chown(file.c_str(), kSomebody, kSomebody), 0);
  expect_untrusted(file, belongs(file, "0755"));
  ASSERT_EQ(chown(file.c_str(), 0, 0), 0);
  fs::permissions(folder, fs::perms(01755));
  ASSERT_EQ(chown(folder.c_str(), kSomebody, kSomebody), 0);
  expect_untrusted(file, belongs(folder, "1755"));
}
TEST_F(UntrustedLibraryTest, CacheIsTheUsersAlone) {
  const fs::path file = copy_good(false), cache = scratch.path / "cache" / "marrow" / "libraries";
  umask(0);
  marrow::library_info(file, framework);
  umask(022);
  const fs::path entry = *fs::directory_iterator(cache);
  EXPECT_EQ(fs::status(cache).permissions(), fs::perms(0700));
  EXPECT_EQ(fs::status(cache.parent_path()).permissions(), fs::perms(0700));
  EXPECT_EQ(fs::status(entry).permissions(), fs::perms(0600));
  fs::permissions(cache, fs::perms(0755));  // as an older version made it
  marrow::library_info(file, framework);
  EXPECT_EQ(fs::status(cache).permissions(), fs::perms(0700));
  if (geteuid() != 0) return;
  ASSERT_EQ(chown(cache.c_str(), kSomebody, kSomebody), 0);
  fs::remove(entry);
  EXPECT_GT(marrow::library_info(file, framework).nodes.size(), 5u);
  EXPECT_TRUE(fs::is_empty(cache)) << "somebody else's folder is left alone";
}
TEST_F(UntrustedLibraryTest, CacheWhereOthersMayWriteIsNotMade) {
  const fs::path file = copy_good(false);
  fs::create_directories(scratch.path / "cache");
  fs::permissions(scratch.path / "cache", fs::perms(0777));
  EXPECT_GT(marrow::library_info(file, framework).nodes.size(), 5u);
  EXPECT_TRUE(fs::is_empty(scratch.path / "cache"));
}
TEST_F(UntrustedLibraryTest, WithoutAHomeNothingIsKept) {
  const fs::path file = copy_good(false), before = fs::current_path(), here = scratch.path / "here";
  const std::string home = getenv("HOME") ? getenv("HOME") : "";
  fs::create_directories(here);
  fs::current_path(here);
  unsetenv("HOME");
  for (const char* cache : {"", "relative"}) {
    setenv("XDG_CACHE_HOME", cache, 1);
    EXPECT_GT(marrow::library_info(file, framework).nodes.size(), 5u);
  }
  unsetenv("XDG_CACHE_HOME");
  setenv("HOME", "", 1);
  EXPECT_GT(marrow::library_info(file, framework).nodes.size(), 5u);
  setenv("HOME", home.c_str(), 1);
  fs::current_path(before);
  EXPECT_TRUE(fs::is_empty(here));
}
TEST_F(UntrustedLibraryTest, FileThatShrinksWhileItIsHashed) {
  const fs::path file = scratch.write("file", "");
  constexpr std::uintmax_t kLarge_bytes = 64 << 20;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    while (!done) {
      fs::resize_file(file, kLarge_bytes);
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
      fs::resize_file(file, 100);
    }
  });
  int refused = 0;
  // By the clock: while the writer is kept from the processor, the file stays small and is hashed in no time.
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
  while (refused < 20 && std::chrono::steady_clock::now() < end) {
    const std::string said = MESSAGE_OF(marrow::file_digest(file));
    if (said.empty()) continue;
    ++refused;
    EXPECT_EQ(said, file.string() + " was changed while it was read; try again when nothing writes to it");
  }
  done = true;
  writer.join();
  EXPECT_EQ(refused, 20);
}
TEST_F(UntrustedLibraryTest, DigestIsOfTheWholeFile) {
  for (const std::size_t size :
       {std::size_t(0), std::size_t(1), std::size_t(262144), std::size_t(262145), std::size_t(1000003)}) {
    std::string text(size, 'x');
    for (std::size_t i = 0; i < size; ++i) text[i] = char(i * 7 + i / 256);
    EXPECT_EQ(marrow::file_digest(scratch.write("whole", text)), marrow::hash_of_bytes(text.data(), text.size()));
  }
  EXPECT_THROW(marrow::file_digest(scratch.path), marrow::Error);
}

// A plugin of the user's own that links a library in a folder into which others may write.

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

}  // namespace untrusted_library_test
