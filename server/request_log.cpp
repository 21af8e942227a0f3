#include "server/request_log.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include <fcntl.h>

#include "server/observe/clock.h"
#include "server/store/files.h"

namespace server {
namespace {

/// Returns the trace id of a `traceparent` header (W3C Trace Context); empty if there is none.
std::string_view trace_id(const Request& request) {
  const std::string_view text = request.header("traceparent").value_or("");
  constexpr std::size_t kBegin = 3;
  constexpr std::size_t kDigits = 32;
  if (text.size() < 55 || text[2] != '-' || text[kBegin + kDigits] != '-') {
    return {};
  }
  const std::string_view id = text.substr(kBegin, kDigits);
  return id.find_first_not_of("0123456789abcdef") == std::string_view::npos ? id
                                                                            : std::string_view();
}

bool only_reads(const Request& request) {
  return request.method == "GET" || request.method == "HEAD" || request.method == "OPTIONS";
}

/// Returns the created object, or the one that the path names.
std::string_view object_of(const Request& request, const Outcome& outcome) {
  if (const std::size_t slash = outcome.location.rfind('/'); slash != std::string::npos) {
    return std::string_view(outcome.location).substr(slash + 1);
  }
  const std::string_view id = request.path_param("id");
  return id.empty() ? request.path_param("sha256") : id;
}

}  // namespace

core::Status RequestLog::check() const {
  if (audit_path_.empty()) {
    return core::ok_status();
  }
  const auto file = open_file(audit_path_, O_WRONLY | O_CREAT | O_APPEND);
  return file ? core::ok_status() : core::Status(file.error());
}

core::Status RequestLog::append(const std::string& line) const {
  const auto file = open_file(audit_path_, O_WRONLY | O_CREAT | O_APPEND);
  if (!file) {
    return file.error();
  }
  return write_at(file->get(), std::as_bytes(std::span(line)), 0,
                  audit_path_);  // At the end: O_APPEND.
}

void RequestLog::audit(const Request& request, const Outcome& outcome) {
  if (audit_path_.empty() && !log_.enabled(LogLevel::kInfo)) {
    return;
  }
  const std::string_view result = outcome.status < 400   ? "done"
                                  : outcome.status < 500 ? "refused"
                                                         : "failed";
  const std::string line = log_line(unix_now(), LogLevel::kInfo, "audit",
                                    {{"outcome", result},
                                     {"method", request.method},
                                     {"path", request.path},
                                     {"object", object_of(request, outcome)},
                                     {"status", std::int64_t{outcome.status}},
                                     {"key", request.principal},
                                     {"key_name", request.principal_name},
                                     {"request_id", request.request_id},
                                     {"trace_id", trace_id(request)},
                                     {"remote", request.remote_addr}});
  write_audit(line, request.request_id);
}

void RequestLog::note_key(KeyRing::Change change, const KeyRow& key) {
  if (audit_path_.empty() && !log_.enabled(LogLevel::kInfo)) {
    return;
  }
  const std::string scopes = scopes_text(key);
  write_audit(log_line(unix_now(), LogLevel::kInfo, "audit",
                       {{"outcome", "done"},
                        {"action", change == KeyRing::Change::kAdded ? "key-added" : "key-removed"},
                        {"object", key.id},
                        {"object_name", key.name},
                        {"scopes", scopes}}),
              {});
}

void RequestLog::write_audit(const std::string& line, std::string_view request_id) {
  if (audit_path_.empty()) {
    log_.write_line(line);
  } else if (const auto written = append(line + "\n"); !written) {
    log_.write(LogLevel::kError, "audit_failed",
               {{"detail", written.error().message}, {"request_id", request_id}});
  }
}

bool RequestLog::may_tell(int status) {
  constexpr std::array kRefusals = {401, 403, 421, 429, 503};
  constexpr int kLinesPerMinute = 60;
  if (std::find(kRefusals.begin(), kRefusals.end(), status) == kRefusals.end()) {
    return true;
  }
  std::int64_t count = 0;
  {
    const core::MutexLock lock(mutex_);
    std::int64_t& left_out = left_out_[status];
    if (!refusals_.take(std::to_string(status), kLinesPerMinute).allowed) {
      ++left_out;
      return false;
    }
    count = std::exchange(left_out, 0);
  }
  if (count > 0) {
    log_.write(LogLevel::kWarning, "refusals_left_out",
               {{"status", std::int64_t{status}}, {"count", count}});
  }
  return true;
}

void RequestLog::note(const Request& request, const Outcome& outcome) {
  metrics_.count_request({.method = request.method,
                          .route = request.route,
                          .status = outcome.status,
                          .seconds = outcome.seconds,
                          .bytes_received = outcome.bytes_received,
                          .bytes_sent = outcome.bytes_sent,
                          .is_stream = outcome.is_stream});
  if (!may_tell(outcome.status)) {
    return;
  }
  const bool reads = only_reads(request);
  const LogLevel level = outcome.status >= 500 ? LogLevel::kError
                         : reads               ? LogLevel::kDebug
                                               : LogLevel::kInfo;
  if (log_.enabled(level)) {
    log_.write(level, "request",
               {{"method", request.method},
                {"path", request.path},
                {"status", std::int64_t{outcome.status}},
                {"seconds", outcome.seconds},
                {"request_id", request.request_id},
                {"trace_id", trace_id(request)},
                {"key", request.principal},
                {"remote", request.remote_addr},
                {"error", outcome.internal_error}});
  }
  if (!reads || outcome.status == 401 || outcome.status == 403 || outcome.status == 421) {
    audit(request, outcome);
  }
}

}  // namespace server
