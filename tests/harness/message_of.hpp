// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <marrow/base/error.hpp>
#include <string>

namespace marrow::test {

/// The text of the Error that `function` throws; "" if it throws none.
template <class Function>
std::string message_of(Function function) {
  try {
    function();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace marrow::test

/// message_of() of one expression.
#define MESSAGE_OF(...) ::marrow::test::message_of([&] { (void)(__VA_ARGS__); })
/// That the text has this part.
#define EXPECT_HAS(text, part) EXPECT_PRED2(::marrow::test::has, text, part)
