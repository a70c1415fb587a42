// SPDX-License-Identifier: Apache-2.0
// Who makes a result: one byte of one file is locked for each key, so there is nothing to clean up, and the kernel gives the
// lock back when its holder dies.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "marrow/runtime/store.hpp"

namespace marrow {

Store::Claim::~Claim() {
  if (descriptor_ >= 0) close(descriptor_);
}

Store::Claim Store::claim(const Digest& key, const std::atomic<bool>* cancelled) const {
  std::error_code ignored;
  std::filesystem::create_directories(folder_, ignored);
  // A description of the file of its own: two threads of one process exclude each other too.
  const int descriptor = open((folder_ / "claims").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return Claim();
  Claim claim(descriptor);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t(key.low >> 2);
  lock.l_len = 1;
  auto pause = std::chrono::milliseconds(1);
  while (fcntl(descriptor, F_OFD_SETLK, &lock) != 0) {
    if ((errno != EAGAIN && errno != EACCES && errno != EINTR) || (cancelled && cancelled->load())) return Claim();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(50));
  }
  return claim;
}

}  // namespace marrow
