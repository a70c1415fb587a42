// SPDX-License-Identifier: Apache-2.0
// Entries of the store: as they are, with a description that has the right hash, and the packed values alone.
#include "marrow/runtime/store/store.hpp"

#include "marrow/runtime/node/types.hpp"
#include "target.hpp"

namespace {

using namespace marrow;

constexpr Digest kKey{0x0123456789abcdefull, 0xfedcba9876543210ull};

/// The beginning of an entry, as store_entry.cpp writes it: the mark of the format, the length of the description, and
/// its hash.
std::string with_preamble(std::string_view description, std::string_view payload) {
  Packer packer;
  packer.bytes("marrowr2", 8);
  packer.add(std::uint64_t(description.size()));
  packer.add(hash_of_bytes(description.data(), description.size()));
  return packer.packed.append(description).append(payload);
}

void read_all(const Value& value) {
  for (const Value& item : value.items) read_all(item);
  if (!value.source) return;
  for (TypeInfo type : {TypeInfo::of<Pose>(), TypeInfo::of<Image>(), TypeInfo::of<Metrics>()}) {
    if (type.id != value.type.id) continue;
    type.version = value.type.version;
    type.size = value.type.size;
    fuzz::expect_value_or_error([&] { value.source->data(type); });
  }
}

void find(std::string_view file) {
  static const Store store(fuzz::folder() / "store");
  static const std::string fault = store.prepare();
  if (!fault.empty()) throw std::runtime_error(fault);
  const std::string name = kKey.hex();
  fuzz::put("store/" + name.substr(0, 2) + "/" + name, file);
  store.entries();
  if (const auto found = store.find(kKey))
    for (const Value& value : found->outputs) read_all(value);
}

template <class... T>
void unpack(char type, std::string_view packed) {
  int index = 0;
  const auto one = [&](const Content* content) {
    if (index++ != type - 'A') return;
    Unpacker unpacker(packed);
    content->unpack(unpacker);
  };
  (one(content_of<T>()), ...);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const char way = input.choice("fdv");
  fuzz::expect_value_or_error([&] {
    if (way == 'f') find(input.rest);
    if (way == 'd') {
      const std::size_t wanted = std::uint8_t(input.choice("\x10\x20\x40\x80"));
      const std::size_t payload = std::min(wanted, input.rest.size());
      find(with_preamble(input.rest.substr(0, input.rest.size() - payload),
                         input.rest.substr(input.rest.size() - payload)));
    }
    if (way == 'v') {
      const char type = input.choice("ABCDEFGHIJKLMNOPQ");
      unpack<Image, Picture, Volume, SignedField, Seeds, Mesh, Camera, View, EdgeMap, ShaftLines, Landmarks, Pose,
             Truth, Metrics, Scene, Landscape, Case>(type, input.rest);
    }
  });
  return 0;
}
