// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/runtime/node/context.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace listener {

/// Keeps what a node warns of.
struct Listener {
  std::vector<std::string> warnings;
  marrow::Context context{
      marrow::Context::Hooks{0, nullptr, {}, [this](std::string_view message, marrow::LogLevel level) {
                               if (level == marrow::LogLevel::warning) warnings.emplace_back(message);
                             }}};
};

}  // namespace listener
