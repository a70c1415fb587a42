// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/resident_memory.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "marrow/base/descriptor.hpp"

namespace marrow {

double resident_memory_mb() {
  const Descriptor file(open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) return 0;
  char text[100];
  const ssize_t size = read(file, text, sizeof text - 1);
  text[std::max<ssize_t>(size, 0)] = '\0';
  unsigned long resident = 0;
  return std::sscanf(text, "%*u %lu", &resident) == 1 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6 : 0;
}

}  // namespace marrow
