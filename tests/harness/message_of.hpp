// SPDX-License-Identifier: Apache-2.0
#pragma once
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

}  // namespace marrow::test
