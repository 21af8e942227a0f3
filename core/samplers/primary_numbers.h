/// PrimaryNumbers: the numbers of a path as a point that a Markov chain moves.
#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace core {

class PrimaryNumbers {
 public:
  virtual ~PrimaryNumbers() = default;
  /// Four numbers in [0,1), the same for the same key until the chain moves.
  virtual Vec4 at(std::uint64_t key) noexcept = 0;
};

}  // namespace core
