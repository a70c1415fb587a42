// SPDX-License-Identifier: Apache-2.0
// Values in files and in bytes: single values are written as a run writes them, and packed as the store packs them.
#include "marrow/base/process_state.hpp"
#include "pipelines.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

Value value_in(const py::object& object, const std::string& what) {
  if (auto value = known_value(object)) return *value;
  throw Error(what + ": expected a value of marrow, got " + py::type::of(object).attr("__name__").cast<std::string>());
}

/// Throws Error if no library writes the type.
const WriterInfo& writer_of(const Catalogue& known, const TypeInfo& type) {
  const WriterInfo* writer = known.find_writer(type);
  if (!writer) throw Error(no_writer(type));
  return *writer;
}

/// The end of the name of a file that holds the value; empty for a folder.
std::string extension_of(const py::object& object) {
  return writer_of(*catalogue(), value_in(object, "save").type).extension;
}

void write_value(const py::object& object, const std::string& file) {
  const Value value = value_in(object, "save");
  const auto known = catalogue();
  const py::gil_scoped_release release;
  writer_of(*known, value.type);
  const WriterDefinition& definition = known->load_writer(value.type);
  try {
    ProcessState::of_runs()->keep_during([&] { definition.write(value.data.get(), file); });
  } catch (...) {
    throw Error(reason_of_exception());
  }
}

py::object unpickled(const std::string& type, int version, std::size_t size, const py::bytes& packed) {
  for (const Conversion& one : conversions()) {
    if (one.type.id != type) continue;
    if (one.type.version != version || one.type.size != size)
      throw Error("this value of type '" + type +
                  "' was pickled by another version of marrow; marrow.save and marrow.load outlast versions");
    Unpacker unpacker{std::string_view(packed)};
    return one.to_python(one.type.content->unpack(unpacker));
  }
  throw Error("values of type '" + type + "' are not known in Python");
}

}  // namespace

py::tuple pickled(const py::object& object) {
  const Value value = value_in(object, "pickle");
  const bool is_known = std::any_of(conversions().begin(), conversions().end(),
                                    [&](const Conversion& one) { return one.type == value.type; });
  if (!is_known)
    throw Error("a value of type '" + value.type.id + "' cannot be pickled, because " +
                (value.type.is_function ? "it is a function; make it again where it is needed"
                                        : "its type is a plugin's own; marrow.save writes it to a file"));
  Packer packer;
  value.type.content->pack(value.data.get(), packer);
  return py::make_tuple(py::module_::import("marrow.files").attr("unpickled"),
                        py::make_tuple(value.type.id, value.type.version, value.type.size, py::bytes(packer.packed)));
}

void bind_files(py::module_& module) {
  module.def("extension_of", &extension_of, py::arg("value"),
             "The end of the name of a file that holds the value; empty for a folder.");
  module.def("write_value", &write_value, py::arg("value"), py::arg("file"), "Writes a value as a run does.");
  module.def("unpickled", &unpickled, "A value from its packed bytes.");
}

}  // namespace marrow::python
