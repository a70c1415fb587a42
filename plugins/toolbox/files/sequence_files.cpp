// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/sequence_files.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;

/// Files of a higher rank do not count beside those of a lower one: JPEG and BMP are taken for pictures of them, and a
/// file for volumes for a CT.
std::size_t rank_of(FileFormat format) {
  if (format == FileFormat::png || format == FileFormat::tiff || format == FileFormat::dicom) return 0;
  return format == FileFormat::jpeg || format == FileFormat::bmp ? 1 : 2;
}

/// The images among the files of a folder.
std::vector<std::string> images_in(const fs::path& folder, const std::vector<std::string>& names) {
  std::array<std::vector<std::string>, 3> by_rank;
  for (const std::string& name : names) {
    const FileFormat format = file_format(folder / name);
    if (format == FileFormat::unknown || in_small_letters(fs::path(name).filename().string()) == "dicomdir") continue;
    by_rank[rank_of(format)].push_back(name);
  }
  const auto first = std::find_if(by_rank.begin(), by_rank.end(),
                                  [](const std::vector<std::string>& found) { return !found.empty(); });
  return first == by_rank.end() ? std::vector<std::string>() : *first;
}

std::vector<std::string> names_that_fit(const std::string& pattern, const std::vector<std::string>& names) {
  std::vector<std::string> fitting;
  for (const std::string& name : names)
    if (fnmatch(pattern.c_str(), name.c_str(), FNM_PATHNAME | FNM_PERIOD) == 0) fitting.push_back(name);
  return fitting;
}

/// Paths from the folder of all its files, sorted. Folders inside are searched as deep as the pattern reaches.
std::vector<std::string> files_in(const fs::path& folder, long depth) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure)) throw Error(folder.string() + ": there is no such folder");
  std::vector<std::string> names;
  fs::recursive_directory_iterator at(folder, failure), end;
  for (; !failure && at != end; at.increment(failure)) {
    if (at->is_directory(failure) && at.depth() >= depth) at.disable_recursion_pending();
    if (at->is_regular_file(failure)) names.push_back(at->path().lexically_relative(folder).generic_string());
  }
  if (failure) throw Error(folder.string() + ": cannot be searched: " + failure.message());
  std::sort(names.begin(), names.end());
  return names;
}

[[noreturn]] void refuse_no_file(const fs::path& folder, const std::string& pattern,
                                 const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 5;
  std::string there;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) there += (i ? ", '" : "'") + names[i] + "'";
  if (names.size() > kMost) there += formatted(" and {} more", names.size() - kMost);
  throw Error(folder.string() + ": no " +
              (pattern.empty() ? std::string("image (PNG, TIFF, DICOM, ...) is in it")
                               : "file in it fits the pattern '" + pattern + "'") +
              (there.empty() ? "; the folder is empty" : "; there are " + there));
}

/// The part of the names in which they differ: behind `prefix` characters, before `suffix` characters. Digits next to
/// it belong to it.
struct Part {
  std::size_t prefix, suffix;
};

Part differing_part(const std::vector<std::string>& names) {
  const std::string& first = names.front();
  Part part{first.size(), first.size()};
  for (const std::string& name : names) {
    const auto prefix = std::mismatch(first.begin(), first.end(), name.begin(), name.end()).first - first.begin();
    const auto suffix = std::mismatch(first.rbegin(), first.rend(), name.rbegin(), name.rend()).first - first.rbegin();
    part = {std::min(part.prefix, std::size_t(prefix)), std::min(part.suffix, std::size_t(suffix))};
  }
  const auto is_digit = [&](std::size_t at) { return std::isdigit(static_cast<unsigned char>(first[at])); };
  while (part.prefix > 0 && is_digit(part.prefix - 1)) --part.prefix;
  while (part.suffix > 0 && is_digit(first.size() - part.suffix)) --part.suffix;
  return part;
}

struct Numbered {
  long long number;
  std::string name;
};

constexpr std::size_t kMostDigits = 15;

std::vector<Numbered> numbered(const fs::path& folder, const std::vector<std::string>& names) {
  const Part part = differing_part(names);
  std::vector<Numbered> files;
  for (const std::string& name : names) {
    const std::string digits = part.prefix + part.suffix < name.size()
                                   ? name.substr(part.prefix, name.size() - part.prefix - part.suffix)
                                   : std::string();
    if (digits.empty() || digits.size() > kMostDigits ||
        !std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c); }))
      throw Error(folder.string() + ": the images differ in more than a number: '" + names.front() + "' and '" +
                  (&name == &names.front() ? names.back() : name) +
                  "'; name those of one sequence by a pattern, as 'frontal_*.png'");
    files.push_back({std::stoll(digits), name});
  }
  std::stable_sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return files;
}

void check_distinct(const fs::path& folder, const std::vector<Numbered>& files) {
  for (std::size_t i = 1; i < files.size(); ++i)
    if (files[i].number == files[i - 1].number)
      throw Error(folder.string() + ": two images have the same number: '" + files[i - 1].name + "' and '" +
                  files[i].name + "'; remove one of them");
}

/// Numbers may rise by steps of any size, but all steps must be equal.
void check_steps(const fs::path& folder, const std::vector<Numbered>& files) {
  check_distinct(folder, files);
  long long step = 0;
  for (std::size_t i = 1; i < files.size(); ++i) {
    const long long gap = files[i].number - files[i - 1].number;
    if (step == 0 || gap < step) step = gap;
  }
  for (std::size_t i = 1; i < files.size(); ++i)
    if (files[i].number - files[i - 1].number != step)
      throw Error(
          formatted("{}: image {} is missing between '{}' and '{}'; a bone is followed in even steps of time: put a "
                    "blank image of the same size there, or move the images behind the gap to a folder of their own",
                    folder.string(), files[i - 1].number + step, files[i - 1].name, files[i].name));
}

/// The last number in a name; 0 if it has none.
long long last_number(const std::string& name) {
  const std::size_t end = name.find_last_of("0123456789");
  if (end == std::string::npos) return 0;
  const std::size_t before = name.find_last_not_of("0123456789", end);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return std::stoll(name.substr(begin, std::min(end + 1 - begin, kMostDigits)));
}

/// "1 to 4, 9": the numbers of files in their order.
std::string numbers_text(const std::vector<Numbered>& files) {
  constexpr int kMostParts = 8;
  std::string text;
  int parts = 0;
  for (std::size_t i = 0; i < files.size(); ++parts) {
    if (parts == kMostParts) return text + formatted(", ... and {}", files.back().number);
    std::size_t last = i;
    while (last + 1 < files.size() && files[last + 1].number == files[last].number + 1) ++last;
    text += (parts > 0 ? ", " : "") + formatted("{}", files[i].number);
    if (last > i) text += formatted(" to {}", files[last].number);
    i = last + 1;
  }
  return text;
}

}  // namespace

std::vector<int> frames_of(const FrameRange& range, int count, const std::string& what) {
  const int last = range.last == 0 ? count : range.last;
  for (const int frame : {range.first, last})
    if (frame > count) throw Error(formatted("{}: has {} frames; there is no frame {}", what, count, frame));
  if (last < range.first)
    throw Error(formatted("{}: the last frame to be read, {}, lies before the first, {}", what, last, range.first));
  std::vector<int> frames;
  for (int frame = range.first; frame <= last; frame += range.every) frames.push_back(frame);
  return frames;
}

std::vector<fs::path> frame_files(const fs::path& folder, const std::string& pattern) {
  const std::vector<std::string> all = files_in(folder, std::count(pattern.begin(), pattern.end(), '/'));
  const std::vector<std::string> names = pattern.empty() ? images_in(folder, all) : names_that_fit(pattern, all);
  if (names.empty()) refuse_no_file(folder, pattern, all);
  std::vector<fs::path> paths;
  if (names.size() == 1) {
    paths.push_back(folder / names.front());
  } else {
    const std::vector<Numbered> files = numbered(folder, names);
    check_steps(folder, files);
    for (const Numbered& file : files) paths.push_back(folder / file.name);
  }
  // The key of a result covers only the content of the folder.
  for (const fs::path& path : paths) check_stays_inside(folder, path);
  return paths;
}

NumberedFile numbered_file(const fs::path& folder, long long number) {
  const std::vector<std::string> all = files_in(folder, 0);
  const std::vector<std::string> names = images_in(folder, all);
  if (names.empty()) refuse_no_file(folder, "", all);
  const std::vector<Numbered> files =
      names.size() == 1 ? std::vector<Numbered>{{last_number(names[0]), names[0]}} : numbered(folder, names);
  check_distinct(folder, files);
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const Numbered& file) { return file.number == number; });
  if (found == files.end())
    throw Error(formatted("{}: there is no image {}; the numbers in their names are {}", folder.string(), number,
                          numbers_text(files)));
  check_stays_inside(folder, folder / found->name);
  return {folder / found->name, number, std::size_t(found - files.begin())};
}

}  // namespace marrow::files
