// SPDX-License-Identifier: Apache-2.0
// What a process that holds nodes written in Python needs: its inputs, which it maps, and a way to hand values over.
#include <fcntl.h>
#include <link.h>
#include <pybind11/stl.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <set>
#include <thread>

#include "marrow/base/framework_file.hpp"
#include "marrow/base/process_state.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"
#include "marrow/runtime/plugins/trust.hpp"
#include "marrow/runtime/process/packed_values.hpp"
#include "pipelines.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

/// A file of another process, mapped for reading.
class Mapping {
 public:
  explicit Mapping(const std::string& file) {
    const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) throw Error("cannot open an input: " + std::string(std::strerror(errno)));
    size_ = std::size_t(bytes_in(descriptor));
    data_ = mmap(nullptr, size_, PROT_READ, MAP_SHARED, descriptor, 0);
    close(descriptor);
    if (data_ == MAP_FAILED) throw Error("cannot map an input: " + std::string(std::strerror(errno)));
  }
  ~Mapping() { munmap(data_, size_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::string_view bytes() const { return {static_cast<const char*>(data_), size_}; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

const Conversion& conversion_of(const std::string& type) {
  for (const Conversion& one : conversions())
    if (one.type.id == type) return one;
  throw Error("values of type '" + type + "' are not known in Python");
}

/// Tells whether an input is as it was when it was unpacked. Samples in the file need no check: nobody can write there.
struct InputCheck {
  std::shared_ptr<const void> data;
  const Content* content;
  Digest before;
  bool holds() const { return content->hash(data.get()) == before; }
};

/// The input whose packed data are in a file, and its check. Samples stay in the file.
py::tuple mapped_input(const std::string& file, const std::string& type, std::size_t samples_bytes) {
  const auto mapping = std::make_shared<const Mapping>(file);
  const Conversion& conversion = conversion_of(type);
  const std::string_view bytes = mapping->bytes();
  if (samples_bytes > bytes.size()) throw Error("an input is damaged: it ends too early");
  Unpacker packed(bytes.substr(samples_bytes));
  std::shared_ptr<const void> data = conversion.type.content->unpack(packed);
  if (samples_bytes > 0) {
    note_mapped_samples(data.get(), reinterpret_cast<const float*>(bytes.data()));
    data = std::shared_ptr<const void>(data.get(), [data, mapping](const void* item) { forget_mapped_samples(item); });
  }
  const Content* content = conversion.type.content;
  return py::make_tuple(conversion.to_python(data), InputCheck{data, content, content->hash(data.get())});
}

/// The shared libraries that this process has loaded, under the names by which they were found. Left out are the
/// framework and those that it needs, because the key of each result has them.
std::vector<py::bytes> loaded_libraries() {
  std::vector<std::string> names;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* names) {
        if (info->dlpi_name && info->dlpi_name[0] == '/')
          static_cast<std::vector<std::string>*>(names)->emplace_back(info->dlpi_name);
        return 0;
      },
      &names);
  std::set<std::string> of_framework{framework_file().string()};
  for (const LinkedLibrary& one : framework_libraries()) of_framework.insert(one.path);
  std::vector<py::bytes> found;
  std::error_code error;
  for (const std::string& name : names)
    if (!of_framework.contains(std::filesystem::canonical(name, error).string())) found.emplace_back(name);
  return found;
}

/// How many were ever loaded.
unsigned long long count_of_loaded_libraries() {
  unsigned long long count = 0;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* count) {
        *static_cast<unsigned long long*>(count) = info->dlpi_adds;
        return 1;
      },
      &count);
  return count;
}

/// What a call made. It stays here until the other process has read it.
struct Made {
  std::vector<Value> values;
};

void write_again(int descriptor, const std::vector<Value>& values, bool in_place) {
  if (ftruncate(descriptor, 0) != 0 || lseek(descriptor, 0, SEEK_SET) != 0)
    throw Error("cannot hand values to another process: " + std::string(std::strerror(errno)));
  write_values(descriptor, values, in_place);
}

/// One output of a call.
Value output_of(const py::handle& object, const std::string& port, const std::string& type, const std::string& axis) {
  const Conversion& conversion = conversion_of(type);
  Value value;
  value.type = conversion.type;
  if (object.is_none()) return value;
  value = value_of(object, conversion.type, axis, "output '" + port + "'");
  if (!(value.type == conversion.type))
    throw Error("output '" + port + "': expected " + type + ", got " + value.type.id);
  if (value.axis != axis)
    throw Error("output '" + port + "': expected " +
                (axis.empty() ? "one " + type + ", got a list" : "a list over " + axis + ", got one " + type));
  return value;
}

/// Ends this process and all that it started if the one that started it has ended. A thread of its own looks, because
/// Python's may be busy for ever.
void end_with(long parent) {
  keep_descendants();
  std::thread([parent] {
    for (;;) {
      if (long(getppid()) != parent) {
        for (const pid_t one : descendants_of(getpid())) kill(one, SIGKILL);
        kill(0, SIGKILL);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    }
  }).detach();
}

TypeInfo type_named(const std::string& id) {
  for (const FunctionClass& one : function_classes())
    if (one.type.id == id) return one.type;
  return conversion_of(id).type;
}

py::object type_description(const std::string& id) {
  const TypeInfo type = type_named(id);
  py::dict made;
  made["id"] = type.id;
  made["version"] = type.version;
  made["size"] = type.size;
  made["function"] = type.is_function;
  return made;
}

/// What a call of a node must leave as it is in this process.
class KeptState {
 public:
  void begin_call() { thread_.emplace(); }
  std::string put_back() {
    const std::string of_thread = thread_ ? thread_->put_back() : "", of_process = process_.put_back();
    return of_thread.empty() ? of_process : of_thread + " was changed";
  }

 private:
  ProcessState process_;
  std::optional<ThreadState> thread_;
};

std::string untrusted_files(const std::vector<std::string>& files, uid_t owner_of_interpreter) {
  return untrusted_among({files.begin(), files.end()}, owner_of_interpreter);
}

}  // namespace

void bind_worker(py::module_& module) {
  py::class_<KeptState>(module, "ProcessState", "What a call must leave as it is.")
      .def(py::init<>())
      .def("begin_call", &KeptState::begin_call, "From here on the thread calculates as usual.")
      .def("put_back", &KeptState::put_back, "Returns what has changed, in words, or an empty text.");
  module.def("untrusted_among", &untrusted_files, "Why a file must not be loaded, or an empty text.");
  module.def("type_description", &type_description, "A value type as manifests have it.");
  module.def("end_with", &end_with, "Ends this process when its parent has another number.");
  py::class_<InputCheck>(module, "InputCheck", "Whether an input is as it was.").def("holds", &InputCheck::holds);
  module.def("mapped_input", &mapped_input, "An input whose packed data are in a file, and its check.");
  module.def("loaded_libraries", &loaded_libraries, "The shared libraries that this process has loaded, as bytes.");
  module.def("count_of_loaded_libraries", &count_of_loaded_libraries, "How many libraries were ever loaded.");
  py::class_<Made>(module, "Made", "What a call made, for the process that asked for it.")
      .def(py::init([](const py::list& outputs) {
        Made made;
        for (const py::handle& one : outputs) {
          const auto output = one.cast<py::tuple>();
          made.values.push_back(output_of(output[0], output[1].cast<std::string>(), output[2].cast<std::string>(),
                                          output[3].cast<std::string>()));
        }
        return made;
      }))
      .def("hand_over", [](const Made& made, int descriptor, bool in_place) {
        write_again(descriptor, made.values, in_place);
        return made.values.size();
      });
}

}  // namespace marrow::python
