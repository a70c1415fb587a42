// SPDX-License-Identifier: Apache-2.0
// Entries that do not match their names, or that no run ever wrote.
#include "marrow/runtime/store/store_entry.hpp"

#include "tests/framework/store/store_fixture.hpp"

namespace store_entry_test {

using namespace marrow;
namespace fs = std::filesystem;
using runtime_fixture::Scratch;
using runtime_fixture::test_catalogue;
using store_fixture::kept_value;
using store_fixture::number;

class StoreEntryTest : public testing::Test {
 protected:
  fs::path file_of(const Digest& one) const { return entry_file(store.folder(), one); }
  /// Writes an entry with that description, whole and with its hash.
  void forge(EntryDescription description) {
    description.key = key;
    description.payload = 0;
    ASSERT_EQ(store.prepare(), "");
    ASSERT_EQ(write_whole(file_of(key), [&](Archive& out) { write_entry(out, description, {}); }), "");
  }
  Leaf leaf(bool present, std::uint64_t offset, std::uint64_t size) const {
    return {"metrics", 1, sizeof(Metrics), present, {}, offset, size, "", {}};
  }

  Scratch scratch;
  Store store{scratch.path / "store"};
  Digest key = hash_of(1), other = hash_of(2);
};

TEST_F(StoreEntryTest, AnEntryUnderAnothersNameIsNotAccepted) {
  ASSERT_EQ(store.save(key, {number(1)}, {}), "");
  ASSERT_EQ(store.save(other, {number(2)}, {}), "");
  fs::copy_file(file_of(key), file_of(other), fs::copy_options::overwrite_existing);
  EXPECT_FALSE(store.find(other));
  EXPECT_FALSE(fs::exists(file_of(other))) << "removed like a damaged entry";
  ASSERT_TRUE(store.find(key));
  EXPECT_EQ(store.find(key)->outputs[0].as<Metrics>().items[0].value, 1);
}

TEST_F(StoreEntryTest, WhatIsNoFileIsNoEntryAndIsLeft) {
  ASSERT_EQ(store.prepare(), "");
  fs::create_directory(file_of(key).parent_path());
  ASSERT_EQ(mkfifo(file_of(key).c_str(), 0600), 0);
  EXPECT_FALSE(store.find(key));
  EXPECT_TRUE(fs::is_fifo(file_of(key))) << "only a damaged entry is removed";
  ASSERT_EQ(store.save(key, {number(1)}, {}), "");
  EXPECT_TRUE(store.find(key));
}

TEST_F(StoreEntryTest, WhatWasNotMadeIsNotKept) {
  struct Never : Source {
    std::shared_ptr<const void> data(const TypeInfo&) override { return nullptr; }
  };
  Value missing = number(1);
  missing.data.reset();
  missing.source = std::make_shared<Never>();
  EXPECT_HAS(store.save(key, {missing}, {}), "a result that was not made is not kept");
  EXPECT_FALSE(fs::exists(file_of(key)));
}

TEST_F(StoreEntryTest, WhatAnotherPlaceCameToIsNotAccepted) {
  store.remember("one", {{"node", {key, {}}}});
  ASSERT_EQ(store.last("one").count("node"), 1u);
  const fs::path folder = store.folder() / "last";
  fs::copy_file(folder / hash_of(std::string("one")).hex(), folder / hash_of(std::string("two")).hex());
  EXPECT_TRUE(store.last("two").empty());
}

TEST_F(StoreEntryTest, WhatOtherCallsOfAPlaceCameToStays) {
  store.remember("one", {{"a", {key, {}}}, {"b", {key, {}}}});
  store.remember("one", {{"b", {hash_of(7), {}}}});
  const Store::LastResults last = store.last("one");
  ASSERT_EQ(last.size(), 2u);
  EXPECT_EQ(last.at("a").key, key);
  EXPECT_EQ(last.at("b").key, hash_of(7));
}

TEST_F(StoreEntryTest, SizesThatWrapOrLieOutsideAreDamage) {
  constexpr std::uint64_t kMost = ~std::uint64_t(0);
  for (const auto& [offset, size] :
       {std::pair<std::uint64_t, std::uint64_t>{kMost - 99, 200}, {0, kMost}, {kMost, 1}, {1, 0}, {0, 1}}) {
    forge({{}, {}, {leaf(true, offset, size)}, 0});
    EXPECT_FALSE(store.find(key)) << offset << " " << size;
  }
  forge({{}, {}, {leaf(true, 0, 0)}, 0});
  ASSERT_TRUE(store.find(key));
  EXPECT_THROW(store.find(key)->outputs[0].as<Metrics>(), DamagedEntry) << "an empty value cannot be metrics";
}

TEST_F(StoreEntryTest, ListsThatAreNoneAreDamage) {
  Leaf list = leaf(false, 0, 0);
  list.axis = "side";
  list.names = {"a"};
  Leaf named = leaf(false, 0, 0);
  named.names = {"a"};
  Leaf with_data = list;
  with_data.present = true;
  forge({{}, {}, {list, leaf(false, 0, 0)}, 0});
  EXPECT_TRUE(store.find(key));
  for (const std::vector<Leaf>& leaves : {std::vector<Leaf>{list},
                                          {named, leaf(false, 0, 0)},
                                          {with_data, leaf(false, 0, 0)},
                                          std::vector<Leaf>(100000, list)}) {
    forge({{}, {}, leaves, 0});
    EXPECT_FALSE(store.find(key)) << leaves.size() << " leaves";
  }
}

TEST_F(StoreEntryTest, AFileThatGetsShorterWhileItIsReadIsDamageAndNoCrash) {
  Volume volume;
  volume.grid.size = {1 << 20, 1, 1};
  volume.values.assign(volume.grid.count(), 1.5f);
  ASSERT_EQ(store.save(key, {kept_value(volume)}, {}), "");
  const auto found = store.find(key);
  ASSERT_TRUE(found);
  ASSERT_EQ(truncate(file_of(key).c_str(), 100000), 0);
  EXPECT_THROW(found->outputs[0].as<Volume>(), DamagedEntry);

  const fs::path part = scratch.write("part", std::string(1000000, 'x'));
  const StoreFile file(part);
  FileUnpacker unpacker(file, 0, file.size());
  unpacker.get<char>();
  ASSERT_EQ(truncate(part.c_str(), 500000), 0);
  EXPECT_THROW((unpacker.get<std::array<char, 600000>>()), marrow::Error);
}

TEST_F(StoreEntryTest, LargeAndSmallPartsComeBackInOrder) {
  std::vector<std::string> texts;
  for (int i = 0; i < 200; ++i) texts.push_back(std::string(std::size_t(i) * 1717, char('a' + i % 26)));
  Packer packer;
  packer.add(texts);
  const StoreFile file(scratch.write("texts", "before" + packer.packed + "after"));
  FileUnpacker unpacker(file, 6, packer.packed.size());
  EXPECT_EQ(unpacker.get<std::vector<std::string>>(), texts);
  EXPECT_EQ(unpacker.remaining(), 0u);
  EXPECT_EQ(unpacker.digest(), hash_of_bytes(packer.packed.data(), packer.packed.size()));
}

TEST_F(StoreEntryTest, AValueOfAnotherTypeIsNotRead) {
  ASSERT_EQ(store.save(key, {number(1)}, {}), "");
  EXPECT_THROW(store.find(key)->outputs[0].as<Mesh>(), DamagedEntry);
}

TEST_F(StoreEntryTest, AResultOfOtherTypesThanTheNodesIsMadeAgain) {
  Diagnostics diagnostics;
  const Pipeline pipeline = read_pipeline(
      scratch.write("p.yaml", "marrow: 1\nnodes:\n  c: {uses: test.constant, with: {value: 5}}\noutputs: {c: c}\n"), {},
      test_catalogue(), diagnostics);
  ASSERT_TRUE(diagnostics.empty()) << diagnostics.text();
  RunSettings settings;
  settings.store = &store;
  const auto calls = [&] { return run_pipeline(pipeline, test_catalogue(), settings).nodes[0].calls; };
  EXPECT_EQ(calls(), 1);
  EXPECT_EQ(calls(), 0);
  const Digest result = store.entries().at(0).key;
  Value newer = number(1);
  ++newer.type.version;
  Value larger = number(1);
  ++larger.type.size;
  Value list = number(1);
  list.axis = "side";
  list.names = {"a"};
  list.items = {number(1)};
  list.data = nullptr;
  for (const Value& wrong : {kept_value(Mesh{}), newer, larger, list}) {
    ASSERT_EQ(store.save(result, {wrong}, {}), "");
    EXPECT_EQ(calls(), 1) << wrong.type.id << " " << wrong.type.version << " " << wrong.axis;
    EXPECT_EQ(calls(), 0);
  }
}

}  // namespace store_entry_test
