// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes values by the shipped writers of their types, as a run does with the outputs of its pipeline.
#include <marrow/runtime/node/types.hpp>
#include <marrow/runtime/plugins/catalogue.hpp>

namespace writing {

inline const marrow::WriterDefinition& writer_of(const marrow::TypeInfo& type) {
  static const marrow::Catalogue catalogue;
  return catalogue.load_writer(type);
}

template <class T>
void write(const T& value, const std::filesystem::path& path) {
  writer_of(marrow::TypeInfo::of<T>()).write(&value, path.string());
}

}  // namespace writing
