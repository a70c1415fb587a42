// SPDX-License-Identifier: Apache-2.0
#include "dicom_folder.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "dicom_header.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 20;  // files in one message

/// Whether the name of a file that is not DICOM shows that it is no slice: a licence, a note, a picture, a file of
/// marrow. A file with any other name, such as "IM5", may be the rest of a damaged slice.
bool is_no_slice_by_name(const fs::path& path) {
  static const std::set<std::string> kNames{"authors",  "changelog", "checksums",  "copying", "dicomdir",
                                            "lockfile", "licence",   "license",    "md5sum",  "md5sums",
                                            "notice",   "readme",    "sha256sums", "version"};
  static const std::set<std::string> kExtensions{
      ".7z",   ".app",  ".avi",    ".bat", ".bib",    ".bmp",  ".c",    ".cab",  ".cfg",  ".chm",  ".class", ".cpp",
      ".css",  ".csv",  ".db",     ".dll", ".doc",    ".docx", ".exe",  ".fcsv", ".gif",  ".h5",   ".hdf5",  ".htm",
      ".html", ".ico",  ".inf",    ".ini", ".ipynb",  ".jar",  ".jpeg", ".jpg",  ".js",   ".json", ".lnk",   ".log",
      ".m",    ".mat",  ".md",     ".md5", ".mha",    ".mkv",  ".mov",  ".mp3",  ".mp4",  ".mrb",  ".mrml",  ".nii",
      ".npy",  ".npz",  ".nrrd",   ".obj", ".odt",    ".pdf",  ".ply",  ".png",  ".pptx", ".py",   ".rar",   ".rtf",
      ".sh",   ".sha1", ".sha256", ".so",  ".sqlite", ".stl",  ".svg",  ".tar",  ".tfm",  ".tif",  ".tiff",  ".toml",
      ".tra",  ".tsv",  ".ttf",    ".txt", ".url",    ".vtk",  ".vtp",  ".vtu",  ".webm", ".webp", ".wmv",   ".xls",
      ".xlsx", ".xml",  ".yaml",   ".yml", ".zip",    ".zraw"};
  const std::string name = in_small_letters(path.filename().string()), extension = extension_of(path);
  return name[0] == '.' || kNames.count(name) > 0 || kExtensions.count(extension) > 0 ||
         (name.size() > 7 && name.compare(name.size() - 7, 7, ".nii.gz") == 0);
}

/// Whether a file is a text under a name that slices do not have. A slice may have been replaced by a text, such as the
/// error page of a server; it still has its name then.
bool is_text_beside_slices(const fs::path& path, const std::set<std::string>& extensions_of_dicom) {
  static const std::set<std::string> kOfSlices{"",    ".bak", ".dc3", ".dcm",  ".dic", ".dicom",
                                               ".gz", ".ima", ".img", ".part", ".tmp"};
  const std::string extension = extension_of(path);
  const bool is_number = extension.find_first_not_of(".0123456789") == std::string::npos;
  if (is_number || kOfSlices.count(extension) || extensions_of_dicom.count(extension)) return false;
  const InputFile file(path, true);
  const std::string head = file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 4096)));
  return !head.empty() && std::all_of(head.begin(), head.end(),
                                      [](unsigned char c) { return c >= 32 || c == '\t' || c == '\n' || c == '\r'; });
}

/// By its first bytes. Media for patients come with a program that shows the images.
bool is_program_or_archive(const fs::path& path) {
  const InputFile file(path, true);
  const std::string head = file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 4)));
  return head.rfind("MZ", 0) == 0 ||
         head ==
             "\x7f"
             "ELF" ||
         head == "PK\x03\x04";
}

bool is_surely_no_slice(const fs::path& path, const std::set<std::string>& extensions_of_dicom) {
  return is_no_slice_by_name(path) || is_program_or_archive(path) || is_text_beside_slices(path, extensions_of_dicom);
}

/// What is in a folder.
struct Content {
  std::vector<DicomObject> objects;
  std::vector<fs::path> others, folders;  ///< files that are not DICOM; folders that are not hidden
};

/// `root`: the folder that the user named, which no link may lead out of. Links to folders inside are not followed.
Content content_of(const fs::path& folder, const fs::path& root) {
  std::set<fs::path> sorted;
  std::error_code failure, none;
  for (fs::directory_iterator entry(folder, failure), end; entry != end && !failure; entry.increment(failure)) {
    check_stays_inside(root, entry->path());
    if (entry->is_regular_file(none) || (entry->is_directory(none) && !entry->is_symlink(none)))
      sorted.insert(entry->path());
  }
  if (failure) throw Error(folder.string() + ": cannot be read (" + failure.message() + ")");
  Content content;
  for (const fs::path& path : sorted) {
    if (!fs::is_directory(path, none))
      looks_like_dicom(path) ? content.objects.push_back(dicom_object(path)) : content.others.push_back(path);
    else if (path.filename().string()[0] != '.')
      content.folders.push_back(path);
  }
  return content;
}

/// "\n    a\n    b\n    and 3 more"
std::string listed(const std::vector<std::string>& lines) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kMostNamed, lines.size()); ++i) text += "\n    " + lines[i];
  if (lines.size() > kMostNamed) text += formatted("\n    and {} more", lines.size() - kMostNamed);
  return text;
}

std::string why_not_dicom(const fs::path& path) {
  const std::uint64_t bytes = InputFile(path, true).size();
  return bytes == 0    ? "it is empty"
         : bytes < 132 ? formatted("it has {} bytes, at least 132 expected", bytes)
                       : "it has no 'DICM' at byte 128";
}

/// Throws Error that names all files which are not DICOM and may be the rest of a slice. The others are passed over.
void sort_out_others(const fs::path& folder, const Content& content, SeriesFiles& files) {
  std::set<std::string> extensions;
  for (const DicomObject& object : content.objects) extensions.insert(extension_of(object.path));
  std::vector<std::string> doubtful;
  for (const fs::path& path : content.others) {
    const std::string name = path.filename().string();
    if (is_surely_no_slice(path, extensions))
      files.passed_over.push_back(name);
    else
      doubtful.push_back(name + ": this file in the series' folder is no whole DICOM file (" + why_not_dicom(path) +
                         ")");
  }
  if (doubtful.size() == 1)
    throw Error((folder / doubtful[0]).string() +
                "; if it is a slice, it is damaged at its start: fetch it again; if not, remove it from the folder");
  if (doubtful.size() > 1)
    throw Error(
        formatted("{}: holds {} files beside the slices that are no whole DICOM files; those that are slices are "
                  "damaged at their start: fetch them again, and remove the others from the folder:{}",
                  folder.string(), doubtful.size(), listed(doubtful)));
}

/// "1.2.3 (CT, 12 slices, thin)"
std::string described(const std::string& uid, const std::vector<const DicomObject*>& objects) {
  const DicomObject& first = *objects[0];
  return formatted("{} ({}, {}{}{})", uid, first.modality, objects.size(),
                   first.modality == "CT" ? " slices" : " files",
                   first.description.empty() ? "" : ", " + first.description);
}

std::string chosen_series(const fs::path& folder, const std::vector<DicomObject>& objects, const std::string& wanted) {
  std::map<std::string, std::vector<const DicomObject*>> all, possible;
  for (const DicomObject& object : objects) {
    if (!object.is_legible) continue;
    all[object.series].push_back(&object);
    if (object.not_a_slice.empty()) possible[object.series].push_back(&object);
  }
  const auto lines = [&](const auto& series) {
    std::vector<std::string> lines;
    for (const auto& [uid, members] : series) lines.push_back(described(uid, members));
    return listed(lines);
  };
  if (!wanted.empty() && !all.count(wanted))
    throw Error(folder.string() + ": holds no series " + wanted + "; it holds:" + lines(all));
  if (!wanted.empty()) return wanted;
  if (possible.size() > 1)
    throw Error(formatted("{}: holds {} series; name one with series_uid:{}", folder.string(), possible.size(),
                          lines(possible)));
  if (possible.empty() && all.size() > 1)
    throw Error(folder.string() + ": holds no slice of a CT; its DICOM files are of these series:" + lines(all));
  return possible.empty() ? (all.empty() ? "" : all.begin()->first) : possible.begin()->first;
}

/// The class that most slices of the series have, or most of its files if none is surely a slice. What has this class
/// is a slice, whatever else its header says.
std::string usual_class(const std::vector<DicomObject>& objects, const std::string& series) {
  std::map<std::string, int> counts, of_slices;
  for (const DicomObject& object : objects) {
    if (object.series != series) continue;
    ++counts[object.class_uid];
    if (object.not_a_slice.empty()) ++of_slices[object.class_uid];
  }
  if (!of_slices.empty()) counts = of_slices;
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == counts.end() ? "" : most->first;
}

/// Only one folder is read, so slices in folders below it would be missed.
void check_folders_below(const fs::path& root, const Content& content, const std::string& series, SeriesFiles& files) {
  for (const fs::path& folder : content.folders) {
    std::vector<std::string> doubtful;
    std::vector<fs::path> open{folder};
    while (!open.empty()) {
      const Content below = content_of(open.back(), root);
      open.pop_back();
      open.insert(open.end(), below.folders.begin(), below.folders.end());
      for (const DicomObject& object : below.objects)
        if (object.not_a_slice.empty() && (!object.is_legible || object.series == series))
          doubtful.push_back("'" + object.path.lexically_relative(folder).string() + "'");
      for (const fs::path& path : below.others)
        if (!is_surely_no_slice(path, {})) doubtful.push_back("'" + path.lexically_relative(folder).string() + "'");
    }
    files.passed_over.push_back(folder.filename().string() + "/");
    if (doubtful.empty()) continue;
    std::string names = doubtful[0];
    for (std::size_t i = 1; i < std::min(kMostNamed, doubtful.size()); ++i) names += ", " + doubtful[i];
    if (doubtful.size() > kMostNamed) names += formatted(" and {} more", doubtful.size() - kMostNamed);
    throw Error(folder.string() + ": this folder inside the series' folder holds files that may be slices (" + names +
                "), and only one folder is read; move them beside the other slices, or this folder elsewhere");
  }
}

constexpr DicomTag kImageType{0x0008, 0x0008, "ImageType"};
constexpr DicomTag kSeriesDescription{0x0008, 0x103E, "SeriesDescription"};
constexpr DicomTag kSeries{0x0020, 0x000E, "SeriesInstanceUID"};

/// Whether the class is this one or a special kind of it.
bool is_class(const std::string& uid, const std::string& general) {
  return uid == general || uid.rfind(general + ".", 0) == 0;
}

/// A slice's header could be damaged, so more than its class must tell that it is none. Some programs write a CT as
/// secondary capture, or without a class.
std::string why_not_a_slice(const DicomHeader& header, const DicomObject& object) {
  const std::string& uid = object.class_uid;
  if (uid == "1.2.840.10008.1.3.10") return "a media directory";
  if (header.text(kImageType).value_or("").find("LOCALIZER") != std::string::npos) return "a localizer";
  if (uid.empty()) return object.modality.empty() && !header.has(kRows) && object.is_legible ? "no image" : "";
  if (is_class(uid, "1.2.840.10008.5.1.4.1.1.2")) return {};
  if (!object.is_legible) return is_class(uid, "1.2.840.10008.5.1.4.1.1.7") ? "" : "of the class " + uid;
  if (object.modality != "CT") return object.modality.empty() ? "of no modality" : object.modality;
  if (header.number(kSamplesPerPixel).value_or(1) > 1) return "in colours";
  if (!header.has(kImagePosition)) return "without a place in the patient";
  return {};
}

}  // namespace

SeriesFiles files_of_series(const fs::path& folder, const std::string& series_uid) {
  const Content content = content_of(folder, folder);
  SeriesFiles files;
  sort_out_others(folder, content, files);
  if (content.objects.empty()) throw Error(folder.string() + ": holds no DICOM file");
  const std::string series = chosen_series(folder, content.objects, series_uid),
                    class_uid = usual_class(content.objects, series);
  for (const DicomObject& object : content.objects) {
    const std::string name = object.path.filename().string();
    const bool is_localizer = object.not_a_slice == "a localizer";
    if (object.is_legible && object.series != series)
      files.passed_over.push_back(
          name + " (" + (object.not_a_slice.empty() ? "of the series " + object.series : object.not_a_slice) + ")");
    else if (!object.not_a_slice.empty() && (object.class_uid != class_uid || is_localizer))
      files.passed_over.push_back(name + " (" + object.not_a_slice + ")");
    else
      files.slices.push_back(object.path);
  }
  if (files.slices.empty())
    throw Error(folder.string() + ": holds no slice of a CT; there are:" + listed(files.passed_over));
  check_folders_below(folder, content, series, files);
  return files;
}

DicomObject dicom_object(const std::filesystem::path& path) {
  const DicomFile file(path, DicomFile::Part::header);
  const DicomHeader header(file, 1);
  DicomObject object{path, file.media_class(), {}, {}, {}, {}, true};
  try {
    if (const auto given = header.text(kObjectClass)) object.class_uid = *given;
    object.series = header.text(kSeries).value_or("");
    object.description = header.text(kSeriesDescription).value_or("");
    object.modality = header.text(kModality).value_or("");
    object.is_legible = file.fault().empty() || !object.series.empty();
    object.not_a_slice = why_not_a_slice(header, object);
  } catch (const Error&) {  // an element that is damaged; reading the slice says so
    object.is_legible = false;
  }
  return object;
}

}  // namespace marrow::files
