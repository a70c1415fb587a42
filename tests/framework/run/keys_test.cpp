// SPDX-License-Identifier: Apache-2.0
// Each thing that may change a result changes its key, on its own; nothing else does.
#include "marrow/runtime/run/keys.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <thread>

#include "marrow/runtime/run/node_calls.hpp"
#include "tests/framework/fixture.hpp"

namespace keys_test {

using namespace marrow;
namespace fs = std::filesystem;

class Keys : public testing::Test {
 protected:
  Keys() {
    node_.info.name = "kind.one";
    add("flag", OptionType::boolean, false);
    add("count", OptionType::integer, std::int64_t(3));
    add("size", OptionType::number, 1.5);
    add("word", OptionType::text, std::string("a"));
    add("sizes", OptionType::numbers, std::vector<double>{1, 2});
    add("words", OptionType::texts, std::vector<std::string>{"a", "b"});
    add("file", OptionType::path, write("file", "content"));
    add("files", OptionType::paths, std::vector<std::string>{write("first", "1"), write("second", "2")});
    write("below/a", "1");
    write("below/deep/b", "2");
    add("folder", OptionType::path, (folder_ / "below").string());
    for (const char* name : {"image", "views"}) {
      node_.info.inputs.push_back({});
      node_.info.inputs.back().name = name;
    }
    Value image, views;
    image.key = {1, 2};
    views.axis = "view";
    views.names = {"frontal", "lateral"};
    views.items.resize(2);
    views.items[0].key = {3, 4};
    views.items[1].key = {5, 6};
    inputs_ = {image, views};
  }
  void add(const std::string& name, OptionType type, const OptionValue& value) {
    OptionInfo info;
    info.name = name;
    info.type = type;
    node_.info.options.push_back(info);
    node_.options.push_back(value);
  }
  OptionValue& option(const std::string& name) {
    std::size_t i = 0;
    while (node_.info.options.at(i).name != name) ++i;
    return node_.options[i];
  }
  std::string write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  Digest recipe() const { return recipe_of(node_, inputs_); }

  const runtime_fixture::Scratch scratch_;
  const fs::path& folder_ = scratch_.path;
  PipelineNode node_;
  std::vector<Value> inputs_;
};

TEST_F(Keys, EachPartOfARecipeCountsOnItsOwn) {
  const PipelineNode node = node_;
  const std::vector<Value> inputs = inputs_;
  std::set<Digest> seen{recipe()};
  EXPECT_EQ(recipe(), *seen.begin()) << "the same each time";
  const auto is_new = [&](const char* what) {
    EXPECT_TRUE(seen.insert(recipe()).second) << what;
    node_ = node;
    inputs_ = inputs;
  };
  node_.info.name = "kind.other";
  is_new("the node");
  const std::vector<std::pair<std::string, OptionValue>> others{
      {"flag", true},
      {"count", std::int64_t(4)},
      {"size", std::nextafter(1.5, 2)},
      {"word", std::string("b")},
      {"sizes", std::vector<double>{2, 1}},
      {"words", std::vector<std::string>{"ab", ""}},
      {"file", write("other", "other content")},
      {"files", std::vector<std::string>{write("first", "1"), write("third", "3")}},
      {"folder", std::string()}};
  for (const auto& [name, value] : others) {
    option(name) = value;
    is_new(name.c_str());
    for (OptionInfo& info : node_.info.options)
      if (info.name == name) info.name += "_renamed";
    is_new((name + ", renamed").c_str());
  }
  inputs_[0].key.low = 9;
  is_new("an input");
  inputs_[0].key.high = 9;
  is_new("the other half of its key");
  inputs_[1].items[1].key.low = 9;
  is_new("the second item of a list");
  inputs_[1].items.pop_back();
  inputs_[1].names.pop_back();
  is_new("the length of a list");
  inputs_[1].names[0] = "oblique";
  is_new("the name of an item");
  inputs_[1].axis = "frame";
  is_new("the axis of a list");
  std::swap(inputs_[1].items[0], inputs_[1].items[1]);
  is_new("the order of a list");
  node_.info.inputs[0].name = "mask";
  is_new("the port");
}

TEST_F(Keys, FilesBesideTheNamedOneCount) {
  const std::string named = write("networks/bones.yaml", "what it is"), model = write("networks/bones.onnx", "a");
  option("file") = named;
  const Digest without = recipe();
  for (OptionInfo& info : node_.info.options)
    if (info.name == "file") info.beside = {".onnx"};
  std::set<Digest> seen{without, recipe()};
  EXPECT_EQ(seen.size(), 2u) << "the file beside it";
  write("networks/other.onnx", "other");
  EXPECT_FALSE(seen.insert(recipe()).second) << "a file of another name";
  write("networks/bones.onnx", "b");
  EXPECT_TRUE(seen.insert(recipe()).second) << "its content";
  fs::remove(model);
  EXPECT_TRUE(seen.insert(recipe()).second) << "it is gone";
}

TEST_F(Keys, FilesCountByTheirContentAndNames) {
  const Digest before = recipe();
  std::set<Digest> seen{before};
  // As long as before and perhaps within the same tick of the clock: it is read again.
  write("file", "CONTENT");
  EXPECT_TRUE(seen.insert(recipe()).second) << "the content of a file";
  write("file", "content");
  EXPECT_EQ(recipe(), before);
  option("file") = write("elsewhere/file", "content");
  EXPECT_EQ(recipe(), before) << "where it lies is no part of it";
  option("file") = write("elsewhere/other", "content");
  EXPECT_TRUE(seen.insert(recipe()).second) << "what it is called may name an item, or say how it is read";
  option("file") = write("file", "content");
  write("second", "3");
  EXPECT_TRUE(seen.insert(recipe()).second) << "the content of a second file";
  write("second", "2");
  write("below/deep/b", "3");
  EXPECT_TRUE(seen.insert(recipe()).second) << "a file deep in a folder";
  write("below/deep/b", "2");
  write("below/deep/c", "");
  EXPECT_TRUE(seen.insert(recipe()).second) << "one more file";
  fs::remove(folder_ / "below/deep/c");
  fs::rename(folder_ / "below/deep/b", folder_ / "below/deep/d");
  EXPECT_TRUE(seen.insert(recipe()).second) << "the name of a file";
  fs::rename(folder_ / "below/deep/d", folder_ / "below/deep/b");
  EXPECT_EQ(recipe(), before);
  fs::remove(folder_ / "second");
  EXPECT_TRUE(seen.insert(recipe()).second) << "a file that is gone";
}

TEST_F(Keys, AFileIsNoneOfAFolderThatHoldsItAlone) {
  std::set<Digest> seen;
  option("folder") = write("alone/ct", "content");
  seen.insert(recipe());
  option("folder") = (folder_ / "alone").string();
  EXPECT_TRUE(seen.insert(recipe()).second) << "the folder";
  write("around/alone/ct", "content");
  option("folder") = (folder_ / "around").string();
  EXPECT_TRUE(seen.insert(recipe()).second) << "a folder around it";
  fs::create_directory(folder_ / "empty");
  option("folder") = (folder_ / "empty").string();
  EXPECT_TRUE(seen.insert(recipe()).second) << "an empty folder";
  option("folder") = (folder_ / "absent").string();
  EXPECT_TRUE(seen.insert(recipe()).second) << "nothing";
}

TEST_F(Keys, FoldersOfAListKeepTheirFiles) {
  for (const char* name : {"left/a", "left/b", "right/c", "one/a", "two/b", "two/c"}) write(name, "same");
  const auto list = [&](const char* first, const char* second) {
    option("files") = std::vector<std::string>{(folder_ / first).string(), (folder_ / second).string()};
    return recipe();
  };
  EXPECT_NE(list("left", "right"), list("one", "two"));
  EXPECT_NE(list("left", "right"), list("right", "left"));
}

TEST_F(Keys, FilesKnownFromBeforeAreReadAgainWhenTheirSizeOrTimeIsAnother) {
  const fs::path file = write("old", "one");
  const auto day = std::chrono::hours(24);
  fs::last_write_time(file, fs::file_time_type::clock::now() - 2 * day);
  const Digest one = path_digest(file);
  write("old", "two");
  fs::last_write_time(file, fs::file_time_type::clock::now() - day);
  const Digest two = path_digest(file);
  EXPECT_NE(two, one) << "another time";
  const auto time = fs::last_write_time(file);
  write("old", "twenty");
  fs::last_write_time(file, time);
  EXPECT_NE(path_digest(file), two) << "another size";
  write("old", "two");
  EXPECT_EQ(path_digest(file), two);
}

TEST_F(Keys, WritesThroughMemoryDoNotPass) {
  const std::string file = write("file", std::string(10000, 'x'));
  struct statfs system {};
  ASSERT_EQ(statfs(file.c_str(), &system), 0);
  const int descriptor = open(file.c_str(), O_RDWR | O_CLOEXEC);
  auto* text = static_cast<char*>(mmap(nullptr, 10000, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0));
  close(descriptor);
  ASSERT_NE(static_cast<void*>(text), MAP_FAILED);
  const auto write_later = [&](char c) {  // by more than the resolution of the file's time
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    text[5000] = c;
  };
  write_later('a');
  const Digest state = states_of_files(node_);
  write_back_files(node_);
  EXPECT_EQ(states_of_files(node_), state);
  write_later('b');
  EXPECT_TRUE(system.f_type == TMPFS_MAGIC || states_of_files(node_) != state) << "a node may be reading it";
  std::this_thread::sleep_for(std::chrono::milliseconds(3100));  // from then on a digest is kept
  const Digest before = path_digest(file);
  write_later('c');
  EXPECT_NE(path_digest(file), before);
  munmap(text, 10000);
}

TEST_F(Keys, AFileThatGrowsWithinATickOfTheClockHasAnotherState) {
  const std::string file = write("file", "x");
  std::ofstream stream(file, std::ios::app);
  Digest before = states_of_files(node_);
  for (int i = 0; i < 200; ++i) {  // many of these writes have the same time
    stream << 'x' << std::flush;
    const Digest now = states_of_files(node_);
    ASSERT_NE(now, before) << i;
    before = now;
  }
}

TEST_F(Keys, FilesInMemoryAreReadEachTime) {
  struct statfs system {};
  if (statfs("/dev/shm", &system) != 0 || system.f_type != TMPFS_MAGIC) GTEST_SKIP() << "there is no tmpfs";
  const std::string file = "/dev/shm/marrow-keys-" + std::to_string(getpid());
  std::ofstream(file) << std::string(100, 'x');
  const int descriptor = open(file.c_str(), O_RDWR | O_CLOEXEC);
  auto* text = static_cast<char*>(mmap(nullptr, 100, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0));
  close(descriptor);
  ASSERT_NE(static_cast<void*>(text), MAP_FAILED);
  std::this_thread::sleep_for(std::chrono::milliseconds(3100));  // elsewhere a digest is kept from then on
  const Digest before = path_digest(file);
  text[50] = 'a';  // gives the file no new time
  EXPECT_NE(path_digest(file), before);
  munmap(text, 100);
  fs::remove(file);
}

TEST_F(Keys, OfResults) {
  const Digest recipe{1, 2}, build{3, 4};
  const Digest key = result_key(recipe, build, false, 1);
  EXPECT_EQ(result_key(recipe, build, false, 2), key) << "the seed is none of what is not random";
  EXPECT_NE(result_key({1, 3}, build, false, 1), key);
  EXPECT_NE(result_key(recipe, {3, 5}, false, 1), key) << "the build id";
  EXPECT_NE(result_key(recipe, {4, 4}, false, 1), key) << "the other half of the build id";
  EXPECT_NE(result_key(recipe, build, true, 1), result_key(recipe, build, true, 2));
  for (const char* variable : {"OPENCV_CPU_DISABLE", "OPENCV_IPP", "GLIBC_TUNABLES"}) {
    setenv(variable, "glibc.malloc.hugetlb=1:glibc.cpu.hwcaps=-AVX2", 1);
    EXPECT_NE(result_key(recipe, build, false, 1), key) << variable;
    unsetenv(variable);
  }
  setenv("OPENCV_LOG_LEVEL", "INFO", 1);
  setenv("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1", 1);
  EXPECT_EQ(result_key(recipe, build, false, 1), key) << "what is printed, and where memory comes from, are none of it";
  unsetenv("OPENCV_LOG_LEVEL");
  unsetenv("GLIBC_TUNABLES");
  EXPECT_NE(function_key(key, 0), function_key(key, 1));
  EXPECT_NE(function_key(key, 0), function_key(recipe, 0));
  EXPECT_NE(seed_of(recipe, 1), seed_of(recipe, 2));
  EXPECT_NE(seed_of(recipe, 1), seed_of(build, 1));
}

TEST_F(Keys, OptionsInWords) {
  EXPECT_EQ(text_of(true, OptionType::boolean), "true");
  EXPECT_EQ(text_of(false, OptionType::boolean), "false");
  EXPECT_EQ(text_of(std::int64_t(-7), OptionType::integer), "-7");
  EXPECT_EQ(text_of(0.1, OptionType::number), "0.10000000000000001") << "all that counts for the key";
  EXPECT_EQ(text_of(std::string("word"), OptionType::text), "word");
  EXPECT_EQ(text_of(std::vector<double>{1, 2.5}, OptionType::numbers), "[1, 2.5]");
  EXPECT_EQ(text_of(std::vector<std::string>{"a", "b"}, OptionType::texts), "[a, b]");
  EXPECT_EQ(text_of(std::vector<std::string>{}, OptionType::texts), "[]");
  const std::string file = write("file", "content"),
                    content = " (content " + path_digest(file).hex().substr(0, 8) + ")";
  EXPECT_EQ(text_of(file, OptionType::path), file + content);
  EXPECT_EQ(text_of(std::vector<std::string>{file, file}, OptionType::paths),
            "[" + file + content + ", " + file + content + "]");
}

TEST_F(Keys, KeptWarningsNameTheFileThatIsReadNow) {
  Provenance kept;
  for (std::size_t i = 0; i < node_.options.size(); ++i)
    kept.options[node_.info.options[i].name] = text_of(node_.options[i], node_.info.options[i].type);
  const std::string before = std::get<std::string>(option("file")), now = write("elsewhere/file", "content");
  option("file") = now;
  EXPECT_EQ(warning_now(before + ": it has holes; " + before, node_, kept), now + ": it has holes; " + now);
  EXPECT_EQ(warning_now("holes", node_, kept), "holes");
  EXPECT_EQ(warning_now(before + ": it has holes", node_, {}), before + ": it has holes") << "nothing is known of it";
}

TEST_F(Keys, WhatMadeADifference) {
  Provenance before;
  before.node = "edges.canny";
  before.build_id = {1, 1};
  before.options = {{"high", "75"}, {"low", "50"}};
  before.inputs = {{"image", {1, 1}}, {"mask", {2, 2}}};
  before.seed = 1;
  Provenance now = before;
  now.seed = 2;
  now.seconds = 9;
  EXPECT_EQ(difference(before, now), "") << "it is not random";
  now.random = true;
  EXPECT_EQ(difference(before, now), "the seed is 2, was 1");
  now.seed = 1;
  EXPECT_EQ(difference(before, now), "");
  now.build_id = {1, 2};
  EXPECT_EQ(difference(before, now), "the plugin of edges.canny was rebuilt");
  now.options["high"] = "80";
  now.options["blur"] = "1";
  now.inputs["image"] = {3, 3};
  now.inputs["region"] = {};
  EXPECT_EQ(difference(before, now),
            "the plugin of edges.canny was rebuilt; option 'blur' is 1, was not there; option 'high' is 80, was 75; "
            "input 'image' changed; input 'region' changed");
  now.node = "edges.gradient_mask";
  EXPECT_EQ(difference(before, now),
            "it uses edges.gradient_mask, used edges.canny; input 'image' changed; input 'region' changed");
}

}  // namespace keys_test
