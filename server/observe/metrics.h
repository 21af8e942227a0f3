/// Metrics: counters and histograms, written in the Prometheus text format.
///
/// Names follow Prometheus' conventions: base units (seconds, bytes), `_total` for counters. Every
/// label has a closed set of values, and the series exist from the start or come from a set that
/// the server defines (routes, statuses), so that no request can make /metrics grow.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

#include "core/base/mutex.h"

namespace server {

/// Builds the text; each family is announced once, before its samples.
class MetricsText {
 public:
  /// type: "counter", "gauge" or "histogram".
  void family(std::string_view name, std::string_view type, std::string_view help);
  /// labels: `a="b",c="d"`, or empty.
  void sample(std::string_view name, std::string_view labels, double value);
  /// Writes a family of one sample without labels.
  void gauge(std::string_view name, std::string_view help, double value);
  void counter(std::string_view name, std::string_view help, double value);
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// Returns `name="value"`, escaped.
std::string metric_label(std::string_view name, std::string_view value);

/// Counted events. Each row of the table in metrics.cpp is one series.
enum class Counter : std::uint8_t {
  kCheckpointWritten,
  kCheckpointFailed,
  kFilmEvicted,
  kWebhookDelivered,
  kWebhookFailed,   ///< It will be retried.
  kWebhookGivenUp,  ///< It will not be retried.
};
inline constexpr std::size_t kCounterCount = 6;

/// One request, as counted.
struct CountedRequest {
  std::string_view method;
  std::string_view route;  ///< Pattern of the route; empty: none.
  int status = 0;
  double seconds = 0;
  std::uint64_t bytes_received = 0;
  std::uint64_t bytes_sent = 0;
  bool is_stream = false;  ///< A stream or long poll, whose duration the client chose.
};

class Metrics {
 public:
  void count_request(const CountedRequest& request);
  /// Counts the seconds between the submission of a job and its first slice.
  void count_queue_wait(double seconds);
  /// reason: api::to_text() of its stop reason.
  /// Writes the reason from now on: increase() does not see the first event of a new series.
  void expect_job_end(std::string_view reason);
  void count_job_end(std::string_view reason);
  void count(Counter counter);

  void write(MetricsText& text) const;

 private:
  template <std::size_t n>
  struct Histogram {
    std::array<std::uint64_t, n> buckets{};
    std::uint64_t count = 0;
    double sum = 0;
    void add(const std::array<double, n>& bounds, double value);
    void write(MetricsText& text, std::string_view name, const std::string& labels,
               const std::array<double, n>& bounds) const;
  };
  static constexpr std::array kRequestBounds = {0.001, 0.005, 0.01, 0.025, 0.05, 0.1,
                                                0.25,  0.5,   1.0,  2.5,   10.0, 60.0};
  static constexpr std::array kStreamBounds = {1.0, 10.0, 60.0, 600.0, 3600.0};
  static constexpr std::array kWaitBounds = {0.01, 0.1, 0.5, 2.0, 10.0, 60.0, 600.0, 3600.0};
  using RequestHistogram = Histogram<kRequestBounds.size()>;
  using StreamHistogram = Histogram<kStreamBounds.size()>;

  void write_http(MetricsText& text) const REQUIRES(mutex_);
  void write_counters(MetricsText& text) const REQUIRES(mutex_);

  mutable core::Mutex mutex_;
  std::map<std::tuple<std::string, std::string, int>, std::uint64_t> requests_ GUARDED_BY(mutex_);
  std::map<std::string, RequestHistogram> durations_ GUARDED_BY(mutex_);
  std::map<std::string, StreamHistogram> streams_ GUARDED_BY(mutex_);
  std::map<std::string, std::uint64_t> job_ends_ GUARDED_BY(mutex_);
  std::array<std::uint64_t, kCounterCount> counters_ GUARDED_BY(mutex_){};
  Histogram<kWaitBounds.size()> queue_wait_ GUARDED_BY(mutex_);
  std::uint64_t bytes_received_ GUARDED_BY(mutex_) = 0;
  std::uint64_t bytes_sent_ GUARDED_BY(mutex_) = 0;
};

/// Writes the `process_*` families that Prometheus' client libraries share, from /proc/self.
void write_process_metrics(MetricsText& text);

}  // namespace server
