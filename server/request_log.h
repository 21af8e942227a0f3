/// RequestLog: records every request: metrics, a log line, and for some an audit line.
///
/// Audited are requests that would change something (any method but GET, HEAD and OPTIONS), and
/// requests refused for lack of rights (401, 403, 421). An audit line is {"time", "level", "event":
/// "audit", "outcome": "done" (below 400), "refused" (4xx) or "failed" (5xx), "method", "path",
/// "object": id of the created or named object, "status", "key": id of the key, "key_name": its
/// name, "operator" for --key, empty without one, "request_id", "trace_id", "remote"}. Keys
/// themselves are never logged. Refusals cost a client nothing, so each of the statuses 401, 403,
/// 421, 429 and 503 has lines for at most 60 requests per minute, and the next line is followed by
/// {"event": "refusals_left_out", "status", "count"}. A stored key that the operator adds or
/// removes while the server runs has a line too: {"time", "level", "event": "audit", "outcome":
/// "done", "action": "key-added" or "key-removed", "object": its id, "object_name", "scopes"}.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/auth/key_ring.h"
#include "server/auth/rate_limiter.h"
#include "server/http/http_server.h"
#include "server/http/message.h"
#include "server/observe/log.h"
#include "server/observe/metrics.h"

namespace server {

class RequestLog {
 public:
  /// audit_path: a file to which audit lines are appended, whatever the log's level; it is opened
  /// for each line, so that it can be rotated. Empty: they go to the log, at info. log and metrics
  /// must outlive this.
  RequestLog(Log& log, Metrics& metrics, std::string audit_path)
      : log_(log), metrics_(metrics), audit_path_(std::move(audit_path)) {}

  /// Checks that the audit file can be written. Errors: of open_file().
  core::Status check() const;
  void note(const Request& request, const Outcome& outcome);
  void note_key(KeyRing::Change change, const KeyRow& key);

 private:
  void audit(const Request& request, const Outcome& outcome);
  /// Returns whether the rate limit still allows a line for a request with this status.
  bool may_tell(int status);
  void write_audit(const std::string& line, std::string_view request_id);
  core::Status append(const std::string& line) const;

  Log& log_;
  Metrics& metrics_;
  const std::string audit_path_;
  RateLimiter refusals_;
  core::Mutex mutex_;
  std::map<int, std::int64_t> left_out_ GUARDED_BY(mutex_);  ///< Counts by status.
};

}  // namespace server
