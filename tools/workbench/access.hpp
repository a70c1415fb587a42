// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who may talk to the server of `marrow open`. Pages of other sites in the same browser, other users of the machine and
// names that were made to point to this machine (DNS rebinding) reach nothing.
#include <mutex>
#include <string>

#include "marrow/base/number_text.hpp"

namespace marrow::workbench {

/// What a request says about itself. Missing headers are empty.
struct Asked {
  bool changes = false;  ///< a method other than GET
  std::string host, origin, fetch_site, cookie, content_type;
  std::string own_header;  ///< X-Marrow: a page of another site cannot set it without being asked first
};

/// 256 random bits as hexadecimal digits. Throws Error if the system gives none.
std::string random_secret();

/// The secrets of one server. All methods may be called from several threads.
class Access {
 public:
  /// `token` opens the page once, `session` is the cookie's value.
  explicit Access(std::string token = random_secret(), std::string session = random_secret());
  /// Call this once, before any request.
  void listen_on(int port) { port_ = port; }

  /// "http://127.0.0.1:PORT/?token=...", with `place` at its end, such as "#case=cases/7".
  std::string address(const std::string& place) const;
  /// Why the request is refused, as a sentence for people; empty if it may go on. A request without the cookie may only
  /// hand in the token.
  std::string fault(const Asked& asked, bool hands_in_token) const;
  /// Empty if this is the token, and it is handed in for the first time. Otherwise why it opens nothing.
  std::string take_token(const std::string& token);
  /// The value of Set-Cookie for a browser that handed in the token.
  std::string cookie() const;

 private:
  std::string cookie_name() const { return formatted("marrow_{}", port_); }  // cookies do not know ports

  std::string token_, session_;
  int port_ = 0;
  std::mutex mutex_;
  bool is_taken_ = false;
};

}  // namespace marrow::workbench
