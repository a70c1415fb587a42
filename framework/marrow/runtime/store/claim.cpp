// SPDX-License-Identifier: Apache-2.0
// Claims say which process makes a result. Each key locks one byte of one file. So there is nothing to clean up, and
// the kernel releases the lock if its holder dies.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <thread>

#include "marrow/base/waiting.hpp"
#include "marrow/runtime/store/store.hpp"

namespace marrow {
namespace {

struct flock one_byte(short type, off_t place) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = place;
  lock.l_len = 1;
  return lock;
}

}  // namespace

Store::Claim::~Claim() {
  if (!descriptor_.is_open()) return;
  // A child that was forked in the meantime shares the lock through its copy of the descriptor. Closing only our
  // descriptor would not release the lock.
  struct flock lock = one_byte(F_UNLCK, 0);
  lock.l_len = 0;  // to the end of the file
  fcntl(descriptor_, F_OFD_SETLK, &lock);
}

Store::Claim Store::claim(const Digest& key, const std::atomic<bool>* cancelled,
                          const std::function<void(bool)>& on_wait) const {
  if (!prepare().empty()) return Claim();
  // Each claim opens the file again, so that two threads of one process exclude each other too.
  Descriptor descriptor(
      open((folder_ / "claims").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600));
  if (!descriptor.is_open()) return Claim();
  fchmod(descriptor, 0600);  // with any umask
  Waiting waiting(on_wait);
  struct flock lock = one_byte(F_WRLCK, off_t(key.low >> 2));
  auto pause = std::chrono::milliseconds(1);
  while (fcntl(descriptor, F_OFD_SETLK, &lock) != 0) {
    if ((errno != EAGAIN && errno != EACCES && errno != EINTR) || (cancelled && cancelled->load())) return Claim();
    waiting.goes_on();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(50));
  }
  return Claim(std::move(descriptor));
}

}  // namespace marrow
