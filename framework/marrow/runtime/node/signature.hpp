// SPDX-License-Identifier: Apache-2.0
#pragma once
// Derives the ports of a node from the arguments and the return type of its function.
// Derives its options from the members of the options struct, and converts these to option values and back.
#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {
namespace detail {

template <class T>
struct IsList : std::false_type {};
template <class T>
struct IsList<List<T>> : std::true_type {};
template <class T>
struct IsTuple : std::false_type {};
template <class... T>
struct IsTuple<std::tuple<T...>> : std::true_type {};

enum class Role { input, optional_input, list, optional_list, context, options };

/// What an argument of a node's function stands for.
template <class A>
struct Argument {
  using Plain = std::remove_cv_t<std::remove_pointer_t<std::remove_reference_t<A>>>;
  static constexpr bool kPointer = std::is_pointer_v<std::remove_reference_t<A>>;
  static constexpr Role role() {
    if constexpr (std::is_same_v<Plain, Context>)
      return Role::context;
    else if constexpr (IsList<Plain>::value)
      return kPointer ? Role::optional_list : Role::list;
    else if constexpr (Registered<Plain>)
      return kPointer ? Role::optional_input : Role::input;
    else
      return Role::options;
  }
  static constexpr bool kPort = role() != Role::context && role() != Role::options;
};

template <class... Args>
struct OptionsOf {
  using type = void;
};
template <class A, class... Rest>
struct OptionsOf<A, Rest...> {
  using type = std::conditional_t<Argument<A>::role() == Role::options, typename Argument<A>::Plain,
                                  typename OptionsOf<Rest...>::type>;
};

struct NoOptions {};

/// A value that holds one item; absent if `item` is null.
Value value_of_item(const TypeInfo& type, std::shared_ptr<const void> item);
/// A value that holds a list; absent if it is empty.
Value value_of_list(const TypeInfo& type, const std::vector<std::string>& names,
                    std::vector<std::shared_ptr<const void>> items, std::string_view axis);

/// The item type of a returned type: the item of a list, of an optional or of a shared pointer, else the type itself.
template <class M>
struct ItemOf : std::type_identity<M> {};
template <class T>
struct ItemOf<List<T>> : std::type_identity<T> {};
template <class T>
struct ItemOf<std::optional<T>> : std::type_identity<T> {};
template <class T>
struct ItemOf<std::shared_ptr<const T>> : std::type_identity<T> {};

/// What a node's function returns, or a member of it.
template <class M>
struct Returned {
  using Item = typename ItemOf<M>::type;
  static constexpr bool kList = IsList<M>::value;
  static constexpr bool kOptional = std::is_same_v<M, std::optional<Item>>;
  static constexpr bool kShared = std::is_same_v<M, std::shared_ptr<const Item>>;

  /// The value of a member of type M in the object that a node returned. The value keeps the object alive.
  static Value value(const TypeInfo& type, const std::shared_ptr<const void>& member, std::string_view axis) {
    const M& returned = *static_cast<const M*>(member.get());
    if constexpr (kList) {
      std::vector<std::shared_ptr<const void>> items;
      for (std::size_t i = 0; i < returned.size(); ++i) items.push_back(returned.shared(i));
      return value_of_list(type, returned.names(), std::move(items), axis);
    } else if constexpr (kOptional) {
      return value_of_item(type, {member, returned ? &*returned : nullptr});
    } else if constexpr (kShared) {
      return value_of_item(type, returned);
    } else {
      return value_of_item(type, member);
    }
  }
};

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
