// SPDX-License-Identifier: Apache-2.0
#include "report/report.hpp"
#include "runtime/text_file.hpp"

// The page without its data. tools/report/assemble.py makes it when marrow is built.
asm(".section .rodata\n"
    ".global marrow_report_page\n"
    ".global marrow_report_page_end\n"
    "marrow_report_page:\n"
    ".incbin \"" MARROW_REPORT_PAGE
    "\"\n"
    "marrow_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const char marrow_report_page[], marrow_report_page_end[];

namespace marrow::cli {

void write_page(const nlohmann::json& data, const std::filesystem::path& file, Kinds kinds) {
  static constexpr std::string_view kMarker = "<!-- marrow:data -->";
  const std::string_view page(marrow_report_page, std::size_t(marrow_report_page_end - marrow_report_page));
  const std::size_t at = page.find(kMarker);
  std::string text = data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  // No text in the data may end the script, so "<" is written as a JSON escape.
  std::string safe;
  safe.reserve(text.size() + text.size() / 16);
  for (const char c : text) c == '<' ? safe += "\\u003c" : safe += c;
  write_text_file(file,
                  std::string(page.substr(0, at)) + "<script type=\"application/json\" id=\"data\">" + safe +
                      "</script>" + std::string(page.substr(at + kMarker.size())),
                  kinds);
}

}  // namespace marrow::cli
