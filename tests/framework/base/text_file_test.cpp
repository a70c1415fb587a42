// SPDX-License-Identifier: Apache-2.0
// Whole files: what is not read, and that no half one stands under its name.
#include "marrow/base/text_file.hpp"

#include <sched.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <thread>

#include "tests/framework/fixture.hpp"
#include "tests/plugins/write/full_disk.hpp"

namespace text_file_test {

namespace fs = std::filesystem;
using marrow::read_text_file;
using marrow::write_text_file;
using runtime_fixture::Scratch;

class TextFileTest : public testing::Test {
 protected:
  std::string fault_in_reading(const fs::path& file, std::uintmax_t most = 100) {
    const std::string fault = MESSAGE_OF(read_text_file(file, most));
    return fault.starts_with(file.string()) ? fault.substr(file.string().size()) : fault;
  }
  std::size_t files() const {
    return std::size_t(std::distance(fs::directory_iterator(scratch.path), fs::directory_iterator()));
  }
  Scratch scratch;
};

TEST_F(TextFileTest, ReadsBackWhatItWrote) {
  for (const std::string& text : {std::string(), std::string("a\0\r\n\xff", 5), std::string(300000, 'x')}) {
    write_text_file(scratch.path / "file", text);
    EXPECT_EQ(read_text_file(scratch.path / "file", 300000), text);
    EXPECT_EQ(files(), 1u) << "nothing temporary is left";
  }
}

TEST_F(TextFileTest, SaysWhyItDoesNotRead) {
  EXPECT_EQ(fault_in_reading(scratch.path / "none"), " cannot be read: No such file or directory");
  EXPECT_EQ(fault_in_reading(scratch.path), " is a folder, not a regular file");
  scratch.write("long", std::string(3000001, 'x'));
  EXPECT_EQ(fault_in_reading(scratch.path / "long", 3000000), " is longer than 3 MB");
  EXPECT_EQ(fault_in_reading("/dev/zero", 1000000), " is a device, not a regular file");
}

TEST_F(TextFileTest, WaitsForNoPipe) {
  const fs::path pipe = scratch.path / "pipe", link = scratch.path / "link";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink(pipe, link);
  EXPECT_EQ(fault_in_reading(pipe), " is a named pipe, not a regular file");
  EXPECT_EQ(fault_in_reading(link), " is a named pipe, not a regular file");
  write_text_file(pipe, "text");
  EXPECT_EQ(read_text_file(pipe, 100), "text") << "replaced";
}

TEST_F(TextFileTest, WritesToAPipeThatIsMeant) {
  const fs::path pipe = scratch.path / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { std::getline(std::ifstream(pipe), read); });
  fs::create_symlink(pipe, scratch.path / "link");
  write_text_file(scratch.path / "link", "text\n", marrow::Kinds::files_and_pipes);
  reader.join();
  EXPECT_EQ(read, "text");
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(TextFileTest, FullDiskLeavesTheOldFile) {
  const fs::path file = scratch.write("file", "old");
  {
    const marrow::test::FullDisk full(1000);
    EXPECT_HAS(MESSAGE_OF(write_text_file(file, std::string(5000, 'x'))), "cannot write " + file.string() + ": ");
    EXPECT_NE(MESSAGE_OF(write_text_file(scratch.path / "new", std::string(5000, 'x'))), "");
  }
  EXPECT_EQ(read_text_file(file, 100), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(TextFileTest, WhereItCannotWrite) {
  EXPECT_EQ(MESSAGE_OF(write_text_file(scratch.path / "no" / "file", "x")),
            "cannot write " + (scratch.path / "no" / "file").string() + ": No such file or directory");
  fs::create_directory(scratch.path / "folder");
  EXPECT_HAS(MESSAGE_OF(write_text_file(scratch.path / "folder", "x")), "directory");
  const auto kinds = marrow::Kinds::files_and_pipes;
  EXPECT_EQ(MESSAGE_OF(write_text_file("/dev/full", "x", kinds)), "cannot write /dev/full: the disk is full");
  write_text_file("/dev/null", "x", kinds);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(files(), 1u);
}

TEST_F(TextFileTest, LinkIsReplacedAndWhatItNamesStays) {
  const fs::path other = scratch.write("other", "mine"), link = scratch.path / "link";
  fs::create_symlink(other, link);
  write_text_file(link, "new");
  EXPECT_EQ(read_text_file(other, 100), "mine");
  EXPECT_EQ(read_text_file(link, 100), "new");
}

TEST_F(TextFileTest, ManyWritersLeaveOneWholeFile) {
  std::vector<std::thread> writers;
  for (int k = 0; k < 8; ++k)
    writers.emplace_back([&, k] {
      for (int i = 0; i < 50; ++i) write_text_file(scratch.path / "file", std::string(20000, char('a' + k)));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string text = read_text_file(scratch.path / "file", 20000);
  EXPECT_EQ(text, std::string(20000, text[0]));
  EXPECT_EQ(files(), 1u);
}

/// Runs `work` as process 1 of a container of its own. Returns the process to wait for: its exit code is 0 if `work`
/// returned true, 77 if the system gives no containers.
pid_t in_container(const std::function<bool()>& work) {
  const pid_t child = fork();
  if (child != 0) return child;
  if (unshare(CLONE_NEWUSER | CLONE_NEWPID) != 0) _exit(77);
  const pid_t first = fork();
  if (first == 0) _exit(work() ? 0 : 1);
  int status = 0;
  waitpid(first, &status, 0);
  _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 1);
}

TEST_F(TextFileTest, WritersOfTheSameNumberInTwoContainersDoNotMeet) {
  for (int round = 0; round < 25 && !HasFailure(); ++round) {
    const fs::path file = scratch.path / "file", begin = scratch.path / "begin";
    std::vector<pid_t> writers;
    for (int k = 0; k < 2; ++k)
      writers.push_back(in_container([&] {
        while (!fs::exists(begin)) continue;
        for (int i = 0; i < 50; ++i)
          if (MESSAGE_OF(write_text_file(file, "text")) != "") return false;
        return true;
      }));
    scratch.write("begin", "");
    for (const pid_t writer : writers) {
      int status = 0;
      ASSERT_EQ(waitpid(writer, &status, 0), writer);
      if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "the system gives no containers";
      EXPECT_EQ(status, 0) << "round " << round;
    }
    fs::remove(begin);
  }
}

TEST_F(TextFileTest, ReadsWhereStandardInputIsClosed) {
  const fs::path file = scratch.write("file", "text");
  const int kept = dup(STDIN_FILENO);
  close(STDIN_FILENO);
  const std::string fault = marrow::test::message_of([&] { EXPECT_EQ(read_text_file(file, 100), "text"); });
  dup2(kept, STDIN_FILENO);
  close(kept);
  EXPECT_EQ(fault, "");
}

}  // namespace text_file_test
