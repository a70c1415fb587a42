// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"
#include "report/cell_material.hpp"
#include "report/report.hpp"

// The page without its data. tools/report/page/bundle.py makes it when marrow is built.
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
namespace {

constexpr std::string_view kMarker = "<!-- marrow:data -->", kBefore = "<script type=\"application/json\" id=\"data\">",
                           kAfter = "</script>";

std::string_view page_without_data() {
  return {marrow_report_page, std::size_t(marrow_report_page_end - marrow_report_page)};
}

}  // namespace

std::string text_in_page(const nlohmann::json& data) {
  const std::string text = json_text(data);
  std::string safe;
  safe.reserve(text.size() + text.size() / 16);
  for (const char c : text) c == '<' ? safe += "\\u003c" : safe += c;
  return safe;
}

std::size_t page_bytes(const nlohmann::json& data) {
  return page_without_data().size() - kMarker.size() + kBefore.size() + text_in_page(data).size() + kAfter.size();
}

void write_page(const nlohmann::json& data, const std::vector<NamedRecipe>& recipes, const std::filesystem::path& file,
                Kinds kinds) {
  const std::string_view page = page_without_data();
  const std::size_t at = page.find(kMarker);
  std::string text(page.substr(0, at));
  text.append(recipes_element(recipes));  // first, so that it is found quickly
  text.append(kBefore).append(text_in_page(data)).append(kAfter).append(page.substr(at + kMarker.size()));
  write_text_file(file, text, kinds);
}

}  // namespace marrow::cli
