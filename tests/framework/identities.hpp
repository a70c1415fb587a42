// SPDX-License-Identifier: Apache-2.0
#pragma once
// Identities of other processes, as they stand in names of temporary files and in claims.

#include "marrow/base/process_tree.hpp"

namespace runtime_fixture {

/// This process's identity with another number and start.
inline std::string identity_of(const std::string& number, const std::string& start) {
  const std::string& own = marrow::this_process();
  const std::size_t last = own.rfind('.'), middle = own.rfind('.', last - 1);
  return own.substr(0, middle) + "." + number + "." + start;
}

/// A process of this host that has ended: no process has that number.
inline std::string ended_process() { return identity_of("04194304", "000000000001"); }

/// A process with this process's number on another host.
inline std::string process_elsewhere() {
  std::string identity = marrow::this_process();
  const std::size_t digest = identity.find('.') + 1;
  identity[digest] = identity[digest] == '0' ? '1' : '0';
  return identity;
}

}  // namespace runtime_fixture
