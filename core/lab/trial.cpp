#include "core/lab/trial.h"

#include <algorithm>
#include <cmath>

#include "core/samplers/dimensions.h"
#include "core/samplers/point_sets.h"
#include "core/settings/sample_sets.h"

namespace core::lab {
namespace {

/// Maximum number of points of a set, and its side: floats can distinguish strata up to this
/// number.
constexpr std::int64_t kSetMax = std::int64_t{1} << 20;
constexpr std::int64_t kSideMax = 1024;
constexpr std::int64_t kPrimeMax = 1021;

std::int64_t side_of(std::int64_t n) {
  auto side = static_cast<std::int64_t>(std::sqrt(static_cast<double>(n)));
  while (side * side < n) {
    ++side;
  }
  return std::clamp<std::int64_t>(side, 1, kSideMax);
}

bool is_prime(std::int64_t p) {
  for (std::int64_t d = 2; d * d <= p; ++d) {
    if (p % d == 0) {
      return false;
    }
  }
  return true;
}

/// Returns the smallest prime whose square is at least n, from 3 to kPrimeMax.
std::int64_t prime_of(std::int64_t n) {
  std::int64_t p = std::max<std::int64_t>(3, side_of(n));
  while (p < kPrimeMax && !is_prime(p)) {
    ++p;
  }
  return std::min(p, kPrimeMax);
}

}  // namespace

std::int64_t Trial::n_set(SamplerType sampler, std::int64_t n) {
  switch (sampler) {
    case SamplerType::kStratified:
      return side_of(n) * side_of(n);
    case SamplerType::kLatinHypercube:
      return std::min(n, kSetMax);
    case SamplerType::kOrthogonalArray:
      return prime_of(n) * prime_of(n);
    default:
      return 0;
  }
}

std::int64_t Trial::rounded(SamplerType sampler, std::int64_t n) {
  const std::int64_t set = n_set(sampler, n);
  return set > 0 ? (n + set - 1) / set * set : rounded_samples(sampler, 1, static_cast<int>(n));
}

bool Trial::start_at(std::int64_t x, std::int64_t i) noexcept {
  is_stopped_ = is_stopped_ || ((++starts_ & 1023U) == 0 && stop_.stop_requested());
  if (is_stopped_) {
    return false;
  }
  sampler_.start(static_cast<int>(x), 0, static_cast<int>(i));
  if (set_ > 0) {
    key_ = hash_combine(hash_combine(seed_, static_cast<std::uint64_t>(x)),
                        static_cast<std::uint64_t>(i / set_));
    index_ = static_cast<std::uint32_t>(i % set_);
  }
  return true;
}

Vec4 Trial::whole_set_4d(int group) const noexcept {
  const std::uint64_t h = hash_combine(key_, static_cast<std::uint64_t>(group));
  const std::uint64_t h2 = second_hash(h);
  const auto size = static_cast<std::uint32_t>(set_);
  const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(set_))));
  switch (setup_.sampler) {
    case SamplerType::kStratified:
      return stratified_4d(index_, side, group == kCameraGroup ? Pairing::kXyZw : Pairing::kYz, h,
                           h2);
    case SamplerType::kOrthogonalArray:
      return orthogonal_array_4d(index_, side, h, h2);
    default:
      return latin_hypercube_4d(index_, size, h, h2);
  }
}

}  // namespace core::lab
