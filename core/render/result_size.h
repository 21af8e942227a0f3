/// How large a result can be that another process brings: known before any of it is rendered.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/film/film.h"

namespace core {

/// Bytes of encode_work() for a result of so many slices, at most.
std::uint64_t result_bytes_max(const Film& film, std::size_t slices);

}  // namespace core
