/// POSTs to addresses that users chose, for webhooks. The only home of libcurl.
///
/// The address that a socket is about to connect to is checked, so that a name cannot mean another
/// one a moment later. Redirects are not followed, no proxy is used; of the answer only the status
/// is read.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"

namespace server {

struct WebTarget {
  bool is_tls = false;
  std::string host;  ///< A name or an address, IPv6 without brackets.
  int port = 80;
  std::string path = "/";  ///< With its query.
};
/// Empty when it is not http(s)://host[:port][/path][?query].
std::optional<WebTarget> parse_web_target(std::string_view url);

/// localhost, or an address (not a name) that is not on the public internet.
bool is_private_literal(std::string_view host);
/// An IPv4 or IPv6 address in numbers; other texts are not public.
bool is_public_address(std::string_view address);

enum class Reach { kPublicOnly, kAnywhere };

struct WebPost {
  std::string url;  ///< One that parse_web_target() reads.
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;  ///< With Content-Type.
  Reach reach = Reach::kPublicOnly;
  std::chrono::milliseconds timeout{15'000};  ///< For everything together, the name's look-up too.
};

/// POSTs that are under way at the same time, on the thread that calls wait().
class WebCalls {
 public:
  WebCalls();
  ~WebCalls();
  WebCalls(const WebCalls&) = delete;
  WebCalls& operator=(const WebCalls&) = delete;

  void begin(std::string id, const WebPost& post);
  struct Ended {
    std::string id;
    /// The status of the answer. Errors: kForbidden for an address that is not public; kUnavailable
    /// when there was no answer, with the reason.
    core::Result<int> status;
  };
  /// Returns when a call has ended, when wake() is called, or after that time.
  std::vector<Ended> wait(std::chrono::milliseconds time);
  /// Ends a wait(); from any thread.
  void wake();
  std::size_t open_count() const { return calls_.size(); }

 private:
  struct Call;
  struct Free {
    void operator()(void* multi) const;
  };
  std::unique_ptr<void, Free> multi_;
  std::vector<std::unique_ptr<Call>> calls_;
};

}  // namespace server
