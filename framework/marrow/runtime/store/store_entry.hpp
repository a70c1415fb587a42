// SPDX-License-Identifier: Apache-2.0
#pragma once
// One entry of the store: a preamble, a description of the outputs, and their packed values one after the other.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/runtime/store/store.hpp"
#include "marrow/runtime/store/store_file.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// An output, or an item of a list. A list is followed by its items, one for each name.
struct Leaf {
  std::string type;
  std::int32_t version = 0;
  std::uint64_t type_size = 0;
  bool present = false;
  Digest key;
  std::uint64_t offset = 0, size = 0;  // of the packed value; the offset starts after the description
  std::string axis;
  std::vector<std::string> names;
  using fields = Fields<&Leaf::type, &Leaf::version, &Leaf::type_size, &Leaf::present, &Leaf::key, &Leaf::offset,
                        &Leaf::size, &Leaf::axis, &Leaf::names>;
};

struct EntryDescription {
  Digest key;  ///< the key of the entry; it differs from the file's name if the file was renamed
  Provenance provenance;
  std::vector<Leaf> leaves;
  std::uint64_t payload = 0;  ///< bytes of all packed values
  using fields = Fields<&EntryDescription::key, &EntryDescription::provenance, &EntryDescription::leaves,
                        &EntryDescription::payload>;
};

/// Throws Error if an output cannot be stored.
EntryDescription describe_entry(const Digest& key, const std::vector<Value>& outputs, const Provenance& provenance);
void write_entry(Archive& out, const EntryDescription& description, const std::vector<Value>& outputs);
/// The part of an entry that comes before the packed values. Throws Error if it is too long.
void write_description(Archive& out, const EntryDescription& description);

struct ReadEntry {
  EntryDescription description;
  std::uint64_t begin = 0;  ///< where the payload begins in the file
};
/// Throws Error if the file is not the whole entry of that key.
ReadEntry read_entry(const StoreFile& file, const Digest& key);
/// Copies a part of a file. Returns false if it cannot be read, or has become shorter.
bool copy_bytes(const StoreFile& file, std::uint64_t offset, std::uint64_t size, Archive& to);
/// Whether the leaf lies within the payload of the entry.
bool is_within(const Leaf& leaf, const ReadEntry& entry);
/// Copies the packed value of a leaf. Returns false if it cannot be read, or is not what the leaf says.
bool copy_leaf(const StoreFile& file, const ReadEntry& entry, const Leaf& leaf, Archive& to);
/// Copies an entry with all packed values. Returns false if it is not whole.
bool copy_entry(const StoreFile& file, const ReadEntry& entry, Archive& to);
/// The outputs. Their data are read from the file when they are first needed. Throws Error if the description does not
/// describe outputs.
std::vector<Value> outputs_of(const ReadEntry& entry, const std::filesystem::path& file);

}  // namespace marrow
