// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tables on a terminal: the last column is wrapped at the terminal's edge.
#include <memory>
#include <string>

namespace CLI {
class FormatterBase;
}

namespace marrow::cli {

/// The characters in a line of the terminal that the standard output goes to. 0 if it goes elsewhere: then each row is
/// one line, so that other programs can read it.
std::size_t terminal_columns();

/// `head` and beside it, from the column `indent` on, `text` in lines of at most `columns` characters, each with a line
/// break at its end. With 0 columns lines are only broken where the text has breaks. Where too little room is left,
/// `text` begins on the next line. Words are not broken.
std::string wrapped_beside(const std::string& head, const std::string& text, std::size_t indent, std::size_t columns);

/// Prints such a row for the terminal.
void print_beside(const std::string& head, const std::string& text, std::size_t indent);

/// How CLI11 writes the help, with rows that are wrapped.
std::shared_ptr<CLI::FormatterBase> wrapped_help();

}  // namespace marrow::cli
