// Calls to addresses that a client selects. The function below resolves names; it replaces that of
// the C library in this program.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <arpa/inet.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/http/web_post.h"
#include "tests/unit/server/http_test_server.h"

namespace {

using LookUp = int (*)(const char*, const char*, const addrinfo*, addrinfo**);

/// While it is closed, resolving "slow.test" does not end.
class Gate {
 public:
  void pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++waiting_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
    --waiting_;
    changed_.notify_all();
  }
  bool wait_for_waiting() {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [this] { return waiting_ > 0; });
  }
  int waiting() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return waiting_;
  }
  /// Opens the gate and waits until all callers have passed.
  void open() {
    std::unique_lock<std::mutex> lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return waiting_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  int waiting_ = 0;
};

Gate& gate() {
  static Gate made;
  return made;
}

}  // namespace

/// "slow.test" waits at the gate; it and "private.test" resolve to this machine.
extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints,
                           addrinfo** result) {
  static const auto real = reinterpret_cast<LookUp>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  const std::string name = node == nullptr ? "" : node;
  if (name == "slow.test") {
    gate().pass();
  }
  const bool is_ours = name == "slow.test" || name == "private.test";
  return real(is_ours ? "127.0.0.1" : node, service, hints, result);
}

namespace server {
namespace {

using core::ErrorCode;
using http_test::TestServer;
using std::chrono::milliseconds;

WebPost post_to(const std::string& host, int port, const std::string& path = "/json") {
  WebPost post;
  post.url = "http://" + host + ":" + std::to_string(port) + path;
  post.body = "{}";
  post.headers = {{"Content-Type", "application/json"}};
  post.reach = Reach::kAnywhere;
  return post;
}

/// Waits until all calls have ended.
std::vector<WebCalls::Ended> all_of(WebCalls& calls) {
  std::vector<WebCalls::Ended> ended;
  while (calls.open_count() > 0) {
    for (WebCalls::Ended& each : calls.wait(milliseconds(100))) {
      ended.push_back(std::move(each));
    }
  }
  return ended;
}

TEST(WebCalls, ReturnsTheStatusUnderTheIdOfTheCall) {
  TestServer server;
  WebCalls calls;
  calls.begin("found", post_to("127.0.0.1", server.port()));
  calls.begin("missing", post_to("127.0.0.1", server.port(), "/nowhere"));
  EXPECT_EQ(calls.open_count(), 2U);
  for (const auto& [id, status] : all_of(calls)) {
    ASSERT_TRUE(status) << status.error().message;
    EXPECT_EQ(*status, id == "found" ? 200 : 404) << id;
  }
}

TEST(WebCalls, NeverCallsAnAddressThatIsNotPublic) {
  TestServer server;
  WebCalls calls;
  for (const char* host : {"127.0.0.1", "localhost", "private.test", "127.1"}) {
    WebPost post = post_to(host, server.port());
    post.reach = Reach::kPublicOnly;
    calls.begin(host, post);
    const auto ended = all_of(calls);
    ASSERT_EQ(ended.size(), 1U);
    ASSERT_FALSE(ended.front().status) << host;
    EXPECT_EQ(ended.front().status.error().code, ErrorCode::kForbidden) << host;
  }
  // The next request that the server receives is the allowed one: there was none before.
  calls.begin("allowed", post_to("127.0.0.1", server.port(), "/echo/allowed"));
  all_of(calls);
  const auto seen = server.next_outcome();
  ASSERT_TRUE(seen);
  EXPECT_NE(seen->route, "/json");
}

/// Answers one request with 202 and returns its first line.
std::string first_line_at(int listener) {
  const int line = ::accept(listener, nullptr, nullptr);
  std::string text(4096, '\0');
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, ::read(line, text.data(), 4096))));
  constexpr std::string_view kAnswer = "HTTP/1.1 202 Accepted\r\nContent-Length: 0\r\n\r\n";
  EXPECT_EQ(::write(line, kAnswer.data(), kAnswer.size()), ssize_t{kAnswer.size()});
  ::close(line);
  return text.substr(0, text.find('\r'));
}

TEST(WebCalls, UseTheProxyOfTheEnvironmentIfTheyMayReachAnyAddress) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const std::string proxy = "http://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  ::setenv("http_proxy", proxy.c_str(), 1);
  std::string line;
  std::thread answering([&] { line = first_line_at(listener); });
  WebCalls calls;
  calls.begin("far", post_to("hooks.invalid", 80));
  const auto far = all_of(calls);
  answering.join();
  ::close(listener);
  ASSERT_TRUE(far.front().status) << far.front().status.error().message;
  EXPECT_EQ(*far.front().status, 202);
  EXPECT_EQ(line, "POST http://hooks.invalid/json HTTP/1.1");
  // This machine is called directly, and nothing is asked of the proxy if it must be checked.
  TestServer server;
  calls.begin("near", post_to("127.0.0.1", server.port()));
  EXPECT_EQ(*all_of(calls).front().status, 200);
  WebPost checked = post_to("private.test", server.port());
  checked.reach = Reach::kPublicOnly;
  calls.begin("checked", checked);
  EXPECT_EQ(all_of(calls).front().status.error().code, ErrorCode::kForbidden);
  ::unsetenv("http_proxy");
}

TEST(WebCalls, DeadlineIncludesNameResolutionAndBlocksNoOtherCall) {
  TestServer server;
  WebCalls calls;
  WebPost slow = post_to("slow.test", server.port());
  slow.timeout = milliseconds(500);
  calls.begin("slow", slow);
  static_cast<void>(calls.wait(milliseconds(1)));
  ASSERT_TRUE(gate().wait_for_waiting());
  calls.begin("other", post_to("127.0.0.1", server.port()));
  for (const auto& [id, status] : all_of(calls)) {
    EXPECT_EQ(status.has_value(), id == "other") << id;
  }
  EXPECT_EQ(gate().waiting(), 1);  // the call has ended, its name resolution has not
  gate().open();
}

TEST(WebCalls, ReadsOnlyTheStatusOfAnAnswer) {
  TestServer server({{.method = "POST", .pattern = "/large", .handler = [](Request&) {
                        return text_response(201, "text/plain", std::string(1 << 20, 'x'));
                      }}});
  WebCalls calls;
  calls.begin("large", post_to("127.0.0.1", server.port(), "/large"));
  const auto ended = all_of(calls);
  ASSERT_TRUE(ended.front().status) << ended.front().status.error().message;
  EXPECT_EQ(*ended.front().status, 201);
}

TEST(WebCalls, RedirectIsAnAnswer) {
  TestServer server({{.method = "POST", .pattern = "/away", .handler = [](Request&) {
                        Response response = empty_response(302);
                        response.headers.set("Location", "/json");
                        return response;
                      }}});
  WebCalls calls;
  calls.begin("away", post_to("127.0.0.1", server.port(), "/away"));
  EXPECT_EQ(*all_of(calls).front().status, 302);
}

TEST(WebCalls, AnotherThreadCanEndAWait) {
  WebCalls calls;
  std::thread waker([&calls] { calls.wake(); });
  // Woken before or during the wait; otherwise the test would take an hour.
  EXPECT_TRUE(calls.wait(std::chrono::hours(1)).empty());
  waker.join();
}

}  // namespace
}  // namespace server
