// SPDX-License-Identifier: Apache-2.0
#include "workbench/server.hpp"

#include <sys/random.h>
#include <array>
#include <charconv>
#include <utility>

#include "marrow/base/json_text.hpp"
#include "marrow/base/printable.hpp"
#include "workbench/http_server.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBytes = 64'000'000;  // of one request: a painted mask of a large image
constexpr int kMostAtOnce = 48;                 // requests that are being answered

/// Scripts, styles and pictures come from this server alone, and no other site may show the page inside its own.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

Asked asked_by(const httplib::Request& request) {
  Asked asked;
  asked.changes = request.method != "GET";
  asked.host = request.get_header_value("Host");
  asked.origin = request.get_header_value("Origin");
  asked.fetch_site = request.get_header_value("Sec-Fetch-Site");
  asked.cookie = request.get_header_value("Cookie");
  asked.content_type = request.get_header_value("Content-Type");
  asked.own_header = request.get_header_value("X-Marrow");
  return asked;
}

void refuse(httplib::Response& response, int status, const std::string& text) {
  response.status = status;
  response.set_content(json_text(json{{"error", printable_lines(text)}}), "application/json");
}

/// Sends the content without compression. set_content() would compress it anew for each request, which takes a second
/// for a page's scripts, and ten for a large report.
void send_whole(const std::shared_ptr<const std::string>& content, const std::string& type,
                httplib::Response& response) {
  if (content->empty()) return response.set_content("", type);
  const auto part = [content](std::size_t begin, std::size_t length, httplib::DataSink& sink) {
    return sink.write(content->data() + begin, length);
  };
  response.set_content_provider(content->size(), type, part);
}

Request request_of(const httplib::Request& asked) {
  Request request;
  for (const auto& [name, value] : asked.params) request.parameters[name] = value;
  if (asked.method == "GET") return request;
  request.body = parse_json(asked.body, "the request");  // limits how deep it is nested
  if (!request.body.is_object()) throw Error("the request is no JSON object");
  return request;
}

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

const std::string& Request::parameter(const std::string& name) const {
  const auto found = parameters.find(name);
  if (found == parameters.end()) throw Error("the request lacks '" + name + "'");
  return found->second;
}

int Request::number(const std::string& name, int least, int most) const {
  const std::string& text = parameter(name);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most)
    throw Error(formatted("'{}' must be a whole number from {} to {}, got {}", name, least, most, in_quotes(text)));
  return value;
}

std::string Request::text(const std::string& name) const {
  const auto found = body.find(name);
  if (found == body.end() || !found->is_string()) throw Error("the request lacks the text '" + name + "'");
  return found->get<std::string>();
}

Answer json_answer(const json& value) { return {json_text(value)}; }

Answer bytes_answer(std::string bytes, const json& about) {
  Answer answer{std::move(bytes), "application/octet-stream"};
  if (!about.is_null()) answer.headers = {{"X-Marrow-About", about.dump(-1, ' ', true)}};
  return answer;
}

struct Server::Parts {
  HttpServer http;
  Access access;
  std::atomic<int> at_once = 0;

  Parts() {
    http.new_task_queue = [] { return new GrowingThreads; };
    http.set_payload_max_length(kMostBytes);
    http.set_keep_alive_max_count(1'000'000);  // dragging asks 60 times a second over the same connection
    http.set_tcp_nodelay(true);
    http.set_socket_options([](socket_t socket) {  // nobody may share the port
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http.set_read_timeout(10);
    http.set_default_headers({{"Content-Security-Policy", kPolicy},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Cross-Origin-Opener-Policy", "same-origin"},
                              {"Cache-Control", "no-store"}});
    http.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) { return check(request, response); });
    http.set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (!response.body.empty()) return;
      refuse(response, response.status,
             response.status == 413   ? "the request is too large; at most 64 MB can be sent"
             : response.status == 404 ? "there is no such page"
                                      : "the request could not be answered");
    });
  }

  httplib::Server::HandlerResponse check(const httplib::Request& request, httplib::Response& response) {
    const bool hands_in_token = request.path == "/" && request.method == "GET" && request.has_param("token");
    const std::string fault = access.fault(asked_by(request), hands_in_token);
    if (!fault.empty()) {
      refuse(response, 403, fault);
      return httplib::Server::HandlerResponse::Handled;
    }
    if (!hands_in_token) return httplib::Server::HandlerResponse::Unhandled;
    const std::string fault_of_token = access.take_token(request.get_param_value("token"));
    if (fault_of_token.empty()) {
      response.set_header("Set-Cookie", access.cookie());
    } else if (!access.fault(asked_by(request), false).empty()) {
      refuse(response, 403, fault_of_token);
      return httplib::Server::HandlerResponse::Handled;
    }
    response.set_redirect("/");  // to an address without the token; the browser keeps the part behind '#'
    return httplib::Server::HandlerResponse::Handled;
  }

  void answer(const Handler& handler, const httplib::Request& asked, httplib::Response& response) {
    struct Counted {
      std::atomic<int>& count;
      explicit Counted(std::atomic<int>& c) : count(c) { ++count; }
      ~Counted() { --count; }
    } counted(at_once);
    if (at_once > kMostAtOnce) return refuse(response, 503, "too many requests at once; try again");
    try {
      Answer answer = handler(request_of(asked));
      for (const auto& [name, value] : answer.headers) {
        response.headers.erase(name);  // the default header, which would apply as well
        response.set_header(name, value);
      }
      send_whole(std::make_shared<const std::string>(std::move(answer.body)), answer.type, response);
    } catch (const Conflict& error) {
      refuse(response, 409, error.what());
    } catch (const std::bad_alloc&) {
      refuse(response, 500, "out of memory");
    } catch (...) {
      refuse(response, 400, reason_of_exception());
    }
  }
};

Server::Server() : parts_(std::make_unique<Parts>()) {}
Server::~Server() = default;

void Server::get(const std::string& path, Handler handler) {
  parts_->http.Get(path,
                   [this, handler = std::move(handler)](const httplib::Request& request, httplib::Response& response) {
                     parts_->answer(handler, request, response);
                   });
}

void Server::post(const std::string& path, Handler handler) {
  parts_->http.Post(path,
                    [this, handler = std::move(handler)](const httplib::Request& request, httplib::Response& response) {
                      parts_->answer(handler, request, response);
                    });
}

void Server::page(const std::string& path, const std::string& type, std::string text) {
  parts_->http.Get(path,
                   [type, content = std::make_shared<const std::string>(std::move(text))](
                       const httplib::Request&, httplib::Response& response) { send_whole(content, type, response); });
}

void Server::listen(int port) {
  if (port == 0)
    port = parts_->http.bind_to_any_port("127.0.0.1");
  else if (!parts_->http.bind_to_port("127.0.0.1", port))
    port = -1;
  if (port < 0) throw Error("the port is taken, or may not be used; give another with --port, or leave it out");
  parts_->http.let_many_wait();
  parts_->access.listen_on(port);
}

const Access& Server::access() const { return parts_->access; }

void Server::run(const std::atomic<bool>& stop) {
  std::atomic<bool> ended = false;
  std::thread watcher([&] {
    // stop() does nothing before the server listens, and a signal may have come earlier.
    while (!ended && !(stop && parts_->http.is_running())) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    parts_->http.stop();
  });
  const bool was_good = parts_->http.listen_after_bind();
  ended = true;
  watcher.join();
  if (!was_good && !stop) throw Error("the server stopped listening because of an error");
}

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
