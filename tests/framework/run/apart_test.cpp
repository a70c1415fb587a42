// SPDX-License-Identifier: Apache-2.0
// Readers run apart: whatever a file makes them do is one node's error.
#include "marrow/runtime/run/apart.hpp"

#include <signal.h>
#include <unistd.h>

#include <thread>

#include "marrow/runtime/process/worker.hpp"
#include "tests/framework/run_fixture.hpp"

namespace apart_test {

using marrow::NodeRecord;
using marrow::RunEvent;
using marrow::RunResult;

class ApartTest : public run_fixture::RunTest {
 protected:
  RunResult read_word(const std::string& word, const std::string& more = "") {
    file = scratch.write("file.txt", word);
    return run("  r: {uses: parse.test_number, with: {path: file.txt, value: 1.25, words: [one, two, three]}" + more +
                   "}\n  other: {uses: test.constant, with: {value: 5}}\n",
               "r: r, other: other");
  }
  /// Why the reader failed, from the file's name on; everything else must have gone on.
  std::string failure(const std::string& word, const std::string& more = "") {
    const RunResult result = read_word(word, more);
    EXPECT_EQ(result_of(result, 1), 5);
    for (std::size_t i = 0; i < result.nodes.size(); ++i)
      if (result.nodes[i].status == NodeRecord::Status::failed) {
        const std::string reason = result.nodes[i].reason;
        EXPECT_TRUE(reason.starts_with(file.string())) << reason;
        return reason.substr(file.string().size());
      }
    return "";
  }
  double value(const RunResult& result, std::size_t item = 0) const { return number_of(output(result), item); }
  std::filesystem::path file;
};

TEST_F(ApartTest, GivesWhatTheNodeGives) {
  const RunResult result = read_word("hello");
  EXPECT_NE(pid_t(value(result, 1)), getpid());
  EXPECT_EQ(value(result, 2), 11) << "letters of the words";
  const double drawn = value(result) - 1.25;
  EXPECT_EQ(drawn, std::floor(drawn));
  settings.seed = 4;
  EXPECT_NE(value(read_word("hello")), value(result));
  const double with_input = value(read_word("hello", ", in: {added: other}")) - 1.25;
  EXPECT_EQ(with_input, std::floor(with_input));
  EXPECT_GE(with_input, 5);
  EXPECT_TRUE(was_said(RunEvent::Kind::warning, "a warning of hello"));
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const RunEvent& event) {
    return event.kind == RunEvent::Kind::progress && event.fraction == 0.5 && event.text == "half";
  }));
}

TEST_F(ApartTest, CrashIsOneNodesErrorThatNamesTheFile) {
  EXPECT_EQ(failure("crash"),
            ": to read it crashed the process that was started for it (Segmentation fault); "
            "the file is damaged, or of a kind that its reader cannot take: copy or export it again");
  EXPECT_NE(failure("abort").find("(Aborted)"), std::string::npos);
  EXPECT_EQ(failure("names").substr(0, 7), "/inner:");
  EXPECT_EQ(failure("killed"),
            ": it was not read to its end: the process that read it was killed from outside (SIGKILL), as by a system "
            "whose memory, or that of a cluster's job, runs out; run it again, with more memory or fewer threads; "
            "nothing is known against the file");
  EXPECT_EQ(value(read_word("listen"), 2), 11);
}

TEST_F(ApartTest, WhatAReaderSaysIsUnderstood) {
  const RunResult result = read_word("nan");
  EXPECT_TRUE(std::any_of(result.nodes.begin(), result.nodes.end(), [](const NodeRecord& node) {
    return node.reason == "it reports a progress that is not finite; expected a number from 0 to 1";
  }));
  read_word("flood");
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const RunEvent& event) {
    return event.kind == RunEvent::Kind::message && event.text.ends_with("xxx... (68951424 more bytes)");
  }));  // 70,000,000 less 2^20
}

TEST_F(ApartTest, EndedProcessIsOneNodesError) {
  EXPECT_EQ(failure("exit"), ": could not be read: the process that was started for it ended with exit code 3");
  EXPECT_EQ(failure("inside"), "/inner: could not be read: the process that was started for it ended with exit code 0");
}

TEST_F(ApartTest, WhatEndedAProcessIsASentence) {
  marrow::CallLimits limits;
  limits.seconds = 45.0004;
  marrow::WorkerEnd end;
  end.died = true;
  end.failed = "its process in a.ply sent a line without end";
  EXPECT_EQ(marrow::failure_of("a.ply", end, limits),
            "a.ply: could not be read: the process that was started for it sent a line without end");
  end.is_late = true;
  EXPECT_EQ(marrow::failure_of("a.ply", end, limits),
            "a.ply: to read it takes more than 45 s by the clock, which is more than a file of its size should; where "
            "the machine has "
            "much other work, try again, or raise the limit with --file-seconds");
}

TEST_F(ApartTest, WhatANodeRefusesIsItsOwnError) { EXPECT_EQ(failure("refuse"), ": is refused"); }

TEST_F(ApartTest, MemoryIsLimitedByTheFilesSize) {
  if (marrow::abi_stamp().sanitizers) GTEST_SKIP() << "a sanitizer itself ends a process that is out of memory";
  EXPECT_EQ(failure("memory"),
            ": to read it takes more than 192 MB of memory, which is more than a file of its size should; "
            "where the file is good, raise the limit with --file-memory");
  EXPECT_EQ(failure("opencv"), failure("memory"));  // it has an exception of its own for that
}

TEST_F(ApartTest, TimeIsLimitedByTheFilesSize) {
  settings.file_limits.seconds = 0.2;
  const std::string limit = marrow::abi_stamp().sanitizers ? "4" : "0.2";
  EXPECT_EQ(failure("spin"), ": to read it takes more than " + limit +
                                 " s, which is more than a file of its size should; "
                                 "where the file is good, raise the limit with --file-seconds");
}

TEST_F(ApartTest, LimitsFollowTheSize) {
  read_word("hello");
  const double slower = marrow::abi_stamp().sanitizers ? 20 : 1;
  const auto expect = [&](double bytes, double memory_mb, double processor_s) {
    const marrow::CallLimits limits = marrow::limits_of(pipeline.nodes[0], bytes, settings);
    EXPECT_EQ(limits.memory_mb, memory_mb * slower) << bytes;
    EXPECT_EQ(limits.processor_s, processor_s * slower) << bytes;
    EXPECT_EQ(limits.seconds, 30 + 10 * processor_s * slower) << bytes;
    EXPECT_EQ(limits.threads, 1) << bytes;
  };
  expect(0, 192, 1.5);
  expect(1e6, 192 + 1024, 2.5);
  expect(1e8, 4096, 101.5);
  expect(1e9, 256 + 8000, 1001.5);
  settings.file_limits = {100, 0.5};
  expect(1e9, 100, 0.5);
}

TEST_F(ApartTest, WhatALibraryPrintsIsNoAnswer) { EXPECT_EQ(failure("shout"), ""); }

TEST_F(ApartTest, CtrlCEndsTheProcess) {
  std::atomic<bool> cancelled{false};
  settings.cancelled = &cancelled;
  std::thread stop([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    cancelled = true;
  });
  const RunResult result = read_word("sleep");
  stop.join();
  EXPECT_TRUE(result.cancelled());
}

TEST_F(ApartTest, FileThatChangesWhileItIsReadGivesNoResult) {
  const marrow::Store store(scratch.path / "store");
  settings.store = &store;
  EXPECT_EQ(failure("change"), " changed while it was read; run it again");
  const auto entries = store.entries();
  EXPECT_TRUE(std::none_of(entries.begin(), entries.end(),
                           [](const auto& entry) { return entry.provenance.node == "parse.test_number"; }));
}

TEST_F(ApartTest, FileThatIsAsBeforeWhenItHasBeenReadMayHaveBeenAnotherOne) {
  EXPECT_EQ(failure("change_back"), " changed while it was read; run it again");
  EXPECT_EQ(std::filesystem::file_size(file), std::string("change_back").size());
}

TEST_F(ApartTest, NodesOfOneRunDoNotMixContents) {
  const auto run_with_edit = [&](const char* first, const char* second, const std::function<void()>& edit) {
    std::filesystem::create_directory(scratch.path / "folder");
    file = scratch.write("folder/file.txt", "one");
    on_event = [&](const RunEvent& event) {
      if (event.kind == RunEvent::Kind::finished && event.node == "c") edit();
    };
    const RunResult result =
        run(std::string("  c: {uses: test.constant, with: {path: ") + first +
                "}}\n  r: {uses: parse.test_number, in: {added: c}, with: {path: " + second + "}}\n",
            "r: r, c: c");
    EXPECT_EQ(result.nodes[0].status, NodeRecord::Status::done);
    return result.nodes[1].reason;
  };
  const auto rewrite = [&] { std::ofstream(file) << "two"; };
  const std::string changed =
      " was changed while the run went on: another node read something else there; run it again when nothing writes to "
      "it";
  EXPECT_EQ(run_with_edit("folder/file.txt", "folder/file.txt", [] {}), "");
  EXPECT_EQ(run_with_edit("folder/file.txt", "folder/file.txt", rewrite), file.string() + changed);
  EXPECT_EQ(run_with_edit("folder/file.txt", "folder/file.txt", [&] { std::filesystem::remove(file); }),
            file.string() + changed);
  EXPECT_EQ(run_with_edit("folder", "folder/file.txt", rewrite), file.string() + changed);
  EXPECT_EQ(run_with_edit("folder/file.txt", "folder", rewrite), file.parent_path().string() + changed);
  EXPECT_EQ(run_with_edit("folder", "folder", [&] { scratch.write("folder/another", "x"); }),
            file.parent_path().string() + changed);
  EXPECT_EQ(run_with_edit("folder/file.txt", "folder/file.txt", [] {}), "") << "another run";
}

TEST_F(ApartTest, FolderThatCannotBeHashedIsOneNodesError) {
  std::filesystem::create_directory(scratch.path / "case");
  std::filesystem::create_directory(scratch.path / "elsewhere");
  std::filesystem::create_directory_symlink(scratch.path / "elsewhere", scratch.path / "case" / "link");
  const RunResult result = run("  r: {uses: parse.test_number, with: {path: case}}\n", "r: r");
  EXPECT_EQ(result.nodes[0].reason, (scratch.path / "case" / "link").string() + ": is a link to a place outside " +
                                        std::filesystem::canonical(scratch.path / "case").string() +
                                        "; copy it into the folder");
}

}  // namespace apart_test
