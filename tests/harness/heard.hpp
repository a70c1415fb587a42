// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/runtime/node/context.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace marrow::test {

/// Keeps what a node says in this context: its warnings, and all its lines.
struct Heard {
  std::vector<std::string> warnings, lines;
  Context context;

  explicit Heard(std::uint64_t seed = 0)
      : context(Context::Hooks{seed, nullptr, {}, [this](std::string_view message, LogLevel level) {
                                 lines.emplace_back(message);
                                 if (level == LogLevel::warning) warnings.emplace_back(message);
                               }}) {}
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;
};

}  // namespace marrow::test
