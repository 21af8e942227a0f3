/// Every limit that the API fixes, in one table: used by the parsers, shown by GET /v1/server.
/// Limits set by the operator (streams, queue, upload size) are passed to server_json() separately.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace api {

struct LimitRow {
  std::string_view name;  ///< as in GET /v1/server
  std::int64_t value;
  std::string_view summary;
};
std::span<const LimitRow> limit_table();

namespace limits {
inline constexpr std::int64_t kBodyBytes = std::int64_t{1} << 20;
inline constexpr std::int64_t kJsonDepth = 32;
inline constexpr std::int64_t kJsonKeyBytes = 1024;
inline constexpr std::int64_t kSeed = (std::int64_t{1} << 53) - 1;
inline constexpr std::int64_t kIdempotencyKeyBytes = 255;  // also in api/header_rows.cpp
inline constexpr std::int64_t kPriority = 100;
inline constexpr std::int64_t kKeyRate = 100'000'000;
inline constexpr std::int64_t kKeyDays = 36'500;
inline constexpr std::int64_t kNameCharacters = 255;
inline constexpr std::int64_t kLabels = 16;
inline constexpr std::int64_t kLabelKeyCharacters = 63;
inline constexpr std::int64_t kLabelValueCharacters = 255;
inline constexpr std::int64_t kFilmSide = 16384;
inline constexpr std::int64_t kFilmPixels = 64'000'000;
inline constexpr double kMetres = 1e9;    // beyond, floats are at least 64 m apart
inline constexpr double kRadiance = 1e9;  // W/(m^2 sr)
inline constexpr double kSceneSeconds = 1e6;
inline constexpr std::int64_t kAngleDegrees = 36000;  // a hundred turns
inline constexpr std::int64_t kPhiDegrees = 180;
inline constexpr std::int64_t kFilterRadius = 8;
inline constexpr std::int64_t kLightShares = 64;
inline constexpr std::int64_t kMeterPoints = 4096;
inline constexpr std::int64_t kMixWeight = 1'000'000;
inline constexpr std::int64_t kMaxDepth = 1024;
inline constexpr std::int64_t kReplicates = 64;
inline constexpr std::int64_t kSplitCount = 64;
inline constexpr std::int64_t kPhotons = 1 << 20;
inline constexpr std::int64_t kFinalGather = 64;
inline constexpr std::int64_t kRecordRaysLeast = 16;
inline constexpr std::int64_t kRecordRays = 1 << 16;
inline constexpr std::int64_t kRecords = 1 << 18;
inline constexpr std::int64_t kLightCandidates = 64;
inline constexpr std::int64_t kLightBlock = 8;
inline constexpr std::int64_t kLightHistory = 16;
inline constexpr std::int64_t kDilation = 8;
inline constexpr std::int64_t kFirstReplicate = 65536;
inline constexpr std::int64_t kSamplesPerPixel = 65536;
inline constexpr std::int64_t kStopSeconds = 604800;
inline constexpr std::int64_t kStopCpuSeconds = 1024 * kStopSeconds;  // 1024 threads
inline constexpr double kRelativeErrorMin = 1e-5;
inline constexpr double kRelativeErrorMax = 1;  // every image's error is at most 1
inline constexpr std::int64_t kWaitSeconds = 60;
inline constexpr std::int64_t kPageSize = 200;
inline constexpr std::int64_t kSceneFiles = 4096;
inline constexpr std::int64_t kMergeFilms = 1024;
inline constexpr std::int64_t kFilmBytes = std::int64_t{4} << 30;
inline constexpr std::int64_t kComparisonPixels = 4096 * 2160;
inline constexpr std::int64_t kComparisons = 1000;
inline constexpr std::int64_t kComparisonBytes = std::int64_t{1} << 30;
inline constexpr std::int64_t kExposureStops = 30;
inline constexpr std::int64_t kRetentionSeconds = 315'576'000;
inline constexpr std::int64_t kWebhookUrlCharacters = 2048;
inline constexpr std::int64_t kWatchedJobs = 32;
inline constexpr std::int64_t kBatchJobs = 512;
inline constexpr std::int64_t kLabEvaluations = 1'000'000'000;
inline constexpr std::int64_t kLabReplicates = 4096;
inline constexpr std::int64_t kWorkerThreads = 1024;
inline constexpr std::int64_t kErrorsShown = 32;
}  // namespace limits

}  // namespace api
