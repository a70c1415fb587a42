// SPDX-License-Identifier: Apache-2.0
// The store that hosts share: what is kept there, who may read it, and what its faults do.
#include "marrow/runtime/store/shared_store.hpp"
#include "marrow/runtime/store/shared_folder.hpp"

#include <sys/wait.h>

#include <thread>

#include "marrow/runtime/store/store_entry.hpp"
#include "tests/framework/identities.hpp"
#include "tests/framework/store/store_fixture.hpp"

namespace shared_store_test {

using namespace marrow;
namespace fs = std::filesystem;
using store_fixture::many;
using store_fixture::mode_of;
using store_fixture::number;
using store_fixture::StoreTest;

void set_age(const fs::path& path, std::chrono::hours age) {
  fs::last_write_time(path, fs::file_time_type::clock::now() - age);
}

/// The provenance of a result that took this many seconds.
Provenance took(double seconds) {
  Provenance provenance;
  provenance.node = "test.work";
  provenance.seconds = seconds;
  return provenance;
}

/// A shared folder and the stores of two hosts in front of it.
class SharedStoreTest : public StoreTest {
 protected:
  void SetUp() override {
    fs::create_directory(folder);
    chmod(folder.c_str(), 0700);
  }
  std::shared_ptr<SharedStore> open() const { return std::make_shared<SharedStore>(folder); }
  fs::path file_of(const Digest& one) const { return entry_file(folder, one); }
  std::size_t files_below(const fs::path& path) const {
    std::size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(path)) count += entry.is_regular_file();
    return count;
  }
  void offer(SharedStore& to, const Digest& key, double value, double seconds = 2) {
    to.offer(key, {number(value)}, took(seconds));
  }
  static std::optional<double> value_of(const std::optional<StoredResult>& found) {
    if (!found) return std::nullopt;
    return found->outputs.at(0).as<Metrics>().items.at(0).value;
  }
  /// Why the folder cannot be used.
  std::string fault() const { return open()->fault(); }

  fs::path folder = scratch.path / "shared";
  Digest key = hash_of(1);
  runtime_fixture::Environment environment;
};

TEST_F(SharedStoreTest, AResultIsCopiedToAHostThatLacksIt) {
  const auto shared = open();
  offer(*shared, key, 7);
  const Store host(scratch.path / "host", shared);
  EXPECT_FALSE(host.find(key, Store::Where::here));
  EXPECT_EQ(value_of(host.find(key)), 7);
  EXPECT_EQ(value_of(host.find(key, Store::Where::here)), 7) << "it was copied";
  EXPECT_EQ(host.find(key)->provenance.seconds, 2);
  EXPECT_FALSE(host.find(hash_of(2), Store::Where::anew));
  EXPECT_EQ(shared->complaint(), "");
}

TEST_F(SharedStoreTest, ALargeResultIsReadWhereItIs) {
  const auto shared = open();
  shared->offer(key, {many(300000)}, took(2));
  environment.set("MARROW_CACHE_GB", "0.01");  // a tenth of it is 1 MB, and the result has 1.2 MB
  const Store host(scratch.path / "host", shared);
  const auto found = host.find(key);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->outputs[0].as<Volume>().values[999], 999);
  EXPECT_FALSE(host.find(key, Store::Where::here));
}

TEST_F(SharedStoreTest, OnlyWhatTakesLongerThanReadingItIsKept) {
  const auto shared = open();
  offer(*shared, hash_of(1), 1, 0.9);
  offer(*shared, hash_of(2), 1, 1.1);
  shared->offer(hash_of(3), {many(5000000)}, took(1.9));  // 20 MB
  shared->offer(hash_of(4), {many(5000000)}, took(2.1));
  EXPECT_FALSE(fs::exists(file_of(hash_of(1))));
  EXPECT_TRUE(fs::exists(file_of(hash_of(2))));
  EXPECT_FALSE(fs::exists(file_of(hash_of(3))));
  EXPECT_TRUE(fs::exists(file_of(hash_of(4))));
}

TEST_F(SharedStoreTest, TheNumberOfFilesMayBeLimited) {
  const auto shared = open();
  EXPECT_TRUE(shared->accepts());
  shared->allow_files(0);
  EXPECT_FALSE(shared->accepts());
  offer(*shared, hash_of(1), 1);
  shared->allow_files(2);
  for (int i = 2; i <= 5; ++i) offer(*shared, hash_of(i), 1);
  EXPECT_FALSE(shared->accepts());
  EXPECT_EQ(shared->entries().size(), 2u);
}

TEST_F(SharedStoreTest, ADamagedResultIsNotUsedAndIsReplaced) {
  const auto shared = open();
  offer(*shared, key, 7);
  std::fstream(file_of(key), std::ios::in | std::ios::out).seekp(-3, std::ios::end).put('x');
  const Store host(scratch.path / "host", shared);
  EXPECT_FALSE(host.find(key));
  EXPECT_FALSE(host.find(key, Store::Where::here)) << "it was not copied either";
  EXPECT_EQ(shared->complaint(), "") << "another host may replace it";
  offer(*shared, key, 7);
  EXPECT_EQ(value_of(host.find(key)), 7);
  fs::resize_file(file_of(key), 10);
  fs::remove(entry_file(host.folder(), key));
  EXPECT_FALSE(host.find(key));
  fs::rename(file_of(key), scratch.path / "cut");
  offer(*shared, hash_of(2), 8);
  fs::create_directories(file_of(key).parent_path());
  fs::rename(file_of(hash_of(2)), file_of(key));
  EXPECT_FALSE(host.find(key)) << "another result under its name";
}

TEST_F(SharedStoreTest, ItIsUsedByRunsOfTwoHosts) {
  settings.wanted_by_others = {{"w"}};
  const std::string nodes = "  w: {uses: test.work, with: {value: 1.05}}\n  own: {uses: test.add, in: {a: w, b: w}}\n";
  const auto run_on = [&](const char* host) {
    const Store of_host(scratch.path / host, open());
    read(nodes, "o: own");
    settings.store = &of_host;
    return run_pipeline(pipeline, store_fixture::test_catalogue(), settings);
  };
  const RunResult first = run_on("first"), second = run_on("second");
  EXPECT_EQ(first.nodes[0].calls, 1);
  EXPECT_EQ(second.nodes[0].calls, 0);
  EXPECT_EQ(second.nodes[0].cached, 1);
  EXPECT_EQ(second.nodes[1].calls, 1) << "no other cell needs it, and it is quick";
  EXPECT_EQ(result_of(first), result_of(second));
  EXPECT_EQ(files_below(folder), 2u) << "the result and the marker";
}

TEST_F(SharedStoreTest, AFaultIsSaidOnceAndTheRunGoesOn) {
  const auto shared = open();
  offer(*shared, hash_of(0), 7);
  std::ofstream(file_of(key).parent_path()) << "no folder";
  const Store host(scratch.path / "host", shared);
  EXPECT_FALSE(host.find(key));
  EXPECT_EQ(shared->complaint(),
            "cannot read " + file_of(key).string() + ": Not a directory; the shared store is not used");
  EXPECT_FALSE(host.find(key));
  EXPECT_EQ(shared->complaint(), "");
  EXPECT_FALSE(shared->accepts());
  EXPECT_FALSE(shared->claim(hash_of(3), nullptr).is_held());
  EXPECT_EQ(host.save(key, {number(1)}, {}), "");

  const auto writes = open();
  offer(*writes, key, 7);
  EXPECT_EQ(writes->complaint(),
            "cannot write " + file_of(key).string() + ": Not a directory; nothing more is written to the shared store");
  EXPECT_EQ(value_of(Store(scratch.path / "other", writes).find(hash_of(0))), 7) << "existing results are still read";
}

TEST_F(SharedStoreTest, ItsUseIsNotedOnceADay) {
  const auto shared = open();
  offer(*shared, key, 7);
  const auto age = [&] { return fs::file_time_type::clock::now() - fs::last_write_time(file_of(key)); };
  set_age(file_of(key), std::chrono::hours(20));
  EXPECT_TRUE(Store(scratch.path / "host1", shared).find(key));
  EXPECT_GT(age(), std::chrono::hours(19));
  set_age(file_of(key), std::chrono::hours(30));
  EXPECT_TRUE(Store(scratch.path / "host2", shared).find(key));
  EXPECT_LT(age(), std::chrono::hours(1));
}

TEST_F(SharedStoreTest, AGroupMayUseItIfTheFolderSaysSo) {
  const mode_t before = umask(077);
  for (const auto& [of_folder, of_file] :
       std::map<mode_t, mode_t>{{02770, 0660}, {0770, 0660}, {02750, 0640}, {0700, 0600}}) {
    fs::remove_all(folder);
    fs::create_directory(folder);
    ASSERT_EQ(chmod(folder.c_str(), of_folder), 0);
    const auto shared = open();
    offer(*shared, key, 7);
    const SharedClaim claim = shared->claim(key, nullptr);
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      EXPECT_EQ(mode_of(entry.path()), entry.is_directory() ? of_folder : of_file) << entry.path();
    EXPECT_EQ(files_below(folder), 3u) << "the marker, the result and the claim";
  }
  umask(before);
}

TEST_F(SharedStoreTest, WhatAnotherGroupWouldReadIsPrivate) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a folder to another group";
  const Permissions of_group_4711{0660, 0770, gid_t(4711)};
  const fs::path file = folder / "file";
  ASSERT_EQ(write_whole(
                file, [](Archive&) {}, false, of_group_4711),
            "");
  struct stat status {};
  ASSERT_EQ(stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_gid, 4711u) << "root may give it away";
  const pid_t child = fork();
  if (child == 0) {  // a user who is not in the group
    if (chmod(folder.c_str(), 0777) != 0 || chmod(scratch.path.c_str(), 0755) != 0 || setgid(1234) != 0 ||
        setuid(1234) != 0)
      _exit(2);
    const bool is_written = write_whole(
                                folder / "mine", [](Archive&) {}, false, of_group_4711)
                                .empty();
    _exit(is_written && mode_of(folder / "mine") == 0600 ? 0 : 1);
  }
  int ended = 0;
  waitpid(child, &ended, 0);
  EXPECT_EQ(ended, 0);
}

TEST_F(SharedStoreTest, FoldersThatAreRefused) {
  chmod(folder.c_str(), 01777);
  EXPECT_EQ(fault(), "everybody may write to " + folder.string() + "; take that from them (chmod o-w)");
  chmod(folder.c_str(), 0700);
  scratch.write("shared/letter.txt", "");
  EXPECT_EQ(fault(), "the folder " + folder.string() +
                         " holds other things and is no shared store of marrow; set MARROW_SHARED_CACHE to a folder "
                         "for it, or unset it");
  fs::remove_all(folder);
  EXPECT_EQ(fault(), "the folder " + folder.string() +
                         " does not exist on this host; make it (for a group: mkdir -m 2770), or mount it");
  scratch.write("shared", "");
  EXPECT_EQ(fault(), folder.string() + " is no folder; set MARROW_SHARED_CACHE to a folder for it, or unset it");
  fs::remove(folder);
  fs::create_directory(folder);
  EXPECT_EQ(Store(folder).prepare(), "") << "a store of one host";
  EXPECT_HAS(fault(), "holds other things");
  const auto refused = open();
  offer(*refused, key, 1);
  EXPECT_EQ(refused->complaint(), fault() + "; the shared store is not used");
}

TEST_F(SharedStoreTest, ASharedStoreIsNoStoreOfOneHost) {
  offer(*open(), key, 1);
  EXPECT_HAS(Store(folder).fault(), "holds other things and is no store of marrow");
}

TEST_F(SharedStoreTest, ItIsTheOneOfTheEnvironment) {
  environment.set("MARROW_CACHE", (scratch.path / "host").string());
  for (const char* none : {"", static_cast<const char*>(nullptr)}) {
    environment.set("MARROW_SHARED_CACHE", none ? std::optional<std::string>(none) : std::nullopt);
    EXPECT_EQ(Store().shared(), nullptr);
  }
  environment.set("MARROW_SHARED_CACHE", folder.string());
  ASSERT_TRUE(Store().shared());
  EXPECT_EQ(Store().shared()->folder(), folder);
  EXPECT_EQ(Store(folder).shared(), nullptr);
}

TEST_F(SharedStoreTest, ASimulatedCaseIsOneFile) {
  const fs::path made = scratch.path / "made", taken = scratch.path / "taken";
  fs::create_directories(made / "outputs" / "case");
  std::ofstream(made / "outputs" / "case" / "ct.mha") << std::string(3000000, 'v');
  std::ofstream(made / "content.txt") << "hash\n";
  std::ofstream(made / "empty") << "";
  const auto shared = open();
  shared->offer_case(key, made);
  EXPECT_EQ(shared->complaint(), "");
  EXPECT_EQ(files_below(folder), 2u) << "the case and the marker";
  ASSERT_TRUE(shared->fetch_case(key, taken, SharedLook::quick));
  for (const char* name : {"outputs/case/ct.mha", "content.txt", "empty"}) {
    std::ifstream a(made / name), b(taken / name);
    EXPECT_TRUE(std::equal(std::istreambuf_iterator<char>(a), {}, std::istreambuf_iterator<char>(b), {})) << name;
  }
  EXPECT_EQ(files_below(taken), 3u);
  EXPECT_EQ(mode_of(taken / "content.txt"), 0600u);
  EXPECT_FALSE(shared->fetch_case(hash_of(2), taken, SharedLook::listed));

  std::fstream(file_of(key), std::ios::in | std::ios::out).seekp(-3, std::ios::end).put('x');
  EXPECT_FALSE(shared->fetch_case(key, scratch.path / "damaged", SharedLook::quick));
}

TEST_F(SharedStoreTest, ACaseNeverWritesOutsideItsFolder) {
  const auto shared = open();
  ASSERT_TRUE(shared->accepts());
  for (const char* name : {"../outside", "/tmp/marrow-outside", "a/../../outside", "", "a/", "."}) {
    EntryDescription description;
    description.key = key;
    description.payload = 4;
    description.leaves.push_back({name, 0, 0, true, hash_of_bytes("text", 4), 0, 4, "", {}});
    ASSERT_EQ(write_whole(file_of(key),
                          [&](Archive& out) {
                            write_description(out, description);
                            out.bytes("text", 4);
                          }),
              "");
    EXPECT_FALSE(shared->fetch_case(key, scratch.path / "taken", SharedLook::quick)) << name;
    EXPECT_FALSE(fs::exists(scratch.path / "outside"));
    EXPECT_FALSE(fs::exists("/tmp/marrow-outside"));
  }
}

TEST_F(SharedStoreTest, WhatIsCollected) {
  const auto shared = open();
  for (int i = 1; i <= 3; ++i) offer(*shared, hash_of(i), i);
  set_age(file_of(hash_of(1)), std::chrono::hours(50));
  set_age(file_of(hash_of(2)), std::chrono::hours(60));
  const std::string elsewhere = runtime_fixture::process_elsewhere(), ended = runtime_fixture::ended_process();
  const auto temporary = [&](const std::string& writer) {
    return fs::path(file_of(hash_of(1)).string() + ".tmp-" + writer + "-0");
  };
  fs::create_directory(folder / "claims");
  for (const std::string& writer : {elsewhere, ended}) {
    std::ofstream(temporary(writer)) << "half a result";
    std::ofstream(folder / "claims" / hash_of(writer).hex()) << writer << " 1 30 0\n";
  }
  const std::uint64_t size = fs::file_size(file_of(hash_of(1)));
  EXPECT_EQ(shared->collect(2 * size).entries, 1u);
  EXPECT_FALSE(fs::exists(file_of(hash_of(2)))) << "it is the least recently used";
  EXPECT_TRUE(fs::exists(file_of(hash_of(1))));
  EXPECT_TRUE(fs::exists(temporary(elsewhere)));
  EXPECT_TRUE(fs::exists(folder / "claims" / hash_of(elsewhere).hex()));
  EXPECT_FALSE(fs::exists(temporary(ended)));
  EXPECT_FALSE(fs::exists(folder / "claims" / hash_of(ended).hex()));
  set_age(temporary(elsewhere), std::chrono::hours(25));
  set_age(folder / "claims" / hash_of(elsewhere).hex(), std::chrono::hours(25));
  EXPECT_EQ(shared->collect(0).entries, 2u);
  EXPECT_FALSE(fs::exists(temporary(elsewhere)));
  EXPECT_TRUE(fs::is_empty(folder / "claims"));
  EXPECT_TRUE(shared->entries().empty());
}

TEST_F(SharedStoreTest, ManyThatMakeItAtTheSameTimeAllUseIt) {
  for (int round = 0; round < 100 && !HasFailure(); ++round) {
    const fs::path place = folder / std::to_string(round);
    fs::create_directory(place);
    fs::permissions(place, fs::perms::owner_all);
    std::atomic<int> ready{0};
    std::vector<std::thread> makers;
    for (int k = 0; k < 4; ++k)
      makers.emplace_back([&] {
        for (++ready; ready < 4;) std::this_thread::yield();
        const SharedFolderState state = make_shared(place);
        EXPECT_TRUE(state.is_store) << state.fault;
      });
    for (std::thread& maker : makers) maker.join();
  }
}

TEST_F(SharedStoreTest, TheTimeIsThatOfTheFileSystem) {
  const auto now = time_in(folder);
  ASSERT_TRUE(now);
  EXPECT_NEAR(double(now->tv_sec), double(time(nullptr)), 60) << "the folder is on a disk of this host";
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_FALSE(time_in(folder / "absent"));
}

}  // namespace shared_store_test
