// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <gtest/gtest.h>

#include <marrow/base/error.hpp>

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
inline bool is_framed(const std::string& text, const std::string& first, const std::string& last) {
  return text.starts_with(first) && text.ends_with(last);
}

}  // namespace marrow::test

/// message_of() of one expression.
#define MESSAGE_OF(...) ::marrow::test::message_of([&] { (void)(__VA_ARGS__); })
/// That the text has this part.
#define EXPECT_HAS(text, part) EXPECT_PRED2(::marrow::test::has, text, part)
/// That the text begins like this, and ends like that.
#define EXPECT_BEGINS(text, first) EXPECT_FRAME(text, first, "")
#define EXPECT_FRAME(text, first, last) EXPECT_PRED3(::marrow::test::is_framed, text, first, last)
