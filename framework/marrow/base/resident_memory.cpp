// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/resident_memory.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace marrow {

double resident_memory_mb() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[100];
  const ssize_t size = read(file, text, sizeof text - 1);
  close(file);
  text[std::max<ssize_t>(size, 0)] = '\0';
  unsigned long resident = 0;
  return std::sscanf(text, "%*u %lu", &resident) == 1 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6 : 0;
}

}  // namespace marrow
