// SPDX-License-Identifier: Apache-2.0
// The files of a CT.
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "workbench/ct_requests.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {

FilesOfCt::FilesOfCt(const fs::path& place) {
  constexpr std::size_t kMostSlices = 20'000;  // files of a series
  std::error_code error;
  if (!fs::exists(place, error)) throw Error(printable(place.string()) + ": there is no such file or folder");
  if (!fs::is_directory(place, error)) {
    add(place);
    return;
  }
  std::size_t count = 0;
  for (fs::recursive_directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error)) {
    if (++count > kMostSlices)
      throw Error(formatted("{}: this folder holds more than {} files; choose the folder of one series",
                            printable(place.string()), kMostSlices));
    std::error_code none;
    if (entry->is_regular_file(none)) add(entry->path());
  }
  if (error) throw Error(printable(place.string()) + ": this folder cannot be read: " + error.message());
}

void FilesOfCt::add(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return;  // the reader of the CT reports it
  bytes += size;
  const auto time = fs::last_write_time(file, error).time_since_epoch().count();
  description += formatted("{} {} {}\n", file.filename().string(), size, time);
}

std::string content_of_ct(const fs::path& place, nlohmann::json ct, const FilesOfCt& files) {
  ct.erase("file");
  return place.string() + '\n' + json_text(ct) + '\n' + files.description;
}

}  // namespace marrow::workbench
