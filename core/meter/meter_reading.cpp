#include "core/meter/meter_reading.h"

#include <algorithm>
#include <cmath>

namespace core {
namespace {

constexpr auto kReplicates = static_cast<std::size_t>(kMeterReplicates);
/// Student's t for 15 degrees of freedom, two-sided kMeterConfidence.
constexpr double kStudent95 = 2.131449546;
static_assert(kMeterReplicates == 16);

double luminance_of(const std::array<double, 3>& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
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
                                         const std::vector<MeterChunk>& chunks) {
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
    double squares = 0;
    double largest = 0;
    for (std::size_t r = 0; r < kReplicates; ++r) {
      const double off = luminance_of(sums[r]) * scale - reading.illuminance;
      squares += off * off;
      largest = std::max(largest, off * off);
    }
    reading.unreliable = largest > squares / 2 || !(reading.illuminance > 0);
    const double error = std::sqrt(squares / (kMeterReplicates - 1) / kMeterReplicates);
    reading.low = std::max(0.0, reading.illuminance - kStudent95 * error);
    reading.high = reading.illuminance + kStudent95 * error;
    readings.push_back(reading);
  }
  return readings;
}

}  // namespace core
