/// Upper bound of the size of a result from another process, known before rendering.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/film/film.h"

namespace core {

/// Returns the maximum number of bytes of encode_work() for a result of this many slices.
std::uint64_t result_bytes_max(const Film& film, std::size_t slices);

}  // namespace core
