// SPDX-License-Identifier: Apache-2.0
#pragma once
// What could stand at the end of a command line: the commands, options and values that begin with what is typed.
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace marrow::cli {

/// A word that may be typed, and what it means in one line; may be empty.
struct Candidate {
  std::string word, help;
};

struct Wishes {
  std::vector<Candidate> candidates;
  bool files = false, folders = false;  ///< the shell knows these
};

/// A command line as far as it is typed.
struct Typed {
  std::string command;              ///< "run", or "cache gc"
  std::vector<std::string> given;   ///< what is given beside options, such as the pipeline's file
  std::string place;                ///< what is being typed: "--set" or the name of a positional
  std::string type;                 ///< the option's type in the help, such as FOLDER or TEXT:{a,b}
  std::string value;                ///< what is typed of it
  std::vector<std::string> before;  ///< values that the option has already
};

/// The values that begin with what is typed. They need the known nodes, or the pipeline.
Wishes values_for(const Typed& typed);

/// `words` are those after the program's name; the last one is being typed and may be empty.
Wishes wishes_for(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace marrow::cli
