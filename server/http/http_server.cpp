#include "server/http/http_server.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <random>
#include <thread>
#include <unordered_set>
#include <utility>

#include <fcntl.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "api/json/errors.h"
#include "core/base/check.h"
#include "core/base/mutex.h"
#include "server/http/client_watch.h"
#include "server/http/connection.h"
#include "server/http/lobby.h"
#include "server/http/worker_pool.h"

namespace server {
namespace {

/// Threads beyond max_connections that answer probes and report that the server is full.
constexpr int kProbeThreads = 16;

/// The library's ThreadPool has a fixed size; this one passes each connection to our pool.
/// `enqueue` returns void in version 0.11 and bool in 0.18.
class PoolQueue final : public httplib::TaskQueue {
 public:
  using Enqueued = decltype(std::declval<httplib::TaskQueue&>().enqueue(std::function<void()>()));

  explicit PoolQueue(WorkerPool& pool) : pool_(pool) {}

  Enqueued enqueue(std::function<void()> task) override {
    // If no thread is available, the task runs on this accepting thread, which only refuses.
    if (!pool_.submit(task)) {
      task();
    }
    return Enqueued(true);
  }
  void shutdown() override {}  // The pool outlives the listener.

 private:
  WorkerPool& pool_;
};

/// The parts of the library in use: the socket, the accept loop, and one call per connection.
class Listener final : public httplib::Server {
 public:
  Listener(WorkerPool& pool, std::function<void(int)> serve) : serve_(std::move(serve)) {
    new_task_queue = [&pool] { return new PoolQueue(pool); };
    // The library would set SO_REUSEPORT, which lets two servers take the same port.
    set_socket_options([](socket_t fd) {
      const int on = 1;
      ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
      ::fcntl(fd, F_SETFD, FD_CLOEXEC);
    });
  }
  ~Listener() override {
    if (!has_run_ && is_bound_) {
      ::close(svr_sock_);
    }
  }

  /// Binds the port and returns it, or -1 with errno set.
  int bind(const std::string& host, int port, int backlog) {
    const int bound_port =
        port == 0 ? bind_to_any_port(host) : (bind_to_port(host, port) ? port : -1);
    is_bound_ = bound_port >= 0;
    // The library's fixed backlog of 5 drops connections in bursts.
    if (is_bound_ && ::listen(svr_sock_, backlog) != 0) {
      return -1;
    }
    return bound_port;
  }
  /// Returns after stop_accepting(), or when accepting fails; the socket is then closed.
  void accept_all() {
    has_run_ = true;
    listen_after_bind();
  }
  /// Called from another thread. Only shuts the socket down: the accept loop closes the descriptor
  /// itself, so that its number cannot be reused in between.
  void stop_accepting() {
    if (is_bound_) {
      ::shutdown(svr_sock_, SHUT_RDWR);
    }
  }

 private:
  bool process_and_close_socket(socket_t fd) override {
    serve_(fd);
    return true;
  }

  std::function<void(int)> serve_;
  bool is_bound_ = false;
  std::atomic<bool> has_run_ = false;
};

std::uint64_t random_seed() {
  std::random_device device;
  return (static_cast<std::uint64_t>(device()) << 32U) | device();
}

}  // namespace

class HttpServer::Impl {
 public:
  Impl(HttpOptions options, std::vector<Route> routes, StreamGate& streams)
      : options_(std::move(options)),
        router_(std::move(routes)),
        streams_(streams),
        requests_(options_.limits.max_connections, options_.limits.max_requests_of_client),
        lobby_({.waiting = options_.limits.max_waiting,
                .waiting_of_address = options_.limits.max_waiting_of_address}),
        settings_{.tls = options_.tls,
                  .trusted_proxies = std::make_shared<const Networks>(options_.trusted_proxies)},
        // Evicted clients hold a thread until they notice.
        pool_(options_.limits.max_connections + options_.limits.max_waiting + kProbeThreads) {
    // sendfile has no MSG_NOSIGNAL.
    std::signal(SIGPIPE, SIG_IGN);
  }

  ~Impl() { stop(std::chrono::milliseconds(0)); }

  core::Result<int> bind() {
    auto listener = make_listener();
    errno = 0;
    const int port = listener->bind(options_.host, options_.port, options_.limits.backlog);
    if (port < 0) {
      std::string reason = errno != 0 ? std::strerror(errno) : "the host is unknown";
      if (errno == EADDRINUSE) {
        reason.append("; another program uses this port: choose another with --port N, or any ");
        reason.append("free one with --port 0");
      }
      return core::Error{.code = core::ErrorCode::kUnavailable,
                         .message = "cannot listen on " + options_.host + ":" +
                                    std::to_string(options_.port) + ": " + reason,
                         .where = {}};
    }
    options_.port = port;
    core::MutexLock lock(mutex_);
    listener_ = std::move(listener);
    return port;
  }

  void run() {
    accept_thread_ = std::this_thread::get_id();
    std::shared_ptr<Listener> listener;
    {
      core::MutexLock lock(mutex_);
      CHECK(listener_ != nullptr);
      listener = listener_;
      is_running_ = true;
    }
    while (!watch_.is_stopping()) {
      listener->accept_all();
      // The library stops accepting at the first error that it does not know.
      if (!watch_.is_stopping()) {
        listener = listen_again();
      }
    }
    core::MutexLock lock(mutex_);
    is_running_ = false;
    changed_.notify_all();
  }

  bool stop(std::chrono::milliseconds grace) {
    const auto deadline = Clock::now() + grace;
    const auto cut_at = deadline - std::min(grace / 4, std::chrono::milliseconds(500));
    watch_.stop_all();
    core::MutexLock lock(mutex_);
    if (listener_ != nullptr && !std::exchange(is_stopped_, true)) {
      listener_->stop_accepting();
    }
    for (Connection* connection : connections_) {
      connection->stop_if_idle();
    }
    wait_for_end(cut_at);
    for (Connection* connection : connections_) {
      connection->cut();
    }
    wait_for_end(deadline);
    return connections_.empty() && !is_running_;
  }

  void set_tls(std::shared_ptr<const TlsContext> tls) {
    core::MutexLock lock(mutex_);
    CHECK((tls == nullptr) == (settings_.tls == nullptr));
    settings_.tls = std::move(tls);
  }
  void set_trusted_proxies(Networks trusted) {
    core::MutexLock lock(mutex_);
    settings_.trusted_proxies = std::make_shared<const Networks>(std::move(trusted));
  }

  Stats stats() const {
    const Lobby::Counts waiting = lobby_.counts();
    return {.connections = connection_count_.load(),
            .threads = pool_.thread_count(),
            .connections_accepted = accepted_count_.load(),
            .connections_refused = refused_count_.load(),
            .connections_evicted = waiting.evicted + probe_lobby_.counts().evicted,
            .connections_evicted_of_address = waiting.evicted_of_address,
            .requests = request_count_.load(),
            .requests_refused = refused_request_count_.load()};
  }
  const std::vector<Route>& routes() const { return router_.routes(); }

 private:
  std::shared_ptr<Listener> make_listener() {
    return std::make_shared<Listener>(pool_, [this](int fd) { serve(fd); });
  }

  std::shared_ptr<Listener> listen_again() {
    auto listener = make_listener();
    while (listener->bind(options_.host, options_.port, options_.limits.backlog) < 0 &&
           !watch_.is_stopping()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      listener = make_listener();
    }
    core::MutexLock lock(mutex_);
    listener_ = listener;
    if (is_stopped_) {
      listener->stop_accepting();
    }
    return listener;
  }

  void wait_for_end(Clock::time_point until) REQUIRES(mutex_) {
    while ((!connections_.empty() || is_running_) && Clock::now() < until) {
      changed_.wait_until(mutex_, until);
    }
  }

  /// Runs on a thread of the pool, or on the accepting one if the pool is exhausted.
  void serve(int fd) {
    accepted_count_.fetch_add(1, std::memory_order_relaxed);
    if (std::this_thread::get_id() == accept_thread_) {
      refused_count_.fetch_add(1, std::memory_order_relaxed);
      refuse(fd);
      return;
    }
    const int others = connection_count_.fetch_add(1) - lobby_.leaving_count();
    // Evicts a waiting client to make room, unless all clients are being served.
    const bool is_full = others >= options_.limits.max_connections && !lobby_.evict_oldest();
    const auto service = is_full ? Connection::Service::kProbesOnly : Connection::Service::kFull;
    {
      ::fcntl(fd, F_SETFD, FD_CLOEXEC);
      Connection connection(context_, settings(), is_full ? probe_lobby_ : lobby_, fd, service);
      {
        core::MutexLock lock(mutex_);
        connections_.insert(&connection);
      }
      try {
        connection.run();
      } catch (...) {
        // Out of memory outside a handler: this connection ends, the others continue.
      }
      core::MutexLock lock(mutex_);
      connections_.erase(&connection);
    }
    if (is_full) {
      refused_count_.fetch_add(1, std::memory_order_relaxed);
    }
    ::close(fd);
    connection_count_.fetch_sub(1);
    if (watch_.is_stopping()) {
      core::MutexLock lock(mutex_);
      changed_.notify_all();
    }
  }

  ConnectionSettings settings() {
    core::MutexLock lock(mutex_);
    return settings_;
  }

  static void refuse(int fd) {
    const std::string body =
        api::problem_json(api::make_problem(503, "too many connections are open"), {});
    const std::string answer =
        "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/problem+json\r\n"
        "Retry-After: 5\r\nConnection: close\r\nContent-Length: " +
        std::to_string(body.size()) + "\r\n\r\n" + body;
    ::send(fd, answer.data(), answer.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    ::close(fd);
  }

  HttpOptions options_;
  const Router router_;
  StreamGate& streams_;
  StreamGate requests_;
  Lobby lobby_;
  /// Half of the threads, so that a probe finds one however many clients wait.
  Lobby probe_lobby_{{.waiting = kProbeThreads / 2, .waiting_of_address = kProbeThreads / 2}};
  ClientWatch watch_;
  std::atomic<int> connection_count_ = 0;
  std::atomic<std::uint64_t> accepted_count_ = 0;
  std::atomic<std::uint64_t> refused_count_ = 0;
  std::atomic<std::uint64_t> request_count_ = 0;
  std::atomic<std::uint64_t> refused_request_count_ = 0;
  const ConnectionContext context_ = {.options = options_,
                                      .router = router_,
                                      .streams = streams_,
                                      .requests = requests_,
                                      .watch = watch_,
                                      .request_count = request_count_,
                                      .refused_request_count = refused_request_count_,
                                      .request_id_seed = random_seed()};
  std::atomic<std::thread::id> accept_thread_;
  core::Mutex mutex_;
  core::CondVar changed_;
  ConnectionSettings settings_ GUARDED_BY(mutex_);
  std::unordered_set<Connection*> connections_ GUARDED_BY(mutex_);
  std::shared_ptr<Listener> listener_ GUARDED_BY(mutex_);
  bool is_running_ GUARDED_BY(mutex_) = false;
  bool is_stopped_ GUARDED_BY(mutex_) = false;
  WorkerPool pool_;  ///< Last: its destructor waits for tasks that use the other members.
};

HttpServer::HttpServer(HttpOptions options, std::vector<Route> routes, StreamGate& streams)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(routes), streams)) {}
HttpServer::~HttpServer() = default;
core::Result<int> HttpServer::bind() { return impl_->bind(); }
void HttpServer::run() { impl_->run(); }
bool HttpServer::stop(std::chrono::milliseconds grace) { return impl_->stop(grace); }
void HttpServer::set_tls(std::shared_ptr<const TlsContext> tls) { impl_->set_tls(std::move(tls)); }
void HttpServer::set_trusted_proxies(Networks trusted) {
  impl_->set_trusted_proxies(std::move(trusted));
}
HttpServer::Stats HttpServer::stats() const { return impl_->stats(); }
const std::vector<Route>& HttpServer::routes() const { return impl_->routes(); }

}  // namespace server
