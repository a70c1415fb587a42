// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the tests of damaged files. Files of each format are cut off at random places, bytes of their
// headers are flipped, or their sizes are wrong. A hundred copies of each format must be read, or refused with an error
// that names the file, within 64 MB. Files that are made to harm are in hostile_*_test.cpp.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <regex>

#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace damaged {

using namespace marrow::test;

inline constexpr int kCuts = 40, kFlips = 60;
/// What a reader may reserve for small files: the largest sample unpacks to 200 kB, and the libraries' own buffers are
/// some MB.
inline constexpr std::size_t kMemory = 64 << 20;

/// Reads damaged copies in a folder that may hold other, good files.
inline void expect_handled(const TemporaryFolder& folder, const Sample& sample,
                           const std::function<void(const std::filesystem::path&)>& read) {
  std::map<Outcome, int> counts;
  const std::filesystem::path path = folder / sample.name;
  put(path, sample.bytes);
  std::string said;
  ASSERT_EQ(outcome_of([&] { read(path); }, path.filename(), kMemory, said), Outcome::accepted)
      << sample.name << " as it was: " << said;
  for (const Damaged& copy : damaged_copies(sample, kCuts, kFlips)) {
    put(path, copy.bytes);
    const Outcome outcome = outcome_of([&] { read(path); }, path.filename(), kMemory, said);
    ++counts[outcome];
    EXPECT_TRUE(outcome == Outcome::refused || (outcome == Outcome::accepted && !copy.must_be_refused))
        << sample.name << ", " << copy.how << ": " << name_of(outcome) << ": " << said;
    EXPECT_FALSE(std::regex_search(without_folder(said, folder.path()), std::regex("0x[0-9a-f]{6}"))) << said;
    EXPECT_EQ(said.find("std::"), std::string::npos) << said;
  }
  put(path, sample.bytes);
  std::printf("%-24s %3d refused, %3d read\n", sample.name.c_str(), counts[Outcome::refused],
              counts[Outcome::accepted]);
}

inline ItkGrid<std::uint16_t> picture() {
  ItkGrid<std::uint16_t> grid{.size = {60, 40}};
  for (unsigned i = 0; i < 2400; ++i) grid.samples.push_back(std::uint16_t(i * 40503u));
  return grid;
}

inline ItkGrid<std::int16_t> stack() {
  ItkGrid<std::int16_t> grid{.size = {20, 16, 12}};
  for (unsigned i = 0; i < 20 * 16 * 12; ++i) grid.samples.push_back(std::int16_t(i * 7919u % 3000));
  return grid;
}

template <class T>
Sample written(const TemporaryFolder& folder, const std::string& name, const ItkGrid<T>& grid, bool compressed,
               std::size_t header, std::vector<std::pair<std::string, std::string>> lies = {}) {
  write_itk(folder / name, grid, compressed);
  Sample sample{name, bytes_of(folder / name), header, std::move(lies), false};
  sample.header_bytes = std::min(sample.header_bytes, sample.bytes.size());
  return sample;
}

}  // namespace damaged
