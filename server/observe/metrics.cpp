#include "server/observe/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace server {
namespace {

struct CounterRow {
  Counter counter;
  std::string_view family;
  std::string_view labels;
  std::string_view help;  ///< Help text of the family; rows of one family are adjacent.
};
constexpr std::array kCounters = {
    CounterRow{Counter::kCheckpointWritten, "tessera_checkpoints_total", R"(outcome="written")",
               "Checkpoints of films."},
    CounterRow{Counter::kCheckpointFailed, "tessera_checkpoints_total", R"(outcome="failed")", ""},
    CounterRow{Counter::kFilmEvicted, "tessera_films_evicted_total", "",
               "Films of ended jobs removed to keep the disk below its limit."},
    CounterRow{Counter::kWebhookDelivered, "tessera_webhook_deliveries_total",
               R"(result="delivered")", "Webhook calls: delivered, to be retried, given up."},
    CounterRow{Counter::kWebhookFailed, "tessera_webhook_deliveries_total", R"(result="failed")",
               ""},
    CounterRow{Counter::kWebhookGivenUp, "tessera_webhook_deliveries_total", R"(result="given_up")",
               ""},
};
static_assert(kCounters.size() == kCounterCount);

struct RefusalRow {
  int status;
  std::string_view reason;
};
constexpr std::array kRefusals = {
    RefusalRow{401, "key"},         RefusalRow{403, "forbidden"}, RefusalRow{408, "slow"},
    RefusalRow{413, "size"},        RefusalRow{421, "host"},      RefusalRow{429, "rate_or_quota"},
    RefusalRow{431, "header_size"}, RefusalRow{503, "busy"},      RefusalRow{507, "storage"},
};

/// Clients can invent methods, so unknown ones share a label.
std::string_view known_method(std::string_view method) {
  constexpr std::array<std::string_view, 7> kMethods = {"GET",   "HEAD",   "POST",   "PUT",
                                                        "PATCH", "DELETE", "OPTIONS"};
  return std::find(kMethods.begin(), kMethods.end(), method) == kMethods.end() ? "other" : method;
}

std::string number(double value) {
  if (std::isnan(value)) {
    return "NaN";
  }
  if (std::isinf(value)) {
    return value > 0 ? "+Inf" : "-Inf";
  }
  if (value == std::floor(value) && std::abs(value) < 9e15) {
    return std::to_string(static_cast<std::int64_t>(value));
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

std::string joined(const std::string& labels, const std::string& more) {
  return labels.empty() ? more : labels + "," + more;
}

}  // namespace

void MetricsText::family(std::string_view name, std::string_view type, std::string_view help) {
  text_.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ");
  text_.append(name).append(" ").append(type).append("\n");
}

void MetricsText::sample(std::string_view name, std::string_view labels, double value) {
  text_.append(name);
  if (!labels.empty()) {
    text_.append("{").append(labels).append("}");
  }
  text_.append(" ").append(number(value)).append("\n");
}

void MetricsText::gauge(std::string_view name, std::string_view help, double value) {
  family(name, "gauge", help);
  sample(name, "", value);
}

void MetricsText::counter(std::string_view name, std::string_view help, double value) {
  family(name, "counter", help);
  sample(name, "", value);
}

std::string metric_label(std::string_view name, std::string_view value) {
  std::string text = std::string(name) + "=\"";
  for (const char c : value) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') {
      text += '\\';
    }
    text += c;
  }
  return text + "\"";
}

template <std::size_t n>
void Metrics::Histogram<n>::add(const std::array<double, n>& bounds, double value) {
  for (std::size_t i = 0; i < n; ++i) {
    if (value <= bounds[i]) {
      ++buckets[i];
    }
  }
  ++count;
  sum += value;
}

template <std::size_t n>
void Metrics::Histogram<n>::write(MetricsText& text, std::string_view name,
                                  const std::string& labels,
                                  const std::array<double, n>& bounds) const {
  const std::string base(name);
  for (std::size_t i = 0; i < n; ++i) {
    text.sample(base + "_bucket", joined(labels, metric_label("le", number(bounds[i]))),
                static_cast<double>(buckets[i]));
  }
  text.sample(base + "_bucket", joined(labels, "le=\"+Inf\""), static_cast<double>(count));
  text.sample(base + "_sum", labels, sum);
  text.sample(base + "_count", labels, static_cast<double>(count));
}

void Metrics::count_request(const CountedRequest& request) {
  const std::string route(request.route.empty() ? "unknown" : request.route);
  const core::MutexLock lock(mutex_);
  bytes_received_ += request.bytes_received;
  bytes_sent_ += request.bytes_sent;
  if (request.is_stream) {
    streams_[route].add(kStreamBounds, request.seconds);
    return;
  }
  ++requests_[{std::string(known_method(request.method)), route, request.status}];
  durations_[route].add(kRequestBounds, request.seconds);
}

void Metrics::count_queue_wait(double seconds) {
  const core::MutexLock lock(mutex_);
  queue_wait_.add(kWaitBounds, seconds);
}

void Metrics::count_job_end(std::string_view reason) {
  const core::MutexLock lock(mutex_);
  ++job_ends_[std::string(reason)];
}

void Metrics::expect_job_end(std::string_view reason) {
  const core::MutexLock lock(mutex_);
  job_ends_.try_emplace(std::string(reason), 0);
}

void Metrics::count(Counter counter) {
  const core::MutexLock lock(mutex_);
  ++counters_[static_cast<std::size_t>(counter)];
}

void Metrics::write_http(MetricsText& text) const {
  text.family("tessera_http_requests_total", "counter", "Requests answered, excluding streams.");
  for (const auto& [key, count] : requests_) {
    const auto& [method, route, status] = key;
    text.sample("tessera_http_requests_total",
                metric_label("method", method) + "," + metric_label("route", route) + "," +
                    metric_label("status", std::to_string(status)),
                static_cast<double>(count));
  }
  std::uint64_t errors = 0;
  for (const auto& [key, count] : requests_) {
    errors += std::get<int>(key) == 500 ? count : 0;
  }
  text.counter("tessera_http_errors_total", "Requests answered with status 500.",
               static_cast<double>(errors));
  text.family(
      "tessera_http_request_duration_seconds", "histogram",
      "Time from the first byte of a request to the last byte of its response, excluding streams.");
  for (const auto& [route, histogram] : durations_) {
    histogram.write(text, "tessera_http_request_duration_seconds", metric_label("route", route),
                    kRequestBounds);
  }
  text.family("tessera_http_stream_duration_seconds", "histogram",
              "Duration of event and tile streams and of requests that wait for a job.");
  for (const auto& [route, histogram] : streams_) {
    histogram.write(text, "tessera_http_stream_duration_seconds", metric_label("route", route),
                    kStreamBounds);
  }
  text.counter("tessera_http_received_bytes_total", "Bytes of request bodies.",
               static_cast<double>(bytes_received_));
  text.counter("tessera_http_sent_bytes_total", "Bytes of response bodies.",
               static_cast<double>(bytes_sent_));
  text.family("tessera_http_refusals_total", "counter", "Requests refused, by reason.");
  for (const RefusalRow& row : kRefusals) {
    std::uint64_t refused = 0;
    for (const auto& [key, count] : requests_) {
      refused += std::get<int>(key) == row.status ? count : 0;
    }
    text.sample("tessera_http_refusals_total", metric_label("reason", row.reason),
                static_cast<double>(refused));
  }
}

void Metrics::write_counters(MetricsText& text) const {
  std::string_view announced;
  for (const CounterRow& row : kCounters) {
    if (row.family != announced) {
      announced = row.family;
      text.family(row.family, "counter", row.help);
    }
    text.sample(row.family, row.labels,
                static_cast<double>(counters_[static_cast<std::size_t>(row.counter)]));
  }
}

void Metrics::write(MetricsText& text) const {
  const core::MutexLock lock(mutex_);
  write_http(text);
  text.family("tessera_jobs_ended_total", "counter",
              "Jobs that reached a final state, by stop reason.");
  for (const auto& [reason, count] : job_ends_) {
    text.sample("tessera_jobs_ended_total", metric_label("reason", reason),
                static_cast<double>(count));
  }
  write_counters(text);
  text.family("tessera_queue_wait_seconds", "histogram",
              "Time from submission to the first slice.");
  queue_wait_.write(text, "tessera_queue_wait_seconds", "", kWaitBounds);
}

}  // namespace server
