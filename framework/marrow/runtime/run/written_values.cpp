// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/written_values.hpp"

#include "marrow/base/file_names.hpp"
#include "marrow/base/process_state.hpp"
#include "marrow/base/reason_of_exception.hpp"

namespace marrow {

namespace fs = std::filesystem;

void write_value(const Value& value, const fs::path& stem, const fs::path& root, const Catalogue& catalogue,
                 RunFolder::Written& written) {
  if (value.is_list()) {
    const std::vector<std::string> names = distinct_names(value.names);
    for (std::size_t i = 0; i < value.items.size(); ++i)
      write_value(value.items[i], stem / file_name_of(names[i]), root, catalogue, written);
    return;
  }
  if (value.is_absent()) {
    if (value.may_be_missing)
      written.absent = value.missing;
    else if (!value.missing.empty())
      written.fault = "not made: " + value.missing;
    return;
  }
  const WriterInfo* writer = catalogue.find_writer(value.type);
  if (!writer) {
    written.fault = no_writer(value.type);
    return;
  }
  const fs::path file = stem.string() + writer->extension;
  if (fs::exists(fs::symlink_status(file))) {
    written.fault = file.string() + " holds another output already; give one of them another name";
    return;
  }
  try {
    fs::create_directories(file.parent_path());  // so a list of which no item was made has no folder
    const WriterDefinition& definition = catalogue.load_writer(value.type);
    ProcessState::of_runs()->keep_during([&] { definition.write(value.data.get(), file.string()); });
    written.files.push_back(file.lexically_relative(root).string());
  } catch (...) {
    written.fault = reason_of_exception();
    std::error_code ignored;
    fs::remove_all(file, ignored);  // half a file is worse than none
  }
}

}  // namespace marrow
