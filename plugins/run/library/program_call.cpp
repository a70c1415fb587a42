// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/program_call.hpp"

#include <algorithm>
#include <set>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/temporary_folder.hpp"
#include "marrow/run/command_words.hpp"
#include "marrow/runtime/process/program.hpp"

namespace marrow::run {
namespace {

namespace fs = std::filesystem;

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
          "there is an output_file, but the command does not name the folder that it is in; write "
          "{output_folder}");
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

}  // namespace marrow::run
