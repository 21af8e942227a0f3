/// A real server with short limits, and a client that sends raw bytes, for tests of HTTP.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "server/http/http_server.h"

namespace server::http_test {

/// Limits that make timeouts short in tests.
HttpLimits short_limits();

/// The arguments of the after-hook.
struct Logged {
  std::string route;
  Outcome outcome;
};

/// Routes: GET /echo/{word}, GET /throw, POST /json (limit 1000), POST /upload (limit 100,000),
/// POST /ignore (no body), POST /refuse (reads nothing), GET /livez (probe), and the given ones.
class TestServer {
 public:
  explicit TestServer(std::vector<Route> more_routes = {}, HttpLimits limits = short_limits(),
                      int stream_limit = 100);
  ~TestServer();
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  int port() const { return port_; }
  HttpServer& http() { return *http_; }
  StreamGate& streams() { return streams_; }
  /// Waits for the outcome of the next exchange; empty after 30 s.
  std::optional<Logged> next_outcome();

 private:
  void log(const Request& request, const Outcome& outcome);

  StreamGate streams_;
  core::Mutex mutex_;
  core::CondVar changed_;
  std::vector<Logged> log_ GUARDED_BY(mutex_);
  std::unique_ptr<HttpServer> http_;
  int port_ = 0;
  std::thread thread_;
};

struct Answer {
  int status = 0;  ///< 0: no answer, or a truncated one
  std::string head;
  std::string body;  ///< with chunks decoded

  std::string header(std::string_view name) const;
};

/// A connection of a client.
class Client {
 public:
  explicit Client(const TestServer& server);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Returns false once the server has closed the connection.
  bool send(std::string_view bytes);
  /// Receives one answer; head_only: to HEAD.
  Answer receive(bool head_only = false);
  Answer exchange(std::string_view bytes) {
    send(bytes);
    return receive();
  }
  /// Reads until the text arrives; false after 30 s or at the end of the connection.
  bool wait_for(std::string_view text);
  /// Returns true if the server closes the connection within the time without sending more.
  bool is_closed_within(std::chrono::milliseconds time);
  void close();

 private:
  bool receive_more(std::chrono::milliseconds time);

  int fd_ = -1;
  std::string received_;
};

/// `GET target` with Host.
std::string get(std::string_view target, std::string_view more_headers = {});
/// `POST target` with Host, Content-Length and body.
std::string post(std::string_view target, std::string_view body, std::string_view more = {});

double seconds_since(std::chrono::steady_clock::time_point start);

}  // namespace server::http_test
