// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/program_call.hpp"

#include <set>

#include "marrow/base/names.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/run/metrics_file.hpp"
#include "marrow/run/volume_out.hpp"
#include "marrow/runtime/process/program.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/samples_out.hpp"

namespace marrow::run {
namespace {

namespace fs = std::filesystem;

// The words of a command, with the places of files in them: {volume.nii.gz}.

/// A place in a word: {name.format}, or {name}.
struct Placeholder {
  std::string name, format;
  std::string text() const { return "{" + name + (format.empty() ? "" : "." + format) + "}"; }
};

std::string filled_word(const std::string& word, const std::function<std::string(const Placeholder&)>& file_of) {
  std::string filled;
  for (std::size_t at = 0; at < word.size(); ++at) {
    if (word.compare(at, 2, "{{") == 0 || word.compare(at, 2, "}}") == 0) {
      filled += word[at++];
      continue;
    }
    if (word[at] != '{') {
      filled += word[at];
      continue;
    }
    const std::size_t end = word.find('}', at);
    if (end == word.npos)
      throw Error("the word " + in_quotes(word) + " of the command has a { without a }; write {{ for the character {");
    const std::string inside = word.substr(at + 1, end - at - 1);
    const std::size_t dot = inside.find('.');
    filled += file_of({inside.substr(0, dot), dot == inside.npos ? "" : inside.substr(dot + 1)});
    at = end;
  }
  return filled;
}

/// The words with each place replaced by what `file_of` returns for it. {{ stands for {, and }} for }. Throws Error for
/// a { without its }.
std::vector<std::string> filled_words(const std::vector<std::string>& words,
                                      const std::function<std::string(const Placeholder&)>& file_of) {
  std::vector<std::string> filled;
  for (const std::string& word : words) filled.push_back(filled_word(word, file_of));
  return filled;
}

/// Gives each place in the command its file, and writes the inputs that the command names.
class Files {
 public:
  Files(const GivenInputs& inputs, const ProgramOptions& options, const std::vector<std::string>& formats,
        const fs::path& folder)
      : inputs_(inputs), options_(options), formats_(formats), folder_(folder), output_folder_(folder / "output") {
    fs::create_directory(output_folder_);
  }

  std::string of(const Placeholder& place) {
    if (place.name == "files") return given_file(place);
    if (place.name == "output_folder" && place.format.empty()) {
      names_folder_ = true;
      return output_folder_.string();
    }
    if (place.name == "output") return output_file(place);
    std::vector<std::string> known = names_of_inputs();
    if (std::find(known.begin(), known.end(), place.name) != known.end()) return input_file(place);
    known.insert(known.end(), {"output", "output_folder", "files"});
    throw Error("the command has the place " + in_quotes(place.text()) +
                ", which nothing fills ({{ stands for a brace); " + suggestion(place.name, known));
  }

  /// The file that the program is to make.
  fs::path output() const {
    if (output_.empty() == options_.output_file.empty())
      throw Error(output_.empty() ? "the command does not say where its output goes; write {output." + formats_[0] +
                                        "}, or {output_folder} and its file in it as output_file"
                                  : "the command has {output...}, and there is an output_file, too; give one of them");
    if (!output_.empty()) return output_;
    if (!names_folder_)
      throw Error(
          "there is an output_file, but the command does not name the folder that it is in; write {output_folder}");
    const fs::path file(options_.output_file);
    if (file.is_absolute() || std::find(file.begin(), file.end(), "..") != file.end())
      throw Error("output_file is " + in_quotes(options_.output_file) + ", but must be a name below {output_folder}");
    return output_folder_ / file;
  }

  /// What the program made in its place.
  std::string found() const {
    std::vector<std::string> names;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(output_folder_))
      if (entry.is_regular_file()) names.push_back(entry.path().lexically_relative(output_folder_).string());
    std::sort(names.begin(), names.end());
    return suggestion(options_.output_file, names);
  }

 private:
  void check_format(const Placeholder& place, const std::vector<std::string>& formats) const {
    if (std::find(formats.begin(), formats.end(), place.format) != formats.end()) return;
    throw Error("the place " + in_quotes(place.text()) + " of the command has " +
                (place.format.empty() ? "no format" : "an unknown format") + "; " + suggestion(place.format, formats));
  }

  std::string input_file(const Placeholder& place) {
    check_format(place, formats_of_input(place.name));
    if (!is_given(inputs_, place.name))
      throw Error("the command has " + in_quotes(place.text()) + ", but nothing is wired to the input " +
                  in_quotes(place.name));
    const fs::path file = folder_ / (place.name + "." + place.format);
    if (written_.insert(file).second) write_input(inputs_, place.name, place.format, file);
    return file.string();
  }

  std::string output_file(const Placeholder& place) {
    check_format(place, formats_);
    const fs::path file = output_folder_ / ("output." + place.format);
    if (!output_.empty() && output_ != file)
      throw Error("the command has two outputs, " + in_quotes(output_.filename().string()) + " and " +
                  in_quotes(file.filename().string()) + "; a node makes one");
    output_ = file;
    return file.string();
  }

  std::string given_file(const Placeholder& place) const {
    const std::optional<double> number = parsed_number(place.format);
    const std::size_t count = options_.files.size();
    if (!number || *number < 1 || *number > double(count) || *number != double(std::size_t(*number)))
      throw Error("the command has the place " + in_quotes(place.text()) + ", but the option files " +
                  (count == 0 ? std::string("is empty")
                              : "has " + counted(count, "path") + ": {files.1}" +
                                    (count > 1 ? formatted(" to {{files.{}}}", count) : "")));
    const fs::path& file = options_.files[std::size_t(*number) - 1];
    if (!fs::exists(file)) throw Error(file.string() + " is not there; the option files names it");
    return fs::absolute(file).string();
  }

  const GivenInputs& inputs_;
  const ProgramOptions& options_;
  const std::vector<std::string>& formats_;
  fs::path folder_, output_folder_, output_;
  std::set<fs::path> written_;
  bool names_folder_ = false;
};

}  // namespace

void with_output(const GivenInputs& inputs, const ProgramOptions& options, const std::vector<std::string>& formats,
                 Context& context, const std::function<void(const fs::path&)>& read) {
  const TemporaryFolder folder(new_temporary_folder("program"));
  Files files(inputs, options, formats, folder.path());
  ProgramCall call;
  call.command = filled_words(options.command, [&](const Placeholder& place) { return files.of(place); });
  call.folder = folder.path();
  call.seconds = options.max_time_s;
  call.memory_mb = options.max_memory_mb;
  call.check = [&] { context.check_cancelled(); };
  const fs::path output = files.output();
  const ProgramEnd end = run_program(call);
  if (const std::string fault = failure_of_program(call, end); !fault.empty()) throw Error(fault);
  context.debug(end.printed);
  if (!fs::is_regular_file(output))
    throw Error("the program " + in_quotes(call.command[0]) + " ended well, but made no file " +
                in_quotes(output.filename().string()) +
                (options.output_file.empty() ? "" : " in {output_folder}; " + files.found()) + printed_by_program(end));
  read(output);
}

namespace {

const std::map<std::string, std::vector<std::string>>& formats() {
  static const std::map<std::string, std::vector<std::string>> all{
      {"volume", formats_of_volumes()}, {"second_volume", formats_of_volumes()},
      {"field", formats_of_volumes()},  {"mesh", {"stl", "ply", "obj", "vtp"}},
      {"image", {"png", "tif"}},        {"metrics", {"json"}}};
  return all;
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void write_field(const SignedField& field, const std::string& format, const fs::path& file) {
  std::vector<std::uint8_t> inside(field.values_mm.size());
  std::transform(field.values_mm.begin(), field.values_mm.end(), inside.begin(),
                 [](float distance_mm) { return std::uint8_t(distance_mm < 0); });
  write_volume(file, format, field.grid, inside);
}

void write_mesh(const Mesh& mesh, const std::string& format, const fs::path& file) {
  check_mesh(mesh, "input 'mesh'");
  files::write_plainly(file, {format == "stl"   ? stl_bytes(mesh)
                              : format == "ply" ? ply_bytes(mesh)
                              : format == "obj" ? exchange::obj_text(mesh)
                                                : exchange::vtp_bytes(mesh)});
}

void write_image(const Image& image, const std::string& format, const fs::path& file) {
  const cv::Mat pixels = image.pixels.clone();  // rows without gaps
  if (format == "tif") {
    cv::Mat values;
    pixels.convertTo(values, CV_32F);
    return files::write_float_tiff(file, values.cols, values.rows, values.ptr<float>());
  }
  if (pixels.depth() == CV_32F)
    throw Error(
        "input 'image' has grey values that are no whole numbers, and PNG has no place for them; write {image.tif}");
  files::write_png(file, pixels.cols, pixels.rows, 1, pixels.depth() == CV_8U ? files::Sample::u8 : files::Sample::u16,
                   pixels.data);
}

}  // namespace

std::vector<std::string> names_of_inputs() { return {"volume", "second_volume", "field", "mesh", "image", "metrics"}; }

std::vector<std::string> formats_of_input(const std::string& name) { return formats().at(name); }

bool is_given(const GivenInputs& inputs, const std::string& name) {
  const void* input = name == "volume"          ? static_cast<const void*>(inputs.volume)
                      : name == "second_volume" ? inputs.second_volume
                      : name == "field"         ? inputs.field
                      : name == "mesh"          ? inputs.mesh
                      : name == "image"         ? inputs.image
                                                : static_cast<const void*>(inputs.metrics);
  return input != nullptr;
}

void write_input(const GivenInputs& inputs, const std::string& name, const std::string& format, const fs::path& file) {
  if (name == "volume") write_volume(file, format, inputs.volume->grid, inputs.volume->values);
  if (name == "second_volume") write_volume(file, format, inputs.second_volume->grid, inputs.second_volume->values);
  if (name == "field") write_field(*inputs.field, format, file);
  if (name == "mesh") write_mesh(*inputs.mesh, format, file);
  if (name == "image") write_image(*inputs.image, format, file);
  if (name == "metrics") files::write_plainly(file, {metrics_text(*inputs.metrics)});
}

std::string stl_bytes(const Mesh& mesh) {
  std::string bytes(80, ' ');
  append(bytes, std::uint32_t(mesh.triangles.size()));
  bytes.reserve(84 + 50 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[triangle[0]], &b = mesh.vertices_mm[triangle[1]],
                          &c = mesh.vertices_mm[triangle[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    for (const Eigen::Vector3d& vector : {normal, a, b, c})
      for (const double part : vector) append(bytes, float(part));
    append(bytes, std::uint16_t(0));
  }
  return bytes;
}

std::string ply_bytes(const Mesh& mesh) {
  std::string bytes = formatted(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices_mm.size(), mesh.triangles.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm)
    for (const double coordinate : vertex) append(bytes, coordinate);
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t(3));
    for (const std::uint32_t corner : triangle) append(bytes, std::int32_t(corner));
  }
  return bytes;
}

}  // namespace marrow::run
