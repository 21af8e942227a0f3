#include "core/accel/arithmetic.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <gnu/libc-version.h>

#ifdef __x86_64__
#include <cpuid.h>
#endif

#include "core/accel/accel.h"
#include "core/accel/embree_bridge.h"

namespace core {
namespace {

constexpr std::string_view kArm64 = "arm64";

#ifdef __x86_64__

constexpr std::array<std::string_view, 5> kIsas = {"sse2", "sse4.2", "avx", "avx2", "avx512"};

bool machine_has(std::string_view isa) {
  if (isa == "avx512") {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vl");
  }
  if (isa == "avx2") {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
  if (isa == "avx") {
    return __builtin_cpu_supports("avx");
  }
  return isa == "sse2" || __builtin_cpu_supports("sse4.2");
}

std::string processor() {  // its vendor: approximate reciprocals differ
  unsigned int highest = 0;
  std::array<unsigned int, 3> words = {};
  std::array<char, 13> name = {};
  if (__get_cpuid(0, &highest, words.data(), words.data() + 2, words.data() + 1) == 0) {
    return "unknown";
  }
  std::memcpy(name.data(), words.data(), 12);
  return name.data();
}

#else

// All processors for arm64 have NEON, whose approximations the architecture defines bit for bit.
constexpr std::array<std::string_view, 1> kIsas = {"neon"};

bool machine_has(std::string_view) { return true; }

std::string processor() { return std::string(kArm64); }

#endif

bool embree_takes(std::string_view isa) {
  const std::string config = "threads=1,set_affinity=0,isa=" + std::string(isa);
  RTCDevice device = rtcNewDevice(config.c_str());
  if (device == nullptr) {
    static_cast<void>(rtcGetDeviceError(nullptr));  // clears the error
    return false;
  }
  const bool works = rtcGetDeviceError(device) == RTC_ERROR_NONE;
  rtcReleaseDevice(device);
  return works;
}

}  // namespace

Result<std::string> resolve_isa(std::string_view isa) {
  if (isa == "native") {
    const auto widest = std::find_if(kIsas.rbegin(), kIsas.rend(), [](std::string_view candidate) {
      return machine_has(candidate) && embree_takes(candidate);
    });
    return std::string(widest == kIsas.rend() ? kIsas.front() : *widest);
  }
  if (std::find(kIsas.begin(), kIsas.end(), isa) == kIsas.end()) {
    std::string known = "native";
    for (const std::string_view name : kIsas) {
      known += ", " + std::string(name);
    }
    return Error{ErrorCode::kInvalidArgument, "\"" + std::string(isa) + "\" is not one of " + known,
                 ""};
  }
  if (!machine_has(isa) || !embree_takes(isa)) {
    return Error{ErrorCode::kInvalidArgument,
                 std::string(machine_has(isa) ? "this Embree" : "this machine") +
                     " does not support " + std::string(isa),
                 ""};
  }
  return std::string(isa);
}

std::string arithmetic_class(std::string_view isa) {
  return "embree " + std::string(embree_version()) + ", " + std::string(isa) + ", " + processor() +
         ", glibc " + gnu_get_libc_version();
}

std::string_view architecture_of(std::string_view arithmetic) noexcept {
  return arithmetic.find(kArm64) == std::string_view::npos ? "x86-64" : kArm64;
}

}  // namespace core
