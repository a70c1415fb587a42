// SPDX-License-Identifier: Apache-2.0
#pragma once
// Temporary folders, parts of files, and messages for tests of readers and writers.
#include <unistd.h>

#include <filesystem>
#include <fstream>

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

/// A test with a folder of its own.
class InAFolder : public testing::Test {
 protected:
  TemporaryFolder folder;
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
inline std::string little(std::uint64_t value, int width) { return number(value).substr(0, std::size_t(width)); }

/// Other bytes from a place on.
inline std::string replaced(std::string bytes, std::size_t at, const std::string& by) {
  return bytes.replace(at, by.size(), by);
}

/// `text` with the first `from` replaced.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// `text` with every `from` replaced.
inline std::string with_each(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

/// `text` without a folder's name, which may hold any letters.
inline std::string without_folder(const std::string& text, const std::filesystem::path& folder) {
  return with_each(text, folder.string(), "");
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

}  // namespace marrow::test
