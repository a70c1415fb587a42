// SPDX-License-Identifier: Apache-2.0
#pragma once
// Converts members of an options struct to option values, and back.
#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {
namespace detail {

/// Lists of numbers: of any length as std::vector<double>, of fixed length as std::array<double, N> or Eigen::Vector3d.
template <class M>
constexpr bool is_list_of_numbers() {
  if constexpr (std::is_same_v<M, std::vector<double>> || requires { M::SizeAtCompileTime; })
    return true;
  else if constexpr (requires { std::tuple_size<M>::value; })
    return std::is_same_v<typename M::value_type, double>;
  else
    return false;
}

/// The type of an option, and the type of its value in an OptionValue.
template <OptionType type, class T>
struct StoredAs {
  static constexpr OptionType kType = type;
  static constexpr bool kList = type >= OptionType::numbers;
  using ValueType = T;
};

template <class M>
constexpr auto stored_as() {
  if constexpr (std::is_same_v<M, bool>) {
    return StoredAs<OptionType::boolean, bool>();
  } else if constexpr (std::is_integral_v<M>) {
    return StoredAs<OptionType::integer, std::int64_t>();
  } else if constexpr (std::is_floating_point_v<M>) {
    return StoredAs<OptionType::number, double>();
  } else if constexpr (std::is_same_v<M, std::string>) {
    return StoredAs<OptionType::text, std::string>();
  } else if constexpr (std::is_same_v<M, std::filesystem::path>) {
    return StoredAs<OptionType::path, std::string>();
  } else if constexpr (std::is_same_v<M, std::vector<std::string>>) {
    return StoredAs<OptionType::texts, std::vector<std::string>>();
  } else if constexpr (std::is_same_v<M, std::vector<std::filesystem::path>>) {
    return StoredAs<OptionType::paths, std::vector<std::string>>();
  } else {
    static_assert(is_list_of_numbers<M>(),
                  "an option of this type is not known; for numbers, use std::vector<double> or std::array<double, N>");
    return StoredAs<OptionType::numbers, std::vector<double>>();
  }
}
template <class M>
using Stored = decltype(stored_as<M>());

template <class M>
OptionValue to_option_value(const M& member) {
  using Kept = typename Stored<M>::ValueType;
  if constexpr (Stored<M>::kList)
    return Kept(member.begin(), member.end());
  else
    return Kept(member);
}

template <class M>
void from_option_value(M& member, const OptionValue& value) {
  const auto& stored = std::get<typename Stored<M>::ValueType>(value);
  if constexpr (!Stored<M>::kList)
    member = M(stored);
  else if constexpr (requires { member.assign(stored.begin(), stored.end()); })
    member.assign(stored.begin(), stored.end());
  else
    for (std::size_t i = 0; i < stored.size(); ++i) member[i] = stored[i];
}

/// How many numbers a list option of fixed size takes; 0 for std::vector.
template <class M>
constexpr std::size_t option_length() {
  if constexpr (requires { std::tuple_size<M>::value; })
    return std::tuple_size<M>::value;
  else if constexpr (requires { M::SizeAtCompileTime; })
    return std::size_t(M::SizeAtCompileTime);
  else
    return 0;
}

/// Narrows the range of an integer option to the numbers that the member can hold.
template <class M>
void narrow_range(OptionInfo& info) {
  using Limits = std::numeric_limits<M>;
  constexpr bool kWhole = std::is_integral_v<M> && !std::is_same_v<M, bool>;
  if constexpr (kWhole && (sizeof(M) < sizeof(std::int64_t) || std::is_unsigned_v<M>))
    info.minimum = std::max(info.minimum.value_or(double(Limits::min())), double(Limits::min()));
  if constexpr (kWhole && sizeof(M) < sizeof(std::int64_t))
    info.maximum = std::min(info.maximum.value_or(double(Limits::max())), double(Limits::max()));
}

/// How a member of an options struct is described, read and set.
struct MemberType {
  OptionType type;
  std::size_t length;
  OptionValue (*get)(const void* member);
  void (*set)(void* member, const OptionValue& value);
  void (*narrow)(OptionInfo& info);
};

/// The MemberType of M. For the usual types it is compiled once, in marrow's library.
template <class M>
__attribute__((visibility("default"))) const MemberType* member_type() {
  static constexpr MemberType kType{
      Stored<M>::kType, option_length<M>(),
      [](const void* member) { return to_option_value<M>(*static_cast<const M*>(member)); },
      [](void* member, const OptionValue& value) { from_option_value<M>(*static_cast<M*>(member), value); },
      narrow_range<M>};
  return &kType;
}
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<bool>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<int>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<float>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<double>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::string>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::filesystem::path>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<double>>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<std::string>>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<std::vector<std::filesystem::path>>();
extern template MARROW_EXPORT_INSTANCE const MemberType* member_type<Eigen::Vector3d>();

}  // namespace detail
}  // namespace marrow
