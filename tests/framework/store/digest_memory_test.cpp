// SPDX-License-Identifier: Apache-2.0
// Digests of large files are kept between processes.
#include "marrow/runtime/store/digest_memory.hpp"

#include <thread>

#include "tests/framework/store/store_fixture.hpp"

namespace digest_memory_test {

namespace fs = std::filesystem;
using marrow::Digest;
using store_fixture::StoreTest;

class DigestMemoryTest : public StoreTest {
 protected:
  /// A file that is large enough to be kept. It was changed just now.
  fs::path large(char content) { return scratch.write("ct.mha", std::string(5 << 20, content)); }
  /// The digest as it goes into the keys of results.
  Digest digest_of(const fs::path& file) {
    const marrow::FileState state = *marrow::state_of(file);
    const auto read = [&] {
      ++readings;
      return marrow::hash_of(readings);
    };
    return marrow::is_settled(file, state) ? marrow::digest_in_state(file, state, read) : read();
  }
  fs::path only_record() const { return fs::directory_iterator(store.folder() / "digests")->path(); }
  void wait_until_settled() { std::this_thread::sleep_for(std::chrono::milliseconds(3100)); }
  void SetUp() override { marrow::keep_digests_in(store.folder()); }
  int readings = 0;
};

TEST_F(DigestMemoryTest, ALargeFileIsReadOnceUntilItChanges) {
  const fs::path file = large('a');
  digest_of(file);
  digest_of(file);
  EXPECT_EQ(readings, 2) << "a file that was changed just now may change again within the resolution of its time";
  wait_until_settled();
  if (!marrow::is_settled(file, *marrow::state_of(file)))
    GTEST_SKIP() << "the scratch folder is not on a disk of this host";
  const Digest kept = digest_of(file);
  EXPECT_EQ(readings, 3);
  EXPECT_EQ(digest_of(file), kept);
  EXPECT_EQ(readings, 3);

  const fs::path record = only_record();
  fs::resize_file(record, fs::file_size(record) - 1);
  EXPECT_NE(digest_of(file), kept) << "a damaged record is ignored";
  EXPECT_EQ(readings, 4);
  fs::rename(record, record.parent_path() / marrow::hash_of(1).hex());
  digest_of(file);
  EXPECT_EQ(readings, 5) << "the record of another state is ignored too";

  large('b');
  wait_until_settled();
  digest_of(file);
  EXPECT_EQ(readings, 6);
  store.collect(0);
  EXPECT_TRUE(fs::is_empty(store.folder() / "digests"));
}

TEST_F(DigestMemoryTest, SmallFilesAreReadEachTime) {
  const fs::path file = scratch.write("points.yaml", "small");
  wait_until_settled();
  for (int i = 1; i <= 2; ++i) {
    digest_of(file);
    EXPECT_EQ(readings, i);
  }
}

using marrow::KnownKeys;

int times_hashed = 0;

marrow::Value number(std::shared_ptr<const int> data, const std::string& type = "test_number") {
  static constexpr marrow::Content kContent{[](const void* at) {
                                              ++times_hashed;
                                              return Digest{std::uint64_t(*static_cast<const int*>(at)), 1};
                                            },
                                            nullptr, nullptr};
  marrow::Value value;
  value.type = {type, 1, sizeof(int), false, &kContent};
  value.data = std::move(data);
  return value;
}

TEST(KnownKeys, DataAreHashedOnceWhileTheyLive) {
  KnownKeys keys;
  times_hashed = 0;
  const auto seven = std::make_shared<const int>(7);
  EXPECT_EQ(keys.key_of(number(seven)), (Digest{7, 1}));
  EXPECT_EQ(keys.key_of(number(seven)), (Digest{7, 1}));
  EXPECT_EQ(times_hashed, 1);
  EXPECT_EQ(keys.key_of(number(std::make_shared<const int>(8))), (Digest{8, 1}));
  EXPECT_EQ(times_hashed, 2);
}

TEST(KnownKeys, OtherDataAtTheSameAddressAreHashedAnew) {
  KnownKeys keys;
  int here = 1;
  const auto nothing = [](const int*) {};
  EXPECT_EQ(keys.key_of(number(std::shared_ptr<const int>(&here, nothing))), (Digest{1, 1}));
  here = 2;
  EXPECT_EQ(keys.key_of(number(std::shared_ptr<const int>(&here, nothing))), (Digest{2, 1}));
}

TEST(KnownKeys, TheSameAddressAsAnotherTypeIsHashedAnew) {
  KnownKeys keys;
  times_hashed = 0;
  const auto seven = std::make_shared<const int>(7);
  keys.key_of(number(seven));
  keys.key_of(number(seven, "another_type"));
  EXPECT_EQ(times_hashed, 2);
}

TEST(KnownKeys, DeadDataAreForgotten) {
  KnownKeys keys;
  const auto kept = std::make_shared<const int>(5);
  keys.key_of(number(kept));
  times_hashed = 0;
  for (int i = 0; i < 1000; ++i) keys.key_of(number(std::make_shared<const int>(i)));
  EXPECT_EQ(times_hashed, 1000);
  EXPECT_EQ(keys.key_of(number(kept)), (Digest{5, 1}));
  EXPECT_EQ(times_hashed, 1000) << "data that still exist are still known";
}

}  // namespace digest_memory_test
