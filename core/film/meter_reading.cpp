#include "core/film/meter_reading.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace core {
namespace {

constexpr auto kReplicates = static_cast<std::size_t>(kMeterReplicates);
/// Student's t for 15 degrees of freedom, two-sided kMeterConfidence.
constexpr double kStudent95 = 2.131449546;
static_assert(kMeterReplicates == 16);
/// Upper 97.5% limits of a Poisson mean if no event and if one was seen (Garwood 1936).
constexpr double kOfNone = 3.689;
constexpr double kOfOne = 5.572;
/// Share of a reading that unseen light may be before it is marked.
constexpr double kMarked = 0.25;

double luminance_of(const std::array<double, 3>& c) {
  return kLuminance<double>[0] * c[0] + kLuminance<double>[1] * c[1] + kLuminance<double>[2] * c[2];
}

}  // namespace

std::vector<MeterPoint> meter_points(const MeterSettings& settings) {
  std::vector<MeterPoint> points;
  points.reserve(settings.count());
  for (const MeterPoint& point : settings.points) {
    points.push_back({point.position, normalize(point.normal)});
  }
  if (settings.plane) {
    const MeterPlane& plane = *settings.plane;
    const Vec3 normal = normalize(cross(plane.edge_u, plane.edge_v));
    for (int row = 0; row < plane.rows; ++row) {
      for (int column = 0; column < plane.columns; ++column) {
        const float u = (static_cast<float>(column) + 0.5F) / static_cast<float>(plane.columns);
        const float v = (static_cast<float>(row) + 0.5F) / static_cast<float>(plane.rows);
        points.push_back({plane.origin + Place(plane.edge_u * u + plane.edge_v * v), normal});
      }
    }
  }
  return points;
}

std::vector<MeterReading> meter_readings(const std::vector<MeterPoint>& points,
                                         const std::vector<MeterChunk>& chunks, double path_light) {
  std::vector<MeterReading> readings;
  if (chunks.size() < meter_chunks(points.size()) ||
      std::any_of(chunks.begin(), chunks.end(),
                  [](const MeterChunk& chunk) { return chunk.samples == 0; })) {
    return readings;
  }
  readings.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MeterChunk& chunk = chunks[i / kMeterChunk];
    const auto* sums = &chunk.sums[i % kMeterChunk * kReplicates];
    const double scale = 1.0 / chunk.samples;
    MeterReading reading;
    reading.at = points[i];
    reading.samples = std::int64_t{chunk.samples} * kMeterReplicates;
    for (std::size_t r = 0; r < kReplicates; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        reading.irradiance[c] += sums[r][c] * scale / kMeterReplicates;
      }
    }
    reading.illuminance = luminance_of(reading.irradiance);
    std::array<double, kReplicates> offs{};
    double squares = 0;
    double largest = 0;
    for (std::size_t r = 0; r < kReplicates; ++r) {
      offs[r] = luminance_of(sums[r]) * scale - reading.illuminance;
      squares += offs[r] * offs[r];
      largest = std::max(largest, offs[r] * offs[r]);
    }
    std::sort(offs.begin(), offs.end());
    const double median = 0.5 * (offs[kReplicates / 2 - 1] + offs[kReplicates / 2]);
    const double event = (offs.back() - median) / kMeterReplicates;
    const double unseen = kOfNone * path_light / static_cast<double>(reading.samples);
    reading.unreliable = largest > squares / 2 || !(reading.illuminance > 0) ||
                         unseen > kMarked * reading.illuminance;
    const double reach =
        kStudent95 * std::sqrt(squares / (kMeterReplicates - 1) / kMeterReplicates);
    reading.low = std::max(0.0, reading.illuminance - reach);
    reading.high = reading.illuminance + std::max({reach, (kOfOne - 1) * event, unseen});
    readings.push_back(reading);
  }
  return readings;
}

double meter_error(const std::vector<MeterReading>& readings) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  double worst = readings.empty() ? kUnknown : 0;
  for (const MeterReading& reading : readings) {
    worst =
        std::max(worst, reading.illuminance > 0 ? (reading.high - reading.low) / reading.illuminance
                                                : kUnknown);
  }
  return worst;
}

ReadingDifference difference_of(const MeterReading& a, const MeterReading& b) {
  const double value = a.illuminance - b.illuminance;
  return {value, value - std::hypot(a.illuminance - a.low, b.high - b.illuminance),
          value + std::hypot(a.high - a.illuminance, b.illuminance - b.low)};
}

double mean_illuminance(std::span<const MeterReading> readings) {
  double sum = 0;
  for (const MeterReading& reading : readings) {
    sum += reading.illuminance;
  }
  return sum / static_cast<double>(readings.size());
}

double uniformity(std::span<const MeterReading> readings) {
  double least = std::numeric_limits<double>::infinity();
  for (const MeterReading& reading : readings) {
    least = std::min(least, reading.illuminance);
  }
  const double mean = mean_illuminance(readings);
  return mean > 0 ? least / mean : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace core
