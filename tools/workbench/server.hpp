// SPDX-License-Identifier: Apache-2.0
#pragma once
// The web server of `marrow open`. It answers at 127.0.0.1 only.
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/base/error.hpp"
#include "workbench/access.hpp"

namespace marrow::workbench {

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
