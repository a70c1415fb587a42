// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/names.hpp"

#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"

namespace marrow {

std::string fault_of_item_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.size() > 100) return "has " + std::to_string(name.size()) + " bytes; at most 100 are taken";
  return printable(name) == name ? "" : "holds a character that cannot be printed";
}

void check_item_name(const std::string& what, const std::string& name) {
  if (const std::string fault = fault_of_item_name(name); !fault.empty())
    throw Error("the name " + in_quotes(printable(name)) + " of a " + what + " " + fault + "; choose another");
}

}  // namespace marrow
