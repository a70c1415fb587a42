// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/atomic_file.hpp"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>

#include "marrow/base/number_text.hpp"
#include "marrow/base/process_identity.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMark = ".tmp-";

std::string mark_of_temporary() {
  static std::atomic<std::uint64_t> number{0};
  return formatted("{}{}-{}", kMark, this_process(), number++);
}

}  // namespace

fs::path temporary_beside(const fs::path& final) { return final.string() + mark_of_temporary(); }

fs::path hidden_beside(const fs::path& final) { return final.parent_path() / mark_of_temporary(); }

bool is_hidden_temporary(const fs::path& file) { return file.filename().native().starts_with(kMark); }

AtomicFile::AtomicFile(fs::path final, NameBeside name_beside, const OpenNew& open_new) : final_(std::move(final)) {
  // A name may be taken: a killed process of the same identity left it.
  do {
    temporary_ = name_beside(final_);
    descriptor_ = Descriptor(open_new(temporary_));
  } while (!descriptor_.is_open() && (errno == EEXIST || errno == EINTR));
}

AtomicFile::~AtomicFile() {
  if (descriptor_.is_open()) unlink(temporary_.c_str());
}

bool AtomicFile::finish(bool is_durable) {
  if ((!is_durable || fsync(descriptor_) == 0) && descriptor_.close() &&
      std::rename(temporary_.c_str(), final_.c_str()) == 0)
    return true;
  const int number = errno;
  unlink(temporary_.c_str());
  descriptor_.close();
  errno = number;
  return false;
}

}  // namespace marrow
