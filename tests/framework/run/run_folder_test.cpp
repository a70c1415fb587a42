// SPDX-License-Identifier: Apache-2.0
// The folder of a run: one run each, one file each output, nothing half.
#include "marrow/runtime/run/run_folder.hpp"

#include <sys/wait.h>

#include <cctype>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/framework/run_fixture.hpp"
#include "tests/plugins/write/full_disk.hpp"

namespace run_folder_test {

namespace fs = std::filesystem;
using marrow::RunFolder;
using marrow::test::message_of;
using runtime_fixture::Scratch;
using runtime_fixture::test_catalogue;

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

/// The nodes of the tests, and what writes their numbers.
const marrow::Catalogue& writing_catalogue() {
  static const Scratch plugins;
  static const marrow::Catalogue catalogue([] {
    const fs::path build = MARROW_BINARY_DIR;
    for (const fs::path& library :
         {build / "tests" / "plugins" / "marrow_test_numbers", build / "lib" / "marrow" / "marrow_write"})
      for (const char* extension : {".so", ".json"}) fs::copy(library.string() + extension, plugins.path);
    return std::vector<fs::path>{plugins.path};
  }());
  return catalogue;
}

class RunFolderTest : public run_fixture::RunTest {
 protected:
  marrow::Pipeline pipeline_of(const std::string& nodes, const std::string& outputs) {
    read(nodes, outputs);
    return pipeline;
  }
};

TEST_F(RunFolderTest, OfManyThatWantOneAtOnceOneGetsIt) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  for (int round = 0; round < 100; ++round) {
    const fs::path folder = scratch.path / ("out" + std::to_string(round));
    if (round % 2) fs::create_directory(folder);  // an empty one that was there
    std::atomic<int> good{0}, refused{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] {
        const std::string fault = message_of([&] { RunFolder{folder, pipeline}; });
        good += fault == "";
        refused += fault.find("was taken by another run just now; choose another with --out") != std::string::npos ||
                   fault.find("is already there and not empty") != std::string::npos;
      });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(good, 1);
    EXPECT_EQ(refused, 3);
    EXPECT_TRUE(fs::exists(folder / "pipeline.yaml"));
  }
}

TEST_F(RunFolderTest, FreeNamesAreTakenByOneEach) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  std::vector<pid_t> processes;
  for (int i = 0; i < 8; ++i) {
    const pid_t process = ::fork();
    if (process == 0) {
      try {
        for (int k = 0; k < 25; ++k)
          std::ofstream(RunFolder::with_free_name(scratch.path / "runs" / "p", pipeline).path() / "owner",
                        std::ios::app)
              << ::getpid() << '\n';
      } catch (...) {
        ::_exit(1);
      }
      ::_exit(0);
    }
    processes.push_back(process);
  }
  for (const pid_t process : processes) {
    int status = 1;
    ::waitpid(process, &status, 0);
    EXPECT_EQ(status, 0);
  }
  std::set<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(scratch.path / "runs")) {
    names.insert(entry.path().filename().string());
    const std::string owners = text_of(entry.path() / "owner");
    EXPECT_EQ(std::count(owners.begin(), owners.end(), '\n'), 1) << entry.path();
  }
  EXPECT_EQ(names.size(), 200u);
  EXPECT_TRUE(names.contains("p") && names.contains("p-2") && names.contains("p-200"));
}

TEST_F(RunFolderTest, WhatIsThereStays) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  for (const char* name : {"log.txt", "pipeline.yaml", "other"}) {
    const fs::path folder = scratch.path / (std::string("with ") + name);
    fs::create_directory(folder);
    std::ofstream(folder / name) << "mine";
    EXPECT_HAS(message_of([&] {
                 RunFolder{folder, pipeline};
               }),
               "is already there and not empty; choose another with --out");
    EXPECT_EQ(text_of(folder / name), "mine");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
  }
}

TEST_F(RunFolderTest, AFileIsNoFolder) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  std::ofstream(scratch.path / "file") << "";
  EXPECT_HAS(message_of([&] {
               RunFolder{scratch.path / "file", pipeline};
             }),
             "/file is a file; choose another with --out");
}

TEST_F(RunFolderTest, AfterAFullDiskASecondTrySucceeds) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  const fs::path folder = scratch.path / "out";
  {
    const marrow::test::FullDisk full(10);
    EXPECT_HAS(message_of([&] { RunFolder{folder, pipeline}; }), "cannot write");
  }
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_EQ(message_of([&] { RunFolder{folder, pipeline}; }), "");
}

TEST_F(RunFolderTest, FullDiskLeavesNoHalfRecordAndTheLogSaysSo) {
  const marrow::Pipeline pipeline = pipeline_of("  c: {uses: test.constant}\n", "o: c");
  const marrow::RunResult result = marrow::run_pipeline(pipeline, test_catalogue(), {});
  RunFolder folder(scratch.path / "out", pipeline);
  folder.log().show_from(marrow::LogLevel::error);
  folder.log().write(marrow::LogLevel::info, "", "first");
  EXPECT_EQ(folder.log().fault(), "");
  {
    const marrow::test::FullDisk full(20);
    folder.log().write(marrow::LogLevel::info, "", std::string(100, 'x'));
    EXPECT_HAS(message_of([&] { folder.write_record(pipeline, result, {}, test_catalogue(), {}, {}); }),
               "cannot write");
  }
  EXPECT_HAS(folder.log().fault(), "lines are missing in " + (folder.path() / "log.txt").string())
      << folder.log().fault();
  EXPECT_FALSE(fs::exists(folder.path() / "run.json"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 3);
}

TEST_F(RunFolderTest, LogTakesNoEscapeSequencesAndNoForgedLines) {
  RunFolder folder(scratch.path / "out", pipeline_of("  c: {uses: test.constant}\n", "o: c"));
  folder.log().show_from(marrow::LogLevel::error);
  folder.log().write(marrow::LogLevel::warning, "view \x1b[2J", "mind\n2026-01-01 00:00:00.000 [error] forged");
  folder.log().write(marrow::LogLevel::debug, "", "next");
  const std::string time = "0000-00-00 00:00:00.000", second = " [debug] next\n",
                    first = " [warning] view \\x1b[2J: mind\n  2026-01-01 00:00:00.000 [error] forged\n";
  std::string log = text_of(folder.path() / "log.txt");
  for (const std::size_t start : {std::size_t(0), time.size() + first.size()})
    for (std::size_t i = start; i < std::min(log.size(), start + time.size()); ++i)
      if (std::isdigit(static_cast<unsigned char>(log[i]))) log[i] = '0';
  EXPECT_EQ(log, time + first + time + second);
}

TEST_F(RunFolderTest, EachItemHasAFileOfItsOwn) {
  const marrow::Pipeline pipeline = pipeline_of(
      "  s: {uses: test.sides, with: {names: [a/b, a_b, 'a\\b', .., '', \"a\\nb\", same, same, 'a%2Fb', \"" +
          std::string(300, 'x') + "\"]}}\n",
      "o: s.both");
  const marrow::RunResult result = marrow::run_pipeline(pipeline, writing_catalogue(), {});
  RunFolder folder(scratch.path / "out", pipeline);
  const std::vector<RunFolder::Written> written =
      folder.write_outputs(pipeline, result, writing_catalogue(), std::nullopt);
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(written[0].fault, "");
  ASSERT_EQ(written[0].files.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_HAS(text_of(folder.path() / written[0].files[i]), "\"value\": " + std::to_string(10 * (i + 1)) + ".0")
        << written[0].files[i];
  EXPECT_EQ(written[0].files[0], "outputs/o/a%2Fb.json");
  EXPECT_EQ(written[0].files[1], "outputs/o/a_b.json");
  EXPECT_EQ(written[0].files[7], "outputs/o/same (2).json");
  folder.write_record(pipeline, result, {}, test_catalogue(), {}, written);
  const nlohmann::json items = nlohmann::json::parse(text_of(folder.path() / "run.json"))["outputs"][0]["items"];
  std::set<std::string> places;
  for (const nlohmann::json& item : items) places.insert(item[0]);
  EXPECT_EQ(places.size(), 10u) << items;
}

TEST_F(RunFolderTest, RecordHoldsTheFilesAsTheyWereRead) {
  const fs::path file = scratch.write("file.txt", "one"), inside = scratch.path / "folder";
  fs::create_directory(inside);
  scratch.write("folder/a", "1");
  const marrow::Pipeline pipeline = pipeline_of(
      "  c: {uses: test.constant, with: {path: file.txt}}\n  f: {uses: test.constant, with: {path: folder, value: 2}}\n"
      "  n: {uses: test.constant, with: {path: nothing, value: 3}}\n  w: {uses: test.constant, with: {path: "
      "/proc/self/mem}}\n"
      "  d: {uses: test.work, in: {after: w}, with: {path: file.txt, value: 0}}\n",
      "c: c, f: f, n: n, w: w, d: d");
  const marrow::RunResult result = marrow::run_pipeline(pipeline, writing_catalogue(), {});
  EXPECT_EQ(result.nodes[0].status, marrow::NodeRecord::Status::done);
  EXPECT_EQ(result.nodes[3].status, marrow::NodeRecord::Status::failed) << "it cannot be hashed";
  const auto files_recorded = [&](const std::string& name) {
    RunFolder folder(scratch.path / name, pipeline);
    folder.write_record(pipeline, result, {}, writing_catalogue(), {}, {});
    nlohmann::json files;
    const nlohmann::json record = nlohmann::json::parse(text_of(folder.path() / "run.json"));
    for (const nlohmann::json& node : record["nodes"]) files[std::string(node["id"])] = node["files"];
    return files;
  };
  const nlohmann::json before = files_recorded("before");
  EXPECT_TRUE(before["c"]["path"].is_string());
  EXPECT_TRUE(before["f"]["path"].is_string());
  EXPECT_EQ(before["n"], nlohmann::json({{"path", nullptr}}));
  EXPECT_EQ(before["w"], nlohmann::json({{"path", nullptr}}));
  EXPECT_FALSE(before["d"].contains("path")) << "it did not come to read it";
  std::ofstream(file) << "two";
  fs::create_symlink("/tmp", inside / "link");  // now the folder cannot be hashed
  EXPECT_EQ(files_recorded("after"), before);
}

TEST_F(RunFolderTest, RecordTellsAFailureThatMayBeFromOneThatMayNot) {
  const marrow::Pipeline pipeline = pipeline_of(
      "  s: {uses: test.sides}\n  f: {uses: test.fail_above, in: {a: s.both}, with: {value: 15}, may_fail: true}\n"
      "  g: {uses: test.fail_above, in: {a: s.left}, with: {value: 0}, may_fail: true}\n",
      "f: f, g: g, s: s.left");
  const marrow::RunResult result = marrow::run_pipeline(pipeline, writing_catalogue(), {});
  RunFolder folder(scratch.path / "out", pipeline);
  const auto written = folder.write_outputs(pipeline, result, writing_catalogue(), std::nullopt);
  EXPECT_EQ(written[0].files, std::vector<std::string>{"outputs/f/a.json"});
  EXPECT_EQ(written[0].absent, "node 'f' failed");
  EXPECT_TRUE(written[1].files.empty());
  EXPECT_EQ(written[1].absent, "node 'g' failed");
  EXPECT_EQ(written[0].fault + written[1].fault + written[2].absent, "");
  folder.write_record(pipeline, result, {}, writing_catalogue(), {}, written);
  const nlohmann::json record = nlohmann::json::parse(text_of(folder.path() / "run.json"));
  EXPECT_EQ(record["status"], "done");
  EXPECT_EQ(record["nodes"][0]["status"], "done");
  EXPECT_EQ(record["nodes"][1]["status"], "failed alone");
  EXPECT_EQ(record["nodes"][1]["reason"], "b: the number is too large; give a smaller one");
  EXPECT_EQ(record["outputs"][0]["absent"], "node 'f' failed");
  EXPECT_EQ(record["outputs"][1]["absent"], "node 'g' failed");
  EXPECT_FALSE(record["outputs"][2].contains("absent"));
  EXPECT_HAS(text_of(folder.path() / "pipeline.yaml"), "may_fail: true");
}

TEST_F(RunFolderTest, OneOutputDoesNotReplaceAnother) {
  const marrow::Pipeline pipeline =
      pipeline_of("  c: {uses: test.constant}\n  s: {uses: test.sides}\n", "x: c, x.json: s.both");
  const marrow::RunResult result = marrow::run_pipeline(pipeline, writing_catalogue(), {});
  RunFolder folder(scratch.path / "out", pipeline);
  const auto written = folder.write_outputs(pipeline, result, writing_catalogue(), std::nullopt);
  EXPECT_EQ(written[0].files, std::vector<std::string>{"outputs/x.json"});
  EXPECT_TRUE(written[1].files.empty());
  EXPECT_FALSE(written[1].fault.empty());
  EXPECT_TRUE(fs::is_regular_file(folder.path() / "outputs" / "x.json"));
}

}  // namespace run_folder_test
