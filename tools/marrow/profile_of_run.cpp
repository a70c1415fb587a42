// SPDX-License-Identifier: Apache-2.0
#include "profile_of_run.hpp"

#include <cstdio>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {

ProfileOfRun::ProfileOfRun(const std::filesystem::path& file, RunSettings& settings) : file_(file) {
  if (!file.empty()) settings.profile.profile = &profile_.emplace();
}

bool ProfileOfRun::write(const std::string& title, const RunFolder& folder,
                         const std::function<void(const std::string&)>& note) const {
  if (!profile_) return true;
  if (const std::string text = note_on_profile(*profile_); !text.empty()) note(text);
  const std::string text = profile_->text(title);
  try {
    write_text_file(folder.path() / "profile.json", text);
    write_text_file(file_, text, Kinds::files_and_pipes);
    return true;
  } catch (const Error& error) {
    std::fprintf(stderr, "marrow: error: the profile: %s\n", printable_lines(error.what()).c_str());
    return false;
  }
}

}  // namespace marrow::cli
