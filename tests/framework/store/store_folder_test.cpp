// SPDX-License-Identifier: Apache-2.0
// Who owns a store, what it touches and what it leaves alone, and that it keeps its size.
#include <pwd.h>
#include <sys/wait.h>

#include <thread>

#include "tests/framework/identities.hpp"
#include "tests/framework/store/store_fixture.hpp"

namespace store_folder_test {

namespace fs = std::filesystem;
using marrow::Store;
using runtime_fixture::Environment;
using runtime_fixture::Scratch;
using store_fixture::mode_of;
using store_fixture::number;

void put(const fs::path& file, const std::string& text = "someone's data") {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

/// All paths below a folder.
std::set<std::string> tree(const fs::path& folder) {
  std::set<std::string> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    paths.insert(entry.path().lexically_relative(folder).string());
  return paths;
}

class StoreFolderTest : public testing::Test {
 protected:
  std::string save(const Store& to, int name = 1) { return to.save(marrow::hash_of(name), {number(7)}, {}); }
  /// Runs `work` in another process, as a user who is not root and who owns the scratch folder. Returns its result.
  template <class Work>
  std::string as_someone(uid_t user, const Work& work) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    if (geteuid() == 0 && chown(scratch.path.c_str(), user, user) != 0) return "the folder cannot be given away";
    const pid_t child = fork();
    if (child == 0) {
      if (geteuid() == 0 && setuid(user) != 0) _exit(1);
      const std::string text = work();
      _exit(write(ends[1], text.data(), text.size()) == ssize_t(text.size()) ? 0 : 1);
    }
    close(ends[1]);
    std::string text(1000, '\0');
    text.resize(std::size_t(std::max<ssize_t>(0, read(ends[0], text.data(), text.size()))));
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return text;
  }

  Scratch scratch;
  fs::path folder = scratch.path / "store";
  Store store{folder};
  Environment environment;
};

constexpr const char* kHex = "0123456789abcdef0123456789abcdef";

TEST_F(StoreFolderTest, AFolderOfOtherThingsIsNeverTouched) {
  put(folder / "photos.tmp-0" / "a.jpg");
  put(folder / kHex / "letter.txt");
  put(folder / "01" / kHex);
  put(folder / "cases" / kHex / "ct.nii");
  const std::set<std::string> before = tree(folder);
  const std::string expected =
      "the folder " + folder.string() +
      " holds other things and is no store of marrow; set MARROW_CACHE to a new or empty folder of your own";
  EXPECT_EQ(store.fault(), expected);
  EXPECT_EQ(save(store), expected);
  EXPECT_FALSE(store.find(marrow::hash_of(1)));
  store.remember("place", {{"node", {}}});
  { const Store::Claim claim = store.claim(marrow::hash_of(1), nullptr); }
  const Store::Freed freed = store.collect(0);
  EXPECT_EQ(freed.fault, expected);
  EXPECT_EQ(freed.entries, 0u);
  environment.set("MARROW_CACHE_GB", "0");
  EXPECT_EQ(store.tidy(), "");
  EXPECT_TRUE(store.entries().empty());
  EXPECT_EQ(tree(folder), before);
}

TEST_F(StoreFolderTest, ACaseInUseIsLeft) {
  ASSERT_EQ(save(store), "");
  const fs::path one = folder / "cases" / kHex;
  put(one / "outputs" / "ct.mha");
  put(one / "content.txt");
  std::shared_ptr<const void> first = marrow::use_folder(one), second = marrow::use_folder(one);
  ASSERT_TRUE(first && second);
  Store::Freed freed = store.collect(0);
  EXPECT_EQ(freed.fault, "") << "a case in use is not a fault";
  EXPECT_EQ(freed.entries, 1u) << "only the entry";
  EXPECT_TRUE(fs::exists(one / "outputs" / "ct.mha"));
  first.reset();
  EXPECT_EQ(store.collect(0).entries, 0u);
  second.reset();
  EXPECT_EQ(store.collect(0).entries, 1u);
  EXPECT_FALSE(fs::exists(one));
  EXPECT_FALSE(marrow::use_folder(one));
  EXPECT_FALSE(marrow::use_folder(folder / "marrow-store")) << "no folder";
}

TEST_F(StoreFolderTest, OnlyItsOwnLayoutIsCollected) {
  ASSERT_EQ(save(store), "");
  store.remember("place", {{"node", {}}});
  const std::string key = marrow::hash_of(1).hex(), two = key.substr(0, 2);
  const std::string dead = ".tmp-" + runtime_fixture::ended_process() + "-0";
  put(scratch.path / "elsewhere" / "ab0123456789abcdef0123456789abcd");
  for (const std::string& own : {std::string("cases/0123456789abcdef0123456789abcdef/outputs/case/a"),
                                 std::string("cases/0123456789abcdef0123456789abcdef/content.txt"),
                                 "cases/0123456789abcdef0123456789abcdef" + dead + "/x"})
    put(folder / own);
  put(folder / two / (key + dead));
  put(folder / "last" / (key + dead));
  put(folder / ("tidied" + dead));
  for (const std::string& foreign :
       {std::string("photos.tmp-0/a.jpg"), "photos" + dead, std::string(kHex) + "/letter.txt", std::string(kHex) + dead,
        "ff/" + std::string(kHex), "0123/" + std::string(kHex), two + "/" + two + std::string(30, 'A'),
        two + "/" + two + std::string(30, '0') + "/x", two + "/notes.txt", two + "/" + key + ".tmp-1x-0",
        two + "/" + key + ".tmp--0", two + "/" + key + ".tmp-0-0", "cases/" + std::string(31, '1') + "/x",
        "cases/" + std::string(32, '4') + "/mine.txt", "cases/2222222222222222" + std::string(16, '2'),
        "last/mine" + dead})
    put(folder / foreign);
  fs::create_directory_symlink(scratch.path / "elsewhere", folder / "ab");
  fs::create_directory_symlink(scratch.path / "elsewhere", folder / "cases" / std::string(32, '3'));
  std::set<std::string> expected = tree(folder);
  const std::string place = "last/" + marrow::hash_of(std::string("place")).hex();
  for (const std::string& own : {two + "/" + key, two + "/" + key + dead, place, "last/" + key + dead, "tidied" + dead})
    EXPECT_EQ(expected.erase(own), 1u) << own;
  std::erase_if(expected, [](const std::string& path) { return path.starts_with("cases/0123"); });

  EXPECT_EQ(store.entries().size(), 1u);
  const Store::Freed freed = store.collect(0);
  EXPECT_EQ(freed.entries, 2u) << "the result and the simulated case";
  EXPECT_EQ(freed.fault, "");
  EXPECT_EQ(tree(folder), expected);
  EXPECT_EQ(tree(scratch.path / "elsewhere").size(), 1u);
}

TEST_F(StoreFolderTest, WhatProcessesElsewhereLeftIsRemovedAfterADay) {
  ASSERT_EQ(save(store), "");
  const std::string key = marrow::hash_of(1).hex(), elsewhere = runtime_fixture::process_elsewhere();
  const auto temporary = [&](const std::string& writer, const std::string& number) {
    return folder / key.substr(0, 2) / (key + ".tmp-" + writer + "-" + number);
  };
  for (const std::string& writer : {marrow::this_process(), elsewhere, std::string("4711")})
    for (const char* age : {"23", "25"}) {
      put(temporary(writer, age));
      fs::last_write_time(temporary(writer, age),
                          fs::file_time_type::clock::now() - std::chrono::hours(std::atoi(age)));
    }
  store.collect(1000000);
  for (const std::string& writer : {marrow::this_process(), elsewhere, std::string("4711")}) {
    EXPECT_TRUE(fs::exists(temporary(writer, "23"))) << writer;
    EXPECT_FALSE(fs::exists(temporary(writer, "25"))) << "no result takes a day to write: " << writer;
  }
}

TEST_F(StoreFolderTest, AnEmptyFolderBecomesAPrivateStore) {
  fs::create_directories(folder);
  chmod(folder.c_str(), 0755);
  const mode_t before = umask(0);
  ASSERT_EQ(save(store), "");
  store.remember("place", {{"node", {}}});
  { const Store::Claim claim = store.claim(marrow::hash_of(1), nullptr); }
  umask(before);
  EXPECT_EQ(mode_of(folder), 0700u);
  std::ifstream marker(folder / "marrow-store");
  std::string line;
  std::getline(marker, line);
  EXPECT_EQ(line, "marrow store of results, layout 1");
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    EXPECT_EQ(mode_of(entry.path()), entry.is_directory() ? 0700u : 0600u) << entry.path();
}

TEST_F(StoreFolderTest, AMarkerThatWasBeingWrittenIsNoForeignThing) {
  put(folder / ("marrow-store.tmp-" + runtime_fixture::process_elsewhere() + "-0"));
  put(folder / "marrow-store.tmp-4194304-0");
  EXPECT_EQ(save(store), "");
  EXPECT_TRUE(Store(folder).find(marrow::hash_of(1)));
}

TEST_F(StoreFolderTest, AStoreOfAnotherLayoutIsLeftAlone) {
  put(folder / "marrow-store", "marrow store of results, layout 12\n");
  EXPECT_HAS(save(store), "is a store of another version of marrow");
  put(folder / "marrow-store", "");
  EXPECT_HAS(save(store), "holds other things");
  EXPECT_EQ(tree(folder).size(), 1u);
}

TEST_F(StoreFolderTest, AFolderThatOthersMayWriteIsNotUsed) {
  ASSERT_EQ(save(store), "");
  chmod(folder.c_str(), 0777);
  EXPECT_EQ(Store(folder).fault(),
            "other users may write to " + folder.string() + "; take that from them (chmod go-w), or set MARROW_CACHE");
  EXPECT_FALSE(Store(folder).find(marrow::hash_of(1)));
  fs::create_directories(scratch.path / "shared");
  chmod((scratch.path / "shared").c_str(), 01777);
  EXPECT_HAS(save(Store(scratch.path / "shared")), "other users may write to");
  EXPECT_TRUE(fs::is_empty(scratch.path / "shared"));
}

TEST_F(StoreFolderTest, AFolderOfAnotherUserIsNotUsed) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can make a folder of another user";
  ASSERT_EQ(save(store), "");
  const passwd* other = getpwuid(1);
  ASSERT_EQ(chown(folder.c_str(), 1, 1), 0);
  const std::string expected =
      "the folder " + folder.string() + " belongs to another user, " + (other ? other->pw_name : "user 1");
  EXPECT_HAS(Store(folder).fault(), expected);
  EXPECT_FALSE(Store(folder).find(marrow::hash_of(1)));
  fs::create_directory_symlink(folder, scratch.path / "link");
  EXPECT_HAS(save(Store(scratch.path / "link")), "belongs to another user") << "reached by a link";
  EXPECT_EQ(Store(folder).collect(0).entries, 0u);
}

TEST_F(StoreFolderTest, WhatCannotBeRemovedIsNotCounted) {
  const std::string told = as_someone(65534, [&] {
    save(store);
    const fs::path entries = marrow::entry_file(folder, marrow::hash_of(1)).parent_path();
    chmod(entries.c_str(), 0500);
    const Store::Freed freed = store.collect(0);
    chmod(entries.c_str(), 0700);
    return std::to_string(freed.entries) + " " + std::to_string(freed.bytes) + " " + freed.fault;
  });
  EXPECT_EQ(told,
            "0 0 cannot remove " + marrow::entry_file(folder, marrow::hash_of(1)).string() + ": Permission denied");
}

TEST_F(StoreFolderTest, AReadOnlyFolderIsOneSentence) {
  const std::string told = as_someone(65534, [&] {
    fs::create_directories(folder);
    chmod(folder.c_str(), 0500);
    return save(store);
  });
  EXPECT_EQ(told, "cannot write to " + folder.string() + ": Permission denied");
}

TEST_F(StoreFolderTest, WhereTheStoreIs) {
  const passwd* own = getpwuid(geteuid());
  for (const char* name : {"MARROW_CACHE", "XDG_CACHE_HOME"}) environment.set(name, "");
  environment.set("HOME", "/home/of/mine");
  EXPECT_EQ(Store::default_folder(), "/home/of/mine/.cache/marrow/store");
  environment.set("XDG_CACHE_HOME", "/some/cache");
  EXPECT_EQ(Store::default_folder(), "/some/cache/marrow/store");
  environment.set("XDG_CACHE_HOME", "relative");
  EXPECT_EQ(Store::default_folder(), "/home/of/mine/.cache/marrow/store") << "only absolute paths count";
  environment.set("MARROW_CACHE", "here");
  EXPECT_EQ(Store().folder(), fs::current_path() / "here");
  environment.set("MARROW_CACHE", std::nullopt);
  for (const auto& home : {std::optional<std::string>(), std::optional<std::string>("")}) {
    environment.set("HOME", home);
    EXPECT_EQ(Store::default_folder(), own ? fs::path(own->pw_dir) / ".cache/marrow/store" : fs::path())
        << "it is never a folder that all users share";
  }
}

TEST_F(StoreFolderTest, AUserWithoutAHomeKeepsNothing) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  for (const char* name : {"MARROW_CACHE", "XDG_CACHE_HOME", "HOME"}) environment.set(name, std::nullopt);
  EXPECT_EQ(as_someone(54321, [&] { return save(Store()); }),
            "neither HOME nor the system names a home folder of this user; set MARROW_CACHE to a folder for them");
}

TEST_F(StoreFolderTest, NumbersOfGigabytesAreStrict) {
  EXPECT_EQ(marrow::bytes_of_gigabytes("0"), 0u);
  EXPECT_EQ(marrow::bytes_of_gigabytes("0.5"), 500000000u);
  EXPECT_EQ(marrow::bytes_of_gigabytes("1e6"), 1000000000000000u);
  for (const char* wrong :
       {"", " ", "abc", "inf", "nan", "-5", "-0.1", "0,5", "1e12", "1000001", "5 ", " 5", "5GB", "0x10", "1e999"})
    EXPECT_FALSE(marrow::bytes_of_gigabytes(wrong)) << wrong;
}

TEST_F(StoreFolderTest, AWrongLimitRemovesNothing) {
  ASSERT_EQ(save(store), "");
  for (const char* wrong : {"abc", "inf", "nan", "-5", "0,5", "1e12"}) {
    environment.set("MARROW_CACHE_GB", wrong);
    EXPECT_EQ(store.tidy(), std::string("MARROW_CACHE_GB is '") + wrong +
                                "', but must be a number of gigabytes from 0 to 1000000; nothing is removed");
    EXPECT_TRUE(store.find(marrow::hash_of(1))) << wrong;
  }
  environment.set("MARROW_CACHE_GB", "");
  EXPECT_EQ(store.tidy(), "");
  EXPECT_TRUE(store.find(marrow::hash_of(1))) << "an empty one counts as not set";
}

TEST_F(StoreFolderTest, ItIsTidiedOnceAMinuteWhateverTheClockOnceSaid) {
  ASSERT_EQ(save(store), "");
  environment.set("MARROW_CACHE_GB", "1");
  EXPECT_EQ(store.tidy(), "");
  environment.set("MARROW_CACHE_GB", "0");
  EXPECT_EQ(store.tidy(), "");
  EXPECT_TRUE(store.find(marrow::hash_of(1))) << "it was tidied up just now";
  fs::last_write_time(folder / "tidied", fs::file_time_type::clock::now() - std::chrono::seconds(61));
  EXPECT_EQ(store.tidy(), "");
  EXPECT_FALSE(store.find(marrow::hash_of(1)));
  ASSERT_EQ(save(store), "");
  fs::last_write_time(folder / "tidied", fs::file_time_type::clock::now() + std::chrono::hours(24 * 365));
  EXPECT_EQ(store.tidy(), "");
  EXPECT_FALSE(store.find(marrow::hash_of(1)));
}

/// The first text of `look` that is not empty, while another thread runs `change`.
std::string said_during(const std::function<void()>& change, const std::function<std::string()>& look) {
  std::string said;
  std::atomic<bool> has_looked{false}, is_over{false};
  std::thread other([&] {
    while (!has_looked) std::this_thread::yield();
    change();
    is_over = true;
  });
  for (; !is_over; has_looked = true)
    if (said.empty()) said = look();
  other.join();
  return said;
}

TEST_F(StoreFolderTest, AFolderThatAnotherProcessMakesIsNoFault) {
  for (int round = 0; round < 100 && !HasFailure(); ++round) {
    EXPECT_EQ(said_during([&] { fs::create_directory(folder); }, [&] { return store.fault(); }), "");
    fs::remove(folder);
  }
}

TEST_F(StoreFolderTest, AFolderThatAnotherProcessMakesPrivateIsNoFault) {
  for (int round = 0; round < 100 && !HasFailure(); ++round) {
    fs::create_directory(folder);
    chmod(folder.c_str(), 0775);
    const Store other(folder);
    EXPECT_EQ(said_during([&] { EXPECT_EQ(other.prepare(), ""); }, [&] { return store.fault(); }), "");
    fs::remove_all(folder);
  }
}

TEST_F(StoreFolderTest, ACaseInUseStaysWhileOthersRemoveTheOneBefore) {
  const fs::path one = scratch.path / "case";
  std::atomic<bool> is_over{false};
  std::vector<std::thread> removers;
  for (int k = 0; k < 4; ++k)
    removers.emplace_back([&, to = scratch.path / ("removed-" + std::to_string(k))] {
      while (!is_over) {
        std::error_code error;
        marrow::rename_unused(one, to, error);
        if (!error) fs::remove(to, error);
      }
    });
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  while (std::chrono::steady_clock::now() < end && !HasFailure()) {
    std::error_code error;
    fs::create_directory(one, error);
    const std::shared_ptr<const void> use = marrow::use_folder(one);
    for (int i = 0; use && i < 5; ++i) {
      std::this_thread::yield();
      EXPECT_TRUE(fs::exists(one));
    }
  }
  is_over = true;
  for (std::thread& remover : removers) remover.join();
}

}  // namespace store_folder_test
