// SPDX-License-Identifier: Apache-2.0
#pragma once
// Temporary folders, damaged copies and messages for tests of readers and writers.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "marrow/base/error.hpp"

#include "tests/harness/message_of.hpp"

namespace marrow::test {

/// A folder that is removed with its content.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "marrow-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code failure;
    std::filesystem::remove_all(path_, failure);
  }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void put(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The bytes of a number, the lowest first.
template <class T>
std::string number(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// A field of a TIFF's directory.
inline std::string tiff_entry(int tag, int type, std::uint32_t count, std::uint32_t value) {
  return number(std::uint16_t(tag)) + number(std::uint16_t(type)) + number(count) + number(value);
}

/// Other bytes from a place on.
inline std::string replaced(std::string bytes, std::size_t at, const std::string& by) {
  return bytes.replace(at, by.size(), by);
}

/// `text` without a folder's name, which may hold any letters.
inline std::string without_folder(std::string text, const std::filesystem::path& folder) {
  for (std::size_t at; (at = text.find(folder.string())) != std::string::npos;) text.erase(at, folder.string().size());
  return text;
}

/// `text` with the first `from` replaced.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

#define EXPECT_SAYS(call, text)                                                           \
  do {                                                                                    \
    const std::string marrow_message = ::marrow::test::message_of([&] { (void)(call); }); \
    EXPECT_NE(marrow_message.find(text), std::string::npos)                               \
        << "it said: " << (marrow_message.empty() ? "(nothing thrown)" : marrow_message); \
  } while (false)

/// Real data beside the source tree; empty if it is missing.
inline std::filesystem::path real_data(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(MARROW_SOURCE_DIR) / "../shared/data" / name;
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

#define MARROW_NEED_DATA(variable, name)                                  \
  const std::filesystem::path variable = ::marrow::test::real_data(name); \
  if (variable.empty()) GTEST_SKIP() << "the real data '" << (name) << "' are not on this machine"

/// Reading each of these damaged copies throws Error that names the file: cut off at several places, empty, text,
/// zeros.
template <class Read>
void expect_damage_is_diagnosed(const std::filesystem::path& good, const std::filesystem::path& damaged, Read read) {
  const std::string bytes = bytes_of(good);
  ASSERT_GT(bytes.size(), 64u);
  const auto expect_named = [&](const std::string& content, const std::string& how) {
    put(damaged, content);
    const std::string said = message_of([&] { read(damaged); });
    EXPECT_NE(said.find(damaged.filename().string()), std::string::npos)
        << how << ": " << (said.empty() ? "(nothing thrown)" : said);
    EXPECT_EQ(without_folder(said, damaged.parent_path()).find("0x"), std::string::npos) << how << ": " << said;
  };
  for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99})
    expect_named(bytes.substr(0, std::size_t(double(bytes.size()) * part)), "cut off at " + std::to_string(part));
  expect_named("", "empty");
  expect_named("this is a text, not what the name says\n", "text");
  expect_named(std::string(4096, '\0'), "zeros");
  expect_named(bytes.substr(bytes.size() / 2), "the second half alone");
  std::string noisy = bytes;
  for (std::size_t i = 0; i < std::min<std::size_t>(noisy.size(), 200); ++i)
    noisy[i] = char(noisy[i] ^ char(i * 37 + 11));
  expect_named(noisy, "its first 200 bytes scrambled");
}

}  // namespace marrow::test
