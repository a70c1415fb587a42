// SPDX-License-Identifier: Apache-2.0
#include "workbench/access.hpp"

#include <sys/random.h>

#include <array>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::workbench {
namespace {

/// Takes the same time for all texts of one length, so that nobody can guess the secret digit by digit.
bool is_same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= unsigned(a[i] ^ b[i]);
  return difference == 0;
}

/// The value in "a=1; name=value; b=2"; empty if the name is missing.
std::string value_of_cookie(const std::string& cookies, const std::string& name) {
  for (std::size_t begin = 0; begin < cookies.size();) {
    std::size_t end = cookies.find(';', begin);
    if (end == std::string::npos) end = cookies.size();
    const std::string one = cookies.substr(begin, end - begin);
    if (one.starts_with(name + "=")) return one.substr(name.size() + 1);
    begin = end + 1;
    while (begin < cookies.size() && cookies[begin] == ' ') ++begin;
  }
  return "";
}

}  // namespace

std::string random_secret() {
  std::array<unsigned char, 32> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size()))
    throw Error("the system gives no random numbers, so no secret can be made for the browser");
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

Access::Access(std::string token, std::string session) : token_(std::move(token)), session_(std::move(session)) {}

std::string Access::address(const std::string& place) const {
  return formatted("http://127.0.0.1:{}/?token={}{}", port_, token_, place);
}

std::string Access::fault(const Asked& asked, bool hands_in_token) const {
  const std::string port = formatted(":{}", port_);
  if (asked.host != "127.0.0.1" + port && asked.host != "localhost" + port)
    return "this server answers only to 127.0.0.1" + port + " and localhost" + port;
  if (!asked.origin.empty() && asked.origin != "http://" + asked.host)
    return "a page of another site may not ask this server";
  if (asked.fetch_site == "cross-site" && !hands_in_token) return "a page of another site may not ask this server";
  if (!hands_in_token && !is_same(value_of_cookie(asked.cookie, cookie_name()), session_))
    return "this browser is not known here; open the address that 'marrow open' printed, or start it again";
  if (!asked.changes) return "";
  if (asked.own_header.empty()) return "the header X-Marrow is missing";
  if (asked.content_type != "application/json") return "only JSON may be sent here";
  return "";
}

std::string Access::take_token(const std::string& token) {
  const std::lock_guard lock(mutex_);
  if (!is_same(token, token_))
    return "the token in this address is not that of this server; copy the whole address that 'marrow open' printed";
  if (is_taken_) return "this address was used before; start 'marrow open' again for a new one";
  is_taken_ = true;
  return "";
}

std::string Access::cookie() const { return cookie_name() + "=" + session_ + "; HttpOnly; SameSite=Strict; Path=/"; }

}  // namespace marrow::workbench
