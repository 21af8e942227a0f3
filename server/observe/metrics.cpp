#include "server/observe/metrics.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <utility>

#include <unistd.h>

namespace server {
namespace {

std::string number(double value) {
  if (std::isnan(value)) {
    return "NaN";
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

void Metrics::Histogram::add(double value) {
  for (std::size_t i = 0; i < kBounds.size(); ++i) {
    if (value <= kBounds[i]) {
      ++buckets[i];
    }
  }
  ++count;
  sum += value;
}

void Metrics::count_request(std::string_view method, std::string_view route, int status,
                            double seconds, std::uint64_t bytes_received,
                            std::uint64_t bytes_sent) {
  const core::MutexLock lock(mutex_);
  ++requests_[{std::string(method), std::string(route), status}];
  durations_[std::string(route)].add(seconds);
  bytes_received_ += bytes_received;
  bytes_sent_ += bytes_sent;
}

void Metrics::count_queue_wait(double seconds) {
  const core::MutexLock lock(mutex_);
  queue_wait_.add(seconds);
}

void Metrics::write_histogram(MetricsText& text, std::string_view name, const std::string& labels,
                              const Histogram& histogram) {
  const std::string base(name);
  for (std::size_t i = 0; i < kBounds.size(); ++i) {
    text.sample(base + "_bucket", joined(labels, metric_label("le", number(kBounds[i]))),
                static_cast<double>(histogram.buckets[i]));
  }
  text.sample(base + "_bucket", joined(labels, "le=\"+Inf\""), static_cast<double>(histogram.count));
  text.sample(base + "_sum", labels, histogram.sum);
  text.sample(base + "_count", labels, static_cast<double>(histogram.count));
}

void Metrics::write(MetricsText& text) const {
  const core::MutexLock lock(mutex_);
  text.family("tessera_http_requests_total", "counter", "Requests answered.");
  for (const auto& [key, count] : requests_) {
    const auto& [method, route, status] = key;
    text.sample("tessera_http_requests_total",
                metric_label("method", method) + "," + metric_label("route", route) + "," +
                    metric_label("status", std::to_string(status)),
                static_cast<double>(count));
  }
  text.family("tessera_http_request_duration_seconds", "histogram",
              "From the first byte of the request to the last of the answer.");
  for (const auto& [route, histogram] : durations_) {
    write_histogram(text, "tessera_http_request_duration_seconds", metric_label("route", route),
                    histogram);
  }
  text.family("tessera_http_received_bytes_total", "counter", "Bytes of request bodies.");
  text.sample("tessera_http_received_bytes_total", "", static_cast<double>(bytes_received_));
  text.family("tessera_http_sent_bytes_total", "counter", "Bytes of answers.");
  text.sample("tessera_http_sent_bytes_total", "", static_cast<double>(bytes_sent_));
  text.family("tessera_queue_wait_seconds", "histogram", "From submission to the first slice.");
  write_histogram(text, "tessera_queue_wait_seconds", "", queue_wait_);
}

std::uint64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t total_pages = 0;
  std::uint64_t resident_pages = 0;
  file >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace server
