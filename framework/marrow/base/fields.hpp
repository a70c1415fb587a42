// SPDX-License-Identifier: Apache-2.0
#pragma once
// The members of a value type, by which it is hashed, stored and compared. Their number is checked, because a member
// that the list forgets would be neither hashed nor stored.
#include <cstddef>
#include <type_traits>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The members of a value type, in the order in which they are hashed and stored:
///
///   struct Edge { double u_px = 0, v_px = 0; using fields = Fields<&Edge::u_px, &Edge::v_px>; };
template <auto... Members>
struct Fields {};

namespace detail {

template <class T>
concept HasFields = requires {
  typename T::fields;
};

/// Compiles only if T has exactly `Count` members, 16 at most. If the compiler says that a structured binding has too
/// few or too many names, then T::fields leaves out a member or lists one twice.
template <std::size_t Count, class T>
void has_as_many_members([[maybe_unused]] const T& value) {
  static_assert(Count >= 1 && Count <= 16, "fields lists 1 to 16 members; make a struct of some that belong together");
  if constexpr (Count == 1) {
    const auto& [a] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 2) {
    const auto& [a, b] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 3) {
    const auto& [a, b, c] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 4) {
    const auto& [a, b, c, d] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 5) {
    const auto& [a, b, c, d, e] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 6) {
    const auto& [a, b, c, d, e, f] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 7) {
    const auto& [a, b, c, d, e, f, g] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 8) {
    const auto& [a, b, c, d, e, f, g, h] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 9) {
    const auto& [a, b, c, d, e, f, g, h, i] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 10) {
    const auto& [a, b, c, d, e, f, g, h, i, j] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 11) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 12) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 13) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 14) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 15) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = value;
    static_cast<void>(a);
  }
  if constexpr (Count == 16) {
    const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = value;
    static_cast<void>(a);
  }
}

template <class T, class Function, auto... Members>
void for_each_field(Fields<Members...>, const Function& function) {
  if constexpr (std::is_aggregate_v<T>) {
    [[maybe_unused]] constexpr auto check = &has_as_many_members<sizeof...(Members), T>;
  }
  (function(Members), ...);
}

/// Calls function(pointer to member) for each member of T, which `fields` must list completely. The members of a type
/// with constructors or private members cannot be counted, so its list is not checked.
template <HasFields T, class Function>
void for_each_field(const Function& function) {
  for_each_field<T>(typename T::fields(), function);
}

}  // namespace detail
}  // namespace marrow
