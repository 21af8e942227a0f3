/// PrimaryNumbers: the random numbers of a path as a point that a Markov chain mutates.
#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace core {

class PrimaryNumbers {
 public:
  virtual ~PrimaryNumbers() = default;
  /// Returns four numbers in [0,1), constant per key until the chain mutates.
  virtual Vec4 at(std::uint64_t key) noexcept = 0;
};

}  // namespace core
