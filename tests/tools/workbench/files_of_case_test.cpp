// SPDX-License-Identifier: Apache-2.0
// Saving a case while others do the same.
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "tests/framework/fixture.hpp"
#include "tests/framework/identities.hpp"
#include "workbench/case_text.hpp"
#include "workbench/files_of_case.hpp"

namespace {

namespace fs = std::filesystem;

using marrow::workbench::PlannedCase;
using marrow::workbench::write_case_files;
using runtime_fixture::Scratch;

TEST(FilesOfCase, AFolderThatIsBeingSavedNamesItsProcessAmongAllHosts) {
  const Scratch scratch;
  std::string name;
  write_case_files(scratch.path / "case", {}, "case", "",
                   [&](const fs::path& staged) { name = staged.filename().string(); });
  EXPECT_TRUE(name.starts_with(".saving-" + marrow::this_process() + "-")) << name;
}

TEST(FilesOfCase, OnlyWhatAnEndedProcessLeftIsRemoved) {
  const Scratch scratch;
  const fs::path place = scratch.path / "case";
  const std::string ended = ".saving-" + runtime_fixture::ended_process() + "-1",
                    elsewhere = ".saving-" + runtime_fixture::process_elsewhere() + "-1";
  for (const std::string& name : {ended, elsewhere, std::string(".saving-4194304-1"), std::string(".saving-")})
    fs::create_directories(place / name);
  write_case_files(place, {}, "case", "", [](const fs::path&) {});
  EXPECT_FALSE(fs::exists(place / ended));
  EXPECT_FALSE(fs::exists(place / ".saving-4194304-1")) << "of an older version";
  EXPECT_TRUE(fs::exists(place / elsewhere));
  EXPECT_TRUE(fs::exists(place / ".saving-"));
  fs::last_write_time(place / elsewhere, fs::file_time_type::clock::now() - std::chrono::hours(25));
  write_case_files(place, {}, "case", "", [](const fs::path&) {});
  EXPECT_FALSE(fs::exists(place / elsewhere)) << "nobody saves that long";
}

TEST(FilesOfCase, OfTwoThatSaveAtTheSameTimeTheLaterOneTakesNothingBack) {
  const Scratch scratch;
  scratch.write("ct.mha", "voxels");
  PlannedCase plan;
  plan.files.push_back({scratch.path / "ct.mha", "ct.mha", true});
  for (int round = 0; round < 100 && !testing::Test::HasFailure(); ++round) {
    const fs::path place = scratch.path / std::to_string(round);
    std::atomic<int> ready{0}, saved{0};
    const auto save = [&] {
      try {
        write_case_files(place, plan, "case", "landmarks", [&](const fs::path&) {
          for (++ready; ready < 2;) std::this_thread::yield();
        });
        ++saved;
      } catch (const marrow::Error&) {  // the other one was quicker
      }
    };
    std::thread other(save);
    save();
    other.join();
    EXPECT_EQ(saved, 1);
    for (const char* name : {"ct.mha", "case.yaml", "landmarks.yaml"}) EXPECT_TRUE(fs::exists(place / name)) << name;
  }
}

}  // namespace
