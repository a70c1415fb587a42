// SPDX-License-Identifier: Apache-2.0
// Saving a case while others do the same.
#include "tools/marrow/workbench/files_of_case.cpp"

#include <gtest/gtest.h>

#include <thread>

#include "runtime/fixture.hpp"

namespace {

using marrow::workbench::PlannedCase;
using marrow::workbench::write_case_files;
using runtime_fixture::Scratch;

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
