// SPDX-License-Identifier: Apache-2.0
#pragma once
// Attributes of ports and options in a declaration.
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/node.hpp"

namespace marrow {

struct Over {
  std::string axis;
};
struct Unit {
  std::string text;
};
struct Minimum {
  double value;
};
struct Maximum {
  double value;
};
struct Choices {
  std::vector<std::string> names;
};
struct Required {};

/// The axis along which a list port runs.
inline Over over(std::string axis) { return {std::move(axis)}; }
/// The unit of an option whose name does not end in one. The endings _mm, _deg, _rad, _px, _s, _hu, _kev and _percent
/// already give the unit.
inline Unit unit(std::string text) { return {std::move(text)}; }
inline Minimum at_least(double value) { return {value}; }
inline Maximum at_most(double value) { return {value}; }
inline Choices one_of(std::vector<std::string> names) { return {std::move(names)}; }
/// A pipeline must give this option.
inline Required required() { return {}; }

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
/// At least one of these must be given. The names are as those of exactly_one. With one name, it must not be empty.
inline RelationInfo at_least_one(std::vector<std::string> names) {
  return {RelationType::at_least_one, std::move(names)};
}
/// No item of this list may occur twice.
inline RelationInfo distinct(std::string list) { return {RelationType::distinct, {std::move(list)}}; }

}  // namespace marrow
