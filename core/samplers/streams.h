/// Seeds of random streams other than a job's camera paths. They are independent of those and of
/// each other, because no job's seed reaches 2^53.
#pragma once

#include <cstdint>

namespace core {

inline constexpr std::uint64_t kCensusStream = std::uint64_t{1} << 63U;
inline constexpr std::uint64_t kPilotStream = std::uint64_t{1} << 62U;
inline constexpr std::uint64_t kLightStream = std::uint64_t{1} << 61U;
inline constexpr std::uint64_t kPhotonStream = std::uint64_t{1} << 60U;
inline constexpr std::uint64_t kChainStream = std::uint64_t{1} << 59U;
inline constexpr std::uint64_t kFeatureStream = std::uint64_t{1} << 58U;
inline constexpr std::uint64_t kMeterStream = std::uint64_t{1} << 57U;
inline constexpr std::uint64_t kIrradianceStream = std::uint64_t{1} << 56U;
inline constexpr std::uint64_t kChoiceStream = std::uint64_t{1} << 55U;
inline constexpr std::uint64_t kCacheStream = std::uint64_t{1} << 54U;
inline constexpr std::uint64_t kReferenceStream = std::uint64_t{1} << 53U;
inline constexpr std::uint64_t kAimStream = kCensusStream | kPilotStream;

}  // namespace core
