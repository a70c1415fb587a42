// SPDX-License-Identifier: Apache-2.0
#include "run_files.hpp"

#include <png.h>

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostPixels = 40'000'000;

/// The real path of a name below the folder, with all links followed. Empty if nothing is there.
fs::path target_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  const fs::path target = fs::canonical(folder / name, error);
  return error ? fs::path() : target;
}

bool is_inside(const fs::path& folder, const fs::path& target) {
  std::error_code error;
  const fs::path whole = fs::canonical(folder, error);
  return !error && std::mismatch(whole.begin(), whole.end(), target.begin(), target.end()).first == whole.end();
}

}  // namespace

void refuse_record(const fs::path& folder, const std::string& why) {
  throw Error((folder / "run.json").string() + " is not what 'marrow run' wrote: " + why + "; run it again");
}

nlohmann::json read_record(const fs::path& folder) {
  const fs::path file = folder / "run.json";
  refuse_outside(folder, "run.json");
  nlohmann::json record;
  try {
    record = parse_json(read_text_file(file, kMostRecordBytes), file.string());
  } catch (const Error& fault) {
    const std::string text = fault.what();
    refuse_record(folder, text.starts_with(file.string()) ? "it" + text.substr(file.string().size()) : text);
  }
  if (!record.is_object()) refuse_record(folder, "it holds no object");
  for (const char* list : {"nodes", "outputs", "plugins", "verdicts"})
    if (record.contains(list) && !record[list].is_array())
      refuse_record(folder, std::string("its '") + list + "' is no list");
  return record;
}

std::optional<fs::path> file_of_run(const fs::path& folder, const std::string& name) {
  const fs::path target = target_of(folder, name);
  std::error_code error;
  if (target.empty() || !is_inside(folder, target) || !fs::is_regular_file(target, error)) return std::nullopt;
  return folder / name;
}

bool leads_outside(const fs::path& folder, const std::string& name) {
  const fs::path target = target_of(folder, name);
  return !target.empty() && !is_inside(folder, target);
}

void refuse_outside(const fs::path& folder, const std::string& name) {
  if (leads_outside(folder, name))
    throw Error((folder / name).string() +
                " is a link to a file outside of the folder, and such files are not shown; copy it into the folder");
}

RgbPixels read_png(const fs::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const auto refuse = [&](const std::string& why) {
    png_image_free(&image);
    throw Error(file.string() + ": " + why);
  };
  if (!png_image_begin_read_from_file(&image, file.c_str())) refuse(image.message);
  RgbPixels pixels{int(image.width), int(image.height), (image.format & PNG_FORMAT_FLAG_LINEAR) != 0, {}};
  if (std::uint64_t(image.width) * image.height > kMostPixels)
    refuse(formatted("a picture of {} x {} pixels, at most {} million are read", image.width, image.height,
                     kMostPixels / 1'000'000));
  image.format = PNG_FORMAT_RGB;
  pixels.bytes.resize(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, pixels.bytes.data(), 0, nullptr)) refuse(image.message);
  return pixels;
}

}  // namespace marrow::cli
