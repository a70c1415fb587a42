// SPDX-License-Identifier: Apache-2.0
#pragma once
// The web server of `marrow open`. It answers at 127.0.0.1 only.
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::workbench {

// Who may talk to the server of `marrow open`. Pages of other sites in the same browser, other users of the machine and
// names that were made to point to this machine (DNS rebinding) reach nothing.

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

/// A request that passed the checks of Access.
struct Request {
  std::map<std::string, std::string> parameters;  ///< behind the '?', decoded
  nlohmann::json body;                            ///< of a POST: an object

  /// Throws Error if it is missing, or for number() if it is not a whole number from `least` to `most`.
  const std::string& parameter(const std::string& name) const;
  int number(const std::string& name, int least, int most) const;
  /// The text `name` of the body. Throws Error if it is missing or no text.
  std::string text(const std::string& name) const;
};

struct Answer {
  std::string body;
  std::string type = "application/json";
  std::vector<std::pair<std::string, std::string>> headers =
      {};  ///< these replace the server's own headers of the same name
};
Answer json_answer(const nlohmann::json& value);
/// Bytes as they are, for pixels. `about` goes into the header X-Marrow-About as JSON.
Answer bytes_answer(std::string bytes, const nlohmann::json& about = {});

/// A request relies on a state that has changed, for example because of another tab. The answer is 409.
class Conflict : public Error {
 public:
  using Error::Error;
};

/// An exception of a handler becomes {"error": text} with 400, or 409 for a Conflict. Handlers are called from several
/// threads at once.
using Handler = std::function<Answer(const Request&)>;

class Server {
 public:
  Server();
  ~Server();
  /// `path` without parameters, such as "/api/slice". All paths are added before run().
  void get(const std::string& path, Handler handler);
  void post(const std::string& path, Handler handler);
  /// One of marrow's own pages, scripts or styles.
  void page(const std::string& path, const std::string& type, std::string text);

  /// Takes the port; 0: any that is free. Throws Error if it is taken.
  void listen(int port);
  const Access& access() const;
  /// Answers until `stop` is true.
  void run(const std::atomic<bool>& stop);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace marrow::workbench
