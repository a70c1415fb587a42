// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fields of descriptions of libraries. One list for each type serves both their JSON (manifest.cpp) and their bytes
// (library_index.cpp). Reading the bytes checks only their form: the content was checked when it was read from JSON.
#include <array>
#include <type_traits>

#include "marrow/runtime/node/relations.hpp"
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

/// The names of an enum's values, in their order. `kWhat` names the enum in messages.
template <class Enum>
struct ValueNames {};
template <>
struct ValueNames<OptionType> {
  static constexpr const char* kWhat = "type of options";
  static constexpr std::array kNames{"boolean", "integer", "number", "text", "path", "numbers", "texts", "paths"};
};
template <>
struct ValueNames<RelationType> {
  static constexpr const char* kWhat = "relation";
  static constexpr auto& kNames = kRelationTypes;
};
template <>
struct ValueNames<Apart> {
  static constexpr const char* kWhat = "way to run apart";
  static constexpr std::array kNames{"no", "parses", "computes"};
};
template <class Enum>
requires requires { ValueNames<Enum>::kNames; }
constexpr bool is_valid(Enum value) { return std::size_t(value) < std::size(ValueNames<Enum>::kNames); }

template <class T, class... Types>
concept OneOf = (std::is_same_v<T, Types> || ...);
/// The types of visit_fields().
template <class T>
concept HasNamedFields = OneOf<std::remove_const_t<T>, TypeInfo, PortInfo, OptionInfo, RelationInfo, NodeInfo, KindPort,
                               TraitInfo, CheckInfo, KindInfo, WriterInfo>;

/// Calls field(key, member) for each member of a description. Returns how messages name one such object. A binding of
/// all members does not compile if one is forgotten.
template <HasNamedFields T, class Function>
const char* visit_fields(T& of, const Function& field) {
  using Type = std::remove_const_t<T>;
  if constexpr (std::is_same_v<Type, TypeInfo>) {
    auto& [id, version, size, is_function, content] = of;  // the content is code
    field("id", id), field("version", version), field("size", size), field("function", is_function);
    return "a type";
  } else if constexpr (std::is_same_v<Type, PortInfo>) {
    auto& [name, help, type, optional, axis, figures] = of;
    field("name", name), field("help", help), field("type", type), field("optional", optional), field("axis", axis),
        field("figures", figures);
    return "a port";
  } else if constexpr (std::is_same_v<Type, OptionInfo>) {
    auto& [name, help, unit, type, default_value, required, minimum, maximum, choices, length, replaces, beside] = of;
    field("name", name), field("help", help), field("unit", unit), field("type", type), field("default", default_value),
        field("required", required), field("minimum", minimum), field("maximum", maximum), field("choices", choices),
        field("length", length), field("replaces", replaces), field("beside", beside);
    return "an option";
  } else if constexpr (std::is_same_v<Type, RelationInfo>) {
    auto& [type, names] = of;
    field("type", type), field("names", names);
    return "a relation";
  } else if constexpr (std::is_same_v<Type, NodeInfo>) {
    auto& [name, summary, inputs, outputs, options, relations, traits, random] = of;
    field("name", name), field("summary", summary), field("inputs", inputs), field("outputs", outputs),
        field("options", options), field("relations", relations), field("traits", traits), field("random", random);
    return "a node";
  } else if constexpr (std::is_same_v<Type, KindPort>) {
    auto& [name, help, types, axis] = of;
    field("name", name), field("help", help), field("types", types), field("axis", axis);
    return "a port of a kind";
  } else if constexpr (std::is_same_v<Type, TraitInfo>) {
    auto& [name, help] = of;
    field("name", name), field("help", help);
    return "a trait";
  } else if constexpr (std::is_same_v<Type, CheckInfo>) {
    auto& [name, what, limit, unit] = of;
    field("name", name), field("what", what), field("limit", limit), field("unit", unit);
    return "a check";
  } else if constexpr (std::is_same_v<Type, KindInfo>) {
    auto& [name, summary, inputs, outputs, sees_truth, apart, traits, checks, is_suite] = of;
    field("name", name), field("summary", summary), field("inputs", inputs), field("outputs", outputs),
        field("sees_truth", sees_truth), field("apart", apart), field("traits", traits), field("checks", checks),
        field("is_suite", is_suite);
    return "a kind";
  } else if constexpr (std::is_same_v<Type, WriterInfo>) {
    auto& [type, extension, help] = of;
    field("type", type), field("extension", extension), field("help", help);
    return "a writer";
  }
}

template <HasNamedFields T>
struct Archived<T> {
  static void add(Archive& archive, const T& value) {
    visit_fields(value, [&](const char*, const auto& member) { archive.add(member); });
  }
  static void read(Unpacker& unpacker, T& value) {
    visit_fields(value, [&](const char*, auto& member) { unpacker.read(member); });
  }
};
template <>
struct Archived<OptionValue> {
  static void add(Archive& archive, const OptionValue& value) {
    archive.add(std::uint8_t(value.index()));
    std::visit([&](const auto& one) { archive.add(one); }, static_cast<const OptionVariant&>(value));
  }
  static void read(Unpacker& unpacker, OptionValue& value) {
    read_index(unpacker, value, unpacker.get<std::uint8_t>(),
               std::make_index_sequence<std::variant_size_v<OptionVariant>>());
  }

 private:
  template <std::size_t... Index>
  static void read_index(Unpacker& unpacker, OptionValue& value, std::size_t wanted, std::index_sequence<Index...>) {
    const auto read_if = [&](auto index) {
      if (wanted == index) value = unpacker.get<std::variant_alternative_t<index, OptionVariant>>();
      return wanted == index;
    };
    if (!(read_if(std::integral_constant<std::size_t, Index>()) || ...))
      throw Error("the packed value is an option of an unknown type");
  }
};
template <>
struct Archived<std::filesystem::path> {
  static void add(Archive& archive, const std::filesystem::path& path) { archive.add(path.native()); }
  static void read(Unpacker& unpacker, std::filesystem::path& path) { path = unpacker.get<std::string>(); }
};

}  // namespace marrow
