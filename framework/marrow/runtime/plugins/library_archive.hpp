// SPDX-License-Identifier: Apache-2.0
#pragma once
// Descriptions of libraries as bytes. Reading them checks only their form: what they say was checked when it was read
// from a manifest.
#include "marrow/base/archive.hpp"
#include "marrow/runtime/plugins/library.hpp"

namespace marrow {

inline bool is_valid(OptionType type) { return type >= OptionType::boolean && type <= OptionType::paths; }
inline bool is_valid(RelationType type) { return type >= RelationType::not_above && type <= RelationType::distinct; }
inline bool is_valid(Apart apart) { return apart >= Apart::no && apart <= Apart::computes; }

template <class T, auto... Members>
struct ArchivedByFields {
  static void add(Archive& archive, const T& value) {
    detail::for_each_field<T>(Fields<Members...>(), [&](auto member) { archive.add(value.*member); });
  }
  static void read(Unpacker& unpacker, T& value) {
    detail::for_each_field<T>(Fields<Members...>(), [&](auto member) { unpacker.read(value.*member); });
  }
};

template <>
struct Archived<TypeInfo> {
  static void add(Archive& archive, const TypeInfo& type) {
    archive.add(type.id), archive.add(type.version), archive.add(type.size), archive.add(type.is_function);
  }
  static void read(Unpacker& unpacker, TypeInfo& type) {
    unpacker.read(type.id), unpacker.read(type.version), unpacker.read(type.size), unpacker.read(type.is_function);
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

template <>
struct Archived<PortInfo> : ArchivedByFields<PortInfo, &PortInfo::name, &PortInfo::help, &PortInfo::type,
                                             &PortInfo::optional, &PortInfo::axis, &PortInfo::figures> {};
template <>
struct Archived<OptionInfo>
    : ArchivedByFields<OptionInfo, &OptionInfo::name, &OptionInfo::help, &OptionInfo::unit, &OptionInfo::type,
                       &OptionInfo::default_value, &OptionInfo::required, &OptionInfo::minimum, &OptionInfo::maximum,
                       &OptionInfo::choices, &OptionInfo::length, &OptionInfo::replaces> {};
template <>
struct Archived<RelationInfo> : ArchivedByFields<RelationInfo, &RelationInfo::type, &RelationInfo::names> {};
template <>
struct Archived<NodeInfo>
    : ArchivedByFields<NodeInfo, &NodeInfo::name, &NodeInfo::summary, &NodeInfo::inputs, &NodeInfo::outputs,
                       &NodeInfo::options, &NodeInfo::relations, &NodeInfo::traits, &NodeInfo::random> {};
template <>
struct Archived<KindPort>
    : ArchivedByFields<KindPort, &KindPort::name, &KindPort::help, &KindPort::types, &KindPort::axis> {};
template <>
struct Archived<TraitInfo> : ArchivedByFields<TraitInfo, &TraitInfo::name, &TraitInfo::help> {};
template <>
struct Archived<CheckInfo>
    : ArchivedByFields<CheckInfo, &CheckInfo::name, &CheckInfo::what, &CheckInfo::limit, &CheckInfo::unit> {};
template <>
struct Archived<KindInfo>
    : ArchivedByFields<KindInfo, &KindInfo::name, &KindInfo::summary, &KindInfo::inputs, &KindInfo::outputs,
                       &KindInfo::sees_truth, &KindInfo::apart, &KindInfo::traits, &KindInfo::checks> {};
template <>
struct Archived<WriterInfo>
    : ArchivedByFields<WriterInfo, &WriterInfo::type, &WriterInfo::extension, &WriterInfo::help> {};
template <>
struct Archived<LinkedLibrary> : ArchivedByFields<LinkedLibrary, &LinkedLibrary::path, &LinkedLibrary::size> {};
template <>
struct Archived<SearchedFolder> : ArchivedByFields<SearchedFolder, &SearchedFolder::path, &SearchedFolder::names> {};
template <>
struct Archived<LibraryInfo>
    : ArchivedByFields<LibraryInfo, &LibraryInfo::file, &LibraryInfo::refused, &LibraryInfo::note, &LibraryInfo::digest,
                       &LibraryInfo::build_id, &LibraryInfo::linked, &LibraryInfo::searched, &LibraryInfo::kinds,
                       &LibraryInfo::nodes, &LibraryInfo::writers> {};

}  // namespace marrow
