// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/atomic_write.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>

#include "marrow/base/error.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::files {

namespace fs = std::filesystem;

void write_atomically(const fs::path& path, const std::function<void(const fs::path&)>& fill) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code failure;
  if (!fs::is_directory(folder, failure))
    throw Error(path.string() + ": cannot be written, there is no folder " + folder.string());
  const fs::path temporary = hidden_beside(path);
  try {
    fill(temporary);
    // A folder may only be replaced by a folder. rename() needs the old one to be removed first.
    if (fs::is_directory(temporary) && fs::is_directory(path)) fs::remove_all(path);
    fs::rename(temporary, path);
  } catch (const fs::filesystem_error& error) {
    fs::remove_all(temporary, failure);
    throw Error(path.string() + ": cannot be written (" + error.code().message() + ")");
  } catch (const std::bad_alloc&) {
    fs::remove_all(temporary, failure);
    throw Error(path.string() + ": cannot be written (out of memory)");
  } catch (const std::exception& error) {
    fs::remove_all(temporary, failure);
    // Users do not know the temporary name.
    std::string text = error.what();
    for (std::size_t at; (at = text.find(temporary.string())) != std::string::npos;)
      text.replace(at, temporary.string().size(), path.string());
    throw Error(text.rfind(path.string(), 0) == 0 ? text : path.string() + ": cannot be written (" + text + ")");
  }
}

void write_plainly(const fs::path& path, std::initializer_list<std::string_view> parts) {
  errno = 0;
  std::ofstream stream(path, std::ios::binary);
  for (const std::string_view part : parts) stream.write(part.data(), std::streamsize(part.size()));
  stream.close();
  if (!stream)
    throw Error(path.string() + ": cannot be written" + (errno ? std::string(" (") + std::strerror(errno) + ")" : "") +
                "; is the disk full or the folder read-only?");
}

void write_text(const fs::path& path, const std::string& text) {
  write_atomically(path, [&](const fs::path& temporary) { write_plainly(temporary, {text}); });
}

}  // namespace marrow::files
