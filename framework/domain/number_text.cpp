// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/number_text.hpp"

#include <locale.h>

#include <algorithm>
#include <charconv>
#include <cstdarg>
#include <cstdio>

namespace marrow {
namespace {

/// Gives this thread the "C" locale while it exists.
class PlainLocale {
 public:
  PlainLocale() : before_(uselocale(plain())) {}
  ~PlainLocale() { uselocale(before_); }
  PlainLocale(const PlainLocale&) = delete;
  PlainLocale& operator=(const PlainLocale&) = delete;

 private:
  static locale_t plain() {
    static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
    return locale;
  }
  locale_t before_;
};

}  // namespace

std::string formatted(const char* format, ...) {
  const PlainLocale locale;
  std::va_list values, again;
  va_start(values, format);
  va_copy(again, values);
  std::string text(std::size_t(std::max(0, std::vsnprintf(nullptr, 0, format, values))), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  va_end(values);
  return text;
}

std::optional<double> parsed_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace marrow
