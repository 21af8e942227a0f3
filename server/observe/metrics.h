/// Metrics: counters and histograms, told in the Prometheus text format.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

#include "core/base/mutex.h"

namespace server {

/// Text being put together; each family is announced once, before its samples.
class MetricsText {
 public:
  /// type: "counter", "gauge" or "histogram".
  void family(std::string_view name, std::string_view type, std::string_view help);
  /// labels: `a="b",c="d"`, or empty.
  void sample(std::string_view name, std::string_view labels, double value);
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// `name="value"`, escaped.
std::string metric_label(std::string_view name, std::string_view value);

class Metrics {
 public:
  void count_request(std::string_view method, std::string_view route, int status, double seconds,
                     std::uint64_t bytes_received, std::uint64_t bytes_sent);
  /// Seconds between the submission of a job and its first slice.
  void count_queue_wait(double seconds);

  void write(MetricsText& text) const;

 private:
  static constexpr std::array kBounds = {0.001, 0.005, 0.02, 0.1, 0.5, 2.0, 10.0, 60.0};
  struct Histogram {
    std::array<std::uint64_t, kBounds.size()> buckets{};
    std::uint64_t count = 0;
    double sum = 0;
    void add(double value);
  };
  static void write_histogram(MetricsText& text, std::string_view name, const std::string& labels,
                              const Histogram& histogram);

  mutable core::Mutex mutex_;
  std::map<std::tuple<std::string, std::string, int>, std::uint64_t> requests_ GUARDED_BY(mutex_);
  std::map<std::string, Histogram> durations_ GUARDED_BY(mutex_);
  Histogram queue_wait_ GUARDED_BY(mutex_);
  std::uint64_t bytes_received_ GUARDED_BY(mutex_) = 0;
  std::uint64_t bytes_sent_ GUARDED_BY(mutex_) = 0;
};

/// Memory that the process holds now.
std::uint64_t resident_bytes();

}  // namespace server
