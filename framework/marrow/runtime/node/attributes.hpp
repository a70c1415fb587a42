// SPDX-License-Identifier: Apache-2.0
#pragma once
// Attributes of ports and options in a declaration.
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {

/// The axis of a list port. The text must live until the port is declared.
struct Over {
  std::string_view axis;
};
/// A property of an option. The texts must live until the option is declared.
struct Attribute {
  enum class Type { minimum, maximum, unit, choices, required, replaces, beside };
  Type type = Type::required;
  double number = 0;
  std::string_view text = {};
  std::initializer_list<std::string_view> names = {};
};

/// The axis along which a list port runs.
inline Over over(std::string_view axis) { return {axis}; }
/// The unit of an option whose name does not end in one. The endings _mm, _deg, _rad, _px, _s, _hu, _kev and _percent
/// already give the unit.
inline Attribute unit(std::string_view text) { return {.type = Attribute::Type::unit, .text = text}; }
inline Attribute at_least(double value) { return {.type = Attribute::Type::minimum, .number = value}; }
inline Attribute at_most(double value) { return {.type = Attribute::Type::maximum, .number = value}; }
inline Attribute one_of(std::initializer_list<std::string_view> names) {
  return {.type = Attribute::Type::choices, .names = names};
}
/// A pipeline must give this option.
inline Attribute required() { return {}; }
/// This option replaces options of the nodes whose functions reach this node: those with these names. Their own values
/// then have no effect here. "input.option" means only nodes behind that input. An empty list or a 0 replaces nothing.
/// If a pipeline gives both, `marrow check` prints a note.
inline Attribute replaces(std::initializer_list<std::string_view> names) {
  return {.type = Attribute::Type::replaces, .names = names};
}

/// Beside the file that this option of type path names lie files that belong to it. They have its name, but these
/// endings: ".onnx". They count in the key of the result by their content, and the node may open them.
inline Attribute beside(std::initializer_list<std::string_view> endings) {
  return {.type = Attribute::Type::beside, .names = endings};
}

/// The number of option `low` must not be above that of option `high`.
inline RelationInfo not_above(std::string low, std::string high) {
  return {RelationType::not_above, {std::move(low), std::move(high)}};
}
/// The number of option `low` must be less than that of option `high`.
inline RelationInfo below(std::string low, std::string high) {
  return {RelationType::below, {std::move(low), std::move(high)}};
}
/// These lists must have the same length.
inline RelationInfo same_length(std::vector<std::string> lists) {
  return {RelationType::same_length, std::move(lists)};
}
/// The first list must be empty or have as many items as the second.
inline RelationInfo as_many_or_none(std::string list, std::string like) {
  return {RelationType::as_many_or_none, {std::move(list), std::move(like)}};
}
/// Exactly one of these must be given. A name is an option, which is given if it is not empty, or an input, written as
/// "in.camera".
inline RelationInfo exactly_one(std::vector<std::string> names) {
  return {RelationType::exactly_one, std::move(names)};
}
/// At least one of these must be given. Names are written as for exactly_one(). A single name is an option that must
/// not be empty.
inline RelationInfo at_least_one(std::vector<std::string> names) {
  return {RelationType::at_least_one, std::move(names)};
}
/// No item of this list may occur twice.
inline RelationInfo distinct(std::string list) { return {RelationType::distinct, {std::move(list)}}; }

}  // namespace marrow
