// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/descriptor.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace marrow {

Descriptor::~Descriptor() {
  const int number = errno;
  close();
  errno = number;  // the reason of an earlier failure
}

bool Descriptor::close() {
  // Even after EINTR, the file is closed.
  return number_ < 0 || ::close(release()) == 0 || errno == EINTR;
}

Pipe open_pipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {};
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = EIO;
    if (count <= 0) return false;
    bytes.remove_prefix(std::size_t(count));
  }
  return true;
}

std::int64_t read_at(int descriptor, void* to, std::size_t wanted, std::uint64_t offset) {
  std::size_t got = 0;
  while (got < wanted) {
    const ssize_t count = pread(descriptor, static_cast<char*>(to) + got, wanted - got, off_t(offset + got));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return -1;
    if (count == 0) break;
    got += std::size_t(count);
  }
  return std::int64_t(got);
}

}  // namespace marrow
