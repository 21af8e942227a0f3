#include "tests/unit/server/http_test_server.h"

#include <array>
#include <cstdlib>
#include <stdexcept>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/check.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server::http_test {
namespace {

constexpr std::chrono::milliseconds kPatience(30'000);

std::vector<Route> make_routes(std::vector<Route> routes) {
  routes.push_back({.method = "GET", .pattern = "/echo/{word}", .handler = [](Request& request) {
                      return text_response(200, "text/plain",
                                           std::string(request.path_param("word")));
                    }});
  routes.push_back({.method = "GET", .pattern = "/throw", .handler = [](Request&) -> Response {
                      throw std::runtime_error("secret text");
                    }});
  routes.push_back({.method = "POST",
                    .pattern = "/json",
                    .handler = [](Request& request) { return json_response(200, request.body); },
                    .body = BodyPolicy::json(1000)});
  routes.push_back({.method = "POST",
                    .pattern = "/upload",
                    .handler =
                        [](Request& request) {
                          std::size_t bytes = 0;
                          request.body_reader->read([&](std::string_view piece) {
                            bytes += piece.size();
                            return true;
                          });
                          return text_response(201, "text/plain", std::to_string(bytes));
                        },
                    .body = BodyPolicy::stream(100'000)});
  routes.push_back({.method = "POST", .pattern = "/ignore", .handler = [](Request&) {
                      return empty_response();
                    }});
  routes.push_back(
      {.method = "POST",
       .pattern = "/refuse",
       .handler =
           [](Request& request) { return problem_response(403, "not for you", request.path); },
       .body = BodyPolicy::stream(100'000'000)});
  routes.push_back({.method = "GET",
                    .pattern = "/livez",
                    .handler = [](Request&) { return text_response(200, "text/plain", "ok"); },
                    .is_probe = true});
  return routes;
}

std::string decode_chunks(std::string_view text) {
  std::string body;
  while (true) {
    const std::size_t end = text.find("\r\n");
    const std::size_t size = std::strtoul(std::string(text.substr(0, end)).c_str(), nullptr, 16);
    if (end == std::string_view::npos || size == 0) {
      return body;
    }
    body += text.substr(end + 2, size);
    text.remove_prefix(end + 2 + size + 2);
  }
}

}  // namespace

HttpLimits short_limits() {
  HttpLimits limits;
  limits.header_deadline = std::chrono::milliseconds(300);
  limits.body_idle = std::chrono::milliseconds(300);
  limits.write_stall = std::chrono::milliseconds(500);
  limits.keep_alive_idle = std::chrono::milliseconds(1000);
  return limits;
}

TestServer::TestServer(std::vector<Route> more_routes, HttpLimits limits, int stream_limit)
    : streams_(stream_limit) {
  HttpOptions options;
  options.port = 0;
  options.limits = limits;
  options.hooks.before = [](Request& request) -> std::optional<Response> {
    if (request.header("X-Deny")) {
      return problem_response(401, "no key", request.path);
    }
    request.is_of_worker = request.header("X-Worker").has_value();
    return std::nullopt;
  };
  options.hooks.after = [this](const Request& request, const Outcome& outcome) {
    log(request, outcome);
  };
  http_ = std::make_unique<HttpServer>(options, make_routes(std::move(more_routes)), streams_);
  port_ = http_->bind().value();
  thread_ = std::thread([this] { http_->run(); });
}

TestServer::~TestServer() {
  http_->stop(std::chrono::seconds(2));
  thread_.join();
  http_.reset();
}

void TestServer::log(const Request& request, const Outcome& outcome) {
  core::MutexLock lock(mutex_);
  log_.push_back({.route = request.route, .outcome = outcome});
  changed_.notify_all();
}

std::optional<Logged> TestServer::next_outcome() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  core::MutexLock lock(mutex_);
  while (log_.empty()) {
    if (changed_.wait_until(mutex_, deadline) == std::cv_status::timeout) {
      return std::nullopt;
    }
  }
  Logged logged = std::move(log_.front());
  log_.erase(log_.begin());
  return logged;
}

std::string Answer::header(std::string_view name) const {
  std::string_view rest = head;
  while (!rest.empty()) {
    const std::string_view line = rest.substr(0, rest.find("\r\n"));
    rest.remove_prefix(std::min(rest.size(), line.size() + 2));
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && equal_ignoring_case(line.substr(0, colon), name)) {
      return std::string(trim(line.substr(colon + 1)));
    }
  }
  return {};
}

Client::Client(const TestServer& server) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(server.port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  CHECK(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
}

Client::~Client() { close(); }

void Client::close() {
  if (fd_ >= 0) {
    ::close(std::exchange(fd_, -1));
  }
}

bool Client::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) {
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool Client::receive_more(std::chrono::milliseconds time) {
  pollfd entry = {.fd = fd_, .events = POLLIN, .revents = 0};
  if (::poll(&entry, 1, static_cast<int>(time.count())) <= 0) {
    return false;
  }
  std::array<char, 16384> buffer;
  const ssize_t bytes = ::recv(fd_, buffer.data(), buffer.size(), 0);
  if (bytes <= 0) {
    return false;
  }
  received_.append(buffer.data(), static_cast<std::size_t>(bytes));
  return true;
}

Answer Client::receive(bool head_only) {
  Answer answer;
  std::size_t end = 0;
  while ((end = received_.find("\r\n\r\n")) == std::string::npos) {
    if (!receive_more(kPatience)) {
      return {};
    }
  }
  answer.head = received_.substr(0, end + 2);
  received_.erase(0, end + 4);
  const bool is_chunked = answer.header("Transfer-Encoding") == "chunked";
  const std::size_t length = std::strtoul(answer.header("Content-Length").c_str(), nullptr, 10);
  if (!head_only && is_chunked) {
    // Sufficient for tests: the last chunk is at the end of a read.
    while (received_.size() < 5 || received_.substr(received_.size() - 5) != "0\r\n\r\n") {
      if (!receive_more(kPatience)) {
        return {};
      }
    }
    answer.body = decode_chunks(received_);
    received_.clear();
  } else if (!head_only) {
    while (received_.size() < length) {
      if (!receive_more(kPatience)) {
        return {};
      }
    }
    answer.body = received_.substr(0, length);
    received_.erase(0, length);
  }
  answer.status = std::atoi(answer.head.substr(9, 3).c_str());
  return answer;
}

bool Client::wait_for(std::string_view text) {
  while (received_.find(text) == std::string::npos) {
    if (!receive_more(kPatience)) {
      return false;
    }
  }
  return true;
}

bool Client::is_closed_within(std::chrono::milliseconds time) {
  pollfd entry = {.fd = fd_, .events = POLLIN, .revents = 0};
  if (!received_.empty() || ::poll(&entry, 1, static_cast<int>(time.count())) <= 0) {
    return false;
  }
  char byte = 0;
  return ::recv(fd_, &byte, 1, 0) <= 0;
}

std::string get(std::string_view target, std::string_view more_headers) {
  std::string text = "GET ";
  text += target;
  text += " HTTP/1.1\r\nHost: localhost\r\n";
  text += more_headers;
  return text + "\r\n";
}

std::string post(std::string_view target, std::string_view body, std::string_view more) {
  std::string text = "POST ";
  text += target;
  text += " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
  text += more;
  text += "\r\n";
  text += body;
  return text;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace server::http_test
