// SPDX-License-Identifier: Apache-2.0
#include "cluster/chunk_fault.hpp"

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFaultBytes = 2000;

fs::path fault_file(const fs::path& folder, const std::string& chunk) { return folder / "rows" / (chunk + ".fault"); }

}  // namespace

void leave_fault_of_chunk(const fs::path& folder, const std::string& chunk, const std::string& fault) {
  const fs::path file = fault_file(folder, chunk);
  std::error_code ignored;
  fs::create_directories(file.parent_path(), ignored);
  try {
    write_text_file(file, cut(printable(fault), kMostFaultBytes));
  } catch (const Error&) {
  }
}

void remove_fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  std::error_code ignored;
  fs::remove(fault_file(folder, chunk), ignored);
}

std::string fault_of_chunk(const fs::path& folder, const std::string& chunk) {
  try {
    return printable(read_text_file(fault_file(folder, chunk), kMostFaultBytes));
  } catch (const Error&) {
    return "";
  }
}

}  // namespace marrow::cli
